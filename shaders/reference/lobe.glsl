// GGX and transformed cosines at given directions, and directions drawn from them. Tangent
// frame: x the tangent, z the normal; `wo` and `wi` unit, wo.z > 0 for GGX. Twins: ltc.brdf and
// ltc.transform.

struct GgxLobe {
    vec3 wo;
    vec2 alpha;
    float stretched;  // |(alpha_x x, alpha_y y, z)| of wo
};

float stretched_length(vec3 w, vec2 alpha)
{
    return length(vec3(alpha * w.xy, w.z));
}

GgxLobe ggx_lobe(vec3 wo, vec2 alpha)
{
    return GgxLobe(wo, alpha, stretched_length(wo, alpha));
}

// BRDF times cosine for F = 1, the same with the weight (1 - wo.h)^5, and the density
// [1/sr] in which `ggx_direction` draws wi; wi.z > 0.
vec3 ggx_value(GgxLobe lobe, vec3 wi)
{
    vec3 h = normalize(lobe.wo + wi);
    vec2 slope = h.xy / lobe.alpha;
    float length2 = dot(slope, slope) + h.z * h.z;
    float ndf = 0.318309886 / (lobe.alpha.x * lobe.alpha.y * length2 * length2);
    float masking = lobe.wo.z * stretched_length(wi, lobe.alpha) + wi.z * lobe.stretched;
    float one = 0.5 * ndf * wi.z / masking;
    float x = 1.0 - clamp(dot(lobe.wo, h), 0.0, 1.0);
    float x2 = x * x;
    return vec3(one, one * x2 * x2 * x, 0.5 * ndf / (lobe.wo.z + lobe.stretched));
}

// A direction by reflection at a visible normal; it may point below the surface. Dupuy and
// Benyoub 2023, "Sampling visible GGX normals with spherical caps".
vec3 ggx_direction(GgxLobe lobe, vec2 random)
{
    vec3 wo = vec3(lobe.alpha * lobe.wo.xy, lobe.wo.z) / lobe.stretched;
    float azimuth = 6.28318531 * random.x;
    float z = (1.0 - random.y) * (1.0 + wo.z) - wo.z;
    float r = sqrt(max(1.0 - z * z, 0.0));
    vec3 h = vec3(r * cos(azimuth), r * sin(azimuth), z) + wo;
    h = normalize(vec3(lobe.alpha * h.xy, h.z));
    return 2.0 * dot(lobe.wo, h) * h - lobe.wo;
}

// A clamped cosine under a linear transform K, cosine_from_tangent: its density over
// directions w is that of the cosine at K w times det K / |K w|^3. Lambert's has K = 1.
struct CosineLobe {
    mat3 points;   // K
    mat3 normals;  // the cofactor matrix of K
    float det;     // of K, positive
};

// Density [1/sr] at the unit direction w, above the surface or below.
float cosine_value(CosineLobe lobe, vec3 w)
{
#if TECHNIQUE_RESIDUAL
    vec3 c = lobe.points * w;
    float c2 = dot(c, c);
    return 0.318309886 * max(c.z, 0.0) * lobe.det / (c2 * c2);
#else
    return 0.318309886 * max(w.z, 0.0);
#endif
}

// A direction in that density.
vec3 cosine_direction(CosineLobe lobe, vec2 random)
{
    float azimuth = 6.28318531 * random.x;
    float r = sqrt(random.y);
    vec3 c = vec3(r * cos(azimuth), r * sin(azimuth), sqrt(1.0 - random.y));
#if TECHNIQUE_RESIDUAL
    return normalize(c * lobe.normals);
#else
    return c;
#endif
}
