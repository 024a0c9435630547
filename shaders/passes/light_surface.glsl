// What a visible light leaves in the G-buffer; see gbuffer.frag. The id of light i is
// -1 - i.

#include "common/depth.glsl"
#include "common/octahedron.glsl"

layout(location = 0) out vec4 surface;

// A lamp flush with a wall shows in front of it: 2.6e-5 of the distance.
const float LIGHT_DEPTH_BIAS = 9.5367431640625e-7;  // 2^-20

// `normal`: of the side that is seen; `depth`: along the view axis [m].
void write_light(vec3 normal, float depth, float id)
{
    surface = vec4(octahedral_from_direction(normal), depth, id);
    gl_FragDepth = max(log_depth(depth) - LIGHT_DEPTH_BIAS, 0.0);
}
