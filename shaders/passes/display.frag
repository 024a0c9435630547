// Linear radiance to 8-bit sRGB: exposure, tone map, encoding, dither. Or costs to colours.

#if SHOWS_COST
#include "common/cost_color.glsl"
#else
#include "common/dither.glsl"
#include "common/srgb.glsl"
#include "common/tone_map.glsl"
#endif

uniform sampler2D radiance;

layout(location = 0) out vec4 color;

#if SHOWS_COST
void main()
{
    vec4 value = texelFetch(radiance, ivec2(gl_FragCoord.xy), 0);
    color = vec4(cost_color(value.r, value.a), 1.0);
}
#else
uniform float exposure_scale;  // 2^stops

const float MAX_EXPOSED = 1e9;

vec3 tone_map(vec3 exposed)
{
#if TONE_MAP_AGX
    return tone_map_agx(exposed);
#elif TONE_MAP_ACES
    return tone_map_aces(exposed);
#elif TONE_MAP_REINHARD
    return tone_map_reinhard(exposed);
#elif TONE_MAP_NONE
    return tone_map_none(exposed);
#endif
}

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec3 exposed = min(texelFetch(radiance, pixel, 0).rgb * exposure_scale, MAX_EXPOSED);
    color = vec4(quantise(srgb_from_linear(tone_map(exposed)), pixel), 1.0);
}
#endif
