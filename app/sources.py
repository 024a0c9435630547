"""What a light's outline can be made from, and how it is made (again): text and drawings.

Fonts and drawings cost a fifth of a second to import, and few scenes have any;
so the modules that read them are imported when the first one is met.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from app import contours
from app.scene import AreaLight, Outline, OutlineSource, SvgSource, TextSource


def outline_from(source: OutlineSource) -> Outline:
    """Return the outline that a source describes.

    Raises
    ------
    InputError
        If its file cannot be read, or nothing is to be seen.
    """
    if isinstance(source, TextSource):
        from app.text import text_outline

        return text_outline(source)
    from app.svg import svg_outline

    return svg_outline(source)


def remade(light: AreaLight, source: OutlineSource) -> AreaLight:
    """Return the light with an outline made from ``source``, its plane as it is.

    Raises
    ------
    InputError
        If the outline cannot be made.
    """
    return replace(light, outline=outline_from(source), source=source)


def resized(light: AreaLight, size: float) -> AreaLight:
    """Return the light with the outline of a source of another size, without reading its file."""
    if light.source is None:
        return light
    matrix = size / light.source.size * np.eye(2)
    scaled = tuple(
        contours.transform(contour, matrix, np.zeros(2)) for contour in light.outline.contours
    )
    outline = replace(light.outline, contours=scaled)
    return replace(light, outline=outline, source=replace(light.source, size=size))


def left_out(source: SvgSource) -> tuple[str, ...]:
    """Return in words what of a drawing is not in its outline: "a picture", "text", ...

    Raises
    ------
    InputError
        If the file cannot be read.
    """
    from app.svg import read_drawing

    return read_drawing(source).left_out


def font_suffixes() -> tuple[str, ...]:
    """Return the endings of font files: ".ttf", ..."""
    from app.text import FONT_SUFFIXES

    return FONT_SUFFIXES
