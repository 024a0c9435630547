// See light_surface.glsl. Back faces of one-sided lights are culled before they come
// here.

#include "passes/light_surface.glsl"

flat in vec3 normal_ws;
flat in float light_id;

void main()
{
    write_light(gl_FrontFacing ? normal_ws : -normal_ws, 1.0 / gl_FragCoord.w, light_id);
}
