// Technique `reference`: an unbiased estimate of what all lights send to the eye from one
// surface point, which samples average: GGX with height-correlated masking, anisotropic, with
// Fresnel inside the integral, and Lambert. Twins: ltc.brdf and, in the mean, ltc.reference.
//
// Three directions are drawn: by visible normals, by the cosine, and towards a random point of
// the rectangle around a light, which is chosen by its radiance and rough solid angle. Each
// light sums what it sends along them over the density with which the three together
// would have drawn that direction to it: the balance heuristic (Veach 1997, 9.2), for
// which every sample is at most radiance times albedo. Points of the rectangle off the
// light are samples of zero.

#include "common/light_data.glsl"
#include "common/material.glsl"
#include "common/sequence.glsl"
#include "common/tangent_frame.glsl"
#include "ltc/plane_view.glsl"
#include "reference/inside.glsl"
#include "reference/lobe.glsl"

// What the estimate of a point shares between lights.
struct Estimate {
    vec3 position;
    mat3 world_from_tangent;
    GgxLobe lobe;
    bool glossy;             // whether directions are drawn by visible normals
    bool matt;               // whether they are drawn by the cosine
    vec3 glossy_way;         // tangent frame
    vec3 matt_way;
    float across;            // random height in a light's rectangle
    float total_importance;
    float passed;            // importance of the lights so far
    float pick;              // the light that takes `passed` beyond this is chosen, and the
                             // place along its rectangle is where in its part this lies
};

// What the points of a pixel's sequence are for.
const uint GLOSSY_WAY = 0u;
const uint MATT_WAY = 1u;
const uint LIGHT_PLACE = 2u;

// With which probability a light is chosen, up to a factor; 0 only where it sends nothing.
float light_importance(PlanarLight light, PlaneView view, vec3 normal)
{
    if (light.part_count == 0 || is_unseen(light, view, normal)) {
        return 0.0;
    }
    float r2 = light.radius * light.radius;
    float size = r2 / (r2 + dot(view.offset, view.offset));
    return max(dot(light.radiance, vec3(1.0)) * size, 1e-20);
}

Estimate begin_estimate(
    uvec3 seed, int light_count, vec3 position, vec3 normal, vec3 tangent, vec3 wo, vec2 alpha,
    bool has_lobe, bool has_diffuse)
{
    vec2 light = sequence_point(seed, LIGHT_PLACE);
    Estimate estimate;
    estimate.position = position;
    estimate.world_from_tangent = tangent_frame(normal, tangent);
    estimate.lobe = ggx_lobe(wo * estimate.world_from_tangent, alpha);
    estimate.glossy = has_lobe && estimate.lobe.wo.z > 0.0;
    estimate.matt = has_diffuse;
#if HAS_SPECULAR
    estimate.glossy_way =
        ggx_direction(estimate.lobe, sequence_point(seed, GLOSSY_WAY));
#endif
#if HAS_DIFFUSE
    estimate.matt_way = cosine_direction(sequence_point(seed, MATT_WAY));
#endif
    estimate.across = light.y;
    estimate.total_importance = 0.0;
    for (int i = 0; i < light_count; ++i) {
        PlanarLight candidate = light_at(i);
        estimate.total_importance +=
            light_importance(candidate, plane_view(candidate, position), normal);
    }
    estimate.passed = 0.0;
    estimate.pick = light.x * estimate.total_importance;
    return estimate;
}

// Specular for F = 1, with the weight (1 - wo.h)^5, and diffuse for albedo 1, at one direction
// and over its density; `light_density` is that of the light's own samples.
vec3 weighted_terms(Estimate estimate, vec3 wi, float light_density)
{
    if (wi.z <= 0.0) {
        return vec3(0.0);
    }
    vec3 terms = vec3(0.0);
    float density = light_density;
#if HAS_SPECULAR
    if (estimate.glossy) {
        vec3 value = ggx_value(estimate.lobe, wi);
        terms.xy = value.xy;
        density += value.z;
    }
#endif
#if HAS_DIFFUSE
    if (estimate.matt) {
        terms.z = 0.318309886 * wi.z;
        density += terms.z;
    }
#endif
    return density > 0.0 ? terms / density : vec3(0.0);
}

// The same for a direction that may miss the light; `chance` is the light's of being chosen.
vec3 terms_along(
    Estimate estimate, vec3 wi, PlanarLight light, PlaneView view, float chance)
{
    vec3 way = estimate.world_from_tangent * wi;
    float cosine = dot(way, light.n);
    float reach = view.depth / cosine;
    if (wi.z <= 0.0 || cosine == 0.0 || reach <= 0.0) {
        return vec3(0.0);
    }
    vec2 at = view.foot + reach * vec2(dot(way, light.u), dot(way, light.v));
    if (!is_on_light(light, at)) {
        return vec3(0.0);
    }
    vec4 bounds = light_bounds(light);
    vec2 size = bounds.zw - bounds.xy;
    float density = reach / size.x * (reach / size.y) / abs(cosine);
    return weighted_terms(estimate, wi, chance * density);
}

// `along`: in [0, 1), where in the light's share of `pick`.
vec3 terms_by_area(
    Estimate estimate, PlanarLight light, PlaneView view, float chance, float along)
{
    vec4 bounds = light_bounds(light);
    vec2 size = bounds.zw - bounds.xy;
    vec2 at = bounds.xy + vec2(along, estimate.across) * size;
    if (!is_on_light(light, at)) {
        return vec3(0.0);
    }
    vec2 off = at - view.foot;
    vec3 way = view.depth * light.n + off.x * light.u + off.y * light.v;
    float reach = length(way);
    float density = reach / size.x * (reach / size.y) * (reach / abs(view.depth));
    return weighted_terms(estimate, (way / reach) * estimate.world_from_tangent,
                          chance * density);
}

// One light after the other, in the order in which the total was taken.
vec3 light_terms(inout Estimate estimate, PlanarLight light)
{
    vec3 normal = estimate.world_from_tangent[2];
    PlaneView view = plane_view(light, estimate.position);
    float importance = light_importance(light, view, normal);
    if (importance <= 0.0) {
        return vec3(0.0);
    }
    float chance = importance / estimate.total_importance;
    vec3 terms = vec3(0.0);
#if HAS_SPECULAR
    if (estimate.glossy) {
        terms += terms_along(estimate, estimate.glossy_way, light, view, chance);
    }
#endif
#if HAS_DIFFUSE
    if (estimate.matt) {
        terms += terms_along(estimate, estimate.matt_way, light, view, chance);
    }
#endif
    float along = (estimate.pick - estimate.passed) / importance;
    estimate.passed += importance;
    if (along >= 0.0 && along < 1.0) {
        terms += terms_by_area(estimate, light, view, chance, along);
    }
    return terms;
}

// Radiance towards wo. `normal`, `tangent` and `wo` are unit and leave the surface; alpha.x
// acts along the tangent. `seed`: pixel and index of the sample.
vec3 shade_lights(
    uvec3 seed, int light_count, vec3 position, vec3 normal, vec3 tangent, vec3 wo, MaterialSample material)
{
    // f0 = 0 means no specular lobe at all, as in scenes that leave it out.
    bool has_lobe = material.f0 != vec3(0.0);
    Estimate estimate = begin_estimate(
        seed, light_count, position, normal, tangent, wo, material.alpha, has_lobe,
        material.diffuse != vec3(0.0));
    vec3 radiance = vec3(0.0);
    for (int i = 0; i < light_count; ++i) {
        PlanarLight light = light_at(i);
        vec3 terms = light_terms(estimate, light);
        vec3 specular = material.f0 * (terms.x - terms.y) + terms.y;
        radiance += light.radiance * (specular + material.diffuse * terms.z);
    }
    return radiance;
}

#if PROBES
// The two parts apart, for a white material: F = 1 and albedo 1.
void probe_lights(
    uvec3 seed, int light_count, vec3 position, vec3 normal, vec3 tangent, vec3 wo, vec2 alpha,
    out vec3 specular, out vec3 diffuse)
{
    Estimate estimate =
        begin_estimate(seed, light_count, position, normal, tangent, wo, alpha, true, true);
    specular = vec3(0.0);
    diffuse = vec3(0.0);
    for (int i = 0; i < light_count; ++i) {
        PlanarLight light = light_at(i);
        vec3 terms = light_terms(estimate, light);
        specular += light.radiance * terms.x;
        diffuse += light.radiance * terms.z;
    }
}
#endif
