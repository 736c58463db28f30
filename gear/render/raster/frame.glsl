// The lights of one frame, which all shaders share. "Relative" positions are in metres, along the world's axes, from
// the camera (or from the middle of a shadow map): 32-bit floats are precise near their origin.

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
