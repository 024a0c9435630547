// Technique `ltc+residual`: what `ltc` says, which has no noise, and an unbiased estimate of
// what it lacks, GGX minus the fitted lobe, which samples average. The lobe is the very one
// that `ltc` integrates, as a density, with its reflectance; its light is clipped at the
// surface's horizon. Lambert is exact already, but for lights with pictures: of those `ltc` has
// the form factors exactly and takes one colour for each lobe, so what is estimated besides is how
// the picture differs from that colour. `seed` is pixel and index of the sample.
// Twins: ltc.brdf and ltc.transform and, in the mean, ltc.reference.

#include "passes/table_storage.glsl"
#include "reference/estimate.glsl"

// The density of a transformed cosine in the frame of a point.
CosineLobe cosine_lobe(CosineTransform transform, mat3 world_from_shading)
{
    // det K is a row of K times the same of its cofactors. The second: it is along its cofactors
    // where the lobe is isotropic, and nearly so else, so that nothing cancels.
    mat3 points = transpose(transform.points);
    mat3 normals = transpose(transform.normals);
    return CosineLobe(transform.points * world_from_shading,
                      transform.normals * world_from_shading, dot(points[1], normals[1]));
}

// What lights of `radiance` 1 add for F = 1, and with the weight (1 - wo.h)^5, by GGX, and for
// reflectance 1 by the fitted lobe, comes light by light from this estimate.
Estimate begin_residual(uvec3 seed, SurfacePoint point, CosineTransform fitted)
{
    return begin_estimate(seed, point.position, point.world_from_shading, point.wo, point.alpha,
                          true, true, cosine_lobe(fitted, point.world_from_shading));
}

// Radiance towards wo. `normal`, `tangent` and `wo` are unit and leave the surface; alpha.x
// acts along the tangent.
vec3 shade_lights(
    uvec3 seed, int light_count, vec3 position, vec3 normal,
#if TAKES_TANGENT
    vec3 tangent,
#endif
    vec3 wo, MaterialSample material)
{
#if TAKES_TANGENT
    vec3 radiance = shade_lights(light_count, position, normal, tangent, wo, material);
    SurfacePoint point = surface_point(position, normal, tangent, wo, material.alpha);
#else
    vec3 radiance = shade_lights(light_count, position, normal, wo, material);
    SurfacePoint point = surface_point(position, normal, wo, material.alpha);
#endif
#if !HAS_PICTURES
    if (material.f0 == vec3(0.0)) {
        return radiance;
    }
#endif
    SpecularLobe lobe = specular_lobe(point);
    // As `ltc` has it: f0 = 0 means no specular lobe at all.
    float has_lobe = material.f0 == vec3(0.0) ? 0.0 : 1.0;
    vec3 reflectance = material.f0 * (lobe.albedo.x - lobe.albedo.y) + has_lobe * lobe.albedo.y;
    Estimate estimate = begin_residual(seed, point, lobe.transform);
    for (int i = 0; i < light_count; ++i) {
        PlanarLight light = light_at(i);
#if HAS_PICTURES
        mat4x3 seen;
        vec4 terms = light_terms(estimate, light, seen);
        mat2x3 colours = seen_pictures(light, point, lobe.transform, vec2(1.0));
        vec3 specular = material.f0 * (seen[0] - seen[1]) + has_lobe * seen[1];
        radiance += light.radiance * (specular - reflectance * colours[0] * terms.z +
                                      material.diffuse * (seen[3] - colours[1] * terms.w));
#else
        vec4 terms = light_terms(estimate, light);
        vec3 specular = material.f0 * (terms.x - terms.y) + has_lobe * terms.y;
        radiance += light.radiance * (specular - reflectance * terms.z);
#endif
    }
    return radiance;
}

#if PROBES
// The two parts apart, for a white material: F = 1 and albedo 1.
void probe_lights(
    uvec3 seed, int light_count, vec3 position, vec3 normal,
#if TAKES_TANGENT
    vec3 tangent,
#endif
    vec3 wo, vec2 alpha, out vec3 specular, out vec3 diffuse)
{
#if TAKES_TANGENT
    probe_lights(light_count, position, normal, tangent, wo, alpha, specular, diffuse);
    SurfacePoint point = surface_point(position, normal, tangent, wo, alpha);
#else
    probe_lights(light_count, position, normal, wo, alpha, specular, diffuse);
    SurfacePoint point = surface_point(position, normal, wo, alpha);
#endif
    SpecularLobe lobe = specular_lobe(point);
    Estimate estimate = begin_residual(seed, point, lobe.transform);
    for (int i = 0; i < light_count; ++i) {
        PlanarLight light = light_at(i);
#if HAS_PICTURES
        mat4x3 seen;
        vec4 terms = light_terms(estimate, light, seen);
        mat2x3 colours = seen_pictures(light, point, lobe.transform, vec2(1.0));
        specular += light.radiance * (seen[0] - lobe.albedo.x * colours[0] * terms.z);
        diffuse += light.radiance * (seen[3] - colours[1] * terms.w);
#else
        vec4 terms = light_terms(estimate, light);
        specular += light.radiance * (terms.x - lobe.albedo.x * terms.z);
#endif
    }
}
#endif
