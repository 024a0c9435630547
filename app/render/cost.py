"""The view of costs: colours for numbers of evaluations, and their legend.

One logarithmic scale for all pictures, so that scenes, techniques and sizes can be compared
by eye: a factor of two is an equal step. The colours are matplotlib's viridis (CC0) at
nine places: as lightness alone grows along them, they read the same with any
colour vision, and in print.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from app.images import Picture

if TYPE_CHECKING:
    from PIL import ImageFont

VIRIDIS = (
    (0x44, 0x01, 0x54), (0x47, 0x2D, 0x7B), (0x3B, 0x52, 0x8B), (0x2C, 0x72, 0x8E),
    (0x21, 0x91, 0x8C), (0x28, 0xAE, 0x80), (0x5E, 0xC9, 0x62), (0xAD, 0xDC, 0x30),
    (0xFD, 0xE7, 0x25),
)  # fmt: skip
"""8-bit sRGB, interpolated linearly between neighbours."""

OCTAVES = 12
"""Doublings from one end of the scale, 1 evaluation, to the other, 4,096 or more."""

TICKS = (1, 4, 16, 64, 256, 1024, 4096)

NONE = (0, 0, 0)
"""The colour of a surface whose lights took no evaluation."""
EMPTY = (0x59, 0x59, 0x59)
"""The colour where no surface is."""

LABEL = "evaluations per pixel"


def colour_of(evaluations: float) -> tuple[float, float, float]:
    """Return the sRGB colour, 0 to 255, of a number of evaluations above 0."""
    octave = float(np.clip(np.log2(max(evaluations, 1.0)), 0.0, OCTAVES))
    place = octave / OCTAVES * (len(VIRIDIS) - 1)
    low = min(int(place), len(VIRIDIS) - 2)
    part = place - low
    red, green, blue = (
        (1.0 - part) * a + part * b for a, b in zip(VIRIDIS[low], VIRIDIS[low + 1], strict=True)
    )
    return red, green, blue


class WithLegend:
    """A picture of costs with its legend drawn in; its "radiance" is the counts themselves."""

    def __init__(self, picture: Picture) -> None:
        self._picture = picture

    def display(self) -> NDArray[np.uint8]:
        """Return the colours, (h, w, 3), with the legend at the lower left."""
        return draw_legend(self._picture.display())

    def radiance(self) -> NDArray[np.float32]:
        """Return the evaluations of each pixel, (h, w, 3), three times the same."""
        return self._picture.radiance()


def draw_legend(colours: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return a copy of a picture (h, w, 3) with the legend at its lower left.

    It keeps within the picture; where that is too small to read one, there is none.
    """
    from PIL import Image, ImageDraw

    image = Image.fromarray(np.ascontiguousarray(colours))
    em = max(10, min(image.width // 45, 28))
    font = _font(em)
    draw = ImageDraw.Draw(image)
    margin, bar = em // 2, 24 * em
    height = 3 * em + 3 * margin // 2
    if bar + 4 * margin > image.width or height + 2 * margin > image.height:
        return np.array(colours)
    left, top = margin, image.height - margin - height
    draw.rectangle((left, top, left + bar + 2 * margin, top + height), fill=(20, 20, 20))
    x0, y0 = left + margin, top + margin // 2
    draw.text((x0, y0), LABEL, fill=(240, 240, 240), font=font)
    y1 = y0 + em + margin // 2
    # A black box for none, then the scale.
    draw.rectangle((x0, y1, x0 + em, y1 + em), fill=NONE, outline=(160, 160, 160))
    start, end = x0 + 2 * em, x0 + bar - 2 * em
    for x in range(start, end + 1):
        octave = OCTAVES * (x - start) / (end - start)
        colour = tuple(round(c) for c in colour_of(2.0**octave))
        draw.line((x, y1, x, y1 + em), fill=colour)
    y2 = y1 + em
    draw.text((x0 + em / 2, y2), "0", fill=(240, 240, 240), font=font, anchor="ma")
    for tick in TICKS:
        x = start + (end - start) * np.log2(tick) / OCTAVES
        text = f"{tick}+" if tick == TICKS[-1] else str(tick)
        draw.text((x, y2), text, fill=(240, 240, 240), font=font, anchor="ma")
    return np.array(image)


def _font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    from PIL import ImageFont

    return ImageFont.load_default(size)
