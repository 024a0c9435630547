// Walk a light's outline edge by edge, clipped at the surface's horizon; form factor of
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
    int next;
};

Contour contour_start(PlanarLight light, PlaneView view, CosineLight anchored, vec3 normal)
{
    vec2 slope = vec2(dot(normal, light.u), dot(normal, light.v));
    float base = anchored.pin > 0.0 ? dot(normal, view.offset)
                                    : view.depth * dot(normal, light.n);
    return Contour(slope, base, vec2(0.0), false, false, vec2(0.0), vec2(0.0), 0);
}

bool contour_ends(PlanarLight light, Contour contour)
{
    return !contour.closing && contour.next >= light.edge_count;
}

// The next edge about the anchor; false where it lies below the horizon. Edges that close
// the outline come out of the same call, so that a caller's integral is compiled
// once: in three copies it took 1.6 times as long.
bool contour_edge(
    PlanarLight light, CosineLight anchored, inout Contour contour, out PlanarEdge edge)
{
    vec2 slope = contour.slope;
    float base = contour.base;
    if (contour.closing) {
        contour.closing = false;
        // Direction and moment of the horizon line itself, base + slope . x = 0: the
        // rounded ends would tilt edges that are short or pass close by.
        vec2 along = vec2(-slope.y, slope.x);
        float length_along =
            dot(contour.closing_to - contour.closing_from, along) / dot(slope, slope);
        edge = PlanarEdge(contour.closing_from, contour.closing_to, length_along * along,
                          -length_along * base);
        return true;
    }
    int texel = light.first_edge + 2 * contour.next;
    ++contour.next;
    edge = planar_edge(
        light_texel(texel), light_texel(texel + 1), anchored.anchor, anchored.anchor_low);
    // `precise`: an edge's end and the next one's start must agree to the bit.
    precise float za = base + edge.a.x * slope.x + edge.a.y * slope.y;
    precise float zb = base + edge.b.x * slope.x + edge.b.y * slope.y;
    bool a_above = za > 0.0;
    bool b_above = zb > 0.0;
    if (a_above != b_above) {
        // Where edge line and horizon line meet; going there from a or b would
        // lose a crossing near the anchor between far ends.
        vec2 crossing = vec2(edge.moment * slope.y - base * edge.d.x,
                             -edge.moment * slope.x - base * edge.d.y) /
                        dot(slope, edge.d);
        contour.closing_from = a_above ? crossing : contour.pending;
        contour.closing_to = a_above ? contour.pending : crossing;
        contour.closing = contour.has_pending;
        contour.has_pending = !contour.has_pending;
        contour.pending = crossing;
        float share = (a_above ? za : zb) / abs(za - zb);
        edge.a = a_above ? edge.a : crossing;
        edge.b = a_above ? crossing : edge.b;
        edge.d *= share;
        edge.moment *= share;
    }
    return a_above || b_above;
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
