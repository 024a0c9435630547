// G-buffer to radiance: surfaces shaded by all lights, visible lights by their own
// radiance, nothing else. Alpha is coverage.

#include "common/octahedron.glsl"
#include "common/cost.glsl"
#include "common/light_data.glsl"
#include "passes/light_storage.glsl"
#if HAS_PICTURES
#include "common/light_picture.glsl"
#include "passes/picture_storage.glsl"
#endif
#if ESTIMATES_NOISE
#include "common/running_mean.glsl"
#endif
#if HAS_SPECULAR || HAS_DIFFUSE
#include "passes/material_storage.glsl"
#include "common/frame.glsl"
#if TECHNIQUE_GGX
#include "ggx/shade.glsl"
#elif TECHNIQUE_REFERENCE
#include "reference/shade.glsl"
#elif TECHNIQUE_RESIDUAL
#include "residual/shade.glsl"
#elif TECHNIQUE_REPRESENTATIVE_POINT
#include "representative_point/shade.glsl"
#else
#include "ltc/shade.glsl"
#if HAS_SPECULAR
#include "passes/table_storage.glsl"
#endif
#endif
#endif

uniform sampler2D surfaces;
#if ACCUMULATES
uniform sampler2D history;
uniform float sample_weight;  // 1 / samples so far, this one included
#if ESTIMATES_NOISE
uniform sampler2D noise_history;
uniform float sample_sign;    // 1 and -1 in turn
#endif
#endif

#if HAS_SPECULAR || HAS_DIFFUSE || HAS_PICTURES
uniform vec3 eye;
// A pixel's ray of unit depth is ray_corner + x ray_dx + y ray_dy, pixels from the
// bottom left; the sample's offset within the pixel is in ray_corner.
uniform vec3 ray_corner;
uniform vec3 ray_dx;
uniform vec3 ray_dy;
#endif

#if HAS_SPECULAR || HAS_DIFFUSE
uniform int light_count;
#if CULLS
uniform float faint_radiance;  // that all that is skipped at a point may add up to
#endif
#if TAKES_SEED
uniform uint sample_index;
#endif
#if HAS_TANGENTS
uniform sampler2D tangents;

// The material's own tangent: the mesh's, bent into the surface and turned about the normal.
vec3 material_tangent(ivec2 pixel, vec3 normal, int object)
{
    vec3 t = direction_from_octahedral(texelFetch(tangents, pixel, 0).xy);
    t -= normal * dot(normal, t);
    float t2 = dot(t, t);
    // At a pole of the mesh's tangents they interpolate to nothing: 0, or no number.
    t = t2 > 1e-8 ? t * inversesqrt(t2) : any_tangent(normal);
    float rotation = material_rotation_of_object(object);
    return cos(rotation) * t + sin(rotation) * cross(normal, t);
}
#elif TAKES_TANGENT
vec3 material_tangent(ivec2 pixel, vec3 normal, int object)
{
    return any_tangent(normal);
}
#endif

// Interpolated normals may turn away at silhouettes, where the surface itself does
// not: bend them back until the viewer is just above the horizon.
vec3 facing_normal(vec3 normal, vec3 wo)
{
    const float least_cosine = 1e-4;
    float cosine = dot(normal, wo);
    return cosine >= least_cosine ? normal : normalize(normal + (least_cosine - cosine) * wo);
}

vec3 surface_radiance(vec4 surface)
{
    vec3 ray = ray_corner + gl_FragCoord.x * ray_dx + gl_FragCoord.y * ray_dy;
    vec3 wo = -normalize(ray);
    vec3 normal = facing_normal(direction_from_octahedral(surface.xy), wo);
    vec3 position = eye + surface.z * ray;
    MaterialSample material = material_of_object(int(surface.w));
#if CULLS
    allowance_per_light = faint_radiance / float(light_count);
#endif
#if TAKES_TANGENT
    vec3 tangent = material_tangent(ivec2(gl_FragCoord.xy), normal, int(surface.w));
#endif
    return shade_lights(
#if TAKES_SEED
        uvec3(gl_FragCoord.xy, sample_index),
#endif
        light_count, position, normal,
#if TAKES_TANGENT
        tangent,
#endif
        wo, material);
}
#endif

#if HAS_SHAPES && HAS_PICTURES
// Radiance of a visible light where the pixel sees it.
vec3 seen_light(int index, float depth)
{
    vec3 radiance = light_radiance(index);
    PlanarLight light = light_at(index);
    if (light.picture == 0) {
        return radiance;
    }
    vec3 ray = ray_corner + gl_FragCoord.x * ray_dx + gl_FragCoord.y * ray_dy;
    vec3 at = eye + depth * ray - light.origin;
    return radiance * sharp_picture(picture_at(light.picture), vec2(dot(at, light.u), dot(at, light.v)));
}
#endif

layout(location = 0) out vec4 radiance;
#if ESTIMATES_NOISE
// What rounding took from the radiance; luminance of what is reflected, averaged with
// alternating signs: half of what the means of even and odd samples differ by.
layout(location = 1) out vec4 noise;
#endif

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 surface = texelFetch(surfaces, pixel, 0);
    vec4 value = vec4(0.0);
#if ESTIMATES_NOISE
    float reflected = 0.0;
#endif
    if (surface.z > 0.0) {
        value.a = 1.0;
#if HAS_SHAPES
        if (surface.w < 0.0) {
#if HAS_PICTURES
            value.rgb = seen_light(-1 - int(surface.w), surface.z);
#else
            value.rgb = light_radiance(-1 - int(surface.w));
#endif
        }
#endif
#if HAS_SPECULAR || HAS_DIFFUSE
        if (surface.w >= 0.0) {
            value.rgb = surface_radiance(surface);
#if ESTIMATES_NOISE
            reflected = dot(value.rgb, vec3(0.2126, 0.7152, 0.0722));
#endif
        }
#endif
    }
#if COUNTS_EVALUATIONS
    value.rgb = vec3(float(evaluations));
#endif
#if ACCUMULATES
    // The running mean, not a sum: its rounding errors die out instead of adding up.
#if ESTIMATES_NOISE
    noise = vec4(0.0, 0.0, 0.0, sample_sign * reflected);
    if (sample_weight < 1.0) {
        vec4 mean = texelFetch(history, pixel, 0);
        vec4 rest = texelFetch(noise_history, pixel, 0);
        noise.a = mix(rest.a, noise.a, sample_weight);
        rest.a = 0.0;
        value = next_mean(mean, rest, value, sample_weight);
        noise.rgb = rest.rgb;
    }
#else
    if (sample_weight < 1.0) {
        vec4 mean = texelFetch(history, pixel, 0);
        value = mean + (value - mean) * sample_weight;
    }
#endif
#endif
    radiance = value;
}
