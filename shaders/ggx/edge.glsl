// The integral of (h' x dh')/|h'|^2 along the half vectors of a straight edge, in closed
// form. Derivation and twin: ltc.ggx.
//
// Tangent frame: +z the normal, +x the direction of alpha.x. h' = (v + o)/alpha for the
// view v and the light direction o. The half vectors of an edge in the plane with normal n
// sweep an elliptic cone; its axes and eigenvalues are kept relatively accurate although
// they differ by 1e8 at alpha 1e-4, and differences are taken before the transcendental
// functions.

#include "ltc/polygon.glsl"

struct GgxView {
    vec3 wo;             // tangent frame, unit, z > 0
    vec3 alpha;          // (alpha_x, alpha_y, 1)
    vec3 inverse_alpha;
    vec3 bent;           // alpha wo
    float bent_length;
};

GgxView ggx_view(vec3 wo, vec2 alpha)
{
    vec3 d = vec3(alpha, 1.0);
    vec3 bent = d * wo;
    return GgxView(wo, d, 1.0 / d, bent, length(bent));
}

// The cone b1 h1^2 + b2 h2^2 = b3 h3^2 about w3, b1 >= b2 >= 0, b3 > 0.
struct HalfVectorCone {
    vec3 w1;
    vec3 w2;
    vec3 w3;
    vec3 b;
};

// Least T^2 and R^2 of ltc.ggx, where b1 = b2: their terms then err by a third of it.
const float LEAST_ECCENTRICITY = 1e-12;

// 2 cos(acos(x) / 3) for x in [0, 1]; error 6e-4, which one Newton step makes 1e-7.
float double_cosine_of_third(float x)
{
    return (-0.0539521 * x + 0.3207075) * x + 1.7326476;
}

HalfVectorCone half_vector_cone(vec3 n, GgxView view)
{
    vec3 d = view.alpha;
    vec3 v = view.wo;
    float kappa = dot(n, v);
    float size = abs(kappa);
    vec3 m = kappa < 0.0 ? -n : n;
    vec3 dn = d * m;
    vec3 dv = view.bent;

    // sign(kappa) B, its invariants, and the eigenvalue that stands apart.
    vec3 diagonal = 2.0 * dn * dv - size * d * d;
    vec3 off = vec3(dn.y * dv.z + dn.z * dv.y,   // yz, xz, xy
                    dn.x * dv.z + dn.z * dv.x,
                    dn.x * dv.y + dn.y * dv.x);
    float trace = diagonal.x + diagonal.y + diagonal.z;
    vec2 a2 = d.xy * d.xy;
    vec3 minor = n * n + v * v - 1.0;
    float second = a2.y * minor.x + a2.x * minor.y + a2.x * a2.y * minor.z;
    float product = a2.x * a2.y * size;
    float mean = trace / 3.0;
    vec3 apart = diagonal - mean;
    float inverse_spread =
        inversesqrt(max((dot(apart, apart) + 2.0 * dot(off, off)) / 6.0, 1e-30));
    float cubic = ((mean - trace) * mean + second) * mean - product;
    float skew = -0.5 * cubic * inverse_spread * inverse_spread * inverse_spread;
    bool top = skew >= 0.0;  // b3 stands apart, else -b1
    float root = double_cosine_of_third(min(abs(skew), 1.0)) / inverse_spread;
    float e = mean + (top ? root : -root);
    e -= (((e - trace) * e + second) * e - product) / ((3.0 * e - 2.0 * trace) * e + second);

    // Its axis: the longest cross product of two rows of B - e.
    vec3 r0 = vec3(diagonal.x - e, off.z, off.y);
    vec3 r1 = vec3(off.z, diagonal.y - e, off.x);
    vec3 r2 = vec3(off.y, off.x, diagonal.z - e);
    vec3 w = cross(r0, r1);
    vec3 other = cross(r1, r2);
    w = dot(other, other) > dot(w, w) ? other : w;
    other = cross(r2, r0);
    w = dot(other, other) > dot(w, w) ? other : w;
    w *= inversesqrt(max(dot(w, w), 1e-37));

    // B across it, relatively accurate because it is formed from alpha times the axes.
    bool upright = abs(w.z) > 0.5;
    vec2 axis = upright ? vec2(w.z, -w.x) : vec2(-w.y, w.x);
    axis *= inversesqrt(dot(axis, axis));
    vec3 f1 = upright ? vec3(axis.x, 0.0, axis.y) : vec3(axis, 0.0);
    vec3 f2 = cross(w, f1);
    vec3 y1 = d * f1;
    vec3 y2 = d * f2;
    vec2 my = vec2(dot(m, y1), dot(m, y2));
    vec2 vy = vec2(dot(v, y1), dot(v, y2));
    float m11 = 2.0 * my.x * vy.x - size * dot(y1, y1);
    float m22 = 2.0 * my.y * vy.y - size * dot(y2, y2);
    float m12 = my.x * vy.y + my.y * vy.x - size * dot(y1, y2);
    float middle = 0.5 * (m11 + m22);
    float half_difference = 0.5 * (m11 - m22);
    float radius = sqrt(half_difference * half_difference + m12 * m12);
    // The axis of the larger one.
    vec2 turn = half_difference >= 0.0 ? vec2(half_difference + radius, m12)
                                       : vec2(m12, radius - half_difference);
    float turn2 = dot(turn, turn);
    turn = turn2 > 1e-36 ? turn * inversesqrt(turn2) : vec2(1.0, 0.0);
    vec3 larger = turn.x * f1 + turn.y * f2;
    vec3 smaller = turn.x * f2 - turn.y * f1;

    // The eigenvalue of smallest modulus follows from the product of all.
    float outer = max(radius + abs(middle), 1e-30);
    float inner = product / (abs(e) * outer);
    bool positive = middle >= 0.0;  // only where -b1 stands apart
    HalfVectorCone cone;
    cone.b.x = top ? outer : -e;
    cone.b.y = min(top || positive ? inner : outer, cone.b.x);
    cone.b.z = top ? e : positive ? outer : inner;
    cone.w1 = top ? smaller : w;
    cone.w3 = top ? w : larger;
    cone.w3 = dot(cone.w3, dv) < 0.0 ? -cone.w3 : cone.w3;
    cone.w2 = cross(cone.w3, cone.w1);
    return cone;
}

// An edge's integral and where it runs on its cone.
struct HalfVectorEdge {
    vec3 integral;
    HalfVectorCone cone;
    vec2 start;   // (cos psi, sin psi)
    float sweep;  // of psi, signed
};

// atanh(numerator / denominator), denominator > 0; the ratio is kept below 1.
float area_tangent(float numerator, float denominator)
{
    float x = clamp(numerator / denominator, -0.9999999, 0.9999999);
    float x2 = x * x;
    float series = x * (1.0 + x2 * (0.333333333 + x2 * (0.2 + x2 * (0.142857143 + x2 / 9.0))));
    return x2 < 0.04 ? series : 0.5 * log((1.0 + x) / (1.0 - x));
}

// From h' to h' + dh, half vectors of a light edge in the plane with unit normal n.
HalfVectorEdge half_vector_edge(vec3 h, vec3 dh, vec3 n, GgxView view)
{
    HalfVectorEdge edge;
    HalfVectorCone cone = half_vector_cone(n, view);
    mat3 axes = mat3(cone.w1, cone.w2, cone.w3);
    vec3 p = h * axes;
    vec3 q = (h + dh) * axes;
    vec3 w = cross(h, dh) * axes;
    vec3 b = cone.b;
    float s13 = b.x + b.z;
    float s23 = b.y + b.z;
    float inverse13 = inversesqrt(s13);
    float inverse23 = inversesqrt(s23);
    float difference = max(b.x - b.y, LEAST_ECCENTRICITY * s13);
    float inverse_root = inversesqrt(difference);
    float root = difference * inverse_root;
    float T = root * inverse13;
    float R = root * inverse23;

    float angle1 = positive_atan2(T * abs(w.x), p.z * q.z + T * T * p.y * q.y);
    float i1 = b.x * inverse13 * inverse_root * (w.x < 0.0 ? -angle1 : angle1);
    // At kappa = 0 this is 0 times infinity; b.y vanishes faster.
    float base = max(p.z * q.z - R * R * p.x * q.x, 1e-7 * abs(p.z * q.z) + 1e-37);
    float i2 = b.y * inverse23 * inverse_root * area_tangent(R * w.y, base);
    float across = s13 * s23 * inverse13 * inverse23 * w.z;
    float angle3 = positive_atan2(abs(across), s13 * p.x * q.x + s23 * p.y * q.y);
    edge.sweep = across < 0.0 ? -angle3 : angle3;
    // psi goes the way of kappa: a long edge may turn by more than half.
    float onward = dot(n, view.wo) < 0.0 ? -1.0 : 1.0;
    vec3 moved = dh * view.alpha;
    if (edge.sweep * onward < 0.0 && dot(moved, moved) > 1e-6 && angle3 > 1e-3) {
        edge.sweep += 6.28318530718 * onward;
    }
    float i3 = b.z * inverse13 * inverse23 * edge.sweep;
    edge.integral = axes * vec3(i1, i2, i3);
    edge.cone = cone;
    vec2 start = vec2(p.x * s13 * inverse13, p.y * s23 * inverse23);
    edge.start = start * inversesqrt(max(dot(start, start), 1e-37));
    return edge;
}
