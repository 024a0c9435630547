"""Scatter plots with logarithmic axes, for pages that load nothing and for files."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from app.cli.drawing import LETTER, Drawing, Line, Mark, Shape, Words

WIDTH, HEIGHT = 560, 380
LEFT, RIGHT, TOP, BOTTOM = 64, 20, 14, 46
"""Margins of the axes [px]."""

SIZE = 11.0
"""Of the letters at points and ticks [px]."""

LEAST_OCTAVES = 1.0
"""An axis spans at least a factor of 2 to either side of what it shows."""


@dataclass(frozen=True)
class Point:
    """One mark: ``low`` to ``high`` is the range of x that its whisker shows.

    Points of the same ``series`` are joined in their order, those of none by nothing.
    """

    x: float
    y: float
    label: str
    colour: str
    low: float
    high: float
    on_front: bool = False
    shape: Shape = "circle"
    series: str = ""


@dataclass(frozen=True)
class _Axis:
    """Maps a logarithm to pixels."""

    least: float
    most: float
    start: float
    end: float

    def __call__(self, value: float) -> float:
        if value <= 0.0:
            return self.start
        share = (math.log10(value) - self.least) / (self.most - self.least)
        return self.start + min(max(share, 0.0), 1.0) * (self.end - self.start)

    @classmethod
    def around(cls, values: Sequence[float], start: float, end: float) -> _Axis:
        logs = [math.log10(value) for value in values]
        margin = max(0.08 * (max(logs) - min(logs)), LEAST_OCTAVES * math.log10(2.0))
        return cls(min(logs) - margin, max(logs) + margin, start, end)

    def ticks(self) -> list[float]:
        """Return powers of ten; with 2 and 5 between them where those are few."""
        decades = range(math.floor(self.least), math.ceil(self.most) + 1)
        spread = self.most - self.least
        steps = (1,) if spread > 2.5 else (1, 2, 5)
        every = max(1, math.ceil(spread / 8.0))
        found = [s * 10.0**d for d in decades if d % every == 0 for s in steps]
        return [t for t in found if self.least <= math.log10(t) <= self.most]


def log_plot(
    points: Sequence[Point], title: str, x_label: str, y_label: str, *, labelled: bool = True
) -> Drawing | None:
    """Return a plot, or None if there is nothing to show.

    Points with x or y not above 0 are put onto the axis. Points on the front are filled and
    joined by a dashed line, others are rings. Labels that find no place are left out; every point
    has its label as a tooltip.
    """
    xs = [p.x for p in points if p.x > 0.0]
    ys = [p.y for p in points if p.y > 0.0]
    if not xs or not ys:
        return None
    x = _Axis.around(xs, LEFT, WIDTH - RIGHT)
    y = _Axis.around(ys, HEIGHT - BOTTOM, TOP)
    parts = _axes(x, y, x_label, y_label)
    for name in dict.fromkeys(p.series for p in points if p.series):
        chain = [p for p in points if p.series == name]
        places = tuple((x(p.x), y(p.y)) for p in chain)
        parts.append(Line(places, chain[0].colour, 0.35))
    front = tuple(sorted((x(p.x), y(p.y)) for p in points if p.on_front))
    if len(front) > 1:
        parts.append(Line(front, opacity=0.5, width=1.5, dash=5.0))
    taken = [(x(p.x) - 5.0, y(p.y) - 5.0, x(p.x) + 5.0, y(p.y) + 5.0) for p in points]
    # The front is labelled first, then short names, which are a technique's own.
    for point in sorted(points, key=lambda p: (not p.on_front, len(p.label))):
        px, py = x(point.x), y(point.y)
        if point.low > 0.0 and point.high > point.low:
            parts.append(Line(((x(point.low), py), (x(point.high), py)), point.colour, 0.5))
        tip = f"{point.label}: {point.x:.4g}, {point.y:.3g}"
        parts.append(Mark(px, py, point.shape, point.colour, point.on_front, tip=tip))
        if labelled:
            parts += _label(point, px, py, taken)
    return Drawing(WIDTH, HEIGHT, title, parts)


def _axes(x: _Axis, y: _Axis, x_label: str, y_label: str) -> list[Line | Mark | Words]:
    right, bottom = float(WIDTH - RIGHT), float(HEIGHT - BOTTOM)
    parts: list[Line | Mark | Words] = []
    for tick in x.ticks():
        at = x(tick)
        parts.append(Line(((at, TOP), (at, bottom)), opacity=0.15))
        parts.append(Words(at, bottom + 15.0, _number(tick), "middle", SIZE))
    for tick in y.ticks():
        at = y(tick)
        parts.append(Line(((LEFT, at), (right, at)), opacity=0.15))
        parts.append(Words(LEFT - 6.0, at + 4.0, _number(tick), "end", SIZE))
    frame = ((LEFT, TOP), (right, TOP), (right, bottom), (LEFT, bottom), (LEFT, TOP))
    parts.append(Line(tuple((float(a), float(b)) for a, b in frame), opacity=0.5))
    parts.append(Words((LEFT + right) / 2.0, HEIGHT - 10.0, x_label, "middle", 12.0))
    parts.append(Words(14.0, (TOP + bottom) / 2.0, y_label, "middle", 12.0, turned=True))
    return parts


def _number(value: float) -> str:
    return f"{value:g}" if 1e-3 <= value < 1e5 else f"{value:.0e}".replace("e-0", "e-")


Box = tuple[float, float, float, float]


def _label(point: Point, px: float, py: float, taken: list[Box]) -> list[Words]:
    """Return the text beside a point where nothing is yet, and add its box to ``taken``."""
    width = LETTER * SIZE * len(point.label)
    if not point.label:
        return []
    places = [
        (px + 8.0, py + 4.0), (px - 8.0 - width, py + 4.0), (px - width / 2.0, py - 8.0),
        (px - width / 2.0, py + 17.0), (px + 6.0, py - 7.0), (px + 6.0, py + 15.0),
        (px - 6.0 - width, py - 7.0), (px - 6.0 - width, py + 15.0),
    ]  # fmt: skip
    for left, base in places:
        box = (left, base - SIZE + 1.0, left + width, base + 2.0)
        inside = box[0] >= LEFT and box[2] <= WIDTH - RIGHT
        inside = inside and box[1] >= TOP and box[3] <= HEIGHT - BOTTOM
        if inside and not any(_overlap(box, other) for other in taken):
            taken.append(box)
            return [Words(left, base, point.label, size=SIZE)]
    return []


def _overlap(a: Box, b: Box) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]
