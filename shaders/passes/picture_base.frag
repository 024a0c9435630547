// Level 0 of a light's picture before it is blurred: the mean of the picture over each texel
// times how much of the texel the outline covers; alpha is the latter. Stored as
// common/light_picture.glsl says; border texels are 0.

#include "common/picture_units.glsl"

uniform sampler2D source;     // premultiplied, with mip levels
uniform sampler2D coverage;   // of level 0's texels, no border
uniform ivec2 size;           // of level 0
uniform ivec2 border;
uniform mat3 picture_from_texel;  // to (x, y) in [0, 1]^2
uniform vec2 low;             // corners of the rectangle around the light [texels]
uniform vec2 high;
uniform bool tiles;
uniform float largest;        // of the picture

layout(location = 0) out vec4 value;

const int SIDE = 4;

void main()
{
    ivec2 place = ivec2(gl_FragCoord.xy) - border;
    value = vec4(0.0);
    if (any(lessThan(place, ivec2(0))) || any(greaterThanEqual(place, size))) {
        return;
    }
    float covered = texelFetch(coverage, place, 0).r;
    if (covered <= 0.0) {
        return;
    }
    vec2 source_size = vec2(textureSize(source, 0));
    // Of a sample's square in the picture's texels, the longer side.
    vec2 dx = picture_from_texel[0].xy * source_size / float(SIDE);
    vec2 dy = picture_from_texel[1].xy * source_size / float(SIDE);
    float lod = 0.5 * log2(max(max(dot(dx, dx), dot(dy, dy)), 1.0));
    vec3 sum = vec3(0.0);
    for (int j = 0; j < SIDE; ++j) {
        for (int i = 0; i < SIDE; ++i) {
            // Beyond the light its edge goes on: of a texel there only a part is covered.
            vec2 within = clamp(vec2(place) + (vec2(i, j) + 0.5) / float(SIDE), low, high);
            vec2 at = (picture_from_texel * vec3(within, 1.0)).xy;
            if (tiles || all(lessThanEqual(abs(at - 0.5), vec2(0.50001)))) {
                sum += textureLod(source, at, lod).rgb;
            }
        }
    }
    value = PICTURE_ONE * covered * vec4(sum / (largest * float(SIDE * SIDE)), 1.0);
}
