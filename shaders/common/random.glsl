// Random numbers of a pixel's sample: the same for the same pixel and sample on every machine,
// unrelated between any two. Integers only but for the last step.

// PCG in four dimensions: Jarzynski and Olano 2020, "Hash functions for GPU rendering".
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

// Four numbers in [0, 1), multiples of 2^-24. `seed`: pixel and index of the sample; `purpose`
// tells apart the numbers of one sample.
vec4 random_numbers(uvec3 seed, uint purpose)
{
    return vec4(pcg4d(uvec4(seed, purpose)) >> 8u) * 5.9604645e-8;
}
