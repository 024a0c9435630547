// Where the tables of technique `ltc` are, and the lobes that they describe.

#include "ltc/shade.glsl"
#include "ltc/table.glsl"

// What the lobe's integral over all directions that are lit is, of `above`, its share above the
// surface.
#if DIVIDES_BY_ABOVE
float share_kept(float above) { return above; }
#else
float share_kept(float above) { return 1.0; }
#endif

#if TAKES_TANGENT
#include "ltc/anisotropic.glsl"

uniform sampler2DArray table_residual;
uniform sampler2DArray table_residual_2;
uniform sampler2DArray table_albedo;

SpecularLobe specular_lobe(SurfacePoint point)
{
    vec2 alpha = point.alpha;
    vec4 coordinates = anisotropic_coordinates(alpha, point.wo);
    mat3 residual = residual_matrix(
        alpha, point.wo, table_quadrilinear(table_residual, RESIDUAL_AZIMUTHS, coordinates),
        table_quadrilinear(table_residual_2, RESIDUAL_AZIMUTHS, coordinates));
    AnisotropicLobe lobe = anisotropic_lobe(alpha, point.wo, residual);
    vec2 stored = table_quadrilinear(table_albedo, ALBEDO_AZIMUTHS, coordinates).rg;
    return SpecularLobe(
        cosine_transform(lobe, point.world_from_shading),
        albedo_terms(stored, length(vec3(alpha, 1.0) * point.wo)) / share_kept(lobe.above));
}
#else
#include "ltc/lobe.glsl"

uniform sampler2D table_residual;
uniform sampler2D table_albedo;

SpecularLobe specular_lobe(SurfacePoint point)
{
    float alpha = point.alpha.x;
    float sin_theta = point.wo.x;
    float cos_theta = point.wo.z;
    vec2 coordinates = table_coordinates(alpha, cos_theta);
    IsotropicLobe lobe = isotropic_lobe(
        alpha, sin_theta, cos_theta, table_bilinear(table_residual, coordinates));
    vec2 stored = table_bilinear(table_albedo, coordinates).rg;
    return SpecularLobe(
        cosine_transform(lobe, point.world_from_shading),
        albedo_terms(stored, length(vec2(alpha * sin_theta, cos_theta))) / share_kept(lobe.above));
}
#endif
