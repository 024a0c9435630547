// Colours of the view of costs. The scale is app/render/cost.py's.

#include "common/color_map.glsl"

uniform float cost_octaves;  // of the scale, from 1 evaluation on
uniform vec3 cost_none;
uniform vec3 cost_empty;

// `count`: evaluations; `coverage`: 0 where no surface is.
vec3 cost_color(float count, float coverage)
{
    vec3 color = map_color(log2(max(count, 1.0)) / cost_octaves);
    color = count > 0.0 ? color : cost_none;
    return mix(cost_empty, color, coverage);
}
