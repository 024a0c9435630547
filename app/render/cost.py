"""The view of costs: colours for numbers of evaluations, and their legend.

One logarithmic scale for all pictures, so that scenes, techniques and sizes can be compared
by eye: a factor of two is an equal step.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.colour_maps import VIRIDIS, Legend, colours_at, draw_legend
from app.images import Picture

OCTAVES = 12
"""Doublings from one end of the scale, 1 evaluation, to the other, 4,096 or more."""

TICKS = (1, 4, 16, 64, 256, 1024, 4096)

NONE = (0, 0, 0)
"""The colour of a surface whose lights took no evaluation."""
EMPTY = (0x59, 0x59, 0x59)
"""The colour where no surface is."""

LEGEND = Legend(
    "evaluations per pixel",
    VIRIDIS,
    tuple(
        (float(np.log2(tick)) / OCTAVES, f"{tick}+" if tick == TICKS[-1] else str(tick))
        for tick in TICKS
    ),
    ((NONE, "0"),),
)


def colour_of(evaluations: float) -> tuple[float, float, float]:
    """Return the sRGB colour, 0 to 255, of a number of evaluations above 0."""
    red, green, blue = colours_at(VIRIDIS, np.log2(max(evaluations, 1.0)) / OCTAVES)
    return float(red), float(green), float(blue)


class WithLegend:
    """A picture of costs with its legend drawn in; its "radiance" is the counts themselves."""

    def __init__(self, picture: Picture) -> None:
        self._picture = picture

    def display(self) -> NDArray[np.uint8]:
        """Return the colours, (h, w, 3), with the legend at the lower left."""
        return draw_legend(self._picture.display(), LEGEND)

    def radiance(self) -> NDArray[np.float32]:
        """Return the evaluations of each pixel, (h, w, 3), three times the same."""
        return self._picture.radiance()
