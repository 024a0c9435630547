// An unbiased estimate, which samples average, of what a light reflects in a surface point:
// of GGX with height-correlated masking, anisotropic, with Fresnel inside the integral, and of
// a clamped cosine beside it, which is Lambert's or, for `ltc+residual`, the fitted lobe's.
// Twins: ltc.brdf and, in the mean, ltc.reference.
//
// Directions are drawn by visible normals, by the cosine, and for every light towards a random
// place of the rectangle around it. Each light sums what it sends along these three over
// the density with which they together would have drawn that direction: the balance
// heuristic (Veach 1997, 9.2), for which every sample is at most radiance times albedo. Places
// of the rectangle off the light are samples of zero.

#include "common/light_data.glsl"
#include "common/light_rectangle.glsl"
#if HAS_PICTURES
#include "common/light_picture.glsl"
#endif
#include "common/sequence.glsl"
#include "ltc/plane_view.glsl"
#include "reference/inside.glsl"
#include "reference/lobe.glsl"
#include "reference/rectangle.glsl"

// What the points of a pixel's sequence are for.
const uint GLOSSY_WAY = 0u;
const uint COSINE_WAY = 1u;
const uint LIGHT_PLACE = 2u;  // and on: one for each light

// What the estimate of a point shares between lights. Ways are in the tangent frame.
struct Estimate {
    vec3 position;
    mat3 world_from_tangent;
    GgxLobe lobe;
    bool glossy;             // whether directions are drawn by visible normals
    vec3 glossy_way;
    bool has_cosine;         // whether they are drawn by the cosine
    CosineLobe cosine;
    vec3 cosine_way;
    uvec3 seed;
    uint light;              // of those so far
};

// `wo` and `cosine` are in the tangent frame of `world_from_tangent`.
Estimate begin_estimate(
    uvec3 seed, vec3 position, mat3 world_from_tangent, vec3 wo, vec2 alpha,
    bool has_lobe, bool has_cosine, CosineLobe cosine)
{
    Estimate estimate;
    estimate.position = position;
    estimate.world_from_tangent = world_from_tangent;
    estimate.lobe = ggx_lobe(wo, alpha);
    estimate.glossy = has_lobe && estimate.lobe.wo.z > 0.0;
    estimate.has_cosine = has_cosine;
    estimate.cosine = cosine;
#if HAS_SPECULAR
    estimate.glossy_way = ggx_direction(estimate.lobe, sequence_point(seed, GLOSSY_WAY));
#endif
#if HAS_DIFFUSE || TECHNIQUE_RESIDUAL
    estimate.cosine_way = cosine_direction(cosine, sequence_point(seed, COSINE_WAY));
#endif
    estimate.seed = seed;
    estimate.light = 0u;
    return estimate;
}

// GGX for F = 1, with the weight (1 - wo.h)^5, the cosine, and Lambert's, at one direction and
// over its density; `light_density` is that of the light's own samples.
vec4 weighted_terms(Estimate estimate, vec3 wi, float light_density)
{
    if (wi.z <= 0.0) {
        return vec4(0.0);
    }
    vec4 terms = vec4(0.0, 0.0, 0.0, 0.318309886 * wi.z);
    float density = light_density;
#if HAS_SPECULAR
    if (estimate.glossy) {
        vec3 value = ggx_value(estimate.lobe, wi);
        terms.xy = value.xy;
        density += value.z;
    }
#endif
#if HAS_DIFFUSE || TECHNIQUE_RESIDUAL
    if (estimate.has_cosine) {
        terms.z = cosine_value(estimate.cosine, wi);
        density += terms.z;
    }
#endif
    return density > 0.0 ? terms / density : vec4(0.0);
}

SeenRectangle rectangle_of(PlanarLight light, PlaneView view)
{
    return seen_rectangle(light_rectangle(light) - view.foot.xyxy, abs(view.depth));
}

// The same for a direction that may miss the light; `at` is where it hits.
vec4 terms_along(Estimate estimate, vec3 wi, PlanarLight light, PlaneView view, out vec2 at)
{
    at = vec2(0.0);
    vec3 way = estimate.world_from_tangent * wi;
    float reach = view.depth / dot(way, light.n);
    // Not even a number where the way is along the plane.
    if (wi.z <= 0.0 || !(reach > 0.0)) {
        return vec4(0.0);
    }
    at = view.foot + reach * vec2(dot(way, light.u), dot(way, light.v));
    if (!is_on_light(light, at)) {
        return vec4(0.0);
    }
    return weighted_terms(estimate, wi, rectangle_density(rectangle_of(light, view), reach));
}

// The same for a place on the light's rectangle.
vec4 terms_by_place(Estimate estimate, PlanarLight light, PlaneView view, out vec2 at)
{
    SeenRectangle rectangle = rectangle_of(light, view);
    vec2 random = sequence_point(estimate.seed, LIGHT_PLACE + estimate.light);
    vec2 off = place_on_rectangle(rectangle, random);
    at = view.foot + off;
    if (!is_on_light(light, at)) {
        return vec4(0.0);
    }
    vec3 way = view.depth * light.n + off.x * light.u + off.y * light.v;
    float reach = length(way);
    return weighted_terms(estimate, (way / reach) * estimate.world_from_tangent,
                          rectangle_density(rectangle, reach));
}

#if HAS_PICTURES
// Terms in the colours of the light's picture there, a column each.
mat4x3 coloured_terms(PlanarLight light, vec2 at, vec4 terms)
{
    vec3 colour = light.picture == 0 ? vec3(1.0) : sharp_picture(picture_at(light.picture), at);
    return outerProduct(colour, terms);
}
#endif

// The three of one light; each call is about the next one. `seen` is the same in the
// colours of the light's picture, a column for each term.
vec4 light_terms(inout Estimate estimate, PlanarLight light
#if HAS_PICTURES
    , out mat4x3 seen
#endif
    )
{
    PlaneView view = plane_view(light, estimate.position);
    vec4 sum = vec4(0.0);
    vec4 terms;
    vec2 at;
#if HAS_PICTURES
    seen = mat4x3(0.0);
#endif
    if (light.part_count > 0 && !is_unseen(light, view, estimate.world_from_tangent[2])) {
#if HAS_SPECULAR
        if (estimate.glossy) {
            terms = terms_along(estimate, estimate.glossy_way, light, view, at);
            sum += terms;
#if HAS_PICTURES
            seen += coloured_terms(light, at, terms);
#endif
        }
#endif
#if HAS_DIFFUSE || TECHNIQUE_RESIDUAL
        if (estimate.has_cosine) {
            terms = terms_along(estimate, estimate.cosine_way, light, view, at);
            sum += terms;
#if HAS_PICTURES
            seen += coloured_terms(light, at, terms);
#endif
        }
#endif
        terms = terms_by_place(estimate, light, view, at);
        sum += terms;
#if HAS_PICTURES
        seen += coloured_terms(light, at, terms);
#endif
    }
    ++estimate.light;
    return sum;
}
