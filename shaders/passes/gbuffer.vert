// Objects into the G-buffer. The matrices are composed in float64 on the CPU.

#include "passes/window.glsl"

layout(location = 0) in vec3 in_position;
layout(location = 1) in vec3 in_normal;
#if HAS_TANGENTS
layout(location = 2) in vec3 in_tangent;
uniform mat3 world_from_object;
out vec3 tangent_ws;
#endif

uniform mat4 clip_from_object;
uniform mat3 world_from_object_normal;
uniform vec4 clip_window;

out vec3 normal_ws;

void main()
{
    normal_ws = world_from_object_normal * in_normal;
#if HAS_TANGENTS
    tangent_ws = world_from_object * in_tangent;
#endif
    gl_Position = to_window(clip_from_object * vec4(in_position, 1.0), clip_window);
}
