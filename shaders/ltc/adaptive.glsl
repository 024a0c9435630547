// Curves by straight edges, as published, for comparison. Twin: ltc.adaptive.
//
// CURVE_RULE 1 halves a curve's intervals until the triangle between a chord and the chords of
// its halves adds little to the form factor (Kuge et al. 2022, listing 1); 2 is the same with
// leaves extrapolated to the curve. Instead of the published stack a counter walks the
// intervals: `index` of those `level` halvings deep, from left to right, which needs no
// memory and cannot overflow.
// A chord's way is taken from the powers of t, where nothing cancels.

#include "ltc/curve.glsl"

vec3 point_at(CosineLight light, vec2 p)
{
    return light.center + p.x * light.u + p.y * light.v;
}

// Lambert's term of the chord of [from, to], whose ends are above the cosine's horizon up to
// rounding. (The sign of such an end says nothing, so an edge's own clipping would go astray.)
float chord_angle(CosineLight light, PowerCurve curve, float from, float to)
{
    vec2 a = curve_point(curve, from);
    vec2 b = curve_point(curve, to);
    vec2 d = (to - from) * (curve.c1 + (from + to) * curve.c2 +
                            (from * from + from * to + to * to) * curve.c3);
    vec3 w = edge_plane(light, PlanarEdge(a, b, d, cross_2d(a, d)));
    count_evaluations(1);
    float w2 = dot(w, w);
    float inverse = w2 < 1e-36 ? 0.0 : inversesqrt(w2);
    float cosine = dot(point_at(light, a), point_at(light, b));
    return w.z * inverse * positive_atan2(w2 * inverse, cosine);
}

// By how much the azimuth turns on [from, to], below the horizon, where it is less than half a
// turn: the nadir, opposite to the lobe's axis, is below the surface.
float azimuth_turn(CosineLight light, PowerCurve curve, float from, float to)
{
    vec2 a = point_at(light, curve_point(curve, from)).xy;
    vec2 b = point_at(light, curve_point(curve, to)).xy;
    float cross_z = a.x * b.y - a.y * b.x;
    float angle = positive_atan2(abs(cross_z), dot(a, b));
    return cross_z < 0.0 ? -angle : angle;
}

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

float chord_sum(CosineLight light, PowerCurve curve, float from, float to)
{
    float sum = 0.0;
    int level = 0;
    int index = 0;
    while (level > 0 || index < FIRST_INTERVALS) {
        float width = (to - from) / float(FIRST_INTERVALS << level);
        vec3 t = from + width * (vec3(0.0, 0.5, 1.0) + float(index));
        float halves = chord_angle(light, curve, t.x, t.y) + chord_angle(light, curve, t.y, t.z);
        float triangle = halves + chord_angle(light, curve, t.z, t.x);
        if (0.159154943 * abs(triangle) >= least_triangle && level < MOST_LEVELS) {
            ++level;
            index *= 2;
            continue;
        }
#if CURVE_RULE == 2
        // Arc less chord falls by four when an arc is halved.
        halves += triangle / 3.0;
#endif
        sum += halves;
        ++index;
        while (level > 0 && (index & 1) == 0) {
            index >>= 1;
            --level;
        }
    }
    return sum;
}

// The part [from, to] of a curve, clipped at the surface's horizon before: edges along its
// parts above the cosine's horizon, the azimuth of those below.
void add_divided_curve(
    CosineLight light, PlanarCurve planar, float from, float to, inout ContourSum sum)
{
    PowerCurve curve = power_curve(planar);
    vec2 rise = vec2(light.u.z, light.v.z);
    float start = light.center.z + dot(rise, planar.a);
    vec4 z = start + vec4(0.0, dot(rise, planar.a_handle),
                          dot(rise, planar.d + planar.b_handle), dot(rise, planar.d));
    sum.top = max(sum.top, max(max(z.x, z.y), max(z.z, z.w)));
    bool above = bernstein(z, from) > 0.0;
    float at = from;
    // A cubic crosses the horizon three times at most.
    for (int i = 0; i < 4; ++i) {
        float next = next_crossing(z, at, to, above);
        if (above) {
            sum.angle += chord_sum(light, curve, at, next);
        } else {
            sum.angle += azimuth_turn(light, curve, at, next);
        }
        if (next >= to) {
            break;
        }
        at = next;
        above = !above;
    }
}
