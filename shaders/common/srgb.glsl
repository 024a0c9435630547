// IEC 61966-2-1. Twin: app.render.tone_map.srgb_from_linear.

// Linear Rec. 709 in [0, 1] to sRGB code values in [0, 1].
vec3 srgb_from_linear(vec3 linear)
{
    vec3 low = 12.92 * linear;
    vec3 high = 1.055 * pow(linear, vec3(1.0 / 2.4)) - 0.055;
    return vec3(
        linear.r <= 0.0031308 ? low.r : high.r,
        linear.g <= 0.0031308 ? low.g : high.g,
        linear.b <= 0.0031308 ? low.b : high.b);
}
