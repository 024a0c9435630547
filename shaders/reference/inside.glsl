// Whether a point of a light's plane is on the light, and the light's bounds there. A ray from
// the point along +s crosses the outline an odd number of times if it is; outlines are simple
// loops that cross neither themselves nor each other, so holes need no thought.

#include "common/cost.glsl"
#include "common/light_data.glsl"
#if HAS_CURVES
#include "ltc/curve.glsl"
#endif

#if HAS_CURVES

const int PART_TEXELS = 4;

// Whether the curve whose texels begin at `texel` is crossed an odd number of times.
bool is_crossed(int texel, vec2 at)
{
    vec4 disc = light_texel(texel + 2);
    if (abs(at.y - disc.y) > disc.z || at.x - disc.x > disc.z) {
        return false;
    }
    vec4 ends = light_texel(texel);
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

// The corners (least s, least t, greatest s, greatest t) of a box around a part.
vec4 part_bounds(int texel)
{
    vec4 ends = light_texel(texel);
    vec4 handles = ends + light_texel(texel + 3);
    return vec4(min(min(ends.xy, ends.zw), min(handles.xy, handles.zw)),
                max(max(ends.xy, ends.zw), max(handles.xy, handles.zw)));
}

#else

const int PART_TEXELS = 2;

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

vec4 part_bounds(int texel)
{
    vec4 edge = light_texel(texel);
    return vec4(min(edge.xy, edge.zw), max(edge.xy, edge.zw));
}

#endif

// `at`: (s, t) [m].
bool is_on_light(PlanarLight light, vec2 at)
{
    if (dot(at, at) > light.radius * light.radius) {
        return false;
    }
    count_evaluations(light.part_count);
    bool inside = false;
    for (int i = 0; i < light.part_count; ++i) {
        inside = inside != is_crossed(light.first_part + PART_TEXELS * i, at);
    }
    return inside;
}

// The rectangle (least s, least t, greatest s, greatest t) around a light [m].
vec4 light_bounds(PlanarLight light)
{
    vec4 bounds = vec4(vec2(light.radius), vec2(-light.radius));
    for (int i = 0; i < light.part_count; ++i) {
        vec4 part = part_bounds(light.first_part + PART_TEXELS * i);
        bounds = vec4(min(bounds.xy, part.xy), max(bounds.zw, part.zw));
    }
    return vec4(max(bounds.xy, -light.radius), min(bounds.zw, light.radius));
}
