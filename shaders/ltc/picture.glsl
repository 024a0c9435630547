// The mean of a light's picture under a lobe: times the form factor and radiance it is what arrives.
// Twin and derivation: ltc.textured. Places are texels of the picture's level 0.

#include "common/light_picture.glsl"
#include "ltc/polygon.glsl"

// Of the levels' size, how far the light is from their sides: PAD / (1 + 2 PAD).
const float PICTURE_MARGIN = 1.0 / 6.0;

// How far out taps stand, how wide one among several is, and, by their number, how much of the
// axis each fills.
const float PICTURE_REACH = 0.97;
const float PICTURE_NARROW = 0.65;
#if PICTURE_TAPS <= 1
const float PICTURE_SPREAD = 0.75;
#elif PICTURE_TAPS == 3
const float PICTURE_SPREAD = 0.65;
#elif PICTURE_TAPS == 5
const float PICTURE_SPREAD = 0.8;
#else
const float PICTURE_SPREAD = 0.75;
#endif

// The light's plane in cosine space: the point (s, t) is foot + (s - foot_st.s) u + ....
struct CosinePlane {
    vec3 foot;
    vec3 u;
    vec3 v;
    vec3 n;  // u x v
    vec2 foot_st;
};

// The filter 1 / (1 + e D^-1 e)^2 at e from the centre.
struct Footprint {
    vec2 centre;
    vec3 shape;  // D: xx, xy, yy
    float det;   // of D, without its cancellation
};

CosinePlane cosine_plane(CosineTransform transform, PlanarLight light, PlaneView view)
{
    return CosinePlane(
        transform.points * (view.depth * light.n), transform.points * light.u,
        transform.points * light.v, transform.normals * light.n, view.foot);
}

Footprint cosine_footprint(LightPicture picture, CosinePlane plane)
{
    float n2 = max(dot(plane.n, plane.n), 1e-37);
    vec3 n = plane.n * inversesqrt(n2);
    float h = dot(n, plane.foot);
    n = h < 0.0 ? -n : n;
    vec3 p = abs(h) / max(1.0 + n.z, 1e-3) * (n + vec3(0.0, 0.0, 1.0));
    vec3 away = p - plane.foot;
    vec2 st = plane.foot_st +
              vec2(dot(cross(away, plane.v), plane.n), dot(cross(plane.u, away), plane.n)) / n2;
    vec2 scale = picture.level_from_plane.xy;
    // Edge on, |p| is 0; the least ellipse keeps its inverse finite.
    float size = max(dot(p, p), 1e-12 * dot(plane.foot, plane.foot)) / n2;
    vec3 shape =
        size * vec3(dot(plane.v, plane.v), -dot(plane.u, plane.v), dot(plane.u, plane.u)) *
        vec3(scale.x * scale.x, scale.x * scale.y, scale.y * scale.y);
    float root = size * sqrt(n2) * scale.x * scale.y;
    return Footprint(scale * st + picture.level_from_plane.zw, shape, max(root * root, 1e-30));
}

// e D^-1 e.
float squared_distance(Footprint print, vec2 e)
{
    return max((print.shape.z * e.x * e.x - 2.0 * print.shape.y * e.x * e.y +
                print.shape.x * e.y * e.y) / print.det, 0.0);
}

// The nearest place of a rectangle, by the footprint's distance: beside a corner one
// coordinate is clamped, the other takes its optimum there, and the first again; both ways.
vec2 nearest_place(Footprint print, vec2 low, vec2 high)
{
    vec2 c = print.centre;
    vec3 D = print.shape;
    vec2 a = clamp(c, low, high);
    vec2 b = a;
    a.y = clamp(c.y + D.y / max(D.x, 1e-30) * (a.x - c.x), low.y, high.y);
    a.x = clamp(c.x + D.y / max(D.z, 1e-30) * (a.y - c.y), low.x, high.x);
    b.x = clamp(c.x + D.y / max(D.z, 1e-30) * (b.y - c.y), low.x, high.x);
    b.y = clamp(c.y + D.y / max(D.x, 1e-30) * (b.x - c.x), low.y, high.y);
    return squared_distance(print, a - c) <= squared_distance(print, b - c) ? a : b;
}

// The footprint about the light's nearest place: wider, as the filter's tail is flatter.
Footprint footprint_on_light(Footprint print, vec2 low, vec2 high)
{
    vec2 nearest = nearest_place(print, low, high);
    float wider = 1.0 + squared_distance(print, nearest - print.centre);
    return Footprint(nearest, print.shape * wider, print.det * wider * wider);
}

// A clamped cosine's density at a place of the light, up to a factor.
float cosine_density(LightPicture picture, CosinePlane plane, vec2 place)
{
    vec2 st = (place - picture.level_from_plane.zw) / picture.level_from_plane.xy - plane.foot_st;
    vec3 p = plane.foot + st.x * plane.u + st.y * plane.v;
    // About the foot's length, so that nothing overflows.
    float inv2 = 1.0 / max(dot(p, p), 1e-37);
    float unit = dot(plane.foot, plane.foot) * inv2;
    return max(p.z, 0.0) * sqrt(inv2) * unit * sqrt(unit);
}

// Premultiplied, as stored: the level whose filter is as wide, and below level 0 the
// picture itself, more of it the sharper the lobe is.
vec4 fetched_picture(LightPicture picture, vec2 place, float radius)
{
    vec2 inside = clamp(place, vec2(0.0), picture.levels.zw);
    vec2 away = place - inside;
    float reach = sqrt(radius * radius + dot(away, away));
    vec4 value = blurred_picture(picture, inside, reach);
    float sharp = 1.0 - reach / PICTURE_BLUR;
    if (sharp > 0.0) {
        // Beyond the light its edge goes on.
        vec2 low = PICTURE_MARGIN * picture.levels.zw;
        vec2 own = clamp(inside, low, picture.levels.zw - low);
        vec2 st = (own - picture.level_from_plane.zw) / picture.level_from_plane.xy;
        value.rgb = mix(value.rgb, sharp_picture(picture, st) * value.a, sharp);
    }
    return value;
}

// What one look at a footprint is for: its place and radius, `y` along the axis where
// (1 + t^2)^(-3/2) has its share, `fill` the radius that fills that share.
vec3 picture_look(Footprint print, vec2 axis, float b, float stretch, float fill, float y)
{
    float inv = inversesqrt(max(1.0 - y * y, 1e-8));
    float tau = PICTURE_REACH * stretch * y * inv;
    float filled = fill * inv * inv * inv;
    float narrow = mix(1.0, PICTURE_NARROW, stretch * stretch);
    float radius = b * sqrt(narrow * narrow * (1.0 + tau * tau) + filled * filled);
    return vec3(print.centre + tau * axis, radius);
}

#if PICTURE_TAPS == 0
// One look where Heitz et al. 2016 look, at the foot of the perpendicular, and with a filter
// that falls off as their Gaussian does: d = 2 sigma, sigma^2 = r^2 / 2 A.
vec3 picture_average(
    LightPicture picture, CosineTransform transform, PlanarLight light, PlaneView view,
    bool is_diffuse)
{
    CosinePlane plane = cosine_plane(transform, light, view);
    float n2 = max(dot(plane.n, plane.n), 1e-37);
    vec3 away = dot(plane.foot, plane.n) / n2 * plane.n - plane.foot;
    vec2 st = plane.foot_st +
              vec2(dot(cross(away, plane.v), plane.n), dot(cross(plane.u, away), plane.n)) / n2;
    vec2 scale = picture.level_from_plane.xy;
    float r = abs(dot(plane.foot, plane.n)) * inversesqrt(n2);
    float radius = 1.41421356 * r * sqrt(scale.x * scale.y * inversesqrt(n2));
    vec4 value = fetched_picture(picture, scale * st + picture.level_from_plane.zw, radius);
    return value.a > 0.0 ? value.rgb / value.a : vec3(0.0);
}
#else
// `is_diffuse`: the lobe is the cosine itself. What it sees is as stretched as the picture's
// texels are, the same at every point, so that one look where that is little leaves no line.
vec3 picture_average(
    LightPicture picture, CosineTransform transform, PlanarLight light, PlaneView view,
    bool is_diffuse)
{
    CosinePlane plane = cosine_plane(transform, light, view);
    Footprint whole = cosine_footprint(picture, plane);
    vec2 low = PICTURE_MARGIN * picture.levels.zw;
    vec2 high = picture.levels.zw - low;
    Footprint print = footprint_on_light(whole, low, high);
    // Semi-axes a >= b, the major one from the row that does not cancel.
    float middle = 0.5 * (print.shape.x + print.shape.z);
    float half_gap = 0.5 * (print.shape.x - print.shape.z);
    float spread = length(vec2(half_gap, print.shape.y));
    float a2 = middle + spread;
    float a = sqrt(a2);
    float b = min(sqrt(print.det / a2), a);
    vec2 axis = half_gap >= 0.0 ? vec2(half_gap + spread, print.shape.y)
                                : vec2(print.shape.y, spread - half_gap);
    float axis2 = dot(axis, axis);
    axis = a * (axis2 > 0.0 ? axis * inversesqrt(axis2) : vec2(1.0, 0.0));
    float stretch = sqrt(max(1.0 - b * b / a2, 0.0));
    // Only where the light is, in the measure y of the axis that makes parts weigh alike.
    vec2 margin = vec2(0.7 * b);
    vec2 back = mix(print.centre - low, high - print.centre, lessThan(axis, vec2(0.0))) + margin;
    vec2 forth = mix(high - print.centre, print.centre - low, lessThan(axis, vec2(0.0))) + margin;
    vec2 first = back * inversesqrt(back * back + axis * axis);
    vec2 last = forth * inversesqrt(forth * forth + axis * axis);
    float y = -min(first.x, first.y);
    float whole_part = min(last.x, last.y) - y;
    float filling = 0.5 * PICTURE_REACH * stretch * a / b;
    if (is_diffuse && a < 1.5 * b) {
        vec3 look = picture_look(print, axis, b, stretch, 0.75 * filling * whole_part,
                                 y + 0.5 * whole_part);
        vec4 value = fetched_picture(picture, look.xy, look.z);
        return value.a > 0.0 ? value.rgb / value.a : vec3(0.0);
    }
    float part = whole_part / float(PICTURE_TAPS);
    float fill = PICTURE_SPREAD * filling * part;

    vec3 taps[PICTURE_TAPS];  // place and radius
    float weights[PICTURE_TAPS];
    float largest = 0.0;
    y += 0.5 * part;
    for (int i = 0; i < PICTURE_TAPS; ++i) {
        taps[i] = picture_look(print, axis, b, stretch, fill, y);
        weights[i] = 1.0;
#if PICTURE_TAPS > 1
        float beyond = 1.0 + squared_distance(whole, taps[i].xy - whole.centre);
        weights[i] = cosine_density(picture, plane, taps[i].xy) * beyond * beyond;
        largest = max(largest, weights[i]);
#endif
        y += part;
    }
    // All below the horizon, in a lobe that sees the light's last edge: one like another.
    largest = largest > 0.0 ? largest : 1.0;
    vec4 sum = vec4(0.0);
    for (int i = 0; i < PICTURE_TAPS; ++i) {
        float weight = weights[i] + 1e-4 * largest;
        sum += weight * fetched_picture(picture, taps[i].xy, taps[i].z);
    }
    return sum.a > 0.0 ? sum.rgb / sum.a : vec3(0.0);
}
#endif
