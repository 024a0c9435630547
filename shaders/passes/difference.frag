// Two pictures of one view, or values that were computed of them, as colours. They may differ
// in size: while something moves, a slower technique's picture is smaller.

#include "common/difference.glsl"

#if SHOWS_VALUES
uniform sampler2D values;
#else
uniform sampler2D radiance_a;
uniform sampler2D radiance_b;
uniform float least_divisor;
#endif
uniform vec2 picture_size;  // pixels
uniform float low;
uniform float high;

layout(location = 0) out vec4 color;

vec4 texel(sampler2D picture)
{
    vec2 place = gl_FragCoord.xy / picture_size;
    ivec2 size = textureSize(picture, 0);
    return texelFetch(picture, min(ivec2(place * vec2(size)), size - 1), 0);
}

void main()
{
#if SHOWS_VALUES
    float value = texel(values).r;
#else
    vec3 a = texel(radiance_a).rgb;
    vec3 b = texel(radiance_b).rgb;
    float value = difference(a, b);
#if IS_RELATIVE
    value = abs(value) / max(magnitude(b), least_divisor);
#elif IS_ABSOLUTE
    value = abs(value);
#endif
#endif
    color = vec4(value_color(value, low, high), 1.0);
}
