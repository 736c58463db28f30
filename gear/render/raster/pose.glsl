// Pose of the geom that a vertex belongs to, an attribute of each piece: llvmpipe reads such an attribute once per draw
// command, and a storage buffer once per vertex, number by number.
layout(location = 4) in vec4 camera_from_geom[3]; // rows

// A vertex of a geom as a relative position.
vec3 relative_position(vec3 position) {
    vec4 point = vec4(position, 1.0);
    // Equal to the last bit in every shader: the colour pass draws where its depth equals that of the id pass.
    precise vec3 at = vec3(
        dot(camera_from_geom[0], point), dot(camera_from_geom[1], point), dot(camera_from_geom[2], point)
    );
    return at;
}

// A direction in a geom's frame, in the world's axes.
vec3 rotate_to_world(vec3 direction) {
    return vec3(
        dot(camera_from_geom[0].xyz, direction),
        dot(camera_from_geom[1].xyz, direction),
        dot(camera_from_geom[2].xyz, direction)
    );
}
