// Technique `ltc`: what all lights send to the eye from one surface point.
// Clip each outline at the surface's horizon, transform, integrate.

#include "common/frame.glsl"
#include "common/light_data.glsl"
#include "common/material.glsl"
#include "ltc/polygon.glsl"
#if HAS_SPECULAR
#include "ltc/lobe.glsl"
#include "ltc/table.glsl"
#endif

// Form factor, under the transform, of the part of a light above the surface.
//
// Crossings of the horizon all lie on one line of the light's plane and come in
// pairs, first with second, third with fourth and so on, in whatever order the
// outline meets them: the integral along that line is additive, so any pairing of
// exits with entries closes the clipped outline.
float light_form_factor(
    PlanarLight light, CosineTransform transform, PlaneView view, vec3 normal)
{
    CosineLight transformed = cosine_light(transform, light, view);
    // Height above the surface of (s, t) about the anchor: base + slope . (s, t).
    vec2 slope = vec2(dot(normal, light.u), dot(normal, light.v));
    float base = transformed.pin > 0.0 ? dot(normal, view.offset)
                                       : view.depth * dot(normal, light.n);
    ContourSum sum = ContourSum(0.0, 0.0, 0.0);
    vec2 pending = vec2(0.0);   // crossing that waits for its partner
    bool has_pending = false;
    vec2 closing_from = vec2(0.0);
    vec2 closing_to = vec2(0.0);
    bool closing = false;
    int next = 0;
    // One loop for the outline's edges and those that close it along the horizon, so
    // that the integral is compiled once: in three copies it took 1.6 times as long.
    while (closing || next < light.edge_count) {
        PlanarEdge edge;
        if (closing) {
            closing = false;
            // Direction and moment of the horizon line itself, base + slope . x = 0: the
            // rounded ends would tilt edges that are short or pass close by.
            vec2 along = vec2(-slope.y, slope.x);
            float length_along = dot(closing_to - closing_from, along) / dot(slope, slope);
            edge = PlanarEdge(
                closing_from, closing_to, length_along * along, -length_along * base);
        } else {
            int texel = light.first_edge + 2 * next;
            ++next;
            edge = planar_edge(light_texel(texel), light_texel(texel + 1),
                               transformed.anchor, transformed.anchor_low);
            // `precise`: an edge's end and the next one's start must agree to the bit.
            precise float za = base + edge.a.x * slope.x + edge.a.y * slope.y;
            precise float zb = base + edge.b.x * slope.x + edge.b.y * slope.y;
            bool a_above = za > 0.0;
            bool b_above = zb > 0.0;
            if (!a_above && !b_above) {
                continue;
            }
            if (a_above != b_above) {
                // Where edge line and horizon line meet; going there from a or b would
                // lose a crossing near the anchor between far ends.
                vec2 crossing = vec2(edge.moment * slope.y - base * edge.d.x,
                                     -edge.moment * slope.x - base * edge.d.y) /
                                dot(slope, edge.d);
                closing_from = a_above ? crossing : pending;
                closing_to = a_above ? pending : crossing;
                closing = has_pending;
                has_pending = !has_pending;
                pending = crossing;
                float share = (a_above ? za : zb) / abs(za - zb);
                edge.a = a_above ? edge.a : crossing;
                edge.b = a_above ? crossing : edge.b;
                edge.d *= share;
                edge.moment *= share;
            }
        }
        add_edge(transformed, edge, sum);
    }
    return form_factor(transformed, sum);
}

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

// Whether a point at this depth sees a light's dark side, or only its edge.
bool shows_nothing(PlanarLight light, float depth)
{
#if !HAS_TWO_SIDED
    return depth >= 0.0;
#elif !HAS_ONE_SIDED
    return depth == 0.0;
#else
    return depth == 0.0 || (depth > 0.0 && !light.two_sided);
#endif
}

// Specular and diffuse form factors of a light at a point; both zero where it
// shows its dark side.
vec2 light_form_factors(PlanarLight light, SurfacePoint point, CosineTransform specular)
{
    mat3 world_from_shading = point.frame.world_from_shading;
    vec3 normal = world_from_shading[2];
    PlaneView view = plane_view(light, point.position);
    if (shows_nothing(light, view.depth)) {
        return vec2(0.0);
    }
    // Certainly below the surface: its disc's highest point is.
    float reach = light.radius * length(cross(normal, light.n));
    if (dot(normal, view.offset) + reach <= 0.0) {
        return vec2(0.0);
    }
    // Seen from its emitting side an outline runs counter-clockwise, which is
    // clockwise about +z here.
    float winding = view.depth < 0.0 ? -1.0 : 1.0;
    vec2 factors = vec2(0.0);
#if HAS_SPECULAR
    factors.x = max(0.0, winding * light_form_factor(light, specular, view, normal));
#endif
#if HAS_DIFFUSE
    mat3 shading_from_world = transpose(world_from_shading);
    CosineTransform diffuse = CosineTransform(shading_from_world, shading_from_world);
    factors.y = max(0.0, winding * light_form_factor(light, diffuse, view, normal));
#endif
    return factors;
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
        vec2 factors = light_form_factors(light, point, specular);
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
        vec2 factors = light_form_factors(light, point, lobe.transform);
        specular += light.radiance * (lobe.albedo.x * factors.x);
        diffuse += light.radiance * factors.y;
    }
}
#endif
