// The linearly transformed cosine of an anisotropic GGX lobe: closed-form guess times
// tabulated residual, M = M0 (I + X). Axes, contents and symmetries of the tables are explained
// in ltc/anisotropic.py. Tangent frame: x the tangent, z the normal, the view anywhere above.
// Twins: ltc.anisotropic.table_coordinates, AnisotropicTable.matrix_of_view and
// albedo_terms_of_view; ltc.table.closed_form_guess has the derivation of M0.
//
// Nothing is inverted or crossed numerically. With T, D, R, N of closed_form_guess,
// M0 = T D R N diag(2, 2, 1), e1 along v'_xy, e2 across, each factor has its inverse in closed
// form: N^-1 = diag(2 / (1 + v'_z), 1, 1), and T = c I + [k]x with k = v x h, so that
// p T^-1 = (c^2 p + (p.k) k - c p x k) / (c |h|^2). Where terms would cancel at grazing views they
// are written out by det(D) D^-1 (a x b) = D a x D b; ltc/snippets.py has the identities. The
// normals of edges are carried by the cofactors, that is by M itself transposed.

#include "ltc/polygon.glsl"

struct AnisotropicLobe {
    mat3 points;   // M^-1 times det(I + X) alpha_x
    mat3 normals;  // its cofactor matrix, a positive multiple of M transposed
    float above;   // share of the lobe above the surface, in (0, 1]
};

// (azimuth, ratio, view, alpha), each in [0, 1]. A view along the normal has the azimuth 0:
// nodes there hold one value.
vec4 anisotropic_coordinates(vec2 alpha, vec3 v)
{
    vec2 side = abs(v.xy);
    bool swapped = alpha.y > alpha.x;
    float a = swapped ? alpha.y : alpha.x;
    float b = swapped ? alpha.x : alpha.y;
    float s = length(side);
    float stretched = length(alpha * side);
    bool tilted = s > 0.0;
    float along = tilted ? stretched / s : a;
    float azimuth = tilted ? (swapped ? side.x : side.y) / (side.x + side.y) : 0.0;
    float p = sqrt(stretched * s / (1.0 + v.z));
    float r = sqrt(v.z * (1.0 + along));
    // Ratios of alphas below .01 use the numbers of .01.
    float ratio = max((sqrt(b / a) - 0.1) / 0.9, 0.0);
    return vec4(azimuth, ratio, p / (p + r), sqrt(a));
}

// Nodes at i / (n - 1). The sampler interpolates over alpha and view, within a layer; layers
// are mixed here, over the ratio, which runs fastest, and the azimuth. Samplers whose weights
// have 8 bits, as those of most GPUs, move the shading integral by 1e-5 in the mean and 3e-4 at
// most; with four axes at float32 it would take 48 fetches instead of 12.
vec4 table_quadrilinear(sampler2DArray table, int azimuths, vec4 t)
{
    ivec3 size = textureSize(table, 0);
    int ratios = size.z / azimuths;
    vec2 at = (t.wz * vec2(size.xy - 1) + 0.5) / vec2(size.xy);
    vec2 node = t.xy * vec2(azimuths - 1, ratios - 1);
    ivec2 base = min(ivec2(node), ivec2(azimuths, ratios) - 2);
    vec2 f = node - vec2(base);
    float layer = float(base.x * ratios + base.y);
    float next = layer + float(ratios);
    return mix(
        mix(textureLod(table, vec3(at, layer), 0.0),
            textureLod(table, vec3(at, layer + 1.0), 0.0), f.y),
        mix(textureLod(table, vec3(at, next), 0.0),
            textureLod(table, vec3(at, next + 1.0), 0.0), f.y),
        f.x);
}

// I + X, from the channels p, d, r, e_a and e_b, g_a, g_b.
mat3 residual_matrix(vec2 alpha, vec3 v, vec4 first, vec4 second)
{
    bool swapped = alpha.y > alpha.x;
    float d = swapped ? -first.y : first.y;
    vec2 e = swapped ? vec2(second.x, first.w) : vec2(first.w, second.x);
    vec2 g = swapped ? second.zy : second.yz;
    float across = first.z * v.x * v.y;
    return mat3(
        1.0 + first.x + d + first.z * v.x * v.x, across, g.x * v.x,
        across, 1.0 + first.x - d + first.z * v.y * v.y, g.y * v.y,
        e.x * v.x, e.y * v.y, 1.0);
}

// `residual` is I + X; v is unit, v.z >= 0.
AnisotropicLobe anisotropic_lobe(vec2 alpha, vec3 v, mat3 residual)
{
    // v' = (vs, vz) and m = (ms, mz) in the plane of e1 and the normal.
    vec2 stretched_xy = alpha * v.xy;
    float n = length(stretched_xy);
    float stretched = length(vec2(n, v.z));
    float vs = n / stretched;
    float vz = v.z / stretched;
    bool tilted = n > 0.0;
    vec2 e1 = tilted ? stretched_xy / n : vec2(1.0, 0.0);
    vec2 e2 = vec2(-e1.y, e1.x);
    float skew = (alpha.x - alpha.y) * (alpha.x + alpha.y);
    float mixed = tilted ? v.x * v.y * skew / n : 0.0;
    float tilt = 0.7 * vs * vs / (1.0 + vz);
    float inv = inversesqrt(vs * vs + (vz + tilt) * (vz + tilt));
    float ms = vs * inv;
    float mz = (vz + tilt) * inv;
    float narrow = 0.5 * (1.0 + vz);
    // h = D m is the lobe's centre as a half vector.
    vec3 h = vec3(ms * alpha * e1, mz);
    float h2 = dot(h, h);
    float c = dot(v, h);
    vec3 k = vec3(v.y * h.z - v.z * h.y, v.z * h.x - v.x * h.z, -ms * mixed);

    // alpha_x times rows of R^T D^-1, and these times T^-1.
    float q = alpha.x / alpha.y;
    vec3 p1 = vec3(mz * e1 * vec2(1.0, q), -ms * alpha.x);
    vec3 p2 = vec3(e2 * vec2(1.0, q), 0.0);
    vec3 p3 = vec3(ms * e1 * vec2(1.0, q), mz * alpha.x);
    float turn = skew * e1.x * e1.y * ms;
    float by_w = stretched / alpha.y;
    float p1_k = (ms * vs + mz * vz) * turn * by_w;
    float p2_k = (vz * dot(h.xy, alpha * e1) - vs * mz) * by_w;
    float p3_k = -tilt * inv * vs * turn * by_w;
    float inv_det = 1.0 / (c * h2);
    vec3 a1 = (c * (c * p1 + dot(p1, v) * h) + p1_k * k) * (inv_det * 0.5 / narrow);
    vec3 a2 = (c * (c * p2 + mixed / alpha.y * h) + p2_k * k) * (inv_det * 0.5);
    vec3 a3 = (c * (c * p3 + dot(p3, v) * h - alpha.x * v) + p3_k * k) * inv_det;
    // Columns of M0 about e1, e2 and z: T w = c w + (v.w) h - (h.w) v.
    vec2 along = alpha * e1;
    vec3 g1 = 2.0 * narrow *
              (c * vec3(mz * along, -ms) + stretched * inv * vs * tilt * h -
               ms * mz * (dot(along, along) - 1.0) * v);
    vec3 g2 = 2.0 * (c * vec3(alpha * e2, 0.0) + turn * v);
    vec3 g3 = 2.0 * c * h - h2 * v;

    // From e1, e2 to x, y, then by I + X, whose inverse is its adjugate over a determinant
    // of .3 or more; the columns of the adjugate are cross products of the rows.
    mat3 inverse = mat3(e1.x * a1 + e2.x * a2, e1.y * a1 + e2.y * a2, a3);
    mat3 guess = mat3(e1.x * g1 + e2.x * g2, e1.y * g1 + e2.y * g2, g3);
    mat3 rows = transpose(residual);
    mat3 adjugate = mat3(cross(rows[1], rows[2]), cross(rows[2], rows[0]), cross(rows[0], rows[1]));
    mat3 M = guess * residual;

    AnisotropicLobe lobe;
    lobe.points = adjugate * transpose(inverse);
    float det = dot(rows[0], adjugate[0]);
    lobe.normals = transpose(M) * (0.25 * q * det * inv_det / narrow);
    vec3 z_row = vec3(M[0].z, M[1].z, M[2].z);
    lobe.above = 0.5 + 0.5 * z_row.z * inversesqrt(dot(z_row, z_row));
    return lobe;
}

CosineTransform cosine_transform(AnisotropicLobe lobe, mat3 world_from_tangent)
{
    mat3 tangent_from_world = transpose(world_from_tangent);
    return CosineTransform(lobe.points * tangent_from_world, lobe.normals * tangent_from_world);
}
