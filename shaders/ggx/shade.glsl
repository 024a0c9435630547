// Technique `ggx`: what all lights send to the eye from one surface point, isotropic or
// anisotropic, without tables. Specular by ggx/polygon.glsl, Lambert by ltc/contour.glsl.
// Twin: ltc.ggx.ggx_specular.

#include "common/light_data.glsl"
#include "common/material.glsl"
#include "common/tangent_frame.glsl"
#include "ltc/contour.glsl"
#if HAS_SPECULAR
#include "ggx/polygon.glsl"
#endif
#if CULLS
#include "common/greatest.glsl"
#include "ggx/bound.glsl"
#endif
#if HAS_PICTURES
#include "ltc/picture.glsl"
#if HAS_SPECULAR
#include "ltc/anisotropic.glsl"
#endif
#endif

// Integrals of a light of radiance 1 at a point; what its picture sends instead of white.
struct GgxTerms {
    vec2 specular;  // for F = 1, and with the weight (1 - wo.h)^5
    float diffuse;  // form factor
#if HAS_PICTURES
    vec3 specular_colour;
    vec3 diffuse_colour;
#endif
};

GgxTerms ggx_terms(
    PlanarLight light, vec3 position, mat3 world_from_tangent, vec3 wo_tangent, vec2 alpha
#if CULLS || MIXED_LOBES
    , MaterialSample material
#endif
    )
{
#if HAS_PICTURES
    GgxTerms terms = GgxTerms(vec2(0.0), 0.0, vec3(1.0), vec3(1.0));
#else
    GgxTerms terms = GgxTerms(vec2(0.0), 0.0);
#endif
    vec3 normal = world_from_tangent[2];
    PlaneView plane = plane_view(light, position);
    if (is_unseen(light, plane, normal)) {
        return terms;
    }
    mat3 tangent_from_world = transpose(world_from_tangent);
#if HAS_DIFFUSE
    CosineTransform diffuse = CosineTransform(tangent_from_world, tangent_from_world);
#endif
#if CULLS || MIXED_LOBES
    // What the material has not got, and then what is too faint.
    bvec2 skipped = bvec2(material.f0 == vec3(0.0), material.diffuse == vec3(0.0));
#endif
#if CULLS
    vec2 half_sides;
    vec3 to_middle = way_to_rectangle(light, plane, half_sides);
#endif
#if HAS_SPECULAR
    if (wo_tangent.z > 0.0) {
        GgxView view = ggx_view(wo_tangent, alpha);
#if CULLS
        if (!skipped.x) {
            vec2 most = ggx_bound(tangent_from_world * to_middle,
                                  half_sides.x * (tangent_from_world * light.u),
                                  half_sides.y * (tangent_from_world * light.v), view);
            // f0 (1 - (1 - wo.h)^5) + (1 - wo.h)^5, at most.
            vec3 fresnel = mix(material.f0, vec3(1.0), most.y);
            skipped.x = is_skipped(most.x * greatest(light.radiance * fresnel));
        }
#endif
#if CULLS || MIXED_LOBES
        if (!skipped.x)
#endif
        terms.specular = ggx_light_specular(light, plane, normal, tangent_from_world, view);
    }
#endif
#if HAS_DIFFUSE
#if CULLS
    if (!skipped.y) {
        skipped.y = is_skipped(greatest(light.radiance * material.diffuse) *
                               form_factor_bound(diffuse, light, to_middle, half_sides));
    }
#endif
#if CULLS || MIXED_LOBES
    if (!skipped.y)
#endif
    // A point on the outline itself has no defined form factor, but not above 1.
    terms.diffuse = clamp(
        light_winding(plane) * light_form_factor(light, diffuse, plane, normal), 0.0, 1.0);
#endif
#if HAS_PICTURES
    if (light.picture > 0) {
        LightPicture picture = picture_at(light.picture);
#if HAS_SPECULAR
        if (terms.specular.x > 0.0) {
            // Where the lobe looks and how wide, by the closed form alone: no table.
            AnisotropicLobe lobe = anisotropic_lobe(alpha, wo_tangent, mat3(1.0));
            terms.specular_colour = picture_average(
                picture, cosine_transform(lobe, world_from_tangent), light, plane, false);
        }
#endif
#if HAS_DIFFUSE
        if (terms.diffuse > 0.0) {
            terms.diffuse_colour = picture_average(picture, diffuse, light, plane, true);
        }
#endif
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
#if CULLS
        allow_for_a_light();
#endif
#if CULLS || MIXED_LOBES
        GgxTerms terms = ggx_terms(
            light, position, world_from_tangent, wo_tangent, material.alpha, material);
#else
        GgxTerms terms =
            ggx_terms(light, position, world_from_tangent, wo_tangent, material.alpha);
#endif
        vec3 specular =
            material.f0 * (terms.specular.x - terms.specular.y) + has_lobe * terms.specular.y;
#if HAS_PICTURES
        radiance += light.radiance * (specular * terms.specular_colour +
                                      material.diffuse * terms.diffuse * terms.diffuse_colour);
#else
        radiance += light.radiance * (specular + material.diffuse * terms.diffuse);
#endif
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
        GgxTerms terms = ggx_terms(light, position, world_from_tangent, wo_tangent, alpha);
#if HAS_PICTURES
        specular += light.radiance * terms.specular_colour * terms.specular.x;
        diffuse += light.radiance * terms.diffuse_colour * terms.diffuse;
#else
        specular += light.radiance * terms.specular.x;
        diffuse += light.radiance * terms.diffuse;
#endif
    }
}
#endif
