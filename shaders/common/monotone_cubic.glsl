// Where a cubic that only rises has its zero. Cubics are given by their Bézier
// coefficients. Pure functions.

// Six steps leave at most 4e-7 of the coefficients' size, measured over 300,000 random
// cubics and those with double and triple roots at and between the ends; Newton's
// method, which halves its distance to a double root, leaves 6e-3.
const int ROOT_STEPS = 6;
const float ROOT_RESIDUAL = 5.9604645e-8;  // 2^-24

float cubic_at(vec4 f, float x)
{
    vec3 g = mix(f.xyz, f.yzw, x);
    vec2 h = mix(g.xy, g.yz, x);
    return mix(h.x, h.y, x);
}

// x in [0, 1] with f(x) = 0, for coefficients with f.x <= 0 < f.w. Euler's method, a
// parabola through value, slope and curvature, kept between signs by halving.
float rising_cubic_zero(vec4 f)
{
    float low = 0.0;
    float high = 1.0;
    float x = clamp(-f.x / (f.w - f.x), 0.0, 1.0);
    for (int i = 0; i < ROOT_STEPS; ++i) {
        vec3 g = mix(f.xyz, f.yzw, x);
        vec2 h = mix(g.xy, g.yz, x);
        float value = mix(h.x, h.y, x);
        if (abs(value) <= ROOT_RESIDUAL) {
            break;
        }
        float slope = 3.0 * (h.y - h.x);
        float curvature = 6.0 * ((g.z - g.y) - (g.y - g.x));
        if (value <= 0.0) {
            low = x;
        } else {
            high = x;
        }
        float root = sqrt(max(slope * slope - 2.0 * value * curvature, 0.0));
        float next = x - 2.0 * value / (slope + root);
        // Not "outside": no number is neither.
        x = next >= low && next <= high ? next : 0.5 * (low + high);
    }
    return x;
}
