// The mean of 2 x 2 samples, for the pixels that have them; the others stay.

layout(binding = 0) uniform sampler2D samples;
layout(binding = 1) uniform sampler2D is_supersampled;
layout(location = 0) out vec4 mean;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy), at = 2 * pixel;
    if (texelFetch(is_supersampled, pixel, 0).r == 0.0) discard;
    vec4 sum = texelFetch(samples, at, 0) + texelFetch(samples, at + ivec2(1, 0), 0);
    sum += texelFetch(samples, at + ivec2(0, 1), 0) + texelFetch(samples, at + ivec2(1, 1), 0);
    mean = 0.25 * sum;
}
