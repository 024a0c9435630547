// Whether fma rounds once: the rounding error of a product, 0 where it rounds twice.
// Used by app/render/arithmetic.py.

uniform vec2 factors;

layout(location = 0) out float error;

void main()
{
    precise float product = factors.x * factors.y;
    precise float rest = fma(factors.x, factors.y, -product);
    error = rest;
}
