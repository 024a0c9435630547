// The frame of a surface whose reflection depends on a tangent.

#include "common/frame.glsl"

// Columns: the tangent made perpendicular to the normal, the bitangent, the normal.
mat3 tangent_frame(vec3 normal, vec3 tangent)
{
    vec3 x = tangent - normal * dot(normal, tangent);
    float x2 = dot(x, x);
    x = x2 > 1e-12 ? x * inversesqrt(x2) : any_tangent(normal);
    return mat3(x, cross(normal, x), normal);
}
