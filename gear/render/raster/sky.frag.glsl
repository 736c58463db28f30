// The sky's cube map in the direction of each pixel. Cube maps have their y axis up, the world has its z axis up.

in vec3 ray;
layout(binding = 0) uniform samplerCube sky;
layout(location = 0) out vec4 radiance;

void main() { radiance = vec4(texture(sky, vec3(ray.x, ray.z, -ray.y)).rgb, 1.0); }
