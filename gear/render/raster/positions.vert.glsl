// Positions of geoms without materials: for the pass of ids and depth, and for shadow maps.

layout(location = 0) in vec3 position;

uniform mat4 clip_from_relative;
flat out int id;
invariant gl_Position;

void main() {
    id = pieces[gl_DrawIDARB].number;
    gl_Position = clip_from_relative * vec4(relative_position(position), 1.0);
}
