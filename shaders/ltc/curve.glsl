// Contour integral of the form factor along cubic Bézier curves. Truth: ltc.curved_outline.
//
// In the cosine's frame the integrand (x y' - y x') / |r|^2 is rational in the curve's
// parameter; how fast Gauss-Legendre converges is decided by the nearest complex root of
// |r(t)|^2, its pole. Leaves of the tree (app/render/contour_tree.py) turn so little
// that the pole as seen from a place near it, as if the curve went straight on, is near the
// true one. A panel that sees a pole nearby from its outer nodes is halved, else its
// CURVE_NODES nodes integrate it, four unless asked otherwise. docs/curves.md has the figures, and those of what was tried and left.
// Parts below the cosine's horizon are replaced by their azimuth, as with edges, node by node.

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
        float newton = t - value / slope;
        float inside = clamp(newton, lo, hi);
        bool is_close = abs(newton - inside) < 1e-6;
        bool is_done = is_close && abs(inside - t) < 1e-7;
        // A root at the bracket's very end may be seen beyond it.
        t = is_close ? inside : 0.5 * (lo + hi);
        if (is_done) {
            break;
        }
    }
    // Before `to`, which says that there is none.
    return min(t, 0.9999999 * to);
}

#if !CURVE_RULE

// A place on a curve as the integral sees it: its azimuth where it is below the horizon.
struct CurveNode {
    vec3 r;         // in the cosine's frame
    vec3 r_way;     // dr/dt
    vec3 moment;    // r x r_way, without its cancellation
};

CurveNode curve_node(CosineLight light, PowerCurve curve, float t)
{
    vec2 p = curve_point(curve, t);
    vec2 way = curve_way(curve, t);
    CurveNode node;
    node.r = light.center + p.x * light.u + p.y * light.v;
    node.r_way = way.x * light.u + way.y * light.v;
    node.moment = way.x * light.center_cross_u + way.y * light.center_cross_v +
                  (p.x * way.y - p.y * way.x) * light.u_cross_v;
    if (node.r.z < 0.0) {
        node.r.z = 0.0;
        node.r_way.z = 0.0;
        node.moment.xy = vec2(0.0);
    }
    return node;
}

// The integrand.
float curve_form(CurveNode node)
{
    return node.moment.z / max(dot(node.r, node.r), 1e-30);
}

// The pole of a curve that goes straight on from a node, relative to it: a line whose nearest
// point is a away passes at b.
vec2 nearest_pole(CurveNode node)
{
    return vec2(-dot(node.r, node.r_way), length(node.moment)) /
           max(dot(node.r_way, node.r_way), 1e-30);
}

// Gauss and Legendre's places on [-1, 1] and weights: the outer pair, the next, and the middle.
// They are literals, because arrays that a loop indexes may end in local memory.
#if CURVE_NODES == 2
const vec2 OUTER = vec2(0.577350269190, 1.0);
#elif CURVE_NODES == 3
const vec2 OUTER = vec2(0.774596669241, 0.555555555556);
const float MIDDLE_WEIGHT = 0.888888888889;
#elif CURVE_NODES == 4
const vec2 OUTER = vec2(0.861136311594, 0.347854845137);
const vec2 SECOND = vec2(0.339981043585, 0.652145154863);
#elif CURVE_NODES == 5
const vec2 OUTER = vec2(0.906179845939, 0.236926885056);
const vec2 SECOND = vec2(0.538469310106, 0.478628670499);
const float MIDDLE_WEIGHT = 0.568888888889;
#else
const vec2 OUTER = vec2(0.932469514203, 0.171324492379);
const vec2 SECOND = vec2(0.661209386466, 0.360761573048);
const vec2 THIRD = vec2(0.238619186083, 0.467913934573);
#endif

// A part of a curve in panels, one after the other, halved where they must be: after the second
// half of one comes the one it is half of. A counter, not a stack.
struct Panels {
    float from;
    float half_width;
    int index;       // of the panel among those of its width
    int halvings;
};

// Panels are 2^-20 of a part at least: float32 knows little more of a place on it.
const int MOST_HALVINGS = 20;

Panels panels_of(float from, float to)
{
    return Panels(from, 0.5 * (to - from), 0, 0);
}

bool has_panel(Panels panels)
{
    return panels.index < 1 || panels.halvings > 0;
}

float panel_middle(Panels panels)
{
    return panels.from + panels.half_width * float(2 * panels.index + 1);
}

void halve_panel(inout Panels panels)
{
    panels.half_width *= 0.5;
    panels.index *= 2;
    ++panels.halvings;
}

void next_panel(inout Panels panels)
{
    ++panels.index;
    while ((panels.index & 1) == 0 && panels.halvings > 0) {
        panels.index >>= 1;
        --panels.halvings;
        panels.half_width *= 2.0;
    }
}

// A curve about the middle of one of its panels. Near the anchor, where panels are short, float32
// is finest: so all nodes of a panel lie on one curve, where about the curve's start each
// would be off by 6e-8 of its length, by itself.
PowerCurve panel_curve(PowerCurve curve, Panels panels)
{
    float t = panel_middle(panels);
    return PowerCurve(curve_point(curve, t), curve_way(curve, t), curve.c2 + 3.0 * t * curve.c3,
                      curve.c3);
}

// Adds w v, w = weight + weight_low, to high + low; every product and sum keeps its error.
void add_accurately(inout vec2 high, inout vec2 low, float weight, float weight_low, vec2 v)
{
    precise vec2 p = weight * v;
    precise vec2 s = high + p;
    precise vec2 back = s - high;
    precise vec2 error = (high - (s - back)) + (p - back);
    low += error + (vec2(product_error(weight, v.x, p.x), product_error(weight, v.y, p.y)) +
                    weight_low * v);
    high = s;
}

// A place of a curve about the anchor, as exact as its distance from there even where the curve
// passes close by and its terms cancel. Ends in the light's plane, handles from the ends.
vec2 accurate_place(CosineLight about, vec4 ends, vec4 ends_low, vec4 handles, float t)
{
    // The end's, the first handle's and the second's Bernstein weights, each with its error.
    precise float s = 1.0 - t;
    precise float s_low = (1.0 - s) - t;
    precise float square = t * t;
    precise float square_low = product_error(t, t, square);
    precise float rest = 3.0 - 2.0 * t;
    precise float rest_low = (3.0 - rest) - 2.0 * t;
    precise float end = square * rest;
    precise float end_low =
        product_error(square, rest, end) + (square_low * rest + square * rest_low);
    precise float three = 3.0 * t;
    precise float mixed = three * s;
    precise float mixed_low =
        product_error(three, s, mixed) + (product_error(3.0, t, three) * s + three * s_low);
    precise float first = mixed * s;
    precise float first_low = product_error(mixed, s, first) + (mixed_low * s + mixed * s_low);
    precise float second = mixed * t;
    precise float second_low = product_error(mixed, t, second) + mixed_low * t;
    vec2 low;
    vec2 d_low;
    vec2 place = accurate_difference(ends.xy, ends_low.xy, about.anchor, about.anchor_low, low);
    vec2 d = accurate_difference(ends.zw, ends_low.zw, ends.xy, ends_low.xy, d_low);
    low += end * d_low;
    add_accurately(place, low, end, end_low, d);
    add_accurately(place, low, first, first_low, handles.xy);
    add_accurately(place, low, second, second_low, handles.zw);
    return place + low;
}

// Limits of rho + 1/rho for the ellipse with foci at a panel's ends that keeps its pole outside.
// At 3.6 four nodes err by rho^-8 = 1e-4 of what the pole contributes, which is little wherever
// it is near. Across the cosine's horizon the integrand has a kink in its second derivative,
// and panels must be half as wide for the same error.
const float FAR_POLE = 3.6;
const float FAR_FROM_KINK = 7.0;

// The pole in half widths from the panel's middle.
float pole_ellipse(vec2 pole)
{
    return length(pole - vec2(1.0, 0.0)) + length(pole + vec2(1.0, 0.0));
}

// The integrand at two nodes, (place, weight), of a curve about its panel's middle.
float node_pair(CosineLight light, PowerCurve curve, float half_width, vec2 node)
{
    float off = node.x * half_width;
    return node.y *
           (curve_form(curve_node(light, curve, -off)) + curve_form(curve_node(light, curve, off)));
}

// Integral over a part of the curve.
float curve_integral(CosineLight light, PowerCurve whole, float from, float to)
{
    Panels panels = panels_of(from, to);
    float sum = 0.0;
    while (has_panel(panels)) {
        PowerCurve curve = panel_curve(whole, panels);
        float half_width = panels.half_width;
        CurveNode first = curve_node(light, curve, -OUTER.x * half_width);
        CurveNode last = curve_node(light, curve, OUTER.x * half_width);
        count_evaluations(2);
        vec2 from_first = nearest_pole(first) / half_width - vec2(OUTER.x, 0.0);
        vec2 from_last = nearest_pole(last) / half_width + vec2(OUTER.x, 0.0);
        float ellipse = min(pole_ellipse(from_first), pole_ellipse(from_last));
        bool has_kink = (first.r.z > 0.0) != (last.r.z > 0.0);
        if (ellipse < (has_kink ? FAR_FROM_KINK : FAR_POLE) && panels.halvings < MOST_HALVINGS) {
            halve_panel(panels);
            continue;
        }
        float panel_sum = OUTER.y * (curve_form(first) + curve_form(last));
#if CURVE_NODES >= 4
        panel_sum += node_pair(light, curve, half_width, SECOND);
#endif
#if CURVE_NODES == 6
        panel_sum += node_pair(light, curve, half_width, THIRD);
#endif
#if CURVE_NODES == 3 || CURVE_NODES == 5
        panel_sum += MIDDLE_WEIGHT * curve_form(curve_node(light, curve, 0.0));
#endif
        count_evaluations(CURVE_NODES - 2);
        sum += half_width * panel_sum;
        next_panel(panels);
    }
    return sum;
}

// The part [from, to] of a curve, clipped at the surface's horizon before.
void add_curve(
    CosineLight light, PlanarCurve planar, float from, float to, inout ContourSum sum)
{
    vec2 a = planar.a;
    vec2 b = planar.a + planar.d;
    vec2 rise = vec2(light.u.z, light.v.z);
    vec4 z = vec4(dot(rise, a), dot(rise, a + planar.a_handle), dot(rise, b + planar.b_handle),
                  dot(rise, b));
    sum.top = max(sum.top, light.center.z + max(max(z.x, z.y), max(z.z, z.w)));
    sum.angle += curve_integral(light, power_curve(planar), from, to);
}

#endif
