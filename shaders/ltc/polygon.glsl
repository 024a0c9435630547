// Form factor of planar outlines under a linear transform, in float32 that
// survives far, tiny, huge and edge-on lights. Twin: ltc.polygon.
//
// The contour sum is Lambert's: an edge from p to q adds theta w_z / |w|, with
// w = p x q and theta = atan2(|w|, p . q). What keeps it exact:
//   - Outlines stay in the light's plane, as (s, t) about an anchor g. With c the
//     transformed way from the point to g, w = ds (c x U) + dt (c x V) + m (U x V)
//     for an edge (ds, dt) of 2D moment m = a x b about the anchor. The anchor of a
//     near light is the foot of the point on its plane, so an edge that passes close
//     by has a small m instead of a small difference of large numbers; the normals
//     are transformed by the cofactor matrix, whose last row is the lobe's axis,
//     instead of crossing transformed vectors.
//   - A light small against its distance is pinned to its own centre: the sum of w_z
//     over a closed outline is twice its projected area exactly, so only differences
//     1/|r|^2 - 1/|c|^2 are integrated, by quadrature. (Relative error of a unit quad
//     30,000 away: 54 with arccosines, .008 unpinned, 2e-7 so.)
//   - Below the horizon of the cosine the contour is replaced by its azimuth, edge by
//     edge, with no state between edges; where an edge crosses the horizon, the
//     crossing's direction is w x z.

#include "common/atan2.glsl"
#include "common/cost.glsl"
#include "common/light_data.glsl"
#include "ltc/plane_view.glsl"

// What carries points (directions) and edge planes (their normals) from the world
// to where the lobe is a clamped cosine, up to positive factors.
struct CosineTransform {
    mat3 points;   // K = cosine_from_world
    mat3 normals;  // the cofactor matrix of K: (K p) x (K q) = normals (p x q)
};

// A transformed light: points are center + s u + t v, (s, t) about the anchor.
struct CosineLight {
    vec3 center;
    vec3 u;
    vec3 v;
    vec3 center_cross_u;
    vec3 center_cross_v;
    vec3 u_cross_v;
    vec2 anchor;      // in the light's own (s, t)
    vec2 anchor_low;
    float pin;        // 1/W(center) where pinned, else 0; W = x^2 + y^2 + max(z, 0)^2
};

struct ContourSum {
    float angle;      // sum of signed edge terms
    float area;       // twice the clipped area in (s, t)
    float top;        // largest z met
};

// a.x b.y - a.y b.x to about one unit in the last place.
float cross_2d(vec2 a, vec2 b)
{
    precise float p = a.x * b.y;
    precise float q = a.y * b.x;
    precise float d = p - q;
    return d + (product_error(a.x, b.y, p) - product_error(a.y, b.x, q));
}

// (x + x_low) - (y + y_low): the difference and, in `low`, what rounding takes from it
// (Knuth's TwoSum, then renormalised). `precise` keeps compilers from simplifying.
vec2 accurate_difference(vec2 x, vec2 x_low, vec2 y, vec2 y_low, out vec2 low)
{
    precise vec2 d = x - y;
    precise vec2 back = d - x;
    precise vec2 error = ((x - (d - back)) - (y + back)) + (x_low - y_low);
    precise vec2 difference = d + error;
    precise vec2 rest = error - (difference - d);
    low = rest;
    return difference;
}

// An edge about an anchor in the light's plane: from a to b, d = b - a, moment = a x d.
struct PlanarEdge {
    vec2 a;
    vec2 b;
    vec2 d;
    float moment;
};

PlanarEdge planar_edge(vec4 corners, vec4 corners_low, vec2 anchor, vec2 anchor_low)
{
    PlanarEdge edge;
    vec2 a_low;
    vec2 b_low;
    vec2 d_low;
    // Both ends alike: a vertex is one edge's end and the next one's start, to the bit.
    edge.a = accurate_difference(corners.xy, corners_low.xy, anchor, anchor_low, a_low);
    edge.b = accurate_difference(corners.zw, corners_low.zw, anchor, anchor_low, b_low);
    edge.d = accurate_difference(corners.zw, corners_low.zw, corners.xy, corners_low.xy, d_low);
    edge.moment = cross_2d(edge.a, edge.d) +
                  ((a_low.x * edge.d.y - a_low.y * edge.d.x) +
                   (edge.a.x * d_low.y - edge.a.y * d_low.x));
    return edge;
}

// Lambert's term of an edge from p to q, w = p x q, the part below z = 0 replaced by
// its azimuth. Where w underflows the edge subtends nothing float32 can tell from 0.
float edge_angle(vec3 p, vec3 q, vec3 w)
{
    float w2 = dot(w, w);
    if (w2 < 1e-36) {
        return 0.0;
    }
    float inv = inversesqrt(w2);
    float unit_z = w.z * inv;
    float length_w = w2 * inv;
    float sign_z = w.z < 0.0 ? -1.0 : 1.0;
    bool above = min(p.z, q.z) >= 0.0;
    // An edge within a milliradian of the horizon's plane counts as lying in it, at
    // 1e-7 of cost: where it crosses would be noise.
    bool below = !above && (max(p.z, q.z) <= 0.0 || dot(w.xy, w.xy) < 1e-6 * w2);
    // Other edges meet z = 0 in the direction w x z, descending, or its opposite: the part
    // above spans the angle to it, the part below the azimuth.
    bool descending = p.z > 0.0;
    vec3 high = descending ? p : q;
    vec3 low = descending ? q : p;
    vec2 crossing = descending ? vec2(w.y, -w.x) : vec2(-w.y, w.x);
    float y = above ? length_w : below ? abs(w.z) : abs(low.z * w.z);
    float x = above ? dot(p, q) : below ? dot(p.xy, q.xy) : dot(low.xy, crossing);
    float angle = (above ? unit_z : sign_z) * positive_atan2(y, x);
    if (!above && !below) {
        angle += unit_z * positive_atan2(high.z * length_w, dot(high.xy, crossing));
    }
    return angle;
}

// 1/W(r) - pin, r = center + d, in difference form.
float pinned_weight(CosineLight light, vec3 d)
{
    vec3 c = light.center;
    vec3 r = c + d;
    float top = max(r.z, 0.0);
    // max(r.z, 0) - max(c.z, 0), exactly d.z above the horizon.
    float rise = max(d.z, -c.z) + min(c.z, 0.0);
    float excess = dot(d.xy, r.xy + c.xy) + rise * (top + max(c.z, 0.0));
    return -excess * light.pin / (dot(r.xy, r.xy) + top * top);
}

// Integral of the pinned form over an edge by 2 Gauss-Legendre nodes. Within
// |d| < 0.1 |c| they err by 20^-4 of a term that is itself 0.2 of the result: 1e-6.
float pinned_edge(CosineLight light, vec3 dp, vec3 dq, float w_z)
{
    vec3 middle = 0.5 * (dp + dq);
    vec3 offset = 0.288675135 * (dq - dp);
    return 0.5 * w_z *
           (pinned_weight(light, middle - offset) + pinned_weight(light, middle + offset));
}

// The edge's plane, p x q, from the cofactors.
vec3 edge_plane(CosineLight light, PlanarEdge edge)
{
    return edge.d.x * light.center_cross_u + edge.d.y * light.center_cross_v +
           edge.moment * light.u_cross_v;
}

// An edge of a light that is not pinned.
void add_near_edge(CosineLight light, PlanarEdge edge, inout ContourSum sum)
{
    vec3 p = light.center + edge.a.x * light.u + edge.a.y * light.v;
    vec3 q = light.center + edge.b.x * light.u + edge.b.y * light.v;
    sum.top = max(sum.top, max(p.z, q.z));
    sum.angle += edge_angle(p, q, edge_plane(light, edge));
    count_evaluations(1);
}

void add_edge(CosineLight light, PlanarEdge edge, inout ContourSum sum)
{
    vec3 dp = edge.a.x * light.u + edge.a.y * light.v;
    vec3 dq = edge.b.x * light.u + edge.b.y * light.v;
    vec3 p = light.center + dp;
    vec3 q = light.center + dq;
    vec3 w = edge_plane(light, edge);
    count_evaluations(1);
    sum.top = max(sum.top, max(p.z, q.z));
    if (light.pin > 0.0) {
        sum.area += edge.moment;
        sum.angle += pinned_edge(light, dp, dq, w.z);
    } else {
        sum.angle += edge_angle(p, q, w);
    }
}

// A light about the foot of the point on its plane, not pinned.
CosineLight near_light(CosineTransform transform, PlanarLight light, PlaneView view)
{
    CosineLight result;
    result.u = transform.points * light.u;
    result.v = transform.points * light.v;
    result.u_cross_v = transform.normals * light.n;
    result.anchor = view.foot;
    result.anchor_low = view.foot_low;
    result.center = transform.points * (view.depth * light.n);
    result.center_cross_u = view.depth * (transform.normals * light.v);
    result.center_cross_v = -view.depth * (transform.normals * light.u);
    result.pin = 0.0;
    return result;
}

CosineLight cosine_light(CosineTransform transform, PlanarLight light, PlaneView view)
{
    CosineLight result = near_light(transform, light, view);
    vec3 c = transform.points * view.offset;
    float c2 = dot(c, c);
    float extent2 =
        light.radius * light.radius * (dot(result.u, result.u) + dot(result.v, result.v));
    if (extent2 < 0.01 * c2) {
        result.anchor = vec2(0.0);
        result.anchor_low = vec2(0.0);
        result.center = c;
        // offset x u and offset x v, from its coordinates (-foot, depth) in (u, v, n).
        result.center_cross_u =
            transform.normals * (view.depth * light.v + view.foot.y * light.n);
        result.center_cross_v =
            transform.normals * (-view.depth * light.u - view.foot.x * light.n);
        // Where W(center) is below half |center|^2 all of the light is below z = 0.
        float top = max(c.z, 0.0);
        result.pin = 1.0 / max(dot(c.xy, c.xy) + top * top, 0.5 * c2);
    }
    return result;
}

// Form factor from the sum over the closed, clipped outline; positive for
// outlines counter-clockwise about +z.
float form_factor(CosineLight light, ContourSum sum)
{
    if (sum.top <= 0.0) {
        return 0.0;
    }
    return 0.159154943 * (sum.angle + sum.area * light.u_cross_v.z * light.pin);
}
