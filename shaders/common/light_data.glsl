// Planar lights as an array of vec4 "texels", packed by app/render/pack.py.
//
// Four header texels a light, at texel 4 * light, then edges anywhere after:
//   0: origin_ws.xyz, index of the first edge texel
//   1: u.xyz,         number of edges
//   2: v.xyz,         bounding radius about the origin [m]
//   3: radiance.rgb,  1 if the light emits to both sides
//   edge: (a.s, a.t, b.s, b.t) [m] in the orthonormal basis u, v about the origin,
//         interior on the left seen from the emitting side, which is that of u x v.

// Where the texels are (uniform block or texture) is the entry shader's business.
vec4 light_texel(int index);

struct PlanarLight {
    vec3 origin;  // world [m]
    vec3 u;       // world, unit
    vec3 v;       // world, unit
    vec3 radiance;
    float radius;
    int first_edge;
    int edge_count;
    bool two_sided;
};

PlanarLight light_at(int index)
{
    vec4 t0 = light_texel(4 * index);
    vec4 t1 = light_texel(4 * index + 1);
    vec4 t2 = light_texel(4 * index + 2);
    vec4 t3 = light_texel(4 * index + 3);
    return PlanarLight(
        t0.xyz, t1.xyz, t2.xyz, t3.rgb, t2.w, int(t0.w), int(t1.w), t3.w != 0.0);
}
