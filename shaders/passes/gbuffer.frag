// G-buffer: (octahedral normal, depth along the view axis [m], id). An object's id
// is its index. Surfaces have two sides: the normal is turned to the one in view.

#include "common/depth.glsl"
#include "common/octahedron.glsl"

in vec3 normal_ws;
#if HAS_TANGENTS
in vec3 tangent_ws;
#endif

uniform float object_id;

layout(location = 0) out vec4 surface;
#if HAS_TANGENTS
layout(location = 1) out vec2 tangent;
#endif

void main()
{
    float side = gl_FrontFacing ? 1.0 : -1.0;
    float depth = 1.0 / gl_FragCoord.w;
    surface = vec4(octahedral_from_direction(normal_ws * side), depth, object_id);
#if HAS_TANGENTS
    tangent = octahedral_from_direction(tangent_ws);
#endif
    gl_FragDepth = log_depth(depth);
}
