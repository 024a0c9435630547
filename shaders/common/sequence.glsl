// Low-discrepancy points of a pixel: the first two dimensions of Sobol's sequence,
// Owen-scrambled by hashes. The same for the same pixel, sample and purpose on every machine,
// unrelated between pixels and purposes. Integers only but for the last step.
// Twin, to the bit, with its sources: ltc.sequence.

uvec4 pcg4d(uvec4 v)
{
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v ^= v >> 16u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

// Owen's scrambling of a number whose bits are reversed, before and after.
uint scrambled_reversed(uint x, uint key)
{
    x ^= x * 0x3d20adeau;
    x += key;
    x *= (key >> 16u) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return x;
}

// Sobol's second dimension of an index, bits reversed: Pascal's triangle modulo 2.
uint pascal_digits(uint x)
{
    x ^= (x >> 1u) & 0x55555555u;
    x ^= (x >> 2u) & 0x33333333u;
    x ^= (x >> 4u) & 0x0f0f0f0fu;
    x ^= (x >> 8u) & 0x00ff00ffu;
    x ^= x >> 16u;
    return x;
}

// Two numbers in [0, 1), multiples of 2^-24. `seed`: pixel and index of the sample, of which
// even and odd ones run through two sequences that are scrambled apart; `purpose` tells
// apart the points of one sample.
vec2 sequence_point(uvec3 seed, uint purpose)
{
    uvec4 key = pcg4d(uvec4(seed.xy, purpose, seed.z & 1u));
    uint index =
        bitfieldReverse(scrambled_reversed(bitfieldReverse(seed.z >> 1u), key.x));
    uint first = bitfieldReverse(scrambled_reversed(index, key.y));
    uint second = bitfieldReverse(scrambled_reversed(pascal_digits(index), key.z));
    return vec2(uvec2(first, second) >> 8u) * 5.9604645e-8;
}
