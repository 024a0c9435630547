// Visible lights into the G-buffer: triangles of their outlines, in world space.

#include "passes/window.glsl"

layout(location = 0) in vec3 in_position;
layout(location = 1) in vec3 in_normal;
layout(location = 2) in float in_id;

uniform mat4 clip_from_world;
uniform vec4 clip_window;

flat out vec3 normal_ws;
flat out float light_id;

void main()
{
    normal_ws = in_normal;
    light_id = in_id;
    gl_Position = to_window(clip_from_world * vec4(in_position, 1.0), clip_window);
}
