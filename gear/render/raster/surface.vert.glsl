// Geoms as they look.

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec2 texcoord;
layout(location = 3) in uint piece;
layout(location = 4) in uint geom;

uniform mat4 clip_from_place;
out vec3 place_m;
out vec3 smooth_normal;
out vec3 tangent;
out vec2 uv;
#ifdef SHADOWS
out vec3 near_at; // where to look at the maps of shadows, a little before the surface
out vec3 moving_at;
out vec3 town_at;
#endif
flat out int id;
flat out vec3 albedo; // a geom's own: looked up once a triangle, not once a sample
flat out vec4 surface;
invariant gl_Position;

vec3 on_map(int map, vec3 place_by_sun, vec3 facing_by_sun) {
    vec4 scale = shadow_scale[map];
    return (place_by_sun + facing_by_sun * (1.5 * scale.w)) * scale.xyz + shadow_offset[map].xyz;
}

void main() {
    id = int(piece);
    albedo = geoms[geom].colour.rgb;
    surface = geoms[geom].surface;
    uv = texcoord;
    place_m = place(geom, position);
    smooth_normal = turn(geom, normal);
#ifdef HAS_NORMAL
    // As Filament makes it of a normal alone; gear.world.compilation.normal_maps turns meshes and maps for it.
    float share = 1.0 / max(1.0 + normal.y, 1e-6);
    vec3 red = vec3(-normal.x * normal.z * share, -normal.z, 1.0 - normal.z * normal.z * share);
    tangent = turn(geom, 1.0 + normal.y < 1e-6 ? vec3(-1.0, 0.0, 0.0) : red);
#endif
#ifdef SHADOWS
    mat3 to_sun = transpose(mat3(sun_axes[0].xyz, sun_axes[1].xyz, sun_axes[2].xyz));
    vec3 by_sun = to_sun * place_m, facing = to_sun * smooth_normal;
    near_at = on_map(0, by_sun, facing);
    moving_at = on_map(1, by_sun, facing);
    town_at = on_map(2, by_sun, facing);
#endif
    gl_Position = clip_from_place * vec4(place_m, 1.0);
}
