// Planar lights as an array of vec4 "texels", packed by app/render/pack.py.
//
// Eight header texels a light, at texel 8 * light, then its outline anywhere after:
//   0: origin_ws.xyz, index of the outline's first texel
//   1: u.xyz,         number of its edges, or nodes
//   2: v.xyz,         bounding radius about the origin [m]
//   3: n.xyz = u x v, 1 if the light emits to both sides
//   4 to 7: what rounding to float32 took from origin, u, v, n; radiance in the w of 4 to 6, and
//      in that of 7 the index of its picture's first texel, or 0 (common/light_picture.glsl)
//   edge: (a.s, a.t, b.s, b.t) [m] in the orthonormal basis u, v about the origin,
//         interior on the left seen from the emitting side, that of n; then what rounding took.
//
// Where some light has curves every outline is a tree instead (app/render/contour_tree.py),
// four texels a node in depth-first order:
//   0, 1: its ends, as an edge's
//   2: disc around it: center.st, radius; area between node and chord, negative for inner nodes
//   3: leaves: both handles from their ends; inner nodes: the node after the subtree, and the
//      area between node and chord, to the right of the chord positive
//
// Twice float32, because a point a millimetre from an outline metres away sees a
// rounding of its coordinates (1e-7 m) as 1e-4 rad, a tenth of a sharp lobe.

const int LIGHT_HEADER_TEXELS = 8;

// Where the texels are (uniform block or texture) is the entry shader's business.
vec4 light_texel(int index);

struct PlanarLight {
    vec3 origin;  // world [m]
    vec3 u;       // world, unit
    vec3 v;       // world, unit
    vec3 n;       // world, unit
    vec3 origin_low;
    vec3 u_low;
    vec3 v_low;
    vec3 n_low;
    vec3 radiance;
    float radius;
    int first_part;
    int part_count;
    bool two_sided;
#if HAS_PICTURES
    int picture;  // 0: none
#endif
};

PlanarLight light_at(int index)
{
    int base = LIGHT_HEADER_TEXELS * index;
    vec4 t0 = light_texel(base);
    vec4 t1 = light_texel(base + 1);
    vec4 t2 = light_texel(base + 2);
    vec4 t3 = light_texel(base + 3);
    vec4 t4 = light_texel(base + 4);
    vec4 t5 = light_texel(base + 5);
    vec4 t6 = light_texel(base + 6);
    vec4 t7 = light_texel(base + 7);
    PlanarLight light;
    light.origin = t0.xyz;
    light.u = t1.xyz;
    light.v = t2.xyz;
    light.n = t3.xyz;
    light.origin_low = t4.xyz;
    light.u_low = t5.xyz;
    light.v_low = t6.xyz;
    light.n_low = t7.xyz;
    light.radiance = vec3(t4.w, t5.w, t6.w);
    light.radius = t2.w;
    light.first_part = int(t0.w);
    light.part_count = int(t1.w);
    light.two_sided = t3.w != 0.0;
#if HAS_PICTURES
    light.picture = int(t7.w);
#endif
    return light;
}

vec3 light_radiance(int index)
{
    int base = LIGHT_HEADER_TEXELS * index;
    return vec3(light_texel(base + 4).w, light_texel(base + 5).w, light_texel(base + 6).w);
}
