// Technique `reference`: an unbiased estimate of what all lights send to the eye from one
// surface point, GGX and Lambert. `alpha.x` acts along the tangent, `seed` is pixel and
// index of the sample. Twins: ltc.brdf and, in the mean, ltc.reference.

#include "common/material.glsl"
#include "common/tangent_frame.glsl"
#include "reference/estimate.glsl"

// Radiance towards wo. `normal`, `tangent` and `wo` are unit and leave the surface.
vec3 shade_lights(
    uvec3 seed, int light_count, vec3 position, vec3 normal, vec3 tangent, vec3 wo,
    MaterialSample material)
{
    // f0 = 0 means no specular lobe at all, as in scenes that leave it out.
    bool has_lobe = material.f0 != vec3(0.0);
    mat3 frame = tangent_frame(normal, tangent);
    Estimate estimate = begin_estimate(
        seed, position, frame, wo * frame, material.alpha,
        has_lobe, material.diffuse != vec3(0.0), CosineLobe(mat3(1.0), mat3(1.0), 1.0));
    vec3 radiance = vec3(0.0);
    for (int i = 0; i < light_count; ++i) {
        PlanarLight light = light_at(i);
#if HAS_PICTURES
        mat4x3 seen;
        light_terms(estimate, light, seen);
        vec3 specular = material.f0 * (seen[0] - seen[1]) + seen[1];
        radiance += light.radiance * (specular + material.diffuse * seen[2]);
#else
        vec4 terms = light_terms(estimate, light);
        vec3 specular = material.f0 * (terms.x - terms.y) + terms.y;
        radiance += light.radiance * (specular + material.diffuse * terms.z);
#endif
    }
    return radiance;
}

#if PROBES
// The two parts apart, for a white material: F = 1 and albedo 1.
void probe_lights(
    uvec3 seed, int light_count, vec3 position, vec3 normal, vec3 tangent, vec3 wo, vec2 alpha,
    out vec3 specular, out vec3 diffuse)
{
    mat3 frame = tangent_frame(normal, tangent);
    Estimate estimate = begin_estimate(
        seed, position, frame, wo * frame, alpha, true, true,
        CosineLobe(mat3(1.0), mat3(1.0), 1.0));
    specular = vec3(0.0);
    diffuse = vec3(0.0);
    for (int i = 0; i < light_count; ++i) {
        PlanarLight light = light_at(i);
#if HAS_PICTURES
        mat4x3 seen;
        light_terms(estimate, light, seen);
        specular += light.radiance * seen[0];
        diffuse += light.radiance * seen[2];
#else
        vec4 terms = light_terms(estimate, light);
        specular += light.radiance * terms.x;
        diffuse += light.radiance * terms.z;
#endif
    }
}
#endif
