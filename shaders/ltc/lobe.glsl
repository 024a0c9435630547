// The linearly transformed cosine of an isotropic GGX lobe: closed-form guess
// times tabulated residual, M = M0 (I + X). Twin and derivation: ltc.table.
//
// Shading frame, view (sin theta, 0, cos theta). Everything is block diagonal
// (xz and y), and M0 factors into a scaled rotation, an explicit 2x2 matrix of
// determinant 2 q alpha and a diagonal, so the inverse is written down entry by
// entry: nothing is inverted numerically and nothing cancels at small alpha.

#include "ltc/polygon.glsl"

struct IsotropicLobe {
    // Rows of cosine_from_shading = M^-1, scaled by alpha: (row0.x, 0, row0.y),
    // (0, row1, 0), (row2.x, 0, row2.y).
    vec2 row0;
    float row1;
    vec2 row2;
    float det;    // row0.x row2.y - row0.y row2.x, without its cancellation
    float above;  // share of the lobe above the surface, in (0, 1]
};

// residual = (X00, X02 / s, X11, X20 / s) as in the table, s = sin_theta.
IsotropicLobe isotropic_lobe(float alpha, float sin_theta, float cos_theta, vec4 residual)
{
    float s = sin_theta;
    float c = cos_theta;

    // v': the view seen by the surface stretched to a hemisphere.
    float inv = inversesqrt(alpha * alpha * s * s + c * c);
    float vx = alpha * s * inv;
    float vz = c * inv;
    float one_minus_vz = vx * vx / (1.0 + vz);
    // m: between v' and the normal; R takes z to m.
    float mz = vz + 0.7 * one_minus_vz;
    inv = inversesqrt(vx * vx + mz * mz);
    float mx = vx * inv;
    mz *= inv;
    float q = 0.5 * (1.0 + vz);
    // h = A e_z in the unstretched space; T reflects the view about it.
    float hx = alpha * mx;
    float k = s * hx + c * mz;
    float w = c * hx - s * mz;

    // alpha M0^-1, and the z row of M0.
    float h2 = hx * hx + mz * mz;
    vec2 r0 = vec2(mz * k - hx * w, -(mz * w + hx * k));
    float r1 = 0.5 * h2 / k;
    vec2 r2 = vec2(mx * k + alpha * mz * w, alpha * mz * k - mx * w);
    vec2 z_row = vec2(-2.0 * q * r2.x, r0.x);
    r0 /= 2.0 * q;

    float x00 = 1.0 + residual.x;
    float x02 = s * residual.y;
    float x11 = 1.0 + residual.z;
    float x20 = s * residual.w;
    float inv_det = 1.0 / (x00 - x02 * x20);

    IsotropicLobe lobe;
    lobe.row0 = (r0 - x02 * r2) * inv_det;
    lobe.row1 = r1 / x11;
    lobe.row2 = (x00 * r2 - x20 * r0) * inv_det;
    lobe.det = 0.5 * alpha * h2 * (s * s + c * c) * inv_det / q;

    // The lobe's share above the plane with normal row 3 of M, in closed form.
    float m20 = z_row.x * x00 + z_row.y * x20;
    float m22 = z_row.x * x02 + z_row.y;
    lobe.above = 0.5 + 0.5 * m22 * inversesqrt(m20 * m20 + m22 * m22);
    return lobe;
}

CosineTransform cosine_transform(IsotropicLobe lobe, mat3 world_from_shading)
{
    vec3 x = world_from_shading[0];
    vec3 y = world_from_shading[1];
    vec3 z = world_from_shading[2];
    CosineTransform result;
    result.points = transpose(mat3(
        lobe.row0.x * x + lobe.row0.y * z, lobe.row1 * y, lobe.row2.x * x + lobe.row2.y * z));
    result.normals = transpose(mat3(
        lobe.row1 * (lobe.row2.y * x - lobe.row2.x * z),
        lobe.det * y,
        lobe.row1 * (lobe.row0.x * z - lobe.row0.y * x)));
    return result;
}
