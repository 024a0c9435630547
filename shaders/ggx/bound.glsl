// What GGX over a light cannot exceed, from a rectangle around it: certified, and cheaper than
// its outline. Twin, derivation and measured slack: ltc.bounds.half_vector_bound.

#include "ltc/bound.glsl"
#include "ggx/edge.glsl"

// Least cosine between the direction to a rectangle's middle and one to a corner.
const float LEAST_COSINE = 0.1;

// A rectangle as directions to its corners, of which those between are means divided by at
// least `least`.
struct CornerDirections {
    mat4x3 corners;
    float least;
};

// The least and the most that a direction's product with d can be.
vec2 span_along(CornerDirections seen, vec3 d)
{
    vec4 along = d * seen.corners;
    float low = min(min(along.x, along.y), min(along.z, along.w));
    float high = max(max(along.x, along.y), max(along.z, along.w));
    return vec2(low < 0.0 ? low / seen.least : low, high > 0.0 ? high / seen.least : high);
}

// The least and the most that a half vector's product with d can be, with what rounding may
// have taken.
vec2 half_vector_span(CornerDirections seen, GgxView view, vec3 d)
{
    vec3 stretched = d * view.inverse_alpha;
    vec2 span = span_along(seen, stretched);
    float own = dot(view.wo, stretched);
    float margin = 1e-6 * (abs(own) + abs(span.x) + abs(span.y));
    return own + span + vec2(-margin, margin);
}

// (integral for F = 1, largest (1 - wo.h)^5) of a light of radiance 1; tangent frame.
vec2 ggx_bound(vec3 middle, vec3 u, vec3 v, GgxView view)
{
    CornerDirections seen;
    seen.corners = mat4x3(normalize(middle - u - v), normalize(middle + u - v),
                          normalize(middle + u + v), normalize(middle - u + v));
    float distance = length(middle);
    vec3 toward = middle / max(distance, 1e-30);
    vec4 cosines = toward * seen.corners;
    seen.least = min(min(cosines.x, cosines.y), min(cosines.z, cosines.w));
    // Also where a corner is at the point, and directions are no numbers.
    if (!(seen.least >= LEAST_COSINE)) {
        return vec2(1.0);
    }
    vec3 axis = view.bent / view.bent_length;
    vec3 half_vector = (view.wo + toward) * view.inverse_alpha;
    vec3 lateral = half_vector - dot(half_vector, axis) * axis;
    float away2 = dot(lateral, lateral);
    vec3 radial = away2 > 0.0 ? lateral * inversesqrt(away2) : vec3(1.0, 0.0, 0.0);
    vec2 height = half_vector_span(seen, view, axis);
    float near = max(half_vector_span(seen, view, radial).x, 0.0);
    vec2 across = half_vector_span(seen, view, cross(axis, radial));
    float width = max(abs(across.x), abs(across.y));
    float bottom = max(height.x, 0.0);
    float sector = extent_bound(Extent(bottom, height.y, near, width));
    vec3 normal = 4.0 * cross(u, v);
    float volume = abs(dot(normal, middle));
    float plane = volume * inversesqrt(max(dot(normal, normal), 1e-30));
    float r = max(max(distance - sqrt(dot(u, u) + dot(v, v)), plane), 1e-9);
    vec2 toward_viewer = span_along(seen, view.wo);
    float half2 = 2.0 + 2.0 * min(toward_viewer.y, 1.0);
    float flux = volume / (r * r * r) * 0.5 * half2 * view.inverse_alpha.x * view.inverse_alpha.y *
                 height.y;
    float share = 2.0 / (1.0 + axis.z) *
                  min(sector, density_bound(flux, near * near + bottom * bottom));
    float cosine = sqrt(max(0.5 + 0.5 * clamp(toward_viewer.x, -1.0, 1.0), 0.0));
    float x = 1.0 - cosine;
    float x2 = x * x;
    return vec2(min(share, 1.0), x2 * x2 * x);
}
