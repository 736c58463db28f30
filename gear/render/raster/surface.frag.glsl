// Radiance of a surface towards the camera: Lambert's diffuse term, and the GGX specular term of Walter et al. (2007)
// with Smith's height-correlated visibility in Hammon's form (2017) and Schlick's Fresnel term. Light of the sky comes
// from its irradiance (diffuse) and from a prefiltered environment map with Karis' split sum (2013) (specular).

in vec3 position_m;
in vec3 smooth_normal;
in vec3 tangent;
in vec2 uv;
#ifdef SHADOWS
in vec3 near_at;
in vec3 moving_at;
in vec3 town_at;
#endif
flat in int id;
flat in vec3 albedo;
flat in vec4 surface;

layout(binding = 0) uniform sampler2D base_map;
layout(binding = 1) uniform sampler2D normal_map;
layout(binding = 2) uniform sampler2D orm_map;
layout(binding = 3) uniform sampler2D emissive_map;
layout(binding = 4) uniform sampler2DShadow shadows;
layout(binding = 5) uniform samplerCube environment_map;
layout(binding = 6) uniform isampler2D visible_piece;
layout(binding = 7) uniform sampler2D split_sum;

layout(location = 0) out vec4 radiance;

#ifndef LOD_BIAS
#define LOD_BIAS 0.0
#endif
const float PI = 3.14159265358979;

#ifdef SHADOWS
// 1 where the sun reaches a place on the shadow maps, 0 in shadow, between them on a shadow's edge.
float lit(vec3 at, vec2 aside) { return texture(shadows, vec3(at.xy + aside, at.z)); }

// Share of the sun that is visible. Software drivers execute all branches: reads of the maps are shared by them.
float sun_visibility() {
    float ahead_m = 1.0 / gl_FragCoord.w;
    bool is_near = ahead_m < shadow_end.x;
    vec3 at = is_near ? near_at : town_at, other = is_near ? near_at : moving_at;
    // Places beyond the end of a map have its farthest depth, which is lit; below the town's map lie the other two.
    at.z = !is_near && at.y > shadow_end.z ? 0.0 : min(at.z, 1.0);
    other.z = min(other.z, 1.0);
    // Bilinear reads at the corners of a square blur an edge over three texels.
    vec2 aside = (is_near ? 0.75 : 0.0) / vec2(textureSize(shadows, 0));
#ifdef MANY_SAMPLES
    // Two of the four corners per sample, alternately: a pixel's four samples read each corner twice.
    ivec2 odd = ivec2(gl_FragCoord.xy) & 1;
    if (odd.x != odd.y) aside.y = -aside.y;
    float a = lit(at, aside), b = lit(other, -aside);
#else
    float a = 0.0, b = 0.0, share = is_near ? 0.5 : 1.0;
    for (int turn = is_near ? 2 : 1; turn > 0; --turn) {
        a += share * lit(at, aside);
        b += share * lit(other, -aside);
        aside.y = -aside.y;
    }
#endif
    if (is_near) return 0.5 * (a + b);
    return ahead_m < shadow_end.y ? min(a, b) : a;
}
#endif

// Irradiance of the sky over pi on a surface of normal n.
vec3 sky_irradiance(vec3 n) {
    return max(irradiance[0].rgb + mat3(irradiance[1].rgb, irradiance[2].rgb, irradiance[3].rgb) * n, 0.0);
}

void main() {
    vec3 base = albedo;
    float roughness = surface.x, metallic = surface.y, ambient_occlusion = 1.0;
#ifdef HAS_BASE
    base *= texture(base_map, uv, LOD_BIAS).rgb;
#endif
#ifdef HAS_ORM
    vec3 orm = texture(orm_map, uv, LOD_BIAS).rgb;
    ambient_occlusion = orm.r;
    roughness *= orm.g;
    metallic *= orm.b;
#endif
    vec3 n = normalize(smooth_normal);
#ifdef HAS_NORMAL
    vec3 t = normalize(tangent);
    vec3 relief = texture(normal_map, uv, LOD_BIAS).xyz * 2.0 - 1.0;
    n = normalize(t * relief.x + cross(t, n) * relief.y + n * relief.z);
#endif
    vec3 v = -normalize(position_m);
    float nv = max(dot(n, v), 1e-4);
    roughness = max(roughness, 0.045);
    float alpha = roughness * roughness;
    vec3 f0 = mix(vec3(surface.w), base, metallic);
    vec3 diffuse = base * (1.0 - metallic);

    vec2 share = textureLod(split_sum, vec2(nv, roughness), 0.0).rg;
    vec3 specular_share = f0 * share.x + share.y;
    // Energy that single scattering between facets loses is added back (Turquin 2019).
    vec3 energy_compensation = 1.0 + f0 * (1.0 / (share.x + share.y) - 1.0);
    vec3 r = mix(reflect(-v, n), n, alpha * alpha); // wide lobes lean towards the normal (Lagarde 2014)
    float blur = environment.x * roughness * (2.0 - roughness);
    vec3 mirror = textureLod(environment_map, vec3(r.x, r.z, -r.y), blur).rgb;
    vec3 specular = mirror * specular_share * energy_compensation;
    vec3 sum = (diffuse * sky_irradiance(n) * (1.0 - specular_share) + specular) * ambient_occlusion;

    for (int i = 0; i < LIGHTS; ++i) {
        // Towards a distant light (of length 1), or from the surface to a point light.
        vec3 l = towards_light[i].xyz - towards_light[i].w * position_m;
        float squared = max(dot(l, l), 1e-4);
        vec3 arriving = light[i].rgb / squared;
        l *= inversesqrt(squared);
        float nl = max(dot(n, l), 1e-6), lit_share = 1.0;
#ifdef SHADOWS
        if (i == 0) lit_share = sun_visibility();
#endif
        vec3 h = v + l;
        h *= inversesqrt(max(dot(h, h), 1e-12)); // h is zero for a light straight behind the surface
        float nh = clamp(dot(n, h), 0.0, 1.0), k = nh * alpha;
        float d = alpha / (1.0 - nh * nh + k * k);
        float grazing = 1.0 - clamp(dot(l, h), 0.0, 1.0), g2 = grazing * grazing;
        vec3 fresnel = f0 + (1.0 - f0) * (g2 * g2 * grazing);
        float visibility = 0.5 / mix(2.0 * nl * nv, nl + nv, alpha);
        sum += (diffuse / PI + (d * d / PI) * visibility * fresnel * energy_compensation) * arriving * (nl * lit_share);
    }
#ifdef HAS_EMISSIVE
    sum += texture(emissive_map, uv, LOD_BIAS).rgb * surface.z;
#else
    sum += base * surface.z;
#endif
    // Of two surfaces at equal depth, the one that the id pass drew is kept. The test comes last because mip levels
    // need the texture coordinates of neighbouring samples.
    if (texelFetch(visible_piece, ivec2(gl_FragCoord.xy), 0).r != id) discard;
    radiance = vec4(sum, 1.0);
}
