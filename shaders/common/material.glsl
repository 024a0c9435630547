// What a surface point reflects. Packed by app/render/pack.py (MATERIAL_RECORD).

struct MaterialSample {
    vec3 diffuse;  // Lambert albedo
    vec3 f0;       // Schlick reflectance at normal incidence, f90 = 1
    vec2 alpha;    // GGX parameters along tangent and bitangent
};

// The three texels of a record: (diffuse, rotation), (f0, -), (alpha, -).
MaterialSample unpack_material(vec4 t0, vec4 t1, vec4 t2)
{
    return MaterialSample(t0.rgb, t1.rgb, t2.xy);
}
