// The lighting pass's own shading at given points, for a white material.

#include "passes/light_storage.glsl"
#include "ltc/shade.glsl"

uniform sampler2D positions;  // world [m]
uniform sampler2D normals;    // unit
uniform sampler2D views;      // unit, to the viewer
uniform sampler2D alphas;     // (alpha_x, alpha_y)
uniform sampler2D table_residual;
uniform sampler2D table_albedo;
uniform int light_count;

layout(location = 0) out vec4 specular;
layout(location = 1) out vec4 diffuse;

void main()
{
    ivec2 place = ivec2(gl_FragCoord.xy);
    vec3 specular_radiance;
    vec3 diffuse_radiance;
    probe_lights(
        table_residual, table_albedo, light_count,
        texelFetch(positions, place, 0).xyz, texelFetch(normals, place, 0).xyz,
        texelFetch(views, place, 0).xyz, texelFetch(alphas, place, 0).xy,
        specular_radiance, diffuse_radiance);
    specular = vec4(specular_radiance, 0.0);
    diffuse = vec4(diffuse_radiance, 0.0);
}
