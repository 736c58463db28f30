// Geoms as shapes alone: for ids and depth, and, from the sun, for shadows.

layout(location = 0) in vec3 position;
layout(location = 3) in uint piece;
layout(location = 4) in uint geom;

uniform mat4 clip_from_place;
flat out int id;
invariant gl_Position;

void main() {
    id = int(piece);
    gl_Position = clip_from_place * vec4(place(geom, position), 1.0);
}
