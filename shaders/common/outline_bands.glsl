// Whether a point is inside an outline: where a ray from it towards +p meets the
// boundary an odd number of times. Points and outline are in the box from -1 to 1;
// app/render/light_shapes.py has the whole idea and makes the texels.

#include "common/monotone_cubic.glsl"

// Where the texels are, is the entry shader's choice.
vec4 outline_texel(int index);

// Whether the piece at `index` is farther along +p than `at`, where it has the same q.
bool is_beyond(int index, vec2 q_ends, vec2 at)
{
    vec4 p = outline_texel(index + 1) - at.x;
    vec4 q = vec4(q_ends.x, outline_texel(index + 2).xy, q_ends.y) - at.y;
    return cubic_at(p, rising_cubic_zero(q_ends.x < q_ends.y ? q : -q)) > 0.0;
}

// Whether of `count` pieces from `piece` on, which begin or end in the band or may hold
// the point in their box, an odd number is beyond.
bool is_odd_beyond(int piece, int count, vec2 at)
{
    bool odd = false;
    for (int end = piece + 3 * count; piece < end; piece += 3) {
        vec4 box = outline_texel(piece);  // q of both ends, least and greatest p
        if (at.x >= box.w) {
            break;  // as are all that follow
        }
        // Half-open and exact: of two pieces that join at this very q one counts.
        if ((box.x <= at.y) != (box.y <= at.y)
            && (at.x < box.z || is_beyond(piece, box.xy, at))) {
            odd = !odd;
        }
    }
    return odd;
}

// `at`: (p, q). The outline's texels begin at `first`, with one for each band.
bool is_inside_outline(int first, int bands, vec2 at)
{
    int band = clamp(int((at.y + 1.0) * 0.5 * float(bands)), 0, bands - 1);
    vec4 head = outline_texel(first + band);
    int list = first + int(head.x);
    int crossing = int(head.y);
    // Of the pieces that cross the band, how many are beyond with all of their box.
    int beyond = 0;
    for (int rest = crossing; beyond < rest;) {
        int middle = (beyond + rest) / 2;
        if (at.x < outline_texel(list + 3 * middle).z) {
            beyond = middle + 1;
        } else {
            rest = middle;
        }
    }
    bool inside = (beyond & 1) != 0;
    inside = inside != is_odd_beyond(list + 3 * beyond, crossing - beyond, at);
    return inside != is_odd_beyond(list + 3 * crossing, int(head.z), at);
}
