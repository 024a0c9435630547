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

// `at`: (p, q). The outline's texels begin at `first`, with one for each band.
bool is_inside_outline(int first, int bands, vec2 at)
{
    int band = clamp(int((at.y + 1.0) * 0.5 * float(bands)), 0, bands - 1);
    vec4 head = outline_texel(first + band);
    int piece = first + int(head.x);
    int end = piece + 3 * int(head.y);
    bool inside = false;
    for (; piece < end; piece += 3) {
        vec4 box = outline_texel(piece);  // q of both ends, least and greatest p
        if (at.x >= box.w) {
            break;  // as are all that follow
        }
        // Half-open and exact: of two pieces that join at this very q one counts.
        if ((box.x <= at.y) != (box.y <= at.y)
            && (at.x < box.z || is_beyond(piece, box.xy, at))) {
            inside = !inside;
        }
    }
    return inside;
}
