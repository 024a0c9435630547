// Colours of the view of costs. The table and the scale are app/render/cost.py's.

uniform vec3 cost_colors[COST_COLORS];  // sRGB, 0 to 1
uniform float cost_octaves;             // of the scale, from 1 evaluation on
uniform vec3 cost_none;
uniform vec3 cost_empty;

// `count`: evaluations; `coverage`: 0 where no surface is.
vec3 cost_color(float count, float coverage)
{
    float place = clamp(log2(max(count, 1.0)) / cost_octaves, 0.0, 1.0) *
                  float(COST_COLORS - 1);
    int low = min(int(place), COST_COLORS - 2);
    vec3 color = mix(cost_colors[low], cost_colors[low + 1], place - float(low));
    color = count > 0.0 ? color : cost_none;
    return mix(cost_empty, color, coverage);
}
