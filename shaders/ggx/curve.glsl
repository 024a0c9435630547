// GGX along the curves of a light: which chords of its outline's tree will do, and half vectors
// along the others. Truth: ltc.curved_reference.curve_specular_integral.
//
// Along a curve (h' x dh')/|h'|^2 has poles where the curve, drawn on, meets the mirror
// direction or comes back to the viewer's (|h'|^2 = 0), and where it meets the point itself
// (|r|^2 = 0). Panels are halved until all are far, as in ltc/curve.glsl; the same nodes then
// carry the fan.

#include "ltc/tree.glsl"

// What lies between a node and its chord, for F = 1 and G1: GGX's density
// |h|^4 / (2 pi ax ay (|bent| + bent.z) |h'|^4), h = v + o, times depth / distance^3.
Sliver ggx_sliver(GgxLight about, GgxView view, float depth, ContourNode node)
{
    vec3 disc = node.disc;
    vec2 at = disc.xy - about.placed.anchor;
    vec3 r = about.placed.center + at.x * about.placed.u + at.y * about.placed.v;
    float distance = max(length(r), 1e-30);
    float nearest = max(distance - disc.z, abs(depth));
    float farthest = distance + disc.z;
    // No direction to the disc is farther than this from the one to its center.
    float spread = min(2.0 * disc.z / nearest, 2.0);
    vec3 h = view.wo + r / distance;
    float length_h = length(h);
    float longest = min(length_h + spread, 2.0);
    float shortest = max(length_h - spread, 0.0);
    // Along and across the surface h' = h / (ax, ay, 1) changes by so much.
    vec3 change = spread * view.inverse_alpha;
    vec3 bent = abs(h) * view.inverse_alpha;
    vec3 least_bent = max(bent - change, vec3(0.0, 0.0, view.wo.z));
    float least_bent2 = dot(least_bent, least_bent);
    float most_bent2 = dot(bent + change, bent + change);
    float bent2 = dot(bent, bent);
    float scale = 0.159154943 * view.inverse_alpha.x * view.inverse_alpha.y * abs(depth) /
                  (view.bent_length + view.bent.z);
    float longest2 = longest * longest;
    float shortest2 = shortest * shortest;
    float most = longest2 * longest2 /
                 (least_bent2 * least_bent2 * nearest * nearest * nearest);
    float least = node.above ? shortest2 * shortest2 / (most_bent2 * most_bent2 * farthest *
                                                        farthest * farthest)
                             : 0.0;
    float length_h2 = length_h * length_h;
    float middle = node.above ? length_h2 * length_h2 /
                                    (bent2 * bent2 * distance * distance * distance)
                              : 0.0;
    return Sliver(scale * middle * node.signed_area, scale * (most - least) * node.area);
}

// The next part of the outline; false where there is none above the surface, or only further
// down the tree.
bool ggx_contour_part(
    PlanarLight light, GgxLight about, GgxView view, float depth, inout Contour contour,
    out ContourPart part, out float sliver)
{
    part.is_curve = false;
    sliver = 0.0;
    if (contour.closing) {
        part.edge = closing_edge(contour);
        return true;
    }
    ContourNode node;
    if (!contour_node(light, about.placed, contour, node)) {
        return false;
    }
    Sliver beside = ggx_sliver(about, view, depth, node);
    bool is_chord = beside.error <= CHORD_ERROR;
    if (node.is_inner && !is_chord) {
        ++contour.next;
        return false;
    }
    sliver = is_chord ? beside.value : 0.0;
    return contour_part(light, about.placed, node, is_chord, contour, part);
}

// A place on a curve and the half vector there.
struct HalfVectorNode {
    vec3 h;        // h' of any length
    vec3 dh;       // by the curve's parameter
    vec2 pole;     // nearest one, relative to the parameter
};

HalfVectorNode half_vector_node(GgxLight light, PowerCurve curve, GgxView view, float t)
{
    count_evaluations(1);
    vec2 place = curve_point(curve, t);
    vec2 way = curve_way(curve, t);
    vec3 p = place.x * light.placed.u + place.y * light.placed.v;
    vec3 d = way.x * light.placed.u + way.y * light.placed.v;
    vec3 r = light.placed.center + p;
    float distance = max(length(r), 1e-30);
    vec3 difference = direction_difference(light, p, distance);
    vec3 o = light.toward + difference;
    vec3 d_o = (d - o * dot(o, d)) / distance;
    HalfVectorNode node;
    node.h = light.half_vector + difference * view.inverse_alpha;
    node.dh = d_o * view.inverse_alpha;
    float speed_r = max(dot(d, d), 1e-30);
    float speed_h = max(dot(node.dh, node.dh), 1e-30);
    vec2 pole_r = vec2(-dot(r, d), distance * distance * length(d_o)) / speed_r;
    vec2 pole_h = vec2(-dot(node.h, node.dh), length(cross(node.h, node.dh))) / speed_h;
    node.pole = dot(pole_r, pole_r) < dot(pole_h, pole_h) ? pole_r : pole_h;
    return node;
}

// Whether the poles of a panel, whose curve is about its middle, let four nodes do, seen from its
// outer ones; else halve it.
bool is_panel_ready(GgxLight light, PowerCurve curve, GgxView view, Panels panels)
{
    float off = OUTER.x * panels.half_width;
    vec2 first = half_vector_node(light, curve, view, -off).pole;
    vec2 last = half_vector_node(light, curve, view, off).pole;
    float ellipse = min(pole_ellipse(first / panels.half_width - vec2(OUTER.x, 0.0)),
                        pole_ellipse(last / panels.half_width + vec2(OUTER.x, 0.0)));
    return ellipse >= FAR_POLE || panels.halvings >= MOST_HALVINGS;
}

// Node i of a panel's four: its share of the contour's sum, and of the fan's.
FanNode curve_fan_node(
    GgxLight light, PowerCurve curve, GgxView view, Panels panels, int i, out vec3 integral)
{
    vec2 place = i < 2 ? OUTER : SECOND;
    float side = (i & 1) == 0 ? -panels.half_width : panels.half_width;
    HalfVectorNode node = half_vector_node(light, curve, view, side * place.x);
    float weight = panels.half_width * place.y;
    float inverse2 = 1.0 / max(dot(node.h, node.h), 1e-30);
    integral = (weight * inverse2) * cross(node.h, node.dh);
    vec3 along = node.dh - node.h * (dot(node.h, node.dh) * inverse2);
    float inverse = sqrt(inverse2);
    return FanNode(node.h * inverse, along * (weight * inverse));
}

// A light so small that one point of it stands for all, along a curve.
void add_pinned_curve(GgxLight light, ContourPart part, GgxView view, inout PinnedSum sum)
{
    PowerCurve curve = power_curve(part.curve);
    float middle = 0.5 * (part.from + part.to);
    float half_width = 0.5 * (part.to - part.from);
    for (int i = 0; i < 4; ++i) {
        vec2 place = i < 2 ? OUTER : SECOND;
        float t = middle + ((i & 1) == 0 ? -half_width : half_width) * place.x;
        float weight = half_width * place.y;
        vec2 st = curve_point(curve, t);
        vec2 way = weight * curve_way(curve, t);
        float moment = st.x * way.y - st.y * way.x;
        vec3 w = way.x * light.placed.center_cross_u + way.y * light.placed.center_cross_v +
                 moment * light.placed.u_cross_v;
        sum.area += moment;
        add_pinned_node(light, st.x * light.placed.u + st.y * light.placed.v,
                        way.x * light.placed.u + way.y * light.placed.v, w, view, sum);
    }
}
