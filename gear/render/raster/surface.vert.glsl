// Geoms with their materials: relative positions, normals, tangents, texture and shadow-map coordinates.

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec2 texcoord;

uniform mat4 clip_from_relative;
out vec3 position_m;
out vec3 smooth_normal;
out vec3 tangent;
out vec2 uv;
#ifdef SHADOWS
out vec3 near_at; // coordinates in the three shadow maps, a little in front of the surface
out vec3 moving_at;
out vec3 town_at;
#endif
flat out int id;
flat out vec3 albedo; // looked up once per triangle instead of once per sample
flat out vec4 surface; // see material
invariant gl_Position;

// Coordinates in a shadow map, moved by 1.5 texels along the normal so that a surface does not shadow itself.
vec3 shadow_coordinates(int map, vec3 position_by_sun, vec3 facing_by_sun) {
    vec4 scale = shadow_scale[map];
    return (position_by_sun + facing_by_sun * (1.5 * scale.w)) * scale.xyz + shadow_offset[map].xyz;
}

void main() {
    id = pieces[gl_DrawIDARB].number;
    albedo = pieces[gl_DrawIDARB].colour;
    surface = pieces[gl_DrawIDARB].material;
    uv = texcoord;
    position_m = relative_position(position);
    smooth_normal = rotate_to_world(normal);
#ifdef HAS_NORMAL
    // Filament derives the tangent from the normal alone; gear.world.compilation.normal_maps prepares meshes for that.
    float share = 1.0 / max(1.0 + normal.y, 1e-6);
    vec3 red = vec3(-normal.x * normal.z * share, -normal.z, 1.0 - normal.z * normal.z * share);
    tangent = rotate_to_world(1.0 + normal.y < 1e-6 ? vec3(-1.0, 0.0, 0.0) : red);
#endif
#ifdef SHADOWS
    mat3 to_sun = transpose(mat3(sun_axes[0].xyz, sun_axes[1].xyz, sun_axes[2].xyz));
    vec3 by_sun = to_sun * position_m, facing = to_sun * smooth_normal;
    near_at = shadow_coordinates(0, by_sun, facing);
    moving_at = shadow_coordinates(1, by_sun, facing);
    town_at = shadow_coordinates(2, by_sun, facing);
#endif
    gl_Position = clip_from_relative * vec4(position_m, 1.0);
}
