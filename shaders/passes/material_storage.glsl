// Where the objects' material records are; their meaning is in common/material.glsl.

#include "common/material.glsl"

#if MATERIAL_STORAGE_UNIFORM
layout(std140) uniform Materials {
    vec4 material_texels[MATERIAL_TEXELS];
};

vec4 material_texel(int index)
{
    return material_texels[index];
}
#else
uniform sampler2D material_texels;

vec4 material_texel(int index)
{
    ivec2 place = ivec2(index % STORAGE_TEXTURE_WIDTH, index / STORAGE_TEXTURE_WIDTH);
    return texelFetch(material_texels, place, 0);
}
#endif

MaterialSample material_of_object(int object)
{
    return unpack_material(
        material_texel(3 * object), material_texel(3 * object + 1), material_texel(3 * object + 2));
}

#if HAS_TANGENTS
// How far the material's tangent is turned about the normal [rad].
float material_rotation_of_object(int object)
{
    return material_texel(3 * object).w;
}
#endif
