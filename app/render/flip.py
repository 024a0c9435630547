"""LDR-FLIP: how much two pictures differ to somebody who flips between them.

Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild, "FLIP: A Difference Evaluator
for Alternating Images", Proc. ACM Comput. Graph. Interact. Tech. 3(2), 2020. A pixel's value is
between 0, no visible difference, and 1. Two pipelines are combined:

- Colour: both pictures are filtered by the eye's contrast sensitivity in YCxCz, taken to
  L*a*b* with Hunt's adjustment (chroma weighs less in the dark), and compared by the distance
  of Abasi et al. (HyAB), to the power of 0.7, the smaller ones spread over most of the range.
- Features: first and second Gaussian derivatives of the lightness find edges and points; where
  one picture has them and the other has not, the colour's difference is raised.

Written here, and in numpy, because NVIDIA's ``flip-evaluator`` has no wheels for Python 3.14,
Intel Macs or Linux on ARM (version 1.7), and ends the process where an argument is wrong. All
filters are sums of Gaussians, so everything is done axis by axis. It agrees with that package
to 5e-5 (`tests/app/test_flip.py`), whose arithmetic is float32.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import correlate1d

from app.render.tone_map import linear_from_srgb

FloatArray = NDArray[np.float64]

PIXELS_PER_DEGREE = 0.7 * (3840.0 / 0.7) * np.pi / 180.0
"""67: a screen 0.7 m wide with 3840 pixels seen from 0.7 m, the paper's default."""

_COLOUR_POWER = 0.7  # q_c
_TURN, _TURN_TO = 0.4, 0.95  # p_c, p_t: this share of the largest distance gets this error
_FEATURE_WIDTH = 0.082  # w: degrees of an edge detector
_FEATURE_POWER = 0.5  # q_f

# The eye's contrast sensitivity: (weight a, b) of each Gaussian [degrees^2], paper table 1.
_SENSITIVITY: tuple[tuple[tuple[float, float], ...], ...] = (
    ((1.0, 0.0047),),
    ((1.0, 0.0053),),
    ((34.1, 0.04), (13.5, 0.025)),
)

_XYZ_FROM_RGB = np.array(
    [
        [10135552 / 24577794, 8788810 / 24577794, 4435075 / 24577794],
        [2613072 / 12288897, 8788810 / 12288897, 887015 / 12288897],
        [1425312 / 73733382, 8788810 / 73733382, 70074185 / 73733382],
    ]
)
_RGB_FROM_XYZ = np.linalg.inv(_XYZ_FROM_RGB)
_WHITE = _XYZ_FROM_RGB.sum(axis=1)


def flip(
    a: NDArray[np.uint8] | FloatArray,
    b: NDArray[np.uint8] | FloatArray,
    pixels_per_degree: float = PIXELS_PER_DEGREE,
) -> FloatArray:
    """Return LDR-FLIP of each pixel, (h, w) in [0, 1].

    Parameters
    ----------
    a, b : (h, w, 3) uint8, or floats from 0 to 1
        Display colours, sRGB-encoded; the value is the same if they are exchanged.
    pixels_per_degree : float
        Of the observer's visual angle.

    Raises
    ------
    ValueError
        If shapes differ or are no pictures, or the angle is not positive.
    """
    if a.shape != b.shape or a.ndim != 3 or a.shape[2] != 3 or not a.size:
        raise ValueError(
            f"pictures have shapes {a.shape} and {b.shape}, expected (h, w, 3) of both"
        )
    if not pixels_per_degree > 0.0:
        raise ValueError(f"pixels_per_degree is {pixels_per_degree}, expected more than 0")
    colour, light = [], []
    for picture in (a, b):
        opponent = _opponent_from_xyz(_linear(picture) @ _XYZ_FROM_RGB.T)
        light.append((opponent[..., 0] + 16.0) / 116.0)
        seen = _as_seen(opponent, pixels_per_degree)
        linear = np.clip(_xyz_from_opponent(seen) @ _RGB_FROM_XYZ.T, 0.0, 1.0)
        colour.append(_hunt_lab(linear))
    difference = _redistributed(_hyab(*colour) ** _COLOUR_POWER)
    features = np.zeros(a.shape[:2])
    for order in (1, 2):
        first, second = (_feature(channel, order, pixels_per_degree) for channel in light)
        features = np.maximum(features, np.abs(first - second))
    raised = np.clip((features / np.sqrt(2.0)) ** _FEATURE_POWER, 0.0, 1.0)
    return np.asarray(difference ** (1.0 - raised))


def _linear(picture: NDArray[np.uint8] | FloatArray) -> FloatArray:
    """Return linear components of sRGB codes."""
    whole = np.issubdtype(picture.dtype, np.integer)
    return linear_from_srgb(np.clip(picture / (255.0 if whole else 1.0), 0.0, 1.0))


def _opponent_from_xyz(xyz: FloatArray) -> FloatArray:
    """Return YCxCz: lightness, red against green, blue against yellow, all linear."""
    x, y, z = np.moveaxis(xyz / _WHITE, -1, 0)
    return np.stack([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)], axis=-1)


def _xyz_from_opponent(opponent: FloatArray) -> FloatArray:
    y = (opponent[..., 0] + 16.0) / 116.0
    x, z = y + opponent[..., 1] / 500.0, y - opponent[..., 2] / 200.0
    return np.asarray(np.stack([x, y, z], axis=-1) * _WHITE)


def _filtered(channel: FloatArray, rows: FloatArray, columns: FloatArray) -> FloatArray:
    """Return a channel under a separable filter; the border's pixels go on beyond it."""
    once = correlate1d(channel, columns, axis=1, mode="nearest")
    return np.asarray(correlate1d(once, rows, axis=0, mode="nearest"))


def _as_seen(opponent: FloatArray, pixels_per_degree: float) -> FloatArray:
    """Return what is left when details too fine for the eye are gone.

    A Gaussian of parameter b is sqrt(pi/b) exp(-pi^2 x^2/b) along each axis [degrees].
    """
    widest = max(b for gaussians in _SENSITIVITY for _, b in gaussians)
    radius = int(np.ceil(3.0 * np.sqrt(widest / (2.0 * np.pi**2)) * pixels_per_degree))
    x2 = (np.arange(-radius, radius + 1) / pixels_per_degree) ** 2
    seen = np.zeros_like(opponent)
    for channel, gaussians in enumerate(_SENSITIVITY):
        total = 0.0
        for weight, b in gaussians:
            bell = np.exp(-(np.pi**2) * x2 / b)
            mass = weight * np.sqrt(np.pi / b) * bell.sum() ** 2
            bell /= bell.sum()
            seen[..., channel] += mass * _filtered(opponent[..., channel], bell, bell)
            total += mass
        seen[..., channel] /= total
    return seen


def _hunt_lab(linear: FloatArray) -> FloatArray:
    """Return L*a*b* of linear Rec. 709 colours, a* and b* times L/100 (Hunt's adjustment)."""
    t = linear @ _XYZ_FROM_RGB.T / _WHITE
    delta = 6.0 / 29.0
    f = np.where(t > delta**3, np.cbrt(t), t / (3.0 * delta * delta) + 4.0 / 29.0)
    x, y, z = np.moveaxis(f, -1, 0)
    lightness = 116.0 * y - 16.0
    chroma = 0.01 * lightness
    return np.stack([lightness, chroma * 500.0 * (x - y), chroma * 200.0 * (y - z)], axis=-1)


def _hyab(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the distance of colours: by the block in lightness, as the crow flies in chroma."""
    apart = a - b
    return np.asarray(np.abs(apart[..., 0]) + np.hypot(apart[..., 1], apart[..., 2]))


_GREEN, _BLUE = _hunt_lab(np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]))
_LARGEST = float(_hyab(_GREEN, _BLUE)) ** _COLOUR_POWER
"""The two colours of a display that are furthest apart."""


def _redistributed(distance: FloatArray) -> FloatArray:
    """Return distances as errors from 0 to 1: small ones get most of the range."""
    turn = _TURN * _LARGEST
    rest = _TURN_TO + (distance - turn) / (_LARGEST - turn) * (1.0 - _TURN_TO)
    return np.asarray(np.where(distance < turn, _TURN_TO / turn * distance, rest))


def _feature(light: FloatArray, order: int, pixels_per_degree: float) -> FloatArray:
    """Return the length of the Gaussian derivative of an order, 1 for edges, 2 for points.

    Negative and positive weights of the filter each add up to 1.
    """
    width = 0.5 * _FEATURE_WIDTH * pixels_per_degree
    radius = int(np.ceil(3.0 * width))
    x = np.arange(-radius, radius + 1) / width
    bell = np.exp(-0.5 * x * x)
    across = -x * bell if order == 1 else (x * x - 1.0) * bell
    across = np.where(across < 0.0, -across / across[across < 0.0].sum(), across)
    across = np.where(across > 0.0, across / across[across > 0.0].sum(), across)
    bell /= bell.sum()
    right, down = _filtered(light, bell, across), _filtered(light, across, bell)
    return np.asarray(np.hypot(right, down))
