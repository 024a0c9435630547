"""Colours for numbers: maps that read the same with any colour vision, and their legends.

Sequential maps grow in lightness alone, so that they also survive print: matplotlib's
viridis and magma and Nuñez, Anderton and Renslow's cividis (CC0), made for colour-blind
readers. Numbers with a sign get Crameri's berlin (MIT): black at zero, bluish light below,
reddish light above. They are interpolated linearly between a few places, within 3 of 255
levels of the originals, viridis and cividis within 18 and 11.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from PIL import ImageFont

Colour: TypeAlias = tuple[int, int, int]
"""8-bit sRGB."""
ColourMap: TypeAlias = tuple[Colour, ...]
"""Colours at equal steps from one end of a scale to the other."""
MapName: TypeAlias = Literal["magma", "viridis", "cividis"]
"""Maps for numbers without a sign."""

VIRIDIS: ColourMap = (
    (0x44, 0x01, 0x54), (0x47, 0x2D, 0x7B), (0x3B, 0x52, 0x8B), (0x2C, 0x72, 0x8E),
    (0x21, 0x91, 0x8C), (0x28, 0xAE, 0x80), (0x5E, 0xC9, 0x62), (0xAD, 0xDC, 0x30),
    (0xFD, 0xE7, 0x25),
)  # fmt: skip
MAGMA: ColourMap = (
    (0x00, 0x00, 0x04), (0x0A, 0x08, 0x22), (0x1D, 0x11, 0x47), (0x36, 0x10, 0x6B),
    (0x51, 0x12, 0x7C), (0x6A, 0x1C, 0x81), (0x83, 0x26, 0x81), (0x9C, 0x2E, 0x7F),
    (0xB7, 0x37, 0x79), (0xCF, 0x40, 0x70), (0xE5, 0x50, 0x64), (0xF4, 0x69, 0x5C),
    (0xFB, 0x87, 0x61), (0xFE, 0xA5, 0x71), (0xFE, 0xC2, 0x87), (0xFD, 0xE0, 0xA1),
    (0xFC, 0xFD, 0xBF),
)  # fmt: skip
CIVIDIS: ColourMap = (
    (0x00, 0x22, 0x4E), (0x00, 0x2E, 0x6A), (0x1A, 0x38, 0x6F), (0x32, 0x43, 0x6D),
    (0x43, 0x4E, 0x6C), (0x53, 0x5A, 0x6D), (0x61, 0x65, 0x6F), (0x6F, 0x70, 0x73),
    (0x7D, 0x7C, 0x78), (0x8B, 0x87, 0x78), (0x9A, 0x93, 0x76), (0xAA, 0xA0, 0x73),
    (0xBB, 0xAD, 0x6D), (0xCC, 0xBA, 0x64), (0xDD, 0xC8, 0x58), (0xEF, 0xD7, 0x48),
    (0xFE, 0xE8, 0x38),
)  # fmt: skip
BERLIN: ColourMap = (
    (0x9E, 0xB0, 0xFF), (0x79, 0xAB, 0xED), (0x51, 0x9F, 0xD3), (0x36, 0x85, 0xAD),
    (0x28, 0x68, 0x86), (0x1D, 0x4B, 0x61), (0x14, 0x30, 0x3E), (0x11, 0x1A, 0x20),
    (0x19, 0x0C, 0x09), (0x2A, 0x0E, 0x01), (0x3F, 0x12, 0x01), (0x59, 0x1C, 0x07),
    (0x7B, 0x32, 0x1C), (0x9C, 0x4F, 0x3D), (0xBC, 0x6D, 0x61), (0xDD, 0x8D, 0x86),
    (0xFF, 0xAD, 0xAD),
)  # fmt: skip

SEQUENTIAL: dict[MapName, ColourMap] = {"magma": MAGMA, "viridis": VIRIDIS, "cividis": CIVIDIS}


def colours_at(colours: ColourMap, place: ArrayLike) -> NDArray[np.float64]:
    """Return the sRGB colours, (..., 3) from 0 to 255, of places (...) on a map from 0 to 1.

    Places beyond the ends get the ends' colours. Twin: ``map_color`` of
    ``shaders/common/color_map.glsl``.
    """
    table = np.array(colours, dtype=np.float64)
    at = np.clip(np.asarray(place, dtype=np.float64), 0.0, 1.0) * (len(table) - 1)
    low = np.minimum(at.astype(np.intp), len(table) - 2)
    part = (at - low)[..., None]
    return np.asarray((1.0 - part) * table[low] + part * table[low + 1])


@dataclass(frozen=True, slots=True)
class Legend:
    """What explains a map's colours: a title, the scale, numbers under it.

    Attributes
    ----------
    label : str
    colours : ColourMap
    ticks : tuple of (place, text)
        Places on the scale from 0 to 1, and what stands there.
    boxes : tuple of (colour, text)
        Colours that are not on the scale; they stand left of it.
    """

    label: str
    colours: ColourMap
    ticks: tuple[tuple[float, str], ...]
    boxes: tuple[tuple[Colour, str], ...] = ()


WIDTH, HEIGHT = 24.0, 4.0
"""Of a legend, in font sizes."""
PAPER, INK, FRAME = (20, 20, 20), (240, 240, 240), (160, 160, 160)


def draw_legend(picture: NDArray[np.uint8], legend: Legend) -> NDArray[np.uint8]:
    """Return a copy of a picture (h, w, 3) with a legend at its lower left.

    It keeps within the picture; where that is too small to read one, there is none.
    """
    from PIL import Image, ImageDraw

    image = Image.fromarray(np.ascontiguousarray(picture))
    em = max(10, min(image.width // 45, 28))
    font = _font(em)
    draw = ImageDraw.Draw(image)
    margin, bar = em // 2, 24 * em
    height = 3 * em + 3 * margin // 2
    if bar + 4 * margin > image.width or height + 2 * margin > image.height:
        return np.array(picture)
    left, top = margin, image.height - margin - height
    draw.rectangle((left, top, left + bar + 2 * margin, top + height), fill=PAPER)
    x0, y0 = left + margin, top + margin // 2
    draw.text((x0, y0), legend.label, fill=INK, font=font)
    y1 = y0 + em + margin // 2
    y2 = y1 + em
    for index, (colour, text) in enumerate(legend.boxes):
        x = x0 + 2 * index * em
        draw.rectangle((x, y1, x + em, y1 + em), fill=colour, outline=FRAME)
        draw.text((x + em / 2, y2), text, fill=INK, font=font, anchor="ma")
    start, end = x0 + 2 * max(len(legend.boxes), 1) * em, x0 + bar - 2 * em
    places = np.linspace(0.0, 1.0, end - start + 1)
    for x, colour in enumerate(colours_at(legend.colours, places).round().astype(int), start):
        draw.line((x, y1, x, y1 + em), fill=tuple(colour.tolist()))
    for place, text in legend.ticks:
        middle = start + (end - start) * place
        draw.text((middle, y2), text, fill=INK, font=font, anchor="ma")
    return np.array(image)


def _font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    from PIL import ImageFont

    return ImageFont.load_default(size)
