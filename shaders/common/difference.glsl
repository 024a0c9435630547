// How far one radiance is from another, and its colour. Twins: difference, magnitude and
// colours_of in app/render/difference.py.

#include "common/color_map.glsl"

uniform vec3 bad_color;  // of what is not finite

const vec3 LUMINANCE = vec3(0.2126, 0.7152, 0.0722);  // of linear Rec. 709

// How much more `a` has than `b`: of the channel that differs most, or of the luminance.
float difference(vec3 a, vec3 b)
{
    vec3 apart = a - b;
#if LARGEST_CHANNEL
    vec3 size = abs(apart);
    float most = size.y > size.x ? apart.y : apart.x;
    return size.z > max(size.x, size.y) ? apart.z : most;
#else
    return dot(apart, LUMINANCE);
#endif
}

// What a relative difference divides by.
float magnitude(vec3 radiance)
{
#if LARGEST_CHANNEL
    return max(radiance.x, max(radiance.y, radiance.z));
#else
    return dot(radiance, LUMINANCE);
#endif
}

// False of infinities and of what is no number, also where the driver assumes there are none:
// their exponent bits are all set.
bool is_finite(float value)
{
    return (floatBitsToUint(value) & 0x7f800000u) != 0x7f800000u;
}

// `low`, `high`: the values at the ends of the map.
vec3 value_color(float value, float low, float high)
{
    return is_finite(value) ? map_color((value - low) / (high - low)) : bad_color;
}
