// Data that all shaders share: the geoms, and the lights of one frame. "Relative" positions are in metres, along the
// world's axes, from the camera (or from the middle of a shadow map): 32-bit floats are precise near their origin.

struct Geom {
    vec4 camera_from_geom[3]; // rows
    vec4 colour;              // linear albedo
    vec4 surface;             // perceptual roughness, metallic, emission, reflectance at normal incidence (f0)
};

layout(std430, binding = 0) readonly buffer Geoms { Geom geoms[]; };

layout(std140, binding = 0) uniform Frame {
    vec4 sun_axes[3];          // rows: two directions across the sun's rays, and the direction towards the sun
    // Shadow maps of everything near, of what moves, of the town: from metres along sun_axes to texture coordinates.
    vec4 shadow_scale[3];      // w: metres per texel
    vec4 shadow_offset[3];     // added after the scale
    vec4 shadow_end;           // xy: metres ahead where the first two maps end; z: row where the town's map ends
    vec4 irradiance[4];        // of the sky, divided by pi: the mean, and the slopes along the normal's x, y and z
    vec4 towards_light[4];     // w = 0: direction towards a distant light; w = 1: relative position of a point light
    vec4 light[4];             // irradiance of a distant light, intensity of a point light
    vec4 environment;          // x: last mip level of the environment map
};

// A vertex of a geom as a relative position.
vec3 relative_position(uint geom, vec3 position) {
    vec4 point = vec4(position, 1.0);
    Geom g = geoms[geom];
    // Equal to the last bit in every shader: the colour pass draws where its depth equals that of the id pass.
    precise vec3 at = vec3(
        dot(g.camera_from_geom[0], point), dot(g.camera_from_geom[1], point), dot(g.camera_from_geom[2], point)
    );
    return at;
}

// A direction in a geom's frame, in the world's axes.
vec3 rotate_to_world(uint geom, vec3 direction) {
    Geom g = geoms[geom];
    return vec3(
        dot(g.camera_from_geom[0].xyz, direction),
        dot(g.camera_from_geom[1].xyz, direction),
        dot(g.camera_from_geom[2].xyz, direction)
    );
}
