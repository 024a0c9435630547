// What a light cannot exceed, from a rectangle around it: certified, and cheaper than its outline.
// Twin, derivation and measured slack: ltc.bounds.

#include "common/allowance.glsl"
#include "common/light_rectangle.glsl"
#include "ltc/polygon.glsl"

// Where a light is, seen along the axis of a clamped cosine: its heights are within
// [bottom, top]; at right angles to the axis it is at least `near` away in one direction, and
// within `width` of that direction to both sides.
struct Extent {
    float bottom;
    float top;
    float near;
    float width;
};

// The form factor of the sector of the gnomonic plane that an extent lies in.
float extent_bound(Extent extent)
{
    if (extent.top <= 0.0) {
        return 0.0;
    }
    if (extent.near <= 0.0) {
        return 1.0;
    }
    float half_span = min(extent.width / extent.near, 1.57079632679);
    float cotangent = extent.top / extent.near;
    float cotangent2 = cotangent * cotangent;
    return 0.318309886 * half_span * (cotangent2 / (1.0 + cotangent2));
}

// flux / (pi r^4), r2 the smallest square of a distance.
float density_bound(float flux, float r2)
{
    return r2 > 1e-15 ? 0.318309886 * max(flux, 0.0) / (r2 * r2) : 1.0;
}

// From the point to the middle of the rectangle, world, and half its sides along the light's axes.
vec3 way_to_rectangle(PlanarLight light, PlaneView view, out vec2 half_sides)
{
    vec4 rectangle = light_rectangle(light);
    vec2 middle = 0.5 * (rectangle.xy + rectangle.zw);
    half_sides = 0.5 * (rectangle.zw - rectangle.xy);
    return view.offset + middle.x * light.u + middle.y * light.v;
}

// Of a light's form factor under a transform, from what `way_to_rectangle` returns.
float form_factor_bound(
    CosineTransform transform, PlanarLight light, vec3 to_middle, vec2 half_sides)
{
    vec3 c = transform.points * to_middle;
    vec3 u = half_sides.x * (transform.points * light.u);
    vec3 v = half_sides.y * (transform.points * light.v);
    float rise = abs(u.z) + abs(v.z);
    float top = c.z + rise;
    float away = length(c.xy);
    vec2 radial = away > 0.0 ? c.xy / away : vec2(1.0, 0.0);
    vec2 across = vec2(-radial.y, radial.x);
    float near = away - abs(dot(u.xy, radial)) - abs(dot(v.xy, radial));
    // What rounding may have taken.
    near = max(near - 2e-6 * (length(to_middle) + away), 0.0);
    float width = abs(dot(u.xy, across)) + abs(dot(v.xy, across));
    vec3 normal = half_sides.x * half_sides.y * (transform.normals * light.n);
    float volume = abs(dot(c, normal));
    float bottom = max(c.z - rise, 0.0);
    float r2 = max(near * near + bottom * bottom, volume * volume / max(dot(normal, normal), 1e-30));
    float sector = extent_bound(Extent(bottom, top, near, width));
    return min(sector, density_bound(4.0 * volume * top, r2));
}
