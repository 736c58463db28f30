// One triangle that covers the whole picture, with the direction of each pixel's ray in the world's axes.

uniform vec4 view_tangents; // xy: tangents of half the angles of view; zw: of the picture's middle, right and up
uniform mat3 camera_axes; // columns: right, up, forward
out vec3 ray;

void main() {
    vec2 at = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
    ray = camera_axes * vec3(at * view_tangents.xy + view_tangents.zw, 1.0);
    gl_Position = vec4(at, 0.0, 1.0);
}
