// Contour integral of the form factor along cubic Bézier curves. Truth: ltc.bezier.
//
// In the cosine's frame the integrand (x y' - y x') / |r|^2 is rational in the curve's
// parameter; how fast Gauss-Legendre converges is decided by the nearest complex root of
// |r(t)|^2, its pole. Leaves of the tree (app/render/contour_tree.py) turn so little
// that the pole as seen from a place near it, as if the curve went straight on, is near the
// true one. A panel that sees a pole nearby from its outer nodes is halved, else its four
// nodes integrate it. docs/curves.md has the figures, and those of what was tried and left.
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

// A place on a curve as the integral sees it.
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
    return node;
}

// The integrand, above the cosine's horizon.
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

const float NODE_1 = 0.339981043585;
const float NODE_2 = 0.861136311594;
const float WEIGHT_1 = 0.652145154863;
const float WEIGHT_2 = 0.347854845137;

// Panels are 2^-16 of a curve at least: float32 knows no more of a place on it.
const int MOST_HALVINGS = 16;

// Whether a panel's pole, in half widths from its middle, is outside the ellipse with foci
// -1 and 1 and rho + 1/rho = 3.6: four nodes then err by rho^-8 = 1e-4 of what the pole
// contributes, which is little wherever it is near.
bool is_far(vec2 pole)
{
    return length(pole - vec2(1.0, 0.0)) + length(pole + vec2(1.0, 0.0)) > 3.6;
}

// Integral over a part of the curve that is above the cosine's horizon.
float curve_integral(CosineLight light, PowerCurve curve, float from, float to)
{
    float half_width = 0.5 * (to - from);
    int panel = 0;
    int halvings = 0;
    float sum = 0.0;
    // Panels in order: after the second half of one comes the one it is half of.
    while (panel < 1 || halvings > 0) {
        float middle = from + half_width * float(2 * panel + 1);
        CurveNode first = curve_node(light, curve, middle - NODE_2 * half_width);
        CurveNode last = curve_node(light, curve, middle + NODE_2 * half_width);
        vec2 from_first = nearest_pole(first) / half_width - vec2(NODE_2, 0.0);
        vec2 from_last = nearest_pole(last) / half_width + vec2(NODE_2, 0.0);
        if (halvings < MOST_HALVINGS && !(is_far(from_first) && is_far(from_last))) {
            half_width *= 0.5;
            ++halvings;
            panel *= 2;
            continue;
        }
        CurveNode second = curve_node(light, curve, middle - NODE_1 * half_width);
        CurveNode third = curve_node(light, curve, middle + NODE_1 * half_width);
        sum += half_width * (WEIGHT_2 * (curve_form(first) + curve_form(last)) +
                             WEIGHT_1 * (curve_form(second) + curve_form(third)));
        ++panel;
        while ((panel & 1) == 0 && halvings > 0) {
            panel >>= 1;
            --halvings;
            half_width *= 2.0;
        }
    }
    return sum;
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
