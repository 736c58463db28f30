// The pieces of geometry of one draw call, by number of the draw command. With a base instance per draw command instead,
// llvmpipe prepares the whole pipeline for each command, which takes as long as 500 triangles.
struct Piece {
    vec4 camera_from_geom[3]; // rows
    vec3 colour;              // linear albedo
    int number;
    vec4 material;            // perceptual roughness, metallic, emission, reflectance at normal incidence (f0)
};
layout(std140, binding = 1) uniform Pieces { Piece pieces[PIECES]; };

// A vertex of a geom as a relative position.
vec3 relative_position(vec3 position) {
    vec4 camera_from_geom[3] = pieces[gl_DrawIDARB].camera_from_geom;
    vec4 point = vec4(position, 1.0);
    // Equal to the last bit in every shader: the colour pass draws where its depth equals that of the id pass.
    precise vec3 at = vec3(
        dot(camera_from_geom[0], point), dot(camera_from_geom[1], point), dot(camera_from_geom[2], point)
    );
    return at;
}

// A direction in a geom's frame, in the world's axes.
vec3 rotate_to_world(vec3 direction) {
    vec4 camera_from_geom[3] = pieces[gl_DrawIDARB].camera_from_geom;
    return vec3(
        dot(camera_from_geom[0].xyz, direction),
        dot(camera_from_geom[1].xyz, direction),
        dot(camera_from_geom[2].xyz, direction)
    );
}
