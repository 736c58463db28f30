in vec3 ray;
layout(binding = 0) uniform samplerCube sky;
layout(location = 0) out vec4 radiance;

void main() { radiance = vec4(texture(sky, vec3(ray.x, ray.z, -ray.y)).rgb, 1.0); }
