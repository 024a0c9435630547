// Shading frames.
// Twin: tests/gl/test_twins.py holds the float64 definition.

// Some unit vector perpendicular to the normal.
vec3 any_tangent(vec3 normal)
{
    vec3 axis = abs(normal.x) < 0.5 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0);
    return normalize(axis - normal * dot(normal, axis));
}

struct ViewFrame {
    mat3 world_from_shading;  // columns x, y, z: z the normal, the view at x >= 0
    float sin_theta;
    float cos_theta;
};

// Along the normal any tangent serves, because every isotropic lobe is symmetric
// there; 1e-14 is (1e-7)^2, one unit of float32. The sine is the length of the
// tangential part: sqrt(1 - cos^2) would be off by rounding / sin near the normal,
// and turn a mirror-like lobe by a visible part of its width. Views below the
// surface (interpolated normals at silhouettes) count as grazing.
ViewFrame view_aligned_frame(vec3 normal, vec3 wo)
{
    float cos_theta = dot(normal, wo);
    vec3 x = wo - normal * cos_theta;
    // Orthogonalised twice: the first pass leaves a component along the normal of
    // the order of rounding, which is not small against a small x.
    x -= normal * dot(normal, x);
    float x2 = dot(x, x);
    float sin_theta = sqrt(x2);
    x = x2 < 1e-14 ? any_tangent(normal) : x * inversesqrt(x2);
    return ViewFrame(
        mat3(x, cross(normal, x), normal), min(sin_theta, 1.0), clamp(cos_theta, 0.0, 1.0));
}
