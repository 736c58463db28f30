// One triangle over the whole picture; where it looks, for the sky.

uniform vec4 corner; // tangents of half the angles of view (width, height), and of the picture's middle (right, up)
uniform mat3 camera_axes; // columns: right, up, forward
out vec3 ray;

void main() {
    vec2 at = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
    ray = camera_axes * vec3(at * corner.xy + corner.zw, 1.0);
    gl_Position = vec4(at, 0.0, 1.0);
}
