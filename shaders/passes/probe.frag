// The lighting pass's own shading at given points, for a white material.

#include "passes/light_storage.glsl"
#if HAS_PICTURES
#include "passes/picture_storage.glsl"
#endif
#if TECHNIQUE_GGX
#include "ggx/shade.glsl"
#elif TECHNIQUE_REFERENCE
#include "reference/shade.glsl"
#elif TECHNIQUE_RESIDUAL
#include "residual/shade.glsl"
#elif TECHNIQUE_REPRESENTATIVE_POINT
#include "representative_point/shade.glsl"
#else
#include "passes/table_storage.glsl"
#endif

uniform sampler2D positions;  // world [m]
uniform sampler2D normals;    // unit
uniform sampler2D views;      // unit, to the viewer
uniform sampler2D alphas;     // (alpha_x, alpha_y)
#if TAKES_TANGENT
uniform sampler2D tangents;   // unit, perpendicular to the normal
#endif
uniform int light_count;
#if TAKES_SEED
uniform uint sample_index;
#endif

layout(location = 0) out vec4 specular;
layout(location = 1) out vec4 diffuse;

void main()
{
    ivec2 place = ivec2(gl_FragCoord.xy);
    vec3 position = texelFetch(positions, place, 0).xyz;
    vec3 normal = texelFetch(normals, place, 0).xyz;
    vec3 wo = texelFetch(views, place, 0).xyz;
    vec2 alpha = texelFetch(alphas, place, 0).xy;
    vec3 specular_radiance;
    vec3 diffuse_radiance;
#if TAKES_TANGENT
    vec3 tangent = texelFetch(tangents, place, 0).xyz;
#endif
    probe_lights(
#if TAKES_SEED
        uvec3(place, sample_index),
#endif
        light_count, position, normal,
#if TAKES_TANGENT
        tangent,
#endif
        wo, alpha, specular_radiance, diffuse_radiance);
    specular = vec4(specular_radiance, 0.0);
    diffuse = vec4(diffuse_radiance, 0.0);
}
