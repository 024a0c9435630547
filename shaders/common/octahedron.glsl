// Unit vectors as two numbers in [-1, 1]: the octahedral map of Meyer et al. 2010,
// "On floating-point normal vectors". Stored in float32 the round trip errs by 2e-7.
// Twin: tests/gl/test_gbuffer.py.

vec2 sign_not_zero(vec2 v)
{
    return vec2(v.x < 0.0 ? -1.0 : 1.0, v.y < 0.0 ? -1.0 : 1.0);
}

// `direction` need not be unit; zero gives (0, 0), which decodes to +z.
vec2 octahedral_from_direction(vec3 direction)
{
    float norm = abs(direction.x) + abs(direction.y) + abs(direction.z);
    vec2 p = direction.xy / max(norm, 1e-37);
    return direction.z < 0.0 ? (1.0 - abs(p.yx)) * sign_not_zero(p) : p;
}

vec3 direction_from_octahedral(vec2 p)
{
    vec3 v = vec3(p, 1.0 - abs(p.x) - abs(p.y));
    if (v.z < 0.0) {
        v.xy = (1.0 - abs(v.yx)) * sign_not_zero(v.xy);
    }
    return normalize(v);
}
