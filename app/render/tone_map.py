"""From linear radiance to 8-bit sRGB, in float64: the definition that the GPU follows.

Every tone map takes linear Rec. 709 colours (..., 3), 0 or more, and returns
linear Rec. 709 in [0, 1]. Twins: ``shaders/common/tone_map.glsl``, ``srgb.glsl``
and ``dither.glsl``; tests compare them on the GPU.

Sources
-------
agx
    Troy Sobotka's AgX as Blender 4 ships it (Rec. 2020 working space), with
    Benjamin Wrensch's sixth-degree polynomial for the default contrast curve
    ("Minimal AgX implementation", iolite-engine.com, mean squared error
    3.7e-6), and the matrices as Filament's ``ToneMapper.cpp`` gives them. Its
    output is encoded with a pure power of 2.2, undone here. No "look".
aces
    Stephen Hill's fit of the ACES 1.0 RRT and sRGB ODT, from BakingLab by Matt
    Pettineo, without BakingLab's exposure factor.
reinhard
    Reinhard et al. 2002, "Photographic tone reproduction for digital images",
    equation 3, on luminance, so hue and saturation stay until a channel clips.
none
    Values above 1 clip.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from app.scene import Display, ToneMap

FloatArray = NDArray[np.float64]

MAX_EXPOSED = 1e9
"""Exposed values are capped here, so that no tone map divides infinities."""

REC2020_FROM_REC709 = np.array(
    [[0.6274, 0.3293, 0.0433], [0.0691, 0.9195, 0.0113], [0.0164, 0.0880, 0.8956]]
)
REC709_FROM_REC2020 = np.array(
    [[1.6605, -0.5876, -0.0728], [-0.1246, 1.1329, -0.0083], [-0.0182, -0.1006, 1.1187]]
)
AGX_INSET = np.array(
    [
        [0.856627153315983, 0.0951212405381588, 0.0482516061458583],
        [0.137318972929847, 0.761241990602591, 0.101439036467562],
        [0.11189821299995, 0.0767994186031903, 0.811302368396859],
    ]
)
AGX_OUTSET = np.array(
    [
        [1.1271005818144368, -0.11060664309660323, -0.016493938717834573],
        [-0.1413297634984383, 1.157823702216272, -0.016493938717834257],
        [-0.14132976349843826, -0.11060664309660294, 1.2519364065950405],
    ]
)
AGX_MIN_EV, AGX_MAX_EV = -12.47393, 4.026069
AGX_CONTRAST = (15.5, -40.14, 31.96, -6.868, 0.4298, 0.1191, -0.00232)

ACES_INTO = np.array(
    [[0.59719, 0.35458, 0.04823], [0.07600, 0.90834, 0.01566], [0.02840, 0.13383, 0.83777]]
)
ACES_BACK = np.array(
    [[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]]
)

REC709_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def agx(color: ArrayLike) -> FloatArray:
    """Return AgX's default look."""
    v = np.asarray(color, dtype=np.float64) @ REC2020_FROM_REC709.T @ AGX_INSET.T
    x = (np.log2(np.maximum(v, 1e-10)) - AGX_MIN_EV) / (AGX_MAX_EV - AGX_MIN_EV)
    y = np.polyval(AGX_CONTRAST, np.clip(x, 0.0, 1.0))
    linear = np.maximum(y @ AGX_OUTSET.T, 0.0) ** 2.2
    return np.asarray(np.clip(linear @ REC709_FROM_REC2020.T, 0.0, 1.0))


def aces(color: ArrayLike) -> FloatArray:
    """Return Hill's fit of ACES."""
    v = np.asarray(color, dtype=np.float64) @ ACES_INTO.T
    fit = (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.4329510) + 0.238081)
    return np.asarray(np.clip(fit @ ACES_BACK.T, 0.0, 1.0))


def reinhard(color: ArrayLike) -> FloatArray:
    """Return color / (1 + luminance), clipped."""
    c = np.asarray(color, dtype=np.float64)
    luminance = c @ REC709_LUMINANCE
    return np.asarray(np.minimum(c / (1.0 + luminance[..., None]), 1.0))


def clip(color: ArrayLike) -> FloatArray:
    """Return the colour itself, clipped at 1."""
    return np.minimum(np.asarray(color, dtype=np.float64), 1.0)


TONE_MAP_FUNCTIONS: dict[ToneMap, Callable[[ArrayLike], FloatArray]] = {
    "agx": agx,
    "aces": aces,
    "reinhard": reinhard,
    "none": clip,
}


def srgb_from_linear(linear: ArrayLike) -> FloatArray:
    """Return the sRGB code values in [0, 1] of linear values in [0, 1] (IEC 61966-2-1)."""
    x = np.asarray(linear, dtype=np.float64)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.maximum(x, 0.0) ** (1.0 / 2.4) - 0.055)


def linear_from_srgb(code: ArrayLike) -> FloatArray:
    """Return the linear values of sRGB code values in [0, 1], inverse to `srgb_from_linear`."""
    y = np.asarray(code, dtype=np.float64)
    return np.where(y <= 0.04045, y / 12.92, ((y + 0.055) / 1.055) ** 2.4)


def bayer_thresholds(width: int, height: int) -> FloatArray:
    """Return (height, width) dither thresholds in (0, 1), row 0 at the top of the picture."""
    y, x = np.mgrid[height - 1 : -1 : -1, 0:width] if height else np.mgrid[0:0, 0:width]
    x = x ^ y
    rank = np.zeros_like(x)
    for bit in range(3):
        rank |= ((x >> bit) & 1) << (5 - 2 * bit)
        rank |= ((y >> bit) & 1) << (4 - 2 * bit)
    return np.asarray((rank + 0.5) / 64.0)


def quantise(code: ArrayLike) -> NDArray[np.uint8]:
    """Return a picture (h, w, 3) of code values in [0, 1] as dithered 8-bit integers."""
    values = np.asarray(code, dtype=np.float64)
    thresholds = bayer_thresholds(values.shape[1], values.shape[0])
    return np.floor(values * 255.0 + thresholds[..., None]).astype(np.uint8)


def display_codes(radiance: ArrayLike, display: Display) -> FloatArray:
    """Return the sRGB code values (..., 3) in [0, 1] of linear radiance, before dithering."""
    exposed = np.asarray(radiance, dtype=np.float64) * 2.0**display.exposure
    mapped = TONE_MAP_FUNCTIONS[display.tone_map](np.minimum(exposed, MAX_EXPOSED))
    return srgb_from_linear(mapped)
