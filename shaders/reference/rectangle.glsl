// The rectangle around a light as a surface point sees it: its solid angle, and places on it
// drawn evenly over that (Ureña, Fajardo and King 2013, "An area-preserving parametrization
// for spherical rectangles"). Places are (s, t) [m] about the foot of the point on the
// light's plane. Twin: ltc.spherical_rectangle.

#include "common/atan2.glsl"

struct SeenRectangle {
    vec4 sides;         // least s, least t, greatest s, greatest t
    float depth;        // of the plane, positive
    float solid_angle;  // 0 where places are drawn evenly over the area instead
    float angle;        // where the share of the solid angle begins to be counted
};

// Below this solid angle [sr], and this depth in sizes of the rectangle, places would be off by
// rounding: their density is then the area's. It is nearly even over small solid angles anyway.
const float LEAST_SOLID_ANGLE = 0.02;
const float LEAST_DEPTH = 0.02;

SeenRectangle seen_rectangle(vec4 sides, float depth)
{
    // Corners (s0, t0), (s1, t0), (s1, t1), (s0, t1); a corner's angle is atan2(d R, -+ s t).
    vec4 s = sides.xzzx;
    vec4 t = sides.yyww;
    vec4 reach = sqrt(s * s + t * t + depth * depth);
    vec4 height = depth * reach;
    vec4 st = s * t;
    vec4 angles = vec4(positive_atan2(height.x, -st.x), positive_atan2(height.y, st.y),
                       positive_atan2(height.z, -st.z), positive_atan2(height.w, st.w));
    SeenRectangle seen = SeenRectangle(sides, depth, 0.0, 6.28318531 - angles.w - angles.x);
    float solid_angle = angles.x + angles.y + angles.z + angles.w - 6.28318531;
    vec2 size = sides.zw - sides.xy;
    if (solid_angle > LEAST_SOLID_ANGLE && depth > LEAST_DEPTH * max(size.x, size.y)) {
        seen.solid_angle = solid_angle;
    }
    return seen;
}

// A place on the rectangle for two numbers in [0, 1).
vec2 place_on_rectangle(SeenRectangle seen, vec2 random)
{
    vec4 sides = seen.sides;
    if (seen.solid_angle == 0.0) {
        return mix(sides.xy, sides.zw, random);
    }
    float d2 = seen.depth * seen.depth;
    float b0 = -sides.y * inversesqrt(sides.y * sides.y + d2);
    float b1 = sides.w * inversesqrt(sides.w * sides.w + d2);
    float angle = random.x * seen.solid_angle + seen.angle;
    float f = (cos(angle) * b0 - b1) / sin(angle);
    // The cosine's square is 1 / (f^2 + b0^2), and 1 - b0^2 = depth^2 / (t0^2 + depth^2).
    float rest = f * f - d2 / (sides.y * sides.y + d2);
    float s = seen.depth * inversesqrt(max(rest, 1e-30)) * (f < 0.0 ? -1.0 : 1.0);
    s = clamp(s, sides.x, sides.z);
    float q2 = s * s + d2;
    vec2 h = sides.yw * inversesqrt(q2 + sides.yw * sides.yw);
    float height = mix(h.x, h.y, random.y);
    float t = height * sqrt(q2 / max(1.0 - height * height, 1e-30));
    return vec2(s, clamp(t, sides.y, sides.w));
}

// Density [1/sr] in which places are drawn, at a distance from the point.
float rectangle_density(SeenRectangle seen, float reach)
{
    vec2 size = seen.sides.zw - seen.sides.xy;
    return seen.solid_angle > 0.0 ? 1.0 / seen.solid_angle
                                  : reach / size.x * (reach / size.y) * (reach / seen.depth);
}
