// GGX over a planar light: the exact share of visible normals that reflect the viewer into it,
// times the mean of G2/G1 (and of Schlick's Fresnel term) on a fan. Twin: ltc.ggx.
//
// Lights that are small against the lobe are pinned to their centre, like in
// ltc/polygon.glsl: what would cancel is summed exactly as an area.

#include "ltc/contour.glsl"
#include "ggx/edge.glsl"

// The integrand apart from what is exact: (density, G2/G1, (1 - wo.h)^5 G2/G1) at a half
// vector of any length. The density is 2 k / (pi (|bent| + bent.z)) short of its scale.
vec3 ggx_weights(vec3 h, GgxView view)
{
    float h2 = max(dot(h, h), 1e-30);
    float v_h = max(dot(view.bent, h), 0.0);
    vec3 m = view.alpha * h;
    float m2 = max(dot(m, m), 1e-30);
    float scale = 2.0 * v_h / m2;
    float zo = view.wo.z;
    float zi = max(scale * m.z - zo, 0.0);
    vec2 bent_i = view.alpha.xy * (scale * m.xy - view.wo.xy);
    float length_i = sqrt(dot(bent_i, bent_i) + zi * zi);
    float smith = zi * (zo + view.bent_length) /
                  max(zi * view.bent_length + zo * length_i, 1e-30);
    float x = max(1.0 - v_h * inversesqrt(m2), 0.0);
    float x2 = x * x;
    return vec3(v_h / (h2 * h2), smith, smith * (x2 * x2 * x));
}

// A node of the outline: the unit half vector and its change, times the node's weight.
struct FanNode {
    vec3 u;
    vec3 du;
};

#if GGX_NODES > 1

// Gauss and Legendre's nodes and weights on [0, 1], i from 0.
vec2 along_edge(int i)
{
#if GGX_NODES == 2
    return vec2(i == 0 ? 0.211324865 : 0.788675135, 0.5);
#elif GGX_NODES == 3
    return vec2(0.112701665 + 0.387298335 * float(i), i == 1 ? 0.444444444 : 0.277777778);
#else
    float side = i < 2 ? -1.0 : 1.0;
    return i == 0 || i == 3 ? vec2(0.5 + side * 0.430568156, 0.173927423)
                            : vec2(0.5 + side * 0.169990522, 0.326072577);
#endif
}

// The widest panel of psi [rad] that an edge's nodes span; three are a turn.
const float PANEL = 2.1;

// `from`: |psi| at which the node's panel starts.
FanNode fan_node(HalfVectorEdge edge, float from, int i)
{
    vec2 node = along_edge(i);
    float width = min(abs(edge.sweep) - from, PANEL);
    float onward = edge.sweep < 0.0 ? -1.0 : 1.0;
    vec3 b = edge.cone.b;
    mat3 axes = mat3(edge.cone.w1, edge.cone.w2, edge.cone.w3);
    vec2 inverse = 1.0 / (b.xy + b.z);
    vec2 radii = sqrt(b.z * inverse);
    vec2 heights = b.xy * inverse;
    float angle = onward * (from + width * node.x);
    vec2 turn = vec2(cos(angle), sin(angle));
    vec2 c = vec2(edge.start.x * turn.x - edge.start.y * turn.y,
                  edge.start.y * turn.x + edge.start.x * turn.y);
    float height = sqrt(dot(heights, c * c));
    float slope = (heights.y - heights.x) * c.x * c.y / max(height, 1e-15);
    return FanNode(axes * vec3(radii * c, height),
                   (onward * width * node.y) *
                       (axes * vec3(-radii.x * c.y, radii.y * c.x, slope)));
}

// Sums over the nodes of a fan from the mean half vector.
struct FanSum {
    float density;
    vec2 away;      // density times the difference of both weights from the centre's
};

void add_chord_node(
    vec3 chord, float k, float s, float weight, vec3 center, vec3 at_center,
    GgxView view, inout FanSum sum)
{
    vec3 at = ggx_weights(center + s * chord, view);
    float density = weight * k * at.x;
    sum.density += density;
    sum.away += density * (at.yz - at_center.yz);
}

// Nodes along the chord for the weight 2s: Gauss and Jacobi's, or the centre and 3/4.
void add_fan_node(
    FanNode node, vec3 center, vec3 at_center, GgxView view, inout FanSum sum)
{
    vec3 chord = node.u - center;
    float k = dot(center, cross(chord, node.du));
#if GGX_NODES == 2
    add_chord_node(chord, k, 0.75, 0.888888889, center, at_center, view, sum);
    sum.density += 0.111111111 * k * at_center.x;
#elif GGX_NODES == 3
    add_chord_node(chord, k, 0.355051026, 0.363917237, center, at_center, view, sum);
    add_chord_node(chord, k, 0.844948974, 0.636082763, center, at_center, view, sum);
#else
    add_chord_node(chord, k, 0.212340538, 0.139653960, center, at_center, view, sum);
    add_chord_node(chord, k, 0.590533136, 0.458482213, center, at_center, view, sum);
    add_chord_node(chord, k, 0.911412040, 0.401863827, center, at_center, view, sum);
#endif
}
#endif

// A light about its centre of perspective, directions as differences from that centre's.
struct GgxLight {
    CosineLight placed;   // in the tangent frame
    vec3 toward;          // unit, to placed.center
    float distance;       // to it
    vec3 half_vector;     // h' of it
};

GgxLight ggx_light(PlanarLight light, PlaneView plane, mat3 tangent_from_world, GgxView view)
{
    GgxLight result;
    CosineTransform transform = CosineTransform(tangent_from_world, tangent_from_world);
    result.placed = cosine_light(transform, light, plane);
    if (result.placed.pin > 0.0) {
        result.distance = length(result.placed.center);
        result.toward = result.placed.center / result.distance;
    } else {
        result.distance = abs(plane.depth);
        result.toward = tangent_from_world * (plane.depth < 0.0 ? -light.n : light.n);
    }
    result.half_vector = (view.wo + result.toward) * view.inverse_alpha;
    return result;
}

// Unit half vector of the way to the light's origin, which is about its middle.
vec3 origin_half_vector(PlaneView plane, mat3 tangent_from_world, GgxView view)
{
    return normalize((view.wo + normalize(tangent_from_world * plane.offset)) * view.inverse_alpha);
}

// Unit direction to center + dp as a difference from the direction to the centre.
vec3 direction_difference(GgxLight light, vec3 dp, float distance)
{
    vec3 way = 2.0 * light.placed.center + dp;
    return (dp - light.toward * (dot(dp, way) / (light.distance + distance))) /
           max(distance, 1e-30);
}

// Whether the outline spans so little of the lobe that one point of it stands for all.
bool is_pinned(PlanarLight light, GgxLight about, GgxView view)
{
    float inverse = max(view.inverse_alpha.x, view.inverse_alpha.y);
    float extent = light.radius * max(inverse, 1.0) / about.distance;
    return about.placed.pin > 0.0 &&
           extent * extent < 1e-3 * dot(about.half_vector, about.half_vector);
}

struct PinnedSum {
    vec3 solid;   // of r x dr (1/|r|^2 - 1/|c|^2)
    vec3 lobe;    // of ((v + o) x do) (1/|h'|^2 - 1/|hc|^2)
    float area;   // twice the clipped area in (s, t)
};

// A place on the outline: p about the light's centre, d = dp and w = r x dr times a weight.
void add_pinned_node(GgxLight light, vec3 p, vec3 d, vec3 w, GgxView view, inout PinnedSum sum)
{
    float c2 = light.distance * light.distance;
    vec3 hc = light.half_vector;
    float hc2 = dot(hc, hc);
    vec3 r = light.placed.center + p;
    float r2 = dot(r, r);
    float distance = sqrt(r2);
    sum.solid -= w * (dot(2.0 * light.placed.center + p, p) / (r2 * c2));
    vec3 difference = direction_difference(light, p, distance);
    vec3 o = light.toward + difference;
    vec3 q = difference * view.inverse_alpha;
    vec3 h = hc + q;
    vec3 rate = (d - o * dot(o, d)) / distance;
    float excess = dot(2.0 * hc + q, q) / (dot(h, h) * hc2);
    sum.lobe -= excess * cross(view.wo + o, rate);
}

// Two Gauss-Legendre nodes: the outline is within 3 % of the lobe's width.
void add_pinned_edge(GgxLight light, PlanarEdge edge, GgxView view, inout PinnedSum sum)
{
    vec3 w = edge_plane(light.placed, edge);
    vec3 d = edge.d.x * light.placed.u + edge.d.y * light.placed.v;
    count_evaluations(1);
    sum.area += edge.moment;
    for (int i = 0; i < 2; ++i) {
        vec2 st = 0.5 * (edge.a + edge.b) + (i == 0 ? -0.288675135 : 0.288675135) * edge.d;
        vec3 p = st.x * light.placed.u + st.y * light.placed.v;
        add_pinned_node(light, p, 0.5 * d, 0.5 * w, view, sum);
    }
}

// The contour's sum of (h' x dh')/|h'|^2.
vec3 pinned_vector(GgxLight light, PinnedSum sum, GgxView view)
{
    vec3 hc = light.half_vector;
    vec3 a = view.inverse_alpha;
    float c2 = light.distance * light.distance;
    vec3 solid = sum.solid + (sum.area / c2) * light.placed.u_cross_v;
    return vec3(a.y, a.x, a.x * a.y) * (solid / dot(hc, hc) + sum.lobe);
}

// The closed form over an edge of the clipped outline; false if it has no width.
bool light_edge(GgxLight light, PlanarEdge edge, GgxView view, out HalfVectorEdge result)
{
    vec3 u = light.placed.u;
    vec3 v = light.placed.v;
    vec3 w = edge_plane(light.placed, edge);
    float w2 = dot(w, w);
    if (w2 < 1e-36) {
        return false;
    }
    vec3 dp = edge.a.x * u + edge.a.y * v;
    vec3 d = edge.d.x * u + edge.d.y * v;
    vec3 p = light.placed.center + dp;
    vec3 q = light.placed.center + edge.b.x * u + edge.b.y * v;
    float length_p = length(p);
    float length_q = max(length(q), 1e-30);
    vec3 difference = direction_difference(light, dp, length_p);
    vec3 o = light.toward + difference;
    // o_q - o_p from the shorter end, divided by the longer: the other way round loses what
    // their lengths differ by.
    vec3 shorter = length_q < length_p ? q / length_q : o;
    vec3 move = (d - shorter * (dot(d, p + q) / (length_p + length_q))) /
                max(length_p, length_q);
    count_evaluations(1);
    result = half_vector_edge(light.half_vector + difference * view.inverse_alpha,
                              move * view.inverse_alpha, w * inversesqrt(w2), view);
    return true;
}

#if HAS_CURVES
#include "ggx/curve.glsl"
#endif

#if GGX_NODES > 1
// Nodes that wait for the fan's centre; with more, the whole outline is computed again. Curves have
// four a panel: on llvmpipe a store twice as large takes a sixth off.
const int STORED_NODES = (12 + 12 * HAS_CURVES) * GGX_NODES;
#endif

// Integrals for F = 1 and with the weight (1 - wo.h)^5, light radiance 1.
vec2 ggx_light_specular(
    PlanarLight light, PlaneView plane, vec3 normal, mat3 tangent_from_world, GgxView view)
{
    GgxLight about = ggx_light(light, plane, tangent_from_world, view);
    float winding = light_winding(plane);
    float scale = 1.0 / (3.14159265359 * (view.bent_length + view.bent.z));
    bool pinned = is_pinned(light, about, view);
    PinnedSum pinned_sum = PinnedSum(vec3(0.0), vec3(0.0), 0.0);
    vec3 vector = vec3(0.0);
    vec3 center = vec3(0.0);
    vec3 at_center = vec3(0.0);
    float share = 0.0;
    float slivers = 0.0;
#if GGX_NODES > 1
    FanSum fan = FanSum(0.0, vec2(0.0));
    FanNode nodes[STORED_NODES];
    int count = 0;
#endif
    // First the outline's sum, which holds the fan's centre, then the fan.
    for (int round = 0; round < 2; ++round) {
        Contour contour = contour_start(light, plane, about.placed, normal);
        while (!contour_ends(light, contour)) {
#if HAS_CURVES
            ContourPart part;
            float sliver;
            if (!ggx_contour_part(light, about, view, plane.depth, contour, part, sliver)) {
                continue;
            }
            slivers += sliver;
            PlanarEdge planar = part.edge;
            if (part.is_curve && pinned) {
                add_pinned_curve(about, part, view, pinned_sum);
                continue;
            }
            if (part.is_curve) {
                PowerCurve whole = power_curve(part.curve);
                Panels panels = panels_of(part.from, part.to);
                while (has_panel(panels)) {
                    PowerCurve curve = panel_curve(whole, panels);
                    if (!is_panel_ready(about, curve, view, panels)) {
                        halve_panel(panels);
                        continue;
                    }
                    for (int i = 0; i < 4; ++i) {
                        vec3 integral;
                        FanNode node = curve_fan_node(about, curve, view, panels, i, integral);
                        vector += integral;
#if GGX_NODES > 1
                        if (round == 1) {
                            add_fan_node(node, center, at_center, view, fan);
                        } else if (count < STORED_NODES) {
                            nodes[count] = node;
                        }
                        ++count;
#endif
                    }
                    next_panel(panels);
                }
                continue;
            }
#else
            PlanarEdge planar;
            if (!contour_edge(light, about.placed, contour, planar)) {
                continue;
            }
#endif
            if (pinned) {
                add_pinned_edge(about, planar, view, pinned_sum);
                continue;
            }
            HalfVectorEdge edge;
            if (light_edge(about, planar, view, edge)) {
#if GGX_NODES > 1
                for (float from = 0.0; from < abs(edge.sweep); from += PANEL) {
                    for (int i = 0; i < GGX_NODES; ++i) {
                        FanNode node = fan_node(edge, from, i);
                        if (round == 1) {
                            add_fan_node(node, center, at_center, view, fan);
                        } else if (count < STORED_NODES) {
                            nodes[count] = node;
                        }
                        ++count;
                    }
                }
#endif
                vector += edge.integral;
            }
        }
        if (round == 1) {
            break;
        }
        vector = pinned ? pinned_vector(about, pinned_sum, view) : vector;
        vector *= winding;
        float chords = scale * dot(vector, view.bent);
        share = min(chords + slivers, 1.0);
        if (!(share > 0.0)) {
            return vec2(0.0);
        }
        // Of a light that is all slivers, far away and round, chords say nothing of where it is.
        float length2 = dot(vector, vector);
        bool is_vague = pinned || chords < 0.5 * share || length2 < 1e-36;
        center = is_vague ? origin_half_vector(plane, tangent_from_world, view)
                          : vector * inversesqrt(length2);
        at_center = ggx_weights(center, view);
#if GGX_NODES == 1
        break;
#else
        if (pinned || count <= STORED_NODES) {
            break;
        }
#endif
    }
    vec2 mean = at_center.yz;
#if GGX_NODES > 1
    if (count <= STORED_NODES) {
        for (int i = 0; i < count; ++i) {
            add_fan_node(nodes[i], center, at_center, view, fan);
        }
    }
    float whole = scale * winding;
    mean += fan.away * (whole / max(abs(whole * fan.density), share));
#endif
    return share * clamp(mean, 0.0, 1.0);
}
