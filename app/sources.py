"""What a light's outline can be made from, and how it is made (again): text and drawings.

Fonts and drawings cost a fifth of a second to import, and few scenes have any;
so the modules that read them are imported when the first one is met.
"""

from __future__ import annotations

from dataclasses import replace

from app.scene import AreaLight, Outline, OutlineSource, TextSource


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


def font_suffixes() -> tuple[str, ...]:
    """Return the endings of font files: ".ttf", ..."""
    from app.text import FONT_SUFFIXES

    return FONT_SUFFIXES
