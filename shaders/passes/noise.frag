// Sums over blocks of pixels, from which the picture's noise is estimated: luminance of the
// radiance, squares of the mean luminance with alternating signs, and how many pixels
// show a surface; light sources and background are left out.

const int BLOCK = 16;

uniform sampler2D surfaces;
uniform sampler2D radiance;
uniform sampler2D noise;

layout(location = 0) out vec4 sums;

void main()
{
    ivec2 size = textureSize(radiance, 0);
    ivec2 low = BLOCK * ivec2(gl_FragCoord.xy);
    ivec2 high = min(low + BLOCK, size);
    sums = vec4(0.0);
    for (int y = low.y; y < high.y; ++y) {
        for (int x = low.x; x < high.x; ++x) {
            vec4 surface = texelFetch(surfaces, ivec2(x, y), 0);
            if (surface.z > 0.0 && surface.w >= 0.0) {
                float difference = texelFetch(noise, ivec2(x, y), 0).a;
                vec3 mean = texelFetch(radiance, ivec2(x, y), 0).rgb;
                sums += vec4(dot(mean, vec3(0.2126, 0.7152, 0.0722)), difference * difference,
                             1.0, 0.0);
            }
        }
    }
}
