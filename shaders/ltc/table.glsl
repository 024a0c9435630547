// Lookup in the isotropic tables; axes and contents are explained in ltc/table.py.
// Twins: ltc.table.table_coordinates and IsotropicTable.lookup.

// x = sqrt(alpha); y = p / (p + r): 0 at normal incidence, 1 at grazing.
vec2 table_coordinates(float alpha, float cos_theta)
{
    float p = sqrt(alpha * (1.0 - cos_theta));
    float r = sqrt(cos_theta * (1.0 + alpha));
    return vec2(sqrt(alpha), p / (p + r));
}

// Bilinear, nodes at i / (size - 1). Not by the sampler, whose weights have 8 bits:
// that alone would cost 1e-3 of a lobe's width, and GPUs would differ.
vec4 table_bilinear(sampler2D table, vec2 coordinates)
{
    ivec2 last = textureSize(table, 0) - 1;
    vec2 node = clamp(coordinates, 0.0, 1.0) * vec2(last);
    ivec2 base = min(ivec2(node), last - 1);
    vec2 f = node - vec2(base);
    vec4 low = mix(
        texelFetch(table, base, 0), texelFetch(table, base + ivec2(1, 0), 0), f.x);
    vec4 high = mix(
        texelFetch(table, base + ivec2(0, 1), 0), texelFetch(table, base + ivec2(1, 1), 0), f.x);
    return mix(low, high, f.y);
}

// (A, B) from the stored (A, u), B = A (1 - q u)^5, q the length of the stretched
// view: the reflectance of Schlick's f0 is f0 (A - B) + B.
vec2 albedo_terms(vec2 stored, float q)
{
    float t = 1.0 - min(q * stored.y, 1.0);
    float t2 = t * t;
    return stored.x * vec2(1.0, t2 * t2 * t);
}
