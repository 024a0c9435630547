// Curves by straight edges: the published methods, for comparison. Twin: ltc.adaptive.
//
// CURVE_RULE 1 halves a curve's intervals until the triangle between a chord and the chords of
// its halves adds little to the form factor (Kuge et al. 2022, listing 1); 2 is the same
// with leaves extrapolated to the curve; 3 takes UNIFORM_EDGES edges a curve. Instead of the
// published stack a counter walks the intervals: `index` of those `level` halvings
// deep, from left to right, which needs no memory and cannot overflow.
// A chord's way is taken from the powers of t, where nothing cancels.

#include "ltc/curve.glsl"

// The chord of [from, to], whose ends are above the cosine's horizon up to rounding. (The
// sign of such an end says nothing, so an edge's own clipping would go astray.)
void add_chord(CosineLight light, PowerCurve curve, float from, float to, inout ContourSum sum)
{
    vec2 a = curve_point(curve, from);
    vec2 b = curve_point(curve, to);
    vec2 d = (to - from) * (curve.c1 + (from + to) * curve.c2 +
                            (from * from + from * to + to * to) * curve.c3);
    float moment = cross_2d(a, d);
    vec3 dp = a.x * light.u + a.y * light.v;
    vec3 dq = b.x * light.u + b.y * light.v;
    vec3 w = d.x * light.center_cross_u + d.y * light.center_cross_v + moment * light.u_cross_v;
    if (light.pin > 0.0) {
        sum.area += moment;
        sum.angle += pinned_edge(light, dp, dq, w.z);
        return;
    }
    float w2 = dot(w, w);
    float inverse = w2 < 1e-36 ? 0.0 : inversesqrt(w2);
    float cosine = dot(light.center + dp, light.center + dq);
    sum.angle += w.z * inverse * positive_atan2(w2 * inverse, cosine);
}

#if CURVE_RULE == 3

// The polygon's edges, its vertices at equal steps of the whole curve.
void add_chords(CosineLight light, PowerCurve curve, float from, float to, inout ContourSum sum)
{
    const float edges = float(UNIFORM_EDGES);
    int last = int(ceil(to * edges));
    for (int i = int(floor(from * edges)); i < last; ++i) {
        add_chord(light, curve, max(float(i) / edges, from), min(float(i + 1) / edges, to), sum);
    }
}

#else

// The paper's N_div.
const int FIRST_INTERVALS = 4;

const int MOST_LEVELS = 10;

// An interval whose triangle adds as much to the form factor is halved; set for each lobe.
float least_triangle = 1000.0;

const float DIFFUSE_TRIANGLE = 1000.0;

// Below 1e-6 the triangles of float32 edges are noise, which no halving makes smaller.
float specular_triangle(float alpha)
{
    return max(0.1 * alpha * alpha, 1e-6);
}

void add_chords(CosineLight light, PowerCurve curve, float from, float to, inout ContourSum sum)
{
    float area_weight = light.u_cross_v.z * light.pin;
    int level = 0;
    int index = 0;
    while (level > 0 || index < FIRST_INTERVALS) {
        float width = (to - from) / float(FIRST_INTERVALS << level);
        vec3 t = from + width * (vec3(0.0, 0.5, 1.0) + float(index));
        ContourSum halves = ContourSum(0.0, 0.0, 0.0);
        add_chord(light, curve, t.x, t.y, halves);
        add_chord(light, curve, t.y, t.z, halves);
        ContourSum triangle = halves;
        add_chord(light, curve, t.z, t.x, triangle);
        float size = 0.159154943 * abs(triangle.angle + triangle.area * area_weight);
        if (size >= least_triangle && level < MOST_LEVELS) {
            ++level;
            index *= 2;
            continue;
        }
        sum.angle += halves.angle;
        sum.area += halves.area;
#if CURVE_RULE == 2
        // Arc less chord falls by four when an arc is halved.
        sum.angle += triangle.angle / 3.0;
        sum.area += triangle.area / 3.0;
#endif
        ++index;
        while (level > 0 && (index & 1) == 0) {
            index >>= 1;
            --level;
        }
    }
}

#endif

// The part [from, to] of a curve, clipped at the surface's horizon before: its parts above the
// cosine's horizon by edges, the azimuth of those below.
void add_divided_curve(
    CosineLight light, PlanarCurve planar, float from, float to, inout ContourSum sum)
{
    PowerCurve curve = power_curve(planar);
    vec2 rise = vec2(light.u.z, light.v.z);
    float start = light.center.z + dot(rise, planar.a);
    vec4 z = start + vec4(0.0, dot(rise, planar.a_handle),
                          dot(rise, planar.d + planar.b_handle), dot(rise, planar.d));
    sum.top = max(sum.top, max(max(z.x, z.y), max(z.z, z.w)));
    if (light.pin > 0.0) {
        add_chords(light, curve, from, to, sum);
        return;
    }
    bool above = bernstein(z, from) > 0.0;
    float at = from;
    // A cubic crosses the horizon three times at most.
    for (int i = 0; i < 4; ++i) {
        float next = next_crossing(z, at, to, above);
        if (above) {
            add_chords(light, curve, at, next, sum);
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
