// Where the pictures of the lights are; their places are in common/light_picture.glsl.

uniform sampler2D light_pictures;

vec4 picture_texel(vec2 place)
{
    return textureLod(light_pictures, place / vec2(textureSize(light_pictures, 0)), 0.0);
}
