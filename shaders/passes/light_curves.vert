// A visible light with curves into the G-buffer: one triangle around its outline.

#include "passes/window.glsl"

uniform mat3x4 clip_corners;
uniform vec4 clip_window;

void main()
{
    gl_Position = to_window(clip_corners[gl_VertexID], clip_window);
}
