"""Between what sliders and pickers show and what the scene holds.

A `Material` stores GGX's ``alpha``; people turn ``roughness``, which is
perceptually more even, and ``anisotropy``. Colours are picked in sRGB and
stored linear. The conversions live here, once.
"""

from __future__ import annotations

import math

from app.scene import ALPHA_MIN, Quaternion, Vec2, Vec3

ROUGHNESS_MIN = math.sqrt(ALPHA_MIN)


def alpha_from_sliders(roughness: float, anisotropy: float = 0.0) -> Vec2:
    """Return (alpha_x, alpha_y) for the two sliders.

    Parameters
    ----------
    roughness : float
        In [0, 1]; alpha = roughness squared (Burley 2012, section 5.4).
    anisotropy : float
        In [-1, 1]. Positive stretches the highlight along the bitangent's
        normal plane, alpha_x >= alpha_y; negative swaps the two.

    Returns
    -------
    (alpha_x, alpha_y), each clamped to [`ALPHA_MIN`, 1].

    Notes
    -----
    Burley, Physically Based Shading at Disney (2012), addenda B.2:
    aspect = sqrt(1 - 0.9 anisotropy), alpha_x = roughness^2 / aspect,
    alpha_y = roughness^2 aspect. The sign is this program's extension.
    """
    aspect = math.sqrt(1.0 - 0.9 * min(abs(anisotropy), 1.0))
    alpha = roughness * roughness
    wide = min(max(alpha / aspect, ALPHA_MIN), 1.0)
    narrow = min(max(alpha * aspect, ALPHA_MIN), 1.0)
    return (wide, narrow) if anisotropy >= 0.0 else (narrow, wide)


def sliders_from_alpha(alpha: Vec2) -> tuple[float, float]:
    """Return (roughness, anisotropy), the inverse of `alpha_from_sliders`.

    Exact wherever that function did not clamp. Ratios beyond Burley's range
    (alpha_x / alpha_y > 10) give anisotropy 1.
    """
    wide, narrow = max(alpha), min(alpha)
    roughness = (wide * narrow) ** 0.25
    anisotropy = min((1.0 - narrow / wide) / 0.9, 1.0)
    return roughness, anisotropy if alpha[0] >= alpha[1] else -anisotropy


def srgb_from_linear(colour: Vec3) -> Vec3:
    """Return display values of linear Rec. 709 components in [0, 1] (IEC 61966-2-1)."""

    def encode(x: float) -> float:
        return 12.92 * x if x <= 0.0031308 else 1.055 * x ** (1.0 / 2.4) - 0.055

    return (encode(colour[0]), encode(colour[1]), encode(colour[2]))


def linear_from_srgb(colour: Vec3) -> Vec3:
    """Return linear Rec. 709 components of display values in [0, 1] (IEC 61966-2-1)."""

    def decode(x: float) -> float:
        return x / 12.92 if x <= 0.04045 else ((x + 0.055) / 1.055) ** 2.4

    return (decode(colour[0]), decode(colour[1]), decode(colour[2]))


def quaternion_from_euler(angles: Vec3) -> Quaternion:
    """Return the unit quaternion (w, x, y, z) of turns about x, then y, then z [rad]."""
    (cx, cy, cz) = (math.cos(a / 2.0) for a in angles)
    (sx, sy, sz) = (math.sin(a / 2.0) for a in angles)
    return (
        cx * cy * cz + sx * sy * sz,
        sx * cy * cz - cx * sy * sz,
        cx * sy * cz + sx * cy * sz,
        cx * cy * sz - sx * sy * cz,
    )


def euler_from_quaternion(rotate: Quaternion) -> Vec3:
    """Return the turns about x, then y, then z [rad] of a quaternion of any length.

    At y = +-90 degrees, where the other two turn about one axis, x is the angle
    between them and z is 0.
    """
    norm = math.hypot(*rotate)
    w, x, y, z = (component / norm for component in rotate)
    sine = max(-1.0, min(1.0, 2.0 * (w * y - x * z)))
    if abs(sine) > 1.0 - 1e-12:
        return (2.0 * math.atan2(x, w), math.copysign(math.pi / 2.0, sine), 0.0)
    return (
        math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
        math.asin(sine),
        math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),
    )
