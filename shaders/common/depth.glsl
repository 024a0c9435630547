// The depth buffer's contents; app/render/camera.py says why and holds the constants.

const float LOG2_NEAR = -13.2877124;            // log2(1e-4 m)
const float INV_LOG2_RANGE = 0.0250858329719;   // 1 / log2(1e8 m / 1e-4 m)

// `depth`: distance along the view axis [m]. In [0, 1], increasing.
float log_depth(float depth)
{
    return clamp((log2(depth) - LOG2_NEAR) * INV_LOG2_RANGE, 0.0, 1.0);
}
