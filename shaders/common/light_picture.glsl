// Pictures on lights: where they are in the atlas, and how to look them up sharp or blurred.
// Packed by app/render/picture_layout.py, five texels a picture after all outlines:
//   0, 1: x and y of the picture, each (by s, by t, constant), from the light's own (s, t) [m];
//         then 1 if it tiles
//   2: the picture's place in the atlas: corner, size [texels]
//   3: level 0's place: corner, size [texels]
//   4: texels of level 0 from (s, t): scale, offset
//
// (x, y) in [0, 1]^2, x to the right and y down. Levels 1, 2, ... have half the size each, down
// to one texel on both axes, and are stacked to the right of level 0. Their values are
// premultiplied by how much of a texel the outline covers, which is their alpha. Level k is the
// picture seen through (1 + r^2/d^2)^-2, the shape that a clamped cosine has on a plane, with d =
// PICTURE_BLUR texels of the level. Stored are values over the picture's largest, which is a factor
// of the light's radiance, and coverage, both times PICTURE_ONE.
// What levels are: ltc.prefilter.

#include "common/light_data.glsl"
#include "common/picture_units.glsl"

const float PICTURE_BLUR = 1.3;

// The atlas between texel centres, bilinear; `place` in texels. By the pass that has it.
vec4 picture_texel(vec2 place);

struct LightPicture {
    vec3 x_from_plane;
    vec3 y_from_plane;
    bool tiles;
    vec4 source;
    vec4 levels;
    vec4 level_from_plane;
};

LightPicture picture_at(int texel)
{
    vec4 x = light_texel(texel);
    vec4 y = light_texel(texel + 1);
    return LightPicture(
        x.xyz, y.xyz, x.w != 0.0, light_texel(texel + 2), light_texel(texel + 3),
        light_texel(texel + 4));
}

// The picture at (s, t), not blurred, premultiplied; black outside of it.
vec3 sharp_picture(LightPicture picture, vec2 st)
{
    vec2 at = vec2(dot(picture.x_from_plane, vec3(st, 1.0)),
                   dot(picture.y_from_plane, vec3(st, 1.0)));
    if (picture.tiles) {
        at -= floor(at);
    } else if (any(greaterThan(abs(at - 0.5), vec2(0.50001)))) {
        return vec3(0.0);
    }
    // Pictures have a border of one texel, for the sampler.
    return picture_texel(picture.source.xy + at * picture.source.zw).rgb / PICTURE_ONE;
}

// Corner of a level from that of level 0. The heights of levels 1 to k - 1 add up to h - (h >> k - 1)
// for h, a power of two, until they are 1 each.
vec2 level_corner(ivec2 size, int level)
{
    int before = max(level - 1, 0);
    int most = findMSB(size.y);
    int y = size.y - (size.y >> min(before, most)) + max(before - most, 0);
    return level == 0 ? vec2(0.0) : vec2(float(size.x), float(y));
}

// One level at `at` [texels of level 0], premultiplied.
vec4 picture_level(LightPicture picture, int level, vec2 at)
{
    ivec2 size = ivec2(picture.levels.zw);
    vec2 own = vec2(max(size.x >> level, 1), max(size.y >> level, 1));
    vec2 place = clamp(at * own / vec2(size), vec2(0.5), own - 0.5);
    return picture_texel(picture.levels.xy + level_corner(size, level) + place);
}

// Mean over the light.
vec3 mean_picture(LightPicture picture)
{
    vec2 size = picture.levels.zw;
    vec4 last = picture_level(picture, findMSB(max(int(size.x), int(size.y))), 0.5 * size);
    return last.rgb / last.a;
}

// Seen through (1 + r^2/radius^2)^-2 about `at` [texels of level 0], premultiplied, as stored. Radii
// below that of level 0 give level 0.
vec4 blurred_picture(LightPicture picture, vec2 at, float radius)
{
    ivec2 size = ivec2(picture.levels.zw);
    int last = findMSB(max(size.x, size.y));  // of level sizes, which are powers of two
    float lod = clamp(log2(radius / PICTURE_BLUR), 0.0, float(last));
    int level = min(int(lod), last - 1);
    return mix(
        picture_level(picture, level, at), picture_level(picture, level + 1, at),
        lod - float(level));
}
