// Contour integral of the form factor along cubic Bézier curves. Twin: ltc.curve.
//
// In the cosine's frame the integrand (x y' - y x') / |r|^2 is rational in the curve's
// parameter; how fast Gauss-Legendre converges is decided by the nearest complex root of
// |r(t)|^2, its pole. Leaves of the tree (app/render/contour_tree.py) turn so little
// that the pole seen from the middle, as if the curve went straight on, is near the true one:
//   - a pole far from the piece: 4 nodes in t;
//   - else two Newton steps to the pole a + ib, and t = a + b sinh(w): all that was
//     within b of the pole is now within 1 in w, and panels 2 wide with 4 nodes do,
//     log(1/b) of them instead of a bisection towards the pole.
// Parts below the cosine's horizon are replaced by their azimuth, as with edges. (The
// nadir, opposite to the lobe's axis, is below the surface, so it cannot lie between a part
// above the surface and its chord: the chord's azimuth is the curve's.)

#include "ltc/polygon.glsl"

// A cubic about an anchor in the light's plane, by differences that do not cancel.
struct PlanarCurve {
    vec2 a;         // its start
    vec2 d;         // from start to end
    vec2 a_handle;  // from the start
    vec2 b_handle;  // from the end
};

// Powers of t: a + (c1 + (c2 + c3 t) t) t.
struct PowerCurve {
    vec2 a;
    vec2 c1;
    vec2 c2;
    vec2 c3;
};

PowerCurve power_curve(PlanarCurve curve)
{
    return PowerCurve(curve.a, 3.0 * curve.a_handle,
                      3.0 * (curve.d + curve.b_handle - 2.0 * curve.a_handle),
                      3.0 * (curve.a_handle - curve.b_handle) - 2.0 * curve.d);
}

vec2 curve_point(PowerCurve curve, float t)
{
    return curve.a + ((curve.c3 * t + curve.c2) * t + curve.c1) * t;
}

vec2 curve_way(PowerCurve curve, float t)
{
    return (3.0 * curve.c3 * t + 2.0 * curve.c2) * t + curve.c1;
}

// A cubic given by its Bernstein coefficients.
float bernstein(vec4 z, float t)
{
    float s = 1.0 - t;
    return ((z.x * s + 3.0 * z.y * t) * s + 3.0 * z.z * t * t) * s + z.w * t * t * t;
}

// Where a cubic that is above zero at `from`, or not, first ceases to be so; `to` where
// it does not before. Only signs decide, at the turning points and at `to`, so any
// cubic, constant or linear ones included, gives as many crossings as it has changes of sign.
float next_crossing(vec4 z, float from, float to, bool above)
{
    if (above ? all(greaterThan(z, vec4(0.0))) : all(lessThanEqual(z, vec4(0.0)))) {
        return to;
    }
    // z' / 3 = a t^2 - 2 b t + c.
    float c = z.y - z.x;
    float b = z.x - 2.0 * z.y + z.z;
    float a = (z.w - z.z) - 2.0 * (z.z - z.y) + c;
    b = -b;
    float q = b + (b < 0.0 ? -1.0 : 1.0) * sqrt(max(b * b - a * c, 0.0));
    // No number where q or a is zero: such turning points compare as outside.
    float one = c / q;
    float two = q / a;
    float lo = from;
    float hi = to;
    bool found = false;
    for (int i = 0; i < 3 && !found; ++i) {
        float turning = i == 2 ? to : (i == 0) == (one < two) ? one : two;
        if (i == 2 || (turning > lo && turning < to)) {
            float value = turning == 1.0 ? z.w : bernstein(z, turning);
            found = (value > 0.0) != above;
            hi = found ? turning : hi;
            lo = found ? lo : turning;
        }
    }
    if (!found) {
        return to;
    }
    float t = 0.5 * (lo + hi);
    for (int i = 0; i < 12 && hi - lo > 1e-7; ++i) {
        float s = 1.0 - t;
        float value = bernstein(z, t);
        float slope = 3.0 * (((z.y - z.x) * s + 2.0 * (z.z - z.y) * t) * s + (z.w - z.z) * t * t);
        bool before = (value > 0.0) == above;
        lo = before ? t : lo;
        hi = before ? hi : t;
        float step = value / slope;
        float newton = t - step;
        bool inside = newton > lo && newton < hi;
        t = inside ? newton : 0.5 * (lo + hi);
        if (inside && abs(step) < 1e-7) {
            break;
        }
    }
    return t;
}

// The integrand at t, above the cosine's horizon.
float curve_form(CosineLight light, PowerCurve curve, float t)
{
    vec2 p = curve_point(curve, t);
    vec2 way = curve_way(curve, t);
    vec3 r = light.center + p.x * light.u + p.y * light.v;
    float w_z = way.x * light.center_cross_u.z + way.y * light.center_cross_v.z +
                (p.x * way.y - p.y * way.x) * light.u_cross_v.z;
    return w_z / max(dot(r, r), 1e-30);
}

const float NODE_1 = 0.339981043585;
const float NODE_2 = 0.861136311594;
const float WEIGHT_1 = 0.652145154863;
const float WEIGHT_2 = 0.347854845137;

// Twice (rho + 1/rho) / 2 of the ellipse with foci -1 and 1 that goes through x + iy.
float ellipse_size(vec2 z)
{
    return length(z - vec2(1.0, 0.0)) + length(z + vec2(1.0, 0.0));
}

// With poles outside rho = 4 four nodes err by 4^-8.
const float FAR_POLE = 4.25;

// Poles within 1e-7 of a parameter are 1e-7 from it to float32: 35 panels wide.
const float MOST_PANELS = 20.0;

vec2 complex_product(vec2 a, vec2 b)
{
    return vec2(a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x);
}

// One Newton step towards the root of |r(z)|^2 near z.
vec2 improved_pole(CosineLight light, PowerCurve curve, vec2 z)
{
    vec2 z2 = complex_product(z, z);
    vec2 z3 = complex_product(z2, z);
    vec2 s = vec2(curve.a.x, 0.0) + curve.c1.x * z + curve.c2.x * z2 + curve.c3.x * z3;
    vec2 t = vec2(curve.a.y, 0.0) + curve.c1.y * z + curve.c2.y * z2 + curve.c3.y * z3;
    vec2 ds = vec2(curve.c1.x, 0.0) + 2.0 * curve.c2.x * z + 3.0 * curve.c3.x * z2;
    vec2 dt = vec2(curve.c1.y, 0.0) + 2.0 * curve.c2.y * z + 3.0 * curve.c3.y * z2;
    vec3 re = light.center + s.x * light.u + t.x * light.v;
    vec3 im = s.y * light.u + t.y * light.v;
    vec3 d_re = ds.x * light.u + dt.x * light.v;
    vec3 d_im = ds.y * light.u + dt.y * light.v;
    vec2 value = vec2(dot(re, re) - dot(im, im), 2.0 * dot(re, im));
    vec2 slope = 2.0 * vec2(dot(re, d_re) - dot(im, d_im), dot(re, d_im) + dot(im, d_re));
    float slope2 = dot(slope, slope);
    if (slope2 < 1e-36) {
        return z;
    }
    z -= complex_product(value, vec2(slope.x, -slope.y)) / slope2;
    return vec2(z.x, abs(z.y));
}

float inverse_sinh(float x)
{
    float size = log(abs(x) + sqrt(x * x + 1.0));
    return x < 0.0 ? -size : size;
}

// Integral over a part of the curve that is above the cosine's horizon.
float curve_integral(CosineLight light, PowerCurve curve, float from, float to)
{
    float middle = 0.5 * (from + to);
    float half_width = 0.5 * (to - from);
    vec2 p = curve_point(curve, middle);
    vec2 way = curve_way(curve, middle);
    vec3 r = light.center + p.x * light.u + p.y * light.v;
    vec3 r_way = way.x * light.u + way.y * light.v;
    // r may be small between large terms; its product with the way does not cancel.
    vec3 w = way.x * light.center_cross_u + way.y * light.center_cross_v +
             (p.x * way.y - p.y * way.x) * light.u_cross_v;
    float speed2 = max(dot(r_way, r_way), 1e-30);
    vec2 pole = vec2(-dot(r, r_way), length(w)) / speed2;
    if (ellipse_size(pole / half_width) > FAR_POLE) {
        vec2 near = middle + half_width * vec2(-NODE_1, NODE_1);
        vec2 far = middle + half_width * vec2(-NODE_2, NODE_2);
        return half_width *
               (WEIGHT_1 * (curve_form(light, curve, near.x) + curve_form(light, curve, near.y)) +
                WEIGHT_2 * (curve_form(light, curve, far.x) + curve_form(light, curve, far.y)));
    }
    pole.x += middle;
    pole = improved_pole(light, curve, pole);
    pole = improved_pole(light, curve, pole);
    float a = pole.x;
    float b = max(pole.y, 1e-7);
    float first = inverse_sinh((from - a) / b);
    float span = inverse_sinh((to - a) / b) - first;
    int panels = int(ceil(min(0.5 * span, MOST_PANELS)));
    float half_panel = 0.5 * span / float(max(panels, 1));
    float sum = 0.0;
    // Four nodes a panel, in one loop: unrolled, the code is four times as long.
    for (int i = 0; i < 4 * panels; ++i) {
        int node = i & 3;
        float place = (node & 1) == 0 ? -1.0 : 1.0;
        place *= node < 2 ? NODE_1 : NODE_2;
        float grown = exp(first + half_panel * (float(2 * (i >> 2) + 1) + place));
        float inverse = 1.0 / grown;
        float t = clamp(a + 0.5 * b * (grown - inverse), from, to);
        float weight = node < 2 ? WEIGHT_1 : WEIGHT_2;
        sum += weight * (grown + inverse) * curve_form(light, curve, t);
    }
    return 0.5 * b * half_panel * sum;
}

// The same where the light is pinned: differences to the pin, which are smooth.
void add_pinned_curve(
    CosineLight light, PowerCurve curve, float from, float to, inout ContourSum sum)
{
    float middle = 0.5 * (from + to);
    float half_width = 0.5 * (to - from);
    for (int i = 0; i < 4; ++i) {
        float place = (i & 1) == 0 ? -half_width : half_width;
        float t = middle + place * (i < 2 ? NODE_1 : NODE_2);
        float weight = half_width * (i < 2 ? WEIGHT_1 : WEIGHT_2);
        vec2 p = curve_point(curve, t);
        vec2 way = curve_way(curve, t);
        float moment = p.x * way.y - p.y * way.x;
        float w_z = way.x * light.center_cross_u.z + way.y * light.center_cross_v.z +
                    moment * light.u_cross_v.z;
        sum.area += weight * moment;
        sum.angle += weight * w_z * pinned_weight(light, p.x * light.u + p.y * light.v);
    }
}

// The angle from a to b, less than half a turn.
float azimuth_between(vec2 a, vec2 b)
{
    float cross_z = a.x * b.y - a.y * b.x;
    float angle = positive_atan2(abs(cross_z), dot(a, b));
    return cross_z < 0.0 ? -angle : angle;
}

// The part [from, to] of a curve, clipped at the surface's horizon before.
void add_curve(
    CosineLight light, PlanarCurve planar, float from, float to, inout ContourSum sum)
{
    PowerCurve curve = power_curve(planar);
    vec2 rise = vec2(light.u.z, light.v.z);
    float start = light.center.z + dot(rise, planar.a);
    vec4 z = start + vec4(0.0, dot(rise, planar.a_handle),
                          dot(rise, planar.d + planar.b_handle), dot(rise, planar.d));
    sum.top = max(sum.top, max(max(z.x, z.y), max(z.z, z.w)));
    if (light.pin > 0.0) {
        add_pinned_curve(light, curve, from, to, sum);
        return;
    }
    bool above = bernstein(z, from) > 0.0;
    float at = from;
    // A cubic crosses the horizon three times at most.
    for (int i = 0; i < 4; ++i) {
        float next = next_crossing(z, at, to, above);
        if (above) {
            sum.angle += curve_integral(light, curve, at, next);
        } else {
            vec2 p = curve_point(curve, at);
            vec2 q = curve_point(curve, next);
            sum.angle += azimuth_between(
                light.center.xy + p.x * light.u.xy + p.y * light.v.xy,
                light.center.xy + q.x * light.u.xy + q.y * light.v.xy);
        }
        if (next >= to) {
            break;
        }
        at = next;
        above = !above;
    }
}
