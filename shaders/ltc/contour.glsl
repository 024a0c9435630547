// Walk a light's outline part by part, clipped at the surface's horizon; form factor of
// what is left. Shared by every technique.
//
// Crossings of the horizon all lie on one line of the light's plane and come in
// pairs, first with second, third with fourth and so on, in whatever order the
// outline meets them: the integral along that line is additive, so any pairing of
// exits with entries closes the clipped outline.

#include "common/light_data.glsl"
#include "ltc/polygon.glsl"
#if HAS_CURVES
#include "ltc/curve.glsl"
#if CURVE_RULE
#include "ltc/adaptive.glsl"
#endif
#endif

struct Contour {
    // Height above the surface of (s, t) about the anchor: base + slope . (s, t).
    vec2 slope;
    float base;
    vec2 pending;      // crossing that waits for its partner
    bool has_pending;
    bool closing;      // whether an edge along the horizon comes next
    vec2 closing_from;
    vec2 closing_to;
    int next;          // edge, or node of the tree
#if HAS_CURVES
    float from;        // where on the curve at `next` to go on, 0 at its start
    bool above;        // whether the curve is above the surface there
    int piece;         // the same for techniques that take curves in 2^halvings chords
    int halvings;
#endif
};

Contour contour_start(PlanarLight light, PlaneView view, CosineLight anchored, vec3 normal)
{
    vec2 slope = vec2(dot(normal, light.u), dot(normal, light.v));
    float base = anchored.pin > 0.0 ? dot(normal, view.offset)
                                    : view.depth * dot(normal, light.n);
    return Contour(slope, base, vec2(0.0), false, false, vec2(0.0), vec2(0.0), 0
#if HAS_CURVES
                   , 0.0, false, 0, 0
#endif
    );
}

bool contour_ends(PlanarLight light, Contour contour)
{
    return !contour.closing && contour.next >= light.part_count;
}

// The edge along the horizon between the two crossings met last.
PlanarEdge closing_edge(inout Contour contour)
{
    contour.closing = false;
    // Direction and moment of the horizon line itself, base + slope . x = 0: the
    // rounded ends would tilt edges that are short or pass close by.
    vec2 slope = contour.slope;
    vec2 along = vec2(-slope.y, slope.x);
    float length_along =
        dot(contour.closing_to - contour.closing_from, along) / dot(slope, slope);
    return PlanarEdge(contour.closing_from, contour.closing_to, length_along * along,
                      -length_along * contour.base);
}

// The outline meets the horizon, from above or from below.
void meet_horizon(inout Contour contour, vec2 crossing, bool from_above)
{
    contour.closing_from = from_above ? crossing : contour.pending;
    contour.closing_to = from_above ? contour.pending : crossing;
    contour.closing = contour.has_pending;
    contour.has_pending = !contour.has_pending;
    contour.pending = crossing;
}

// Height of a point about the anchor above the surface. `precise`: what ends at a
// vertex and what starts there must agree to the bit.
float height_of(Contour contour, vec2 point)
{
    precise float z = contour.base + point.x * contour.slope.x + point.y * contour.slope.y;
    return z;
}

// Cut off what is below the surface; false if that is all of the edge.
bool clip_edge(inout Contour contour, inout PlanarEdge edge)
{
    float za = height_of(contour, edge.a);
    float zb = height_of(contour, edge.b);
    bool a_above = za > 0.0;
    bool b_above = zb > 0.0;
    if (a_above != b_above) {
        // Where edge line and horizon line meet; going there from a or b would
        // lose a crossing near the anchor between far ends.
        vec2 slope = contour.slope;
        float base = contour.base;
        vec2 crossing = vec2(edge.moment * slope.y - base * edge.d.x,
                             -edge.moment * slope.x - base * edge.d.y) /
                        dot(slope, edge.d);
        meet_horizon(contour, crossing, a_above);
        float share = (a_above ? za : zb) / abs(za - zb);
        edge.a = a_above ? edge.a : crossing;
        edge.b = a_above ? crossing : edge.b;
        edge.d *= share;
        edge.moment *= share;
    }
    return a_above || b_above;
}

#if !HAS_CURVES

// The next edge about the anchor; false where it lies below the horizon. Edges that close
// the outline come out of the same call, so that a caller's integral is compiled
// once: in three copies it took 1.6 times as long.
bool contour_edge(
    PlanarLight light, CosineLight anchored, inout Contour contour, out PlanarEdge edge)
{
    if (contour.closing) {
        edge = closing_edge(contour);
        return true;
    }
    int texel = light.first_part + 2 * contour.next;
    ++contour.next;
    edge = planar_edge(
        light_texel(texel), light_texel(texel + 1), anchored.anchor, anchored.anchor_low);
    return clip_edge(contour, edge);
}

// Form factor, under the transform, of the part of a light above the surface.
float light_form_factor(
    PlanarLight light, CosineTransform transform, PlaneView view, vec3 normal)
{
    CosineLight transformed = cosine_light(transform, light, view);
    Contour contour = contour_start(light, view, transformed, normal);
    ContourSum sum = ContourSum(0.0, 0.0, 0.0);
    while (!contour_ends(light, contour)) {
        PlanarEdge edge;
        if (contour_edge(light, transformed, contour, edge)) {
            add_edge(transformed, edge, sum);
        }
    }
    return form_factor(transformed, sum);
}

#else

// Largest radiance that a node's chord may be wrong by, of a light of radiance 1. The bound
// is far from tight: outlines err by a tenth of this altogether.
const float CHORD_ERROR = 1e-4;

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

// Integral of the lobe over what lies between a part of the outline and its chord: the
// density at one point times the area, and how far that may be off.
struct SliverIntegral {
    float value;
    float error;
};

// `disc`: center about the light's origin, and radius. `area`: at least that of the sliver,
// `signed_area` what it adds up to. Parts below the surface have no value, only an error.
SliverIntegral sliver_integral(
    LobeDensity density, vec3 disc, float area, float signed_area, bool above_surface)
{
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
    bool has_value = above_surface && bottom > 0.0;
    float least = has_value ? scale * bottom / (far2 * far2) : 0.0;
    float value = has_value ? density.scale * center.z / (distance2 * distance2) : 0.0;
    return SliverIntegral(value * signed_area, (most - least) * area);
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

// The chord of the node where the walk is, or of its curve.
PlanarEdge node_chord(PlanarLight light, CosineLight anchored, Contour contour)
{
    int texel = light.first_part + 4 * contour.next;
    return planar_edge(
        light_texel(texel), light_texel(texel + 1), anchored.anchor, anchored.anchor_low);
}

// A straight or curved part of the outline about the anchor, above the surface.
struct ContourPart {
    PlanarEdge edge;
    float sliver;      // the lobe's integral between the edge and what it stands for
    PlanarCurve curve;
    float from;
    float to;
    bool is_curve;
};

// The next part; false where there is none above the surface, or only further down the tree.
bool contour_part(
    PlanarLight light, CosineLight anchored, LobeDensity density, inout Contour contour,
    out ContourPart part)
{
    part.is_curve = false;
    part.sliver = 0.0;
    if (contour.closing) {
        part.edge = closing_edge(contour);
        return true;
    }
    ContourNode node;
    if (!contour_node(light, anchored, contour, node)) {
        return false;
    }
    SliverIntegral sliver =
        sliver_integral(density, node.disc, node.area, node.signed_area, node.above);
#if CURVE_RULE
    // The published methods take every curve.
    bool is_chord = node.area == 0.0;
#else
    bool is_chord = sliver.error <= CHORD_ERROR;
#endif
    if (node.is_inner && !is_chord) {
        ++contour.next;
        return false;
    }
    part.edge = node_chord(light, anchored, contour);
    if (is_chord) {
        contour.next = node.after;
        part.sliver = sliver.value;
        return clip_edge(contour, part.edge);
    }
    part.is_curve = true;
    vec2 a = part.edge.a;
    part.curve = PlanarCurve(a, part.edge.d, node.handles.xy, node.handles.zw);
    vec4 z = vec4(height_of(contour, a), height_of(contour, a + node.handles.xy),
                  height_of(contour, part.edge.b + node.handles.zw),
                  height_of(contour, part.edge.b));
    part.from = contour.from;
    bool above = contour.from > 0.0 ? contour.above : z.x > 0.0;
    part.to = next_crossing(z, part.from, 1.0, above);
    if (part.to < 1.0) {
        meet_horizon(contour, curve_point(power_curve(part.curve), part.to), above);
        // Not 0 again, which would be the curve's start.
        contour.from = max(part.to, 1e-7);
        contour.above = !above;
    } else {
        contour.from = 0.0;
        contour.next = node.after;
    }
    return above;
}

// Chords of a curve are 2^-10 of it at least.
const int MOST_CHORD_HALVINGS = 10;

// The chord of the piece of a leaf where the walk is. `scale`: the share of the leaf that pieces
// of this size are.
PlanarEdge piece_chord(PlanarEdge whole, PowerCurve curve, int piece, float scale)
{
    float from = scale * float(piece);
    float to = scale * float(piece + 1);
    PlanarEdge edge;
    // `precise`: what ends here and what starts here must agree to the bit.
    precise vec2 a = curve_point(curve, from);
    precise vec2 b = curve_point(curve, to);
    edge.a = piece == 0 ? whole.a : a;
    edge.b = to == 1.0 ? whole.b : b;
    // b - a, without its cancellation.
    float h = to - from;
    edge.d = h * (curve.c1 + (to + from) * curve.c2 +
                  (to * to + to * from + from * from) * curve.c3);
    edge.moment = cross_2d(edge.a, edge.d);
    return edge;
}

// Form factor, under the transform, of the part of a light above the surface.
float light_form_factor(
    PlanarLight light, CosineTransform transform, PlaneView view, vec3 normal)
{
    // Never pinned: of a light so small the tree's root is chord enough.
    CosineLight transformed = near_light(transform, light, view);
    LobeDensity density = lobe_density(transformed);
    Contour contour = contour_start(light, view, transformed, normal);
    ContourSum sum = ContourSum(0.0, 0.0, 0.0);
    while (!contour_ends(light, contour)) {
        ContourPart part;
        if (contour_part(light, transformed, density, contour, part)) {
            if (part.is_curve) {
#if CURVE_RULE
                add_divided_curve(transformed, part.curve, part.from, part.to, sum);
#else
                add_curve(transformed, part.curve, part.from, part.to, sum);
#endif
            } else {
                add_near_edge(transformed, part.edge, sum);
                sum.angle += 6.28318530718 * part.sliver;
            }
        }
    }
    return form_factor(transformed, sum);
}

#endif

// Whether a point at this depth sees a light's dark side, or only its edge.
bool shows_nothing(PlanarLight light, float depth)
{
#if !HAS_TWO_SIDED
    return depth >= 0.0;
#elif !HAS_ONE_SIDED
    return depth == 0.0;
#else
    return depth == 0.0 || (depth > 0.0 && !light.two_sided);
#endif
}

// Whether a light sends nothing to a point: it shows its dark side, or all of it is
// below the surface, since its disc's highest point is.
bool is_unseen(PlanarLight light, PlaneView view, vec3 normal)
{
    float reach = light.radius * length(cross(normal, light.n));
    return shows_nothing(light, view.depth) || dot(normal, view.offset) + reach <= 0.0;
}

// Seen from its emitting side an outline runs counter-clockwise, which is clockwise
// about +z of a point's frame: the sign that makes its integral positive.
float light_winding(PlaneView view)
{
    return view.depth < 0.0 ? -1.0 : 1.0;
}
