"""Small drawings of lines, marks and words, written as SVG or PNG: nothing has to be installed.

Coordinates are pixels from the top left. The colour `INK` is that of the text around an SVG
element (``currentColor``), so that a drawing reads the same on light and dark pages; in files,
which do not know what is around them, it is dark on white.
"""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape
from typing import Literal

INK = "ink"
FILE_INK, FILE_PAPER = "#1b1f24", "#ffffff"

NAMESPACE = "http://www.w3.org/2000/svg"
FONT = "sans-serif"
LETTER = 0.56
"""Width of a letter over the size of its font, about."""

OVERSAMPLING = 3
"""PNG files are drawn so many times as large and averaged: Pillow's lines have steps."""

Shape = Literal["circle", "square", "triangle", "diamond", "down", "cross"]


@dataclass(frozen=True)
class Line:
    """A chain of straight lines; ``dash`` is the length of dashes, 0 for none."""

    points: tuple[tuple[float, float], ...]
    colour: str = INK
    opacity: float = 1.0
    width: float = 1.0
    dash: float = 0.0


@dataclass(frozen=True)
class Mark:
    """A shape of ``size`` pixels about a point, filled or a ring; ``tip`` is its tooltip."""

    x: float
    y: float
    shape: Shape
    colour: str
    filled: bool
    size: float = 4.5
    tip: str = ""


@dataclass(frozen=True)
class Words:
    """Text whose base line starts, has its middle or ends at a point; upright or turned left."""

    x: float
    y: float
    text: str
    anchor: Literal["start", "middle", "end"] = "start"
    size: float = 11.0
    turned: bool = False
    colour: str = INK


@dataclass(frozen=True)
class Drawing:
    """What is drawn, in this order, on a sheet of ``width`` times ``height`` pixels."""

    width: int
    height: int
    title: str
    parts: Sequence[Line | Mark | Words] = field(default_factory=tuple)


def corners(mark: Mark) -> tuple[tuple[float, float], ...]:
    """Return the corners of a mark, of the same area as its circle would have, about."""
    s = mark.size
    unit: dict[str, tuple[tuple[float, float], ...]] = {
        "circle": tuple(
            (math.cos(0.2 * math.pi * k), math.sin(0.2 * math.pi * k)) for k in range(10)
        ),
        "square": ((-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)),
        "triangle": ((0.0, -1.25), (1.15, 0.8), (-1.15, 0.8)),
        "down": ((0.0, 1.25), (-1.15, -0.8), (1.15, -0.8)),
        "diamond": ((0.0, -1.3), (1.2, 0.0), (0.0, 1.3), (-1.2, 0.0)),
        "cross": (
            (-1.1, -0.4), (-0.4, -0.4), (-0.4, -1.1), (0.4, -1.1), (0.4, -0.4), (1.1, -0.4),
            (1.1, 0.4), (0.4, 0.4), (0.4, 1.1), (-0.4, 1.1), (-0.4, 0.4), (-1.1, 0.4),
        ),
    }  # fmt: skip
    return tuple((mark.x + s * x, mark.y + s * y) for x, y in unit[mark.shape])


def svg_element(drawing: Drawing) -> str:
    """Return an SVG element for a page."""
    parts = [
        f'<svg viewBox="0 0 {drawing.width} {drawing.height}" width="{drawing.width}" '
        f'height="{drawing.height}" role="img" '
        f'aria-label="{escape(drawing.title)}" font-family="{FONT}" fill="currentColor">'
    ]
    for part in drawing.parts:
        if isinstance(part, Line):
            places = " ".join(f"{x:.1f},{y:.1f}" for x, y in part.points)
            dash = f' stroke-dasharray="{part.dash:g} {0.6 * part.dash:g}"' if part.dash else ""
            parts.append(
                f'<polyline points="{places}" fill="none" stroke="{_svg_colour(part.colour)}" '
                f'stroke-opacity="{part.opacity:g}" stroke-width="{part.width:g}"{dash}/>'
            )
        elif isinstance(part, Mark):
            colour = _svg_colour(part.colour)
            style = f'fill="{colour if part.filled else "none"}" stroke="{colour}"'
            tip = f"<title>{escape(part.tip)}</title>"
            if part.shape == "circle":
                shape = f'<circle cx="{part.x:.1f}" cy="{part.y:.1f}" r="{part.size:g}"'
                end = "</circle>"
            else:
                places = " ".join(f"{x:.1f},{y:.1f}" for x, y in corners(part))
                shape, end = f'<polygon points="{places}"', "</polygon>"
            parts.append(f'{shape} {style} stroke-width="1.6">{tip}{end}')
        else:
            turn = f"translate({part.x:.1f} {part.y:.1f}) rotate(-90)"
            place = f'transform="{turn}"' if part.turned else f'x="{part.x:.1f}" y="{part.y:.1f}"'
            colour = "" if part.colour == INK else f' fill="{part.colour}"'
            parts.append(
                f'<text {place} text-anchor="{part.anchor}" font-size="{part.size:g}"{colour}>'
                f"{escape(part.text)}</text>"
            )
    return "".join([*parts, "</svg>"])


def svg_file(drawing: Drawing) -> str:
    """Return an SVG file: the element on white, in a dark colour of its own."""
    paper = f'<rect width="{drawing.width}" height="{drawing.height}" fill="{FILE_PAPER}"/>'
    head, rest = svg_element(drawing).split(">", 1)
    return f'{head} xmlns="{NAMESPACE}" color="{FILE_INK}">{paper}{rest}\n'


def png_file(drawing: Drawing, scale: int = 2) -> bytes:
    """Return a PNG file, ``scale`` pixels for each of the drawing's."""
    from PIL import Image, ImageDraw, ImageFont

    s = scale * OVERSAMPLING
    image = Image.new("RGB", (drawing.width * s, drawing.height * s), FILE_PAPER)
    pen = ImageDraw.Draw(image)
    for part in drawing.parts:
        if isinstance(part, Line):
            colour = _blended(part.colour, part.opacity)
            for start, end in _dashes(part):
                ends = [(s * x, s * y) for x, y in (start, end)]
                pen.line(ends, fill=colour, width=max(round(s * part.width), 1))
        elif isinstance(part, Mark):
            colour = _blended(part.colour, 1.0)
            fill = colour if part.filled else None
            if part.shape == "circle":
                x, y, r = s * part.x, s * part.y, s * (part.size + 0.8)
                pen.ellipse((x - r, y - r, x + r, y + r), fill, colour, round(1.6 * s))
            else:
                places = [(s * x, s * y) for x, y in corners(part)]
                if part.filled:
                    pen.polygon(places, fill=colour)
                pen.line([*places, *places[:2]], fill=colour, width=round(1.6 * s), joint="curve")
    image = image.resize((drawing.width * scale, drawing.height * scale), Image.Resampling.BOX)
    pen = ImageDraw.Draw(image)
    anchors = {"start": "ls", "middle": "ms", "end": "rs"}
    for part in drawing.parts:
        if not isinstance(part, Words):
            continue
        font = ImageFont.load_default(scale * part.size)
        colour = _blended(part.colour, 1.0)
        if not part.turned:
            place = (scale * part.x, scale * part.y)
            pen.text(place, part.text, colour, font, anchors[part.anchor])
            continue
        box = font.getbbox(part.text, anchor="ls")
        width, height = math.ceil(box[2] - box[0]) + 2, math.ceil(2 * scale * part.size)
        word = Image.new("L", (width, height), 0)
        ImageDraw.Draw(word).text((1, 0.75 * height), part.text, 255, font, "ls")
        word = word.rotate(90, expand=True)
        shift = {"start": width, "middle": width // 2, "end": 0}[part.anchor]
        corner = (round(scale * part.x - 0.75 * height), round(scale * part.y) - shift)
        image.paste(Image.new("RGB", word.size, colour), corner, word)
    buffer = io.BytesIO()
    image.quantize(128).save(buffer, "PNG", optimize=True)
    return buffer.getvalue()


def _svg_colour(colour: str) -> str:
    return "currentColor" if colour == INK else colour


def _blended(colour: str, opacity: float) -> tuple[int, int, int]:
    """Return a colour as it appears on the paper of files."""
    from PIL import ImageColor

    over = ImageColor.getrgb(FILE_INK if colour == INK else colour)[:3]
    r, g, b = (round(255 + (c - 255) * opacity) for c in over)
    return r, g, b


def _dashes(line: Line) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    """Return the pieces of a line that are drawn."""
    pieces = []
    for a, b in zip(line.points, line.points[1:], strict=False):
        length = math.dist(a, b)
        if not line.dash or length == 0.0:
            pieces.append((a, b))
            continue
        at = 0.0
        while at < length:
            t0, t1 = at / length, min((at + line.dash) / length, 1.0)
            pieces.append(
                (
                    (a[0] + t0 * (b[0] - a[0]), a[1] + t0 * (b[1] - a[1])),
                    (a[0] + t1 * (b[0] - a[0]), a[1] + t1 * (b[1] - a[1])),
                )
            )
            at += 1.6 * line.dash
    return pieces
