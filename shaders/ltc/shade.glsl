// Technique `ltc`: what all lights send to the eye from one surface point.
// Clip each outline at the surface's horizon, transform, integrate.

#include "common/frame.glsl"
#include "common/light_data.glsl"
#include "common/material.glsl"
#include "ltc/contour.glsl"
#if CULLS
#include "common/greatest.glsl"
#include "ltc/bound.glsl"
#endif
#if TAKES_TANGENT
#include "common/tangent_frame.glsl"
#endif

#if HAS_PICTURES
#include "ltc/picture.glsl"
#endif

// A point to be shaded. Where the tables tell alpha_x from alpha_y (TAKES_TANGENT) x is the
// tangent, else along the view.
struct SurfacePoint {
    vec3 position;            // world [m]
    mat3 world_from_shading;  // columns x, y and z, the normal
    vec3 wo;                  // to the viewer, in these, z >= 0
    vec2 alpha;
};

#if HAS_SPECULAR
struct SpecularLobe {
    CosineTransform transform;
    vec2 albedo;  // (A, B) / share above the surface: f0 (A - B) + B is the reflectance
};

// By the pass that has the tables, see passes/table_storage.glsl.
SpecularLobe specular_lobe(SurfacePoint point);
#endif

SurfacePoint surface_point(vec3 position, vec3 normal, vec3 wo, vec2 alpha)
{
    ViewFrame frame = view_aligned_frame(normal, wo);
    return SurfacePoint(
        position, frame.world_from_shading, vec3(frame.sin_theta, 0.0, frame.cos_theta), alpha);
}

#if TAKES_TANGENT
// Views below the surface count as grazing.
SurfacePoint surface_point(vec3 position, vec3 normal, vec3 tangent, vec3 wo, vec2 alpha)
{
    mat3 world_from_tangent = tangent_frame(normal, tangent);
    vec3 local = wo * world_from_tangent;
    local.z = max(local.z, 1e-6);
    return SurfacePoint(position, world_from_tangent, normalize(local), alpha);
}
#endif

#if CUTS_AT_LOBE
#include "ltc/published_clip.glsl"
#else
// Specular and diffuse form factors of a light at a point; both zero where it
// shows its dark side. `weights` turn them into radiance: what is too faint is left at zero.
vec2 form_factors_at(
    PlanarLight light, SurfacePoint point, CosineTransform specular
#if CULLS
    , vec2 weights
#endif
    )
{
    vec3 normal = point.world_from_shading[2];
    PlaneView view = plane_view(light, point.position);
    if (is_unseen(light, view, normal)) {
        return vec2(0.0);
    }
    vec2 factors = vec2(0.0);
#if HAS_DIFFUSE
    mat3 shading_from_world = transpose(point.world_from_shading);
    CosineTransform diffuse = CosineTransform(shading_from_world, shading_from_world);
#endif
#if CULLS
    vec2 half_sides;
    vec3 to_middle = way_to_rectangle(light, view, half_sides);
    bvec2 skipped = bvec2(true);
#if HAS_SPECULAR
    skipped.x =
        is_skipped(weights.x * form_factor_bound(specular, light, to_middle, half_sides));
#endif
#if HAS_DIFFUSE
    skipped.y =
        is_skipped(weights.y * form_factor_bound(diffuse, light, to_middle, half_sides));
#endif
    if (all(skipped)) {
        return factors;
    }
#endif
#if HAS_CURVES && HAS_SPECULAR && HAS_DIFFUSE && !CURVE_RULE
#if CULLS
    if (any(skipped)) {
        // One walk in the text for whichever it is.
        CosineTransform only = diffuse;
        if (skipped.y) {
            only = specular;
        }
        float factor = light_form_factor(light, only, view, normal);
        factors = skipped.y ? vec2(factor, 0.0) : vec2(0.0, factor);
    } else
#endif
    factors = light_form_factors(light, specular, diffuse, view, normal);
#else
#if HAS_SPECULAR
#if CURVE_RULE
    least_triangle = specular_triangle(sqrt(point.alpha.x * point.alpha.y));
#endif
#if CULLS
    if (!skipped.x)
#endif
    factors.x = light_form_factor(light, specular, view, normal);
#endif
#if HAS_DIFFUSE
#if CURVE_RULE
    least_triangle = DIFFUSE_TRIANGLE;
#endif
#if CULLS
    if (!skipped.y)
#endif
    factors.y = light_form_factor(light, diffuse, view, normal);
#endif
#endif
    return clamp(light_winding(view) * factors, 0.0, 1.0);
}
#endif

#if HAS_PICTURES
// What the specular and the diffuse lobe see of a light's picture; white without one.
mat2x3 seen_pictures(PlanarLight light, SurfacePoint point, CosineTransform specular, vec2 factors)
{
    mat2x3 colours = mat2x3(vec3(1.0), vec3(1.0));
    if (light.picture == 0) {
        return colours;
    }
    LightPicture picture = picture_at(light.picture);
    PlaneView view = plane_view(light, point.position);
#if HAS_SPECULAR
    if (factors.x > 0.0) {
        colours[0] = picture_average(picture, specular, light, view, false);
    }
#endif
#if HAS_DIFFUSE
    if (factors.y > 0.0) {
        mat3 shading_from_world = transpose(point.world_from_shading);
        CosineTransform diffuse = CosineTransform(shading_from_world, shading_from_world);
        colours[1] = picture_average(picture, diffuse, light, view, true);
    }
#endif
    return colours;
}
#endif

// Radiance towards wo. `normal`, `tangent` and `wo` are unit and leave the surface; alpha.x
// acts along the tangent.
vec3 shade_lights(
    int light_count, vec3 position, vec3 normal,
#if TAKES_TANGENT
    vec3 tangent,
#endif
    vec3 wo, MaterialSample material)
{
#if TAKES_TANGENT
    SurfacePoint point = surface_point(position, normal, tangent, wo, material.alpha);
#else
    SurfacePoint point = surface_point(position, normal, wo, material.alpha);
#endif
    CosineTransform specular = CosineTransform(mat3(0.0), mat3(0.0));
    vec3 reflectance = vec3(0.0);
#if HAS_SPECULAR
    SpecularLobe lobe = specular_lobe(point);
    specular = lobe.transform;
    // f0 = 0 means no specular lobe at all, as in scenes that leave it out.
    float has_lobe = material.f0 == vec3(0.0) ? 0.0 : 1.0;
    reflectance = material.f0 * (lobe.albedo.x - lobe.albedo.y) + has_lobe * lobe.albedo.y;
#endif
    vec3 radiance = vec3(0.0);
    for (int i = 0; i < light_count; ++i) {
        PlanarLight light = light_at(i);
#if CULLS
        allow_for_a_light();
        vec2 weights = vec2(greatest(light.radiance * reflectance),
                            greatest(light.radiance * material.diffuse));
        vec2 factors = form_factors_at(light, point, specular, weights);
#else
        vec2 factors = form_factors_at(light, point, specular);
#endif
#if HAS_PICTURES
        mat2x3 colours = seen_pictures(light, point, specular, factors);
        radiance += light.radiance * (reflectance * factors.x * colours[0] +
                                      material.diffuse * factors.y * colours[1]);
#else
        radiance += light.radiance * (reflectance * factors.x + material.diffuse * factors.y);
#endif
    }
    return radiance;
}

#if PROBES
// The two parts apart, for a white material: F = 1 and albedo 1.
void probe_lights(
    int light_count, vec3 position, vec3 normal,
#if TAKES_TANGENT
    vec3 tangent,
#endif
    vec3 wo, vec2 alpha, out vec3 specular, out vec3 diffuse)
{
#if TAKES_TANGENT
    SurfacePoint point = surface_point(position, normal, tangent, wo, alpha);
#else
    SurfacePoint point = surface_point(position, normal, wo, alpha);
#endif
    SpecularLobe lobe = specular_lobe(point);
    specular = vec3(0.0);
    diffuse = vec3(0.0);
    for (int i = 0; i < light_count; ++i) {
        PlanarLight light = light_at(i);
        vec2 factors = form_factors_at(light, point, lobe.transform);
#if HAS_PICTURES
        mat2x3 colours = seen_pictures(light, point, lobe.transform, factors);
        specular += light.radiance * colours[0] * (lobe.albedo.x * factors.x);
        diffuse += light.radiance * colours[1] * factors.y;
#else
        specular += light.radiance * (lobe.albedo.x * factors.x);
        diffuse += light.radiance * factors.y;
#endif
    }
}
#endif
