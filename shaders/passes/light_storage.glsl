// Where the lights' texels are; their meaning is in common/light_data.glsl.

#if LIGHT_STORAGE_UNIFORM
layout(std140) uniform Lights {
    vec4 light_texels[LIGHT_TEXELS];
};

vec4 light_texel(int index)
{
    return light_texels[index];
}
#else
uniform sampler2D light_texels;

vec4 light_texel(int index)
{
    ivec2 place = ivec2(index % STORAGE_TEXTURE_WIDTH, index / STORAGE_TEXTURE_WIDTH);
    return texelFetch(light_texels, place, 0);
}
#endif
