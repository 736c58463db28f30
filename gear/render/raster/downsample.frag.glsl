// The mean of each block of 2 x 2 samples.

layout(binding = 0) uniform sampler2D samples;
layout(location = 0) out vec4 mean;

void main() {
    ivec2 at = 2 * ivec2(gl_FragCoord.xy);
    vec4 sum = texelFetch(samples, at, 0) + texelFetch(samples, at + ivec2(1, 0), 0);
    sum += texelFetch(samples, at + ivec2(0, 1), 0) + texelFetch(samples, at + ivec2(1, 1), 0);
    mean = 0.25 * sum;
}
