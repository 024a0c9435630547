// Where a light's plane stands to a surface point, in float32 that survives far and near, and
// whether the light can be seen from there at all. Twin: tests/gl/test_twins.py.

#include "common/light_data.glsl"

// a b - p for p = a b rounded: what rounding took from the product, exactly.
#if HAS_EXACT_FMA
float product_error(float a, float b, float p)
{
    return fma(a, b, -p);
}
#else
// Dekker's, for drivers whose fma rounds twice, which GLSL allows.
float product_error(float a, float b, float p)
{
    precise float s = 4097.0 * a;
    precise float a_high = s - (s - a);
    precise float a_low = a - a_high;
    precise float t = 4097.0 * b;
    precise float b_high = t - (t - b);
    precise float b_low = b - b_high;
    precise float error =
        ((a_high * b_high - p) + a_high * b_low + a_low * b_high) + a_low * b_low;
    return error;
}
#endif

// (a + a_low) . (b + b_low) as (high, low): every product and sum keeps its rounding
// error (Ogita, Rump and Oishi 2005, Dot2).
vec2 accurate_dot(vec3 a, vec3 a_low, vec3 b, vec3 b_low)
{
    precise vec3 p = a * b;
    precise float s1 = p.x + p.y;
    precise float t1 = s1 - p.x;
    precise float e1 = (p.x - (s1 - t1)) + (p.y - t1);
    precise float s2 = s1 + p.z;
    precise float t2 = s2 - s1;
    precise float e2 = (s1 - (s2 - t2)) + (p.z - t2);
    float e0 = product_error(a.x, b.x, p.x) + product_error(a.y, b.y, p.y) +
               product_error(a.z, b.z, p.z);
    precise float e = (e0 + (e1 + e2)) + (dot(a_low, b) + dot(a, b_low));
    precise float high = s2 + e;
    precise float low = e - (high - s2);
    return vec2(high, low);
}

// Where a light's plane stands to a surface point, (s, t) in the light's basis [m].
struct PlaneView {
    vec3 offset;     // from the point to the light's origin, world
    vec2 foot;       // of the point on the plane
    vec2 foot_low;   // what rounding took from it
    float depth;     // of the plane along n; negative where the light shows its face
};

PlaneView plane_view(PlanarLight light, vec3 position)
{
    precise vec3 offset = light.origin - position;
    precise vec3 back = light.origin - offset;
    precise vec3 low =
        ((light.origin - (offset + back)) + (back - position)) + light.origin_low;
    vec2 s = accurate_dot(offset, low, light.u, light.u_low);
    vec2 t = accurate_dot(offset, low, light.v, light.v_low);
    vec2 depth = accurate_dot(offset, low, light.n, light.n_low);
    return PlaneView(offset, -vec2(s.x, t.x), -vec2(s.y, t.y), depth.x);
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
