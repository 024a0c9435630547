// Technique `representative-point`, a baseline: each light as one point, with a lobe scaled down
// as if it were as wide as lobe and light together (Karis 2013, "Real Shading in Unreal
// Engine 4"); diffuse by solid angles and the cosines at corners. What is generalised, and how far
// off it is: ltc.representative_point, the Python twin.
//
// All but the lobe is in the light's own frame u, v, n about the surface point.

#include "common/cost.glsl"
#include "common/light_data.glsl"
#if HAS_PICTURES
#include "common/light_picture.glsl"
#endif
#include "common/material.glsl"
#include "common/tangent_frame.glsl"
#include "ltc/plane_view.glsl"
#include "reference/inside.glsl"
#include "reference/lobe.glsl"

// Integrals of a light of radiance 1 at a point.
struct PointTerms {
    vec2 specular;  // for F = 1, and with the weight (1 - wo.h)^5
    float diffuse;  // form factor
};

// Unit direction to the point of an edge at the smallest angle from `way`, unit.
vec3 nearest_on_arc(vec3 a, vec3 b, vec3 way)
{
    vec3 n = cross(a, b);
    float n2 = dot(n, n);
    vec3 level = n2 > 0.0 ? way - n * (dot(n, way) / n2) : vec3(0.0);
    if (dot(cross(a, level), n) > 0.0 && dot(cross(level, b), n) > 0.0) {
        return normalize(level);
    }
    a = normalize(a);
    b = normalize(b);
    return dot(a, way) >= dot(b, way) ? a : b;
}

// Half the signed solid angle of the triangle between an edge and the light's origin [sr].
// `area`: twice the triangle's, signed, from coordinates about the origin, where nothing cancels.
float half_solid_angle(vec3 centre, vec3 a, vec3 b, float area)
{
    float lc = length(centre);
    float la = length(a);
    float lb = length(b);
    float under = lc * la * lb + dot(centre, a) * lb + dot(a, b) * lc + dot(b, centre) * la;
    return atan(centre.z * area, under);
}

PointTerms point_terms(
    PlanarLight light, vec3 position, mat3 world_from_tangent, vec3 wo_tangent, vec2 alpha)
{
    PointTerms terms = PointTerms(vec2(0.0), 0.0);
    vec3 normal = world_from_tangent[2];
    PlaneView plane = plane_view(light, position);
    if (is_unseen(light, plane, normal)) {
        return terms;
    }
    mat3 world_from_light = mat3(light.u, light.v, light.n);
    vec3 up = normal * world_from_light;
    vec3 mirrored = world_from_tangent * vec3(-wo_tangent.xy, wo_tangent.z) * world_from_light;
    vec3 centre = vec3(-plane.foot, plane.depth);
    float centre_cosine = max(dot(normalize(centre), up), 0.0);
    float half_omega = 0.0;
    float lambert = 0.0;
    vec3 nearest = mirrored;
    float most = -2.0;
    count_evaluations(light.part_count);
    for (int i = 0; i < light.part_count; ++i) {
        vec4 edge = light_texel(light.first_part + 2 * i);
        vec3 a = vec3(edge.xy - plane.foot, plane.depth);
        vec3 b = vec3(edge.zw - plane.foot, plane.depth);
        float each = half_solid_angle(centre, a, b, edge.x * edge.w - edge.y * edge.z);
        half_omega += each;
#if HAS_DIFFUSE
        lambert += each * (centre_cosine + max(dot(normalize(a), up), 0.0) +
                           max(dot(normalize(b), up), 0.0));
#endif
#if HAS_SPECULAR
        vec3 candidate = nearest_on_arc(a, b, mirrored);
        float cosine = dot(candidate, mirrored);
        if (cosine > most) {
            most = cosine;
            nearest = candidate;
        }
#endif
    }
#if HAS_DIFFUSE
    // 2 / 3 of half a solid angle times three cosines; over pi.
    terms.diffuse = min(abs(lambert) * 0.212206591, 1.0);
#endif
#if HAS_SPECULAR
    float reach = plane.depth / mirrored.z;
    if (mirrored.z != 0.0 && reach > 0.0 &&
        is_on_light(light, plane.foot + reach * mirrored.xy)) {
        nearest = mirrored;
    }
    vec3 wi = world_from_light * nearest * world_from_tangent;
    if (wi.z > 0.0 && wo_tangent.z > 0.0) {
        float omega = 2.0 * abs(half_omega);
        vec2 wider = min(alpha + sqrt(omega * 0.318309886) / 3.0, 1.0);
        vec2 scale = alpha / wider;
        terms.specular = ggx_value(ggx_lobe(wo_tangent, alpha), wi).xy *
                         (scale.x * scale.y * omega);
    }
#endif
    return terms;
}

// Radiance towards wo. `normal`, `tangent` and `wo` are unit and leave the surface; alpha.x
// acts along the tangent.
vec3 shade_lights(
    int light_count, vec3 position, vec3 normal, vec3 tangent, vec3 wo, MaterialSample material)
{
    mat3 world_from_tangent = tangent_frame(normal, tangent);
    vec3 wo_tangent = wo * world_from_tangent;
    // f0 = 0 means no specular lobe at all, as in scenes that leave it out.
    float has_lobe = material.f0 == vec3(0.0) ? 0.0 : 1.0;
    vec3 radiance = vec3(0.0);
    for (int i = 0; i < light_count; ++i) {
        PlanarLight light = light_at(i);
#if HAS_PICTURES
        light.radiance *= light.picture > 0 ? mean_picture(picture_at(light.picture)) : vec3(1.0);
#endif
        PointTerms terms =
            point_terms(light, position, world_from_tangent, wo_tangent, material.alpha);
        vec3 specular =
            material.f0 * (terms.specular.x - terms.specular.y) + has_lobe * terms.specular.y;
        radiance += light.radiance * (specular + material.diffuse * terms.diffuse);
    }
    return radiance;
}

#if PROBES
// The two parts apart, for a white material: F = 1 and albedo 1.
void probe_lights(
    int light_count, vec3 position, vec3 normal, vec3 tangent, vec3 wo, vec2 alpha,
    out vec3 specular, out vec3 diffuse)
{
    mat3 world_from_tangent = tangent_frame(normal, tangent);
    vec3 wo_tangent = wo * world_from_tangent;
    specular = vec3(0.0);
    diffuse = vec3(0.0);
    for (int i = 0; i < light_count; ++i) {
        PlanarLight light = light_at(i);
#if HAS_PICTURES
        light.radiance *= light.picture > 0 ? mean_picture(picture_at(light.picture)) : vec3(1.0);
#endif
        PointTerms terms = point_terms(light, position, world_from_tangent, wo_tangent, alpha);
        specular += light.radiance * terms.specular.x;
        diffuse += light.radiance * terms.diffuse;
    }
}
#endif
