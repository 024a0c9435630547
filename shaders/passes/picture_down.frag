// The next coarser level, by [1 3 3 1] / 8 along each axis that is not one texel already.

uniform sampler2D finer;
uniform ivec2 finer_size;  // without borders
uniform ivec2 border;

layout(location = 0) out vec4 value;

const float WEIGHTS[4] = float[4](0.125, 0.375, 0.375, 0.125);

vec4 texel(ivec2 place)
{
    ivec2 at = place + border;
    ivec2 last = finer_size + 2 * border - 1;
    bool outside = any(lessThan(at, ivec2(0))) || any(greaterThan(at, last));
    return outside ? vec4(0.0) : texelFetch(finer, at, 0);
}

void main()
{
    ivec2 place = ivec2(gl_FragCoord.xy) - border;
    value = vec4(0.0);
    for (int j = 0; j < 4; ++j) {
        int y = finer_size.y > 1 ? 2 * place.y + j - 1 : place.y;
        float row = finer_size.y > 1 ? WEIGHTS[j] : (j == 0 ? 1.0 : 0.0);
        if (row == 0.0) {
            continue;
        }
        for (int i = 0; i < 4; ++i) {
            int x = finer_size.x > 1 ? 2 * place.x + i - 1 : place.x;
            float weight = finer_size.x > 1 ? WEIGHTS[i] : (i == 0 ? 1.0 : 0.0);
            value += row * weight * texel(ivec2(x, y));
        }
    }
}
