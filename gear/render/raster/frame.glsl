// What every shader knows: the geoms, and one frame's camera and light. Positions are in metres in the world's axes, but
// relative to the camera, so that nothing is lost to the size of 32-bit numbers.

struct Geom {
    vec4 camera_from_geom[3]; // rows
    vec4 colour;              // linear albedo
    vec4 surface;             // perceptual roughness, metallic, emission, reflectance of dielectrics (f0)
};

layout(std430, binding = 0) readonly buffer Geoms { Geom geoms[]; };

layout(std140, binding = 0) uniform Frame {
    mat4 shadow_from_camera[3]; // near, what moves, the town
    vec4 forward;
    vec4 shadow_end_m;         // along forward, of the first two; w is 1 where there are shadows
    vec4 shadow_texel_m;
    vec4 irradiance[4];        // over pi: by itself, and by the normal's x, y and z
    vec4 towards_light[4];     // w is 0 for light from one direction, 1 for a place
    vec4 light[4];             // irradiance from a direction, intensity of a place; w is how many there are
    vec4 environment;          // x: the mirrored light's last mip level; y: 1 where there is such light
};

vec3 place(uint geom, vec3 position) {
    vec4 point = vec4(position, 1.0);
    Geom g = geoms[geom];
    // The same to the last bit in every shader: what is shaded is found by its depth.
    precise vec3 at = vec3(
        dot(g.camera_from_geom[0], point), dot(g.camera_from_geom[1], point), dot(g.camera_from_geom[2], point)
    );
    return at;
}

vec3 turn(uint geom, vec3 direction) {
    Geom g = geoms[geom];
    return vec3(
        dot(g.camera_from_geom[0].xyz, direction),
        dot(g.camera_from_geom[1].xyz, direction),
        dot(g.camera_from_geom[2].xyz, direction)
    );
}
