"""Where in its neighbourhood each sample of a pixel lies, in float64.

Filter importance sampling: all samples weigh the same, and their offsets are
distributed like the pixel filter, here a separable Blackman-Harris window of
radius 1.5 pixels. (Its tails are near a Gaussian's of sigma 0.4, it ends by itself,
and having no negative lobes it never rings around a bright light.) The points are
the R2 sequence (Roberts 2018, "The unreasonable effectiveness of quasirandom
sequences"), shifted so that sample 0 is the pixel centre exactly.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

FILTER_RADIUS = 1.5
"""Pixels."""

PLASTIC = 1.32471795724474602596
"""Real root of x^3 = x + 1."""

_BLACKMAN_HARRIS = (0.35875, 0.48829, 0.14128, 0.01168)
"""Harris 1978, minimum four-term window."""


def _filter_cdf(x: FloatArray) -> FloatArray:
    """Return the share of the filter's weight left of x in [-1, 1] (radius 1)."""
    a0, a1, a2, a3 = _BLACKMAN_HARRIS
    integral = (
        a0 * x
        + a1 / np.pi * np.sin(np.pi * x)
        + a2 / (2.0 * np.pi) * np.sin(2.0 * np.pi * x)
        + a3 / (3.0 * np.pi) * np.sin(3.0 * np.pi * x)
    )
    return np.asarray(0.5 + integral / (2.0 * a0))


_NODES = np.linspace(-1.0, 1.0, 4097)
_CDF = _filter_cdf(_NODES)


def pixel_offset(index: int) -> tuple[float, float]:
    """Return the offset (right, up) of sample ``index`` from the pixel centre [pixels]."""
    if index == 0:
        return 0.0, 0.0
    steps = np.array([1.0 / PLASTIC, 1.0 / PLASTIC**2])
    u = np.mod(0.5 + index * steps, 1.0)
    x, y = FILTER_RADIUS * np.interp(u, _CDF, _NODES)
    return float(x), float(y)
