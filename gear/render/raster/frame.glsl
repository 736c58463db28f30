// What every shader knows: the geoms, and one frame's camera and light. Positions are in metres in the world's axes, but
// relative to the camera, so that nothing is lost to the size of 32-bit numbers.

struct Geom {
    vec4 camera_from_geom[3]; // rows
    vec4 colour;              // linear albedo
    vec4 surface;             // perceptual roughness, metallic, emission, reflectance of dielectrics (f0)
};

layout(std430, binding = 0) readonly buffer Geoms { Geom geoms[]; };

layout(std140, binding = 0) uniform Frame {
    vec4 sun_axes[3];          // rows: two directions across the sun's light, and towards the sun
    vec4 shadow_scale[3];      // near, what moves, the town: from metres along them to the texture; w: metres a texel
    vec4 shadow_offset[3];     // to add
    vec4 shadow_end;           // of the first two, in metres along the view; z: of the town's, in the texture
    vec4 irradiance[4];        // over pi: by itself, and by the normal's x, y and z
    vec4 towards_light[4];     // w is 0 for light from one direction, 1 for a place
    vec4 light[4];             // irradiance from a direction, intensity of a place
    vec4 environment;          // x: the mirrored light's last mip level
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
