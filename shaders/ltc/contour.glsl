// Walk a light's outline part by part, clipped at the surface's horizon; form factor of
// what is left. Shared by every technique.
//
// Crossings of the horizon all lie on one line of the light's plane and come in
// pairs, first with second, third with fourth and so on, in whatever order the
// outline meets them: the integral along that line is additive, so any pairing of
// exits with entries closes the clipped outline.

#include "common/light_data.glsl"
#include "ltc/polygon.glsl"

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
#endif
};

Contour contour_start(PlanarLight light, PlaneView view, CosineLight anchored, vec3 normal)
{
    vec2 slope = vec2(dot(normal, light.u), dot(normal, light.v));
    float base = anchored.pin > 0.0 ? dot(normal, view.offset)
                                    : view.depth * dot(normal, light.n);
    return Contour(slope, base, vec2(0.0), false, false, vec2(0.0), vec2(0.0), 0
#if HAS_CURVES
                   , 0.0, false
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

#endif

// Seen from its emitting side an outline runs counter-clockwise, which is clockwise
// about +z of a point's frame: the sign that makes its integral positive.
float light_winding(PlaneView view)
{
    return view.depth < 0.0 ? -1.0 : 1.0;
}

#if HAS_CURVES
#include "ltc/tree.glsl"
#endif
