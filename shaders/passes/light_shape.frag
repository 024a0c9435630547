// See gbuffer.frag; the id of light i is -1 - i. Back faces of one-sided lights are
// culled before they come here.

#include "common/depth.glsl"
#include "common/octahedron.glsl"

flat in vec3 normal_ws;
flat in float light_id;

layout(location = 0) out vec4 surface;

// A lamp flush with a wall shows in front of it: 2.6e-5 of the distance.
const float LIGHT_DEPTH_BIAS = 9.5367431640625e-7;  // 2^-20

void main()
{
    vec3 normal = gl_FrontFacing ? normal_ws : -normal_ws;
    float depth = 1.0 / gl_FragCoord.w;
    surface = vec4(octahedral_from_direction(normal), depth, light_id);
    gl_FragDepth = max(log_depth(depth) - LIGHT_DEPTH_BIAS, 0.0);
}
