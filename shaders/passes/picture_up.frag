// A blurred level from the same level sharp and the next coarser one, sharp and blurred. The
// weights make (1 + r^2 / (1.3 texels)^2)^-2 of a point; ltc.prefilter has how well.

uniform sampler2D sharp;          // this level
uniform sampler2D coarser_sharp;
uniform sampler2D coarser;
uniform ivec2 size;               // of this level, without borders
uniform ivec2 border;
uniform bool is_last;             // there is no coarser one

layout(location = 0) out vec4 value;

vec4 coarse_texel(ivec2 place, ivec2 coarse_size)
{
    ivec2 at = place + border;
    ivec2 last = coarse_size + 2 * border - 1;
    bool outside = any(lessThan(at, ivec2(0))) || any(greaterThan(at, last));
    return outside ? vec4(0.0)
                   : 0.38 * texelFetch(coarser_sharp, at, 0) + 0.25 * texelFetch(coarser, at, 0);
}

void main()
{
    ivec2 place = ivec2(gl_FragCoord.xy) - border;
    vec4 own = texelFetch(sharp, place + border, 0);
    if (is_last) {
        value = own;
        return;
    }
    ivec2 coarse_size = max(size / 2, ivec2(1));
    // The two nearest coarse texels along each axis, 3 : 1.
    ivec2 near = ivec2(size.x > 1 ? place.x >> 1 : place.x, size.y > 1 ? place.y >> 1 : place.y);
    ivec2 far = near + ivec2((place.x & 1) == 1 ? 1 : -1, (place.y & 1) == 1 ? 1 : -1);
    vec2 f = vec2(size.x > 1 ? 0.25 : 0.0, size.y > 1 ? 0.25 : 0.0);
    value = 0.37 * own +
            mix(mix(coarse_texel(near, coarse_size),
                    coarse_texel(ivec2(far.x, near.y), coarse_size), f.x),
                mix(coarse_texel(ivec2(near.x, far.y), coarse_size),
                    coarse_texel(far, coarse_size), f.x),
                f.y);
}
