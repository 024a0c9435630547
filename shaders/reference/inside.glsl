// Whether a point of a light's plane is on the light. A ray from the point along +s crosses the
// outline an odd number of times if it is; outlines are simple loops that cross neither
// themselves nor each other, so holes need no thought.

#include "common/cost.glsl"
#include "common/light_data.glsl"
#if HAS_CURVES
#include "ltc/curve.glsl"
#endif

#if HAS_CURVES

// Whether the cubic whose texels begin at `texel` is crossed an odd number of times.
bool is_crossed(int texel, vec4 ends, vec2 at)
{
    count_evaluations(1);
    vec4 handles = light_texel(texel + 3);
    vec4 s = vec4(ends.x, ends.x + handles.x, ends.z + handles.z, ends.z) - at.x;
    vec4 t = vec4(ends.y, ends.y + handles.y, ends.w + handles.w, ends.w) - at.y;
    bool above = t.x > 0.0;
    bool odd = false;
    // No cubic meets a line more than three times.
    float place = 0.0;
    for (int i = 0; i < 3; ++i) {
        place = next_crossing(t, place, 1.0, above);
        if (place >= 1.0) {
            break;
        }
        odd = odd != (bernstein(s, place) > 0.0);
        above = !above;
    }
    return odd;
}

// `at`: (s, t) [m]. Down the tree: of a node whose disc is all to the right of the point
// only its ends matter, of one that the ray misses nothing does.
bool is_on_light(PlanarLight light, vec2 at)
{
    if (dot(at, at) > light.radius * light.radius) {
        return false;
    }
    bool inside = false;
    int node = 0;
    while (node < light.part_count) {
        int texel = light.first_part + 4 * node;
        vec4 about = light_texel(texel + 2);
        vec2 away = about.xy - at;
        bool is_inner = about.w < 0.0;
        bool is_near = abs(away.y) <= about.z && away.x >= -about.z;
        if (!is_near || away.x > about.z || !is_inner) {
            if (is_near) {
                vec4 ends = light_texel(texel);
                bool crossed = away.x > about.z ? (ends.y > at.y) != (ends.w > at.y)
                                                : is_crossed(texel, ends, at);
                inside = inside != crossed;
            }
            node = is_inner ? int(light_texel(texel + 3).x) : node + 1;
        } else {
            ++node;
        }
    }
    return inside;
}

#else

// Whether the edge whose texels begin at `texel` is crossed.
bool is_crossed(int texel, vec2 at)
{
    vec4 edge = light_texel(texel);
    // Half-open and exact: of two edges that join at this very t one counts.
    if ((edge.y > at.y) == (edge.w > at.y)) {
        return false;
    }
    vec2 d = edge.zw - edge.xy;
    vec2 away = at - edge.xy;
    return (d.x * away.y - d.y * away.x > 0.0) == (d.y > 0.0);
}

// `at`: (s, t) [m].
bool is_on_light(PlanarLight light, vec2 at)
{
    if (dot(at, at) > light.radius * light.radius) {
        return false;
    }
    count_evaluations(light.part_count);
    bool inside = false;
    for (int i = 0; i < light.part_count; ++i) {
        inside = inside != is_crossed(light.first_part + 2 * i, at);
    }
    return inside;
}

#endif
