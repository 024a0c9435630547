// Technique `ltc`: what all lights send to the eye from one surface point.
// Clip each outline at the surface's horizon, transform, integrate.

#include "common/frame.glsl"
#include "common/light_data.glsl"
#include "common/material.glsl"
#include "ltc/contour.glsl"
#if HAS_SPECULAR
#include "ltc/lobe.glsl"
#include "ltc/table.glsl"
#endif

struct SurfacePoint {
    vec3 position;   // world [m]
    ViewFrame frame;
    float alpha;
};

SurfacePoint surface_point(vec3 position, vec3 normal, vec3 wo, vec2 alpha)
{
    SurfacePoint point;
    point.position = position;
    point.frame = view_aligned_frame(normal, wo);
    // This table is isotropic: of a stretched lobe it keeps the area.
    point.alpha = alpha.x == alpha.y ? alpha.x : sqrt(alpha.x * alpha.y);
    return point;
}

// Specular and diffuse form factors of a light at a point; both zero where it
// shows its dark side.
vec2 form_factors_at(PlanarLight light, SurfacePoint point, CosineTransform specular)
{
    mat3 world_from_shading = point.frame.world_from_shading;
    vec3 normal = world_from_shading[2];
    PlaneView view = plane_view(light, point.position);
    if (is_unseen(light, view, normal)) {
        return vec2(0.0);
    }
    vec2 factors = vec2(0.0);
#if HAS_DIFFUSE
    mat3 shading_from_world = transpose(world_from_shading);
    CosineTransform diffuse = CosineTransform(shading_from_world, shading_from_world);
#endif
#if HAS_CURVES && HAS_SPECULAR && HAS_DIFFUSE && !CURVE_RULE
    factors = light_form_factors(light, specular, diffuse, view, normal);
#else
#if HAS_SPECULAR
#if CURVE_RULE
    least_triangle = specular_triangle(point.alpha);
#endif
    factors.x = light_form_factor(light, specular, view, normal);
#endif
#if HAS_DIFFUSE
#if CURVE_RULE
    least_triangle = DIFFUSE_TRIANGLE;
#endif
    factors.y = light_form_factor(light, diffuse, view, normal);
#endif
#endif
    return clamp(light_winding(view) * factors, 0.0, 1.0);
}

#if HAS_SPECULAR
struct SpecularLobe {
    CosineTransform transform;
    vec2 albedo;  // (A, B) / share above the surface: f0 (A - B) + B is the reflectance
};

SpecularLobe specular_lobe(sampler2D table_residual, sampler2D table_albedo, SurfacePoint point)
{
    float alpha = point.alpha;
    float sin_theta = point.frame.sin_theta;
    float cos_theta = point.frame.cos_theta;
    vec2 coordinates = table_coordinates(alpha, cos_theta);
    IsotropicLobe lobe = isotropic_lobe(
        alpha, sin_theta, cos_theta, table_bilinear(table_residual, coordinates));
    SpecularLobe result;
    result.transform = cosine_transform(lobe, point.frame.world_from_shading);
    vec2 stored = table_bilinear(table_albedo, coordinates).rg;
    result.albedo = albedo_terms(stored, alpha, sin_theta, cos_theta) / lobe.above;
    return result;
}
#endif

// Radiance towards wo. `normal` and `wo` are unit and leave the surface.
vec3 shade_lights(
#if HAS_SPECULAR
    sampler2D table_residual, sampler2D table_albedo,
#endif
    int light_count, vec3 position, vec3 normal, vec3 wo, MaterialSample material)
{
    SurfacePoint point = surface_point(position, normal, wo, material.alpha);
    CosineTransform specular = CosineTransform(mat3(0.0), mat3(0.0));
    vec3 reflectance = vec3(0.0);
#if HAS_SPECULAR
    SpecularLobe lobe = specular_lobe(table_residual, table_albedo, point);
    specular = lobe.transform;
    // f0 = 0 means no specular lobe at all, as in scenes that leave it out.
    float has_lobe = material.f0 == vec3(0.0) ? 0.0 : 1.0;
    reflectance = material.f0 * (lobe.albedo.x - lobe.albedo.y) + has_lobe * lobe.albedo.y;
#endif
    vec3 radiance = vec3(0.0);
    for (int i = 0; i < light_count; ++i) {
        PlanarLight light = light_at(i);
        vec2 factors = form_factors_at(light, point, specular);
        radiance += light.radiance * (reflectance * factors.x + material.diffuse * factors.y);
    }
    return radiance;
}

#if PROBES
// The two parts apart, for a white material: F = 1 and albedo 1.
void probe_lights(
    sampler2D table_residual, sampler2D table_albedo,
    int light_count, vec3 position, vec3 normal, vec3 wo, vec2 alpha,
    out vec3 specular, out vec3 diffuse)
{
    SurfacePoint point = surface_point(position, normal, wo, alpha);
    SpecularLobe lobe = specular_lobe(table_residual, table_albedo, point);
    specular = vec3(0.0);
    diffuse = vec3(0.0);
    for (int i = 0; i < light_count; ++i) {
        PlanarLight light = light_at(i);
        vec2 factors = form_factors_at(light, point, lobe.transform);
        specular += light.radiance * (lobe.albedo.x * factors.x);
        diffuse += light.radiance * factors.y;
    }
}
#endif
