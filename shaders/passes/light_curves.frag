// See light_surface.glsl. What the pixel sees of the light's plane, if it is inside
// the outline.

#include "common/outline_bands.glsl"
#include "passes/light_surface.glsl"

uniform sampler2D outline_texels;
uniform int first_texel;
uniform int band_count;
uniform mat3 box_from_pixel;  // pixels from the middle of the target to (p, q, 1) / depth
uniform vec2 middle;          // of the target [pixels]
uniform vec3 normal_ws;       // of the side that is seen
uniform float light_id;

vec4 outline_texel(int index)
{
    ivec2 place = ivec2(index % STORAGE_TEXTURE_WIDTH, index / STORAGE_TEXTURE_WIDTH);
    return texelFetch(outline_texels, place, 0);
}

void main()
{
    vec3 met = box_from_pixel * vec3(gl_FragCoord.xy - middle, 1.0);
    vec2 at = met.xy / met.z;
    // Not "outside the box": no number is neither.
    bool in_box = met.z > 0.0 && abs(at.x) <= 1.0 && abs(at.y) <= 1.0;
    if (!in_box || !is_inside_outline(first_texel, band_count, at)) {
        discard;
    }
    write_light(normal_ws, 1.0 / met.z, light_id);
}
