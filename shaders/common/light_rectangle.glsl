// The rectangle around a light, which precedes its outline where lights are packed as `bounded`.
// Twin: app.render.pack.light_bounds.

#include "common/light_data.glsl"

// (least s, least t, greatest s, greatest t) about a light's origin [m].
vec4 light_rectangle(PlanarLight light)
{
    return light_texel(light.first_part - 1);
}
