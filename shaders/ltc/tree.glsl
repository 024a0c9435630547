// Walk a curved light's outline down its tree of chords; form factor of what is above the
// surface. Packed by app/render/contour_tree.py.
//
// Every node knows its chord and what lies between: an area in a disc. As a contour integral
// it is the chord's plus the lobe's integral over that area, which is the density at
// the disc's center times the area, wrong by no more than the density's range over the
// disc times the area's size. Where that is less than `CHORD_ERROR` the walk takes the
// chord and skips what is under the node; else it goes on to the children, and of leaves it
// takes the curve.

#include "ltc/contour.glsl"
#include "ltc/curve.glsl"
#if CURVE_RULE
#include "ltc/adaptive.glsl"
#endif

// Largest radiance that a node's chord may be wrong by, of a light of radiance 1. The bound
// is far from tight: outlines err by a tenth of this altogether. It goes with the panels' error.
#if CURVE_NODES == 2
const float CHORD_ERROR = 1e-3;
#elif CURVE_NODES == 3
const float CHORD_ERROR = 3e-4;
#elif CURVE_NODES == 4
const float CHORD_ERROR = 1e-4;
#elif CURVE_NODES == 5
const float CHORD_ERROR = 3e-5;
#else
const float CHORD_ERROR = 1e-5;
#endif

// The cosine lobe's density over a light's plane [1/m^2]: scale z / |r|^4.
struct LobeDensity {
    CosineLight lobe;
    float scale;     // negative where the outline is clockwise about the lobe's z
    float distance;  // of the transformed plane
    float stretch;   // lengths grow by this at most
    float rise;      // z grows by this at most, per metre
};

LobeDensity lobe_density(CosineLight lobe)
{
    float uu = dot(lobe.u, lobe.u);
    float vv = dot(lobe.v, lobe.v);
    float uv = dot(lobe.u, lobe.v);
    float volume = dot(lobe.center, lobe.u_cross_v);
    // The larger eigenvalue of the Gram matrix.
    float stretch2 = 0.5 * (uu + vv + length(vec2(uu - vv, 2.0 * uv)));
    return LobeDensity(lobe, 0.318309886 * volume, abs(volume) / length(lobe.u_cross_v),
                       sqrt(stretch2), length(vec2(lobe.u.z, lobe.v.z)));
}

// Between a cubic and its chord of ends a, b; handles from the ends, chord d = b - a.
float sliver_area(vec4 handles, vec2 d)
{
    vec2 a = handles.xy;
    vec2 b = handles.zw;
    float a_d = a.x * d.y - a.y * d.x;
    float b_d = b.x * d.y - b.y * d.x;
    float a_b = a.x * b.y - a.y * b.x;
    return 0.3 * (a_d + b_d) + 0.15 * a_b;
}

// A node of the outline's tree.
struct ContourNode {
    vec3 disc;          // around it and its chord: center about the light's origin, radius
    float area;         // at least between it and its chord
    float signed_area;  // and what that adds up to, positive to the right of the chord
    bool is_inner;
    bool above;         // all of it is above the surface
    int after;          // the node after its subtree
    vec4 handles;       // of leaves
};

// The node where the walk is; false if none of it is above the surface.
bool contour_node(
    PlanarLight light, CosineLight anchored, inout Contour contour, out ContourNode node)
{
    int texel = light.first_part + 4 * contour.next;
    vec4 ends = light_texel(texel);
    vec4 about = light_texel(texel + 2);
    node.disc = about.xyz;
    node.area = abs(about.w);
    node.is_inner = about.w < 0.0;
    node.handles = light_texel(texel + 3);
    node.after = node.is_inner ? int(node.handles.x) : contour.next + 1;
    node.signed_area =
        node.is_inner ? node.handles.y : sliver_area(node.handles, ends.zw - ends.xy);
    vec2 at = about.xy - anchored.anchor;
    float steepness = length(contour.slope);
    float height = height_of(contour, at);
    float reach = about.z * steepness;
    // Safely below: ends that are shared with other nodes must not be judged differently.
    float margin = 1e-5 * (abs(contour.base) + steepness * (length(at) + about.z));
    if (height + reach < -margin) {
        contour.next = node.after;
        return false;
    }
    node.above = height - reach > margin;
    return true;
}

// Integral of the lobe over what lies between a node and its chord: the density at one
// point times the area, and how far that may be off.
struct Sliver {
    float value;
    float error;
};

// Below either horizon there is no value, only an error.
Sliver sliver_of(LobeDensity density, ContourNode node)
{
    vec3 disc = node.disc;
    vec2 at = disc.xy - density.lobe.anchor;
    vec3 center = density.lobe.center + at.x * density.lobe.u + at.y * density.lobe.v;
    float distance = length(center);
    float reach = disc.z * density.stretch;
    float near = max(distance - reach, density.distance);
    float far = distance + reach;
    float top = center.z + disc.z * density.rise;
    float bottom = center.z - disc.z * density.rise;
    float near2 = near * near;
    float far2 = far * far;
    float distance2 = distance * distance;
    float scale = abs(density.scale);
    float most = top <= 0.0 ? 0.0 : scale * top / (near2 * near2);
    bool has_value = node.above && bottom > 0.0;
    float least = has_value ? scale * bottom / (far2 * far2) : 0.0;
    float value = has_value ? density.scale * center.z / (distance2 * distance2) : 0.0;
    return Sliver(value * node.signed_area, (most - least) * node.area);
}

// The chord of the node where the walk is, or of its curve.
PlanarEdge node_chord(PlanarLight light, CosineLight anchored, Contour contour)
{
    int texel = light.first_part + 4 * contour.next;
    return planar_edge(
        light_texel(texel), light_texel(texel + 1), anchored.anchor, anchored.anchor_low);
}

// A straight or curved part of the outline about the anchor, above the surface.
struct ContourPart {
    PlanarEdge edge;   // the chord of a curve's whole node
    PlanarCurve curve;
    float from;
    float to;
    bool is_curve;
};

// Where the curve of the node where the walk is meets the horizon, about at t.
vec2 horizon_place(
    PlanarLight light, CosineLight anchored, Contour contour, PlanarCurve curve, float t)
{
    PowerCurve power = power_curve(curve);
#if CURVE_RULE
    return curve_point(power, t);
#else
    int texel = light.first_part + 4 * contour.next;
    vec2 place = accurate_place(anchored, light_texel(texel), light_texel(texel + 1),
                                vec4(curve.a_handle, curve.b_handle), t);
    // A curve that only touches the horizon stays where it is.
    vec2 way = curve_way(power, t);
    float rise = dot(contour.slope, way);
    float step = -height_of(contour, place) / (abs(rise) > 1e-30 ? rise : 1e-30);
    return abs(step) < 1e-6 ? place + step * way : place;
#endif
}

// What of the node where the walk is lies above the surface, as its chord or as a curve;
// false if nothing.
bool contour_part(
    PlanarLight light, CosineLight anchored, ContourNode node, bool is_chord,
    inout Contour contour, out ContourPart part)
{
    part.edge = node_chord(light, anchored, contour);
    part.is_curve = !is_chord;
    if (is_chord) {
        contour.next = node.after;
        return clip_edge(contour, part.edge);
    }
    vec2 a = part.edge.a;
    part.curve = PlanarCurve(a, part.edge.d, node.handles.xy, node.handles.zw);
    vec4 z = vec4(height_of(contour, a), height_of(contour, a + node.handles.xy),
                  height_of(contour, part.edge.b + node.handles.zw),
                  height_of(contour, part.edge.b));
    part.from = contour.from;
    bool above = contour.from > 0.0 ? contour.above : z.x > 0.0;
    part.to = next_crossing(z, part.from, 1.0, above);
    if (part.to < 1.0) {
        meet_horizon(
            contour, horizon_place(light, anchored, contour, part.curve, part.to), above);
        // Not 0 again, which would be the curve's start.
        contour.from = max(part.to, 1e-7);
        contour.above = !above;
    } else {
        contour.from = 0.0;
        contour.next = node.after;
    }
    return above;
}

// Whether a node's chord will do.
bool is_chord_enough(ContourNode node, Sliver sliver)
{
#if CURVE_RULE
    // The published methods take every curve.
    return node.area == 0.0;
#else
    return sliver.error <= CHORD_ERROR;
#endif
}

// A part as the curve it is, or as an edge and the sliver beside it.
void add_part(
    CosineLight lobe, ContourPart part, bool as_curve, Sliver sliver, inout ContourSum sum)
{
    if (as_curve) {
#if CURVE_RULE
        add_divided_curve(lobe, part.curve, part.from, part.to, sum);
#else
        add_curve(lobe, part.curve, part.from, part.to, sum);
#endif
    } else {
        add_near_edge(lobe, part.edge, sum);
        sum.angle += 6.28318530718 * sliver.value;
    }
}

// Form factor, under the transform, of the part of a light above the surface.
float light_form_factor(
    PlanarLight light, CosineTransform transform, PlaneView view, vec3 normal)
{
    // Never pinned: of a light so small the tree's root is chord enough.
    CosineLight lobe = near_light(transform, light, view);
    LobeDensity density = lobe_density(lobe);
    Contour contour = contour_start(light, view, lobe, normal);
    ContourSum sum = ContourSum(0.0, 0.0, 0.0);
    while (!contour_ends(light, contour)) {
        ContourPart part;
        if (contour.closing) {
            add_near_edge(lobe, closing_edge(contour), sum);
            continue;
        }
        ContourNode node;
        if (!contour_node(light, lobe, contour, node)) {
            continue;
        }
        Sliver sliver = sliver_of(density, node);
        bool is_chord = is_chord_enough(node, sliver);
        if (node.is_inner && !is_chord) {
            ++contour.next;
        } else if (contour_part(light, lobe, node, is_chord, contour, part)) {
            add_part(lobe, part, part.is_curve, sliver, sum);
        }
    }
    return form_factor(lobe, sum);
}

// The same for two transforms at once: half of the work is to walk.
vec2 light_form_factors(
    PlanarLight light, CosineTransform one, CosineTransform two, PlaneView view, vec3 normal)
{
    CosineLight lobe_1 = near_light(one, light, view);
    CosineLight lobe_2 = near_light(two, light, view);
    LobeDensity density_1 = lobe_density(lobe_1);
    LobeDensity density_2 = lobe_density(lobe_2);
    Contour contour = contour_start(light, view, lobe_1, normal);
    ContourSum sum_1 = ContourSum(0.0, 0.0, 0.0);
    ContourSum sum_2 = sum_1;
    while (!contour_ends(light, contour)) {
        ContourPart part;
        Sliver sliver_1 = Sliver(0.0, 0.0);
        Sliver sliver_2 = sliver_1;
        bool is_chord_1 = true;
        bool is_chord_2 = true;
        bool has_part = true;
        if (contour.closing) {
            part.edge = closing_edge(contour);
            part.is_curve = false;
        } else {
            ContourNode node;
            has_part = contour_node(light, lobe_1, contour, node);
            if (has_part) {
                sliver_1 = sliver_of(density_1, node);
                sliver_2 = sliver_of(density_2, node);
                is_chord_1 = is_chord_enough(node, sliver_1);
                is_chord_2 = is_chord_enough(node, sliver_2);
                bool is_chord = is_chord_1 && is_chord_2;
                has_part = is_chord || !node.is_inner;
                if (has_part) {
                    has_part = contour_part(light, lobe_1, node, is_chord, contour, part);
                } else {
                    ++contour.next;
                }
            }
        }
        if (has_part) {
            // Where a curve meets the horizon its chord would meet it elsewhere.
            bool is_cut = part.is_curve && (part.from > 0.0 || part.to < 1.0);
            add_part(lobe_1, part, part.is_curve && (is_cut || !is_chord_1), sliver_1, sum_1);
            add_part(lobe_2, part, part.is_curve && (is_cut || !is_chord_2), sliver_2, sum_2);
        }
    }
    return vec2(form_factor(lobe_1, sum_1), form_factor(lobe_2, sum_2));
}
