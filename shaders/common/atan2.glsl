// The angle of a vector [rad], to float32: GLSL lets a driver's own atan be far worse.
// Twin: numpy.arctan2, in tests/gl/test_twins.py.

// atan2(y, x) for y >= 0, in [0, pi]. Least-squares minimax fit of atan(r)/r on
// [0, 1], relative error 2e-7 in float32.
float positive_atan2(float y, float x)
{
    float ax = abs(x);
    float r = min(y, ax) / max(max(y, ax), 1e-37);
    float r2 = r * r;
    float p = -0.00469326321;
    p = p * r2 + 0.024252357;
    p = p * r2 - 0.0594863296;
    p = p * r2 + 0.0991428792;
    p = p * r2 - 0.140194789;
    p = p * r2 + 0.199697241;
    p = p * r2 - 0.333319902;
    p = p * r2 + 0.999999881;
    float angle = r * p;
    angle = y > ax ? 1.57079632679 - angle : angle;
    return x < 0.0 ? 3.14159265359 - angle : angle;
}
