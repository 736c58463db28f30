// No colour: the farthest depth at the samples of pixels that are supersampled.

layout(binding = 1) uniform sampler2D is_supersampled;

void main() {
    if (texelFetch(is_supersampled, ivec2(gl_FragCoord.xy) / 2, 0).r == 0.0) discard;
}
