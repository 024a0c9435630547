"""Scatter plots with logarithmic axes as SVG text, for pages that load nothing.

Text and axes take the colour of the text around the picture (``currentColor``), points have
colours that can be told on white and on black: a plot reads the same on light and dark pages.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

WIDTH, HEIGHT = 560, 360
LEFT, RIGHT, TOP, BOTTOM = 64, 20, 14, 46
"""Margins of the axes [px]."""

LETTER, LINE = 6.2, 12.0
"""Width of a letter and height of a line of 11 px text, about [px]."""

LEAST_OCTAVES = 1.0
"""An axis spans at least a factor of 2 to either side of what it shows."""


@dataclass(frozen=True)
class Point:
    """One mark: ``low`` to ``high`` is the range of x that its whisker shows."""

    x: float
    y: float
    label: str
    colour: str
    low: float
    high: float
    on_front: bool = False


@dataclass(frozen=True)
class _Axis:
    """Maps a logarithm to pixels."""

    least: float
    most: float
    start: float
    end: float

    def __call__(self, value: float) -> float:
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


def pareto_front(pairs: Sequence[tuple[float, float]]) -> list[bool]:
    """Tell which pairs no other beats in one number without losing in the other.

    Equal pairs are on the front together.
    """
    return [
        not any(other[0] <= pair[0] and other[1] <= pair[1] and other != pair for other in pairs)
        for pair in pairs
    ]


def log_plot(
    points: Sequence[Point], title: str, x_label: str, y_label: str, *, labelled: bool = True
) -> str:
    """Return an SVG element; points with x or y not above 0 are put onto the axis.

    Points on the front are filled and joined by a line, others are rings. Labels that
    find no place are left out; every point has its label as a tooltip.
    """
    xs = [p.x for p in points if p.x > 0.0]
    ys = [p.y for p in points if p.y > 0.0]
    if not xs or not ys:
        return f"<p>{escape(title)}: there is nothing to show.</p>"
    x = _Axis.around(xs, LEFT, WIDTH - RIGHT)
    y = _Axis.around(ys, HEIGHT - BOTTOM, TOP)
    parts = [
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" '
        f'width="{WIDTH}" height="{HEIGHT}" role="img" aria-label="{escape(title)}" '
        'font-family="sans-serif" font-size="11" fill="currentColor">'
    ]
    parts += _axes(x, y, x_label, y_label)

    def place(point: Point) -> tuple[float, float]:
        return (
            x(point.x) if point.x > 0.0 else x.start,
            y(point.y) if point.y > 0.0 else y.start,
        )

    front = sorted(place(p) for p in points if p.on_front)
    if len(front) > 1:
        line = " ".join(f"{px:.1f},{py:.1f}" for px, py in front)
        parts.append(
            f'<polyline points="{line}" fill="none" stroke="currentColor" stroke-opacity="0.45" '
            'stroke-width="1.5" stroke-dasharray="5 3"/>'
        )
    taken = [(px - 5.0, py - 5.0, px + 5.0, py + 5.0) for px, py in map(place, points)]
    for point in sorted(points, key=lambda p: not p.on_front):  # the front is labelled first
        px, py = place(point)
        fill = point.colour if point.on_front else "none"
        if point.low > 0.0 and point.high > point.low:
            parts.append(
                f'<line x1="{x(point.low):.1f}" x2="{x(point.high):.1f}" y1="{py:.1f}" '
                f'y2="{py:.1f}" stroke="{point.colour}" stroke-opacity="0.6"/>'
            )
        tip = f"{point.label}: {point.x:.4g}, {point.y:.3g}"
        parts.append(
            f'<circle cx="{px:.1f}" cy="{py:.1f}" r="4.5" fill="{fill}" stroke="{point.colour}" '
            f'stroke-width="1.8"><title>{escape(tip)}</title></circle>'
        )
        if labelled:
            parts += _label(point.label, px, py, taken)
    return "".join([*parts, "</svg>"])


def _axes(x: _Axis, y: _Axis, x_label: str, y_label: str) -> list[str]:
    right, bottom = WIDTH - RIGHT, HEIGHT - BOTTOM
    grid = 'stroke="currentColor" stroke-opacity="0.15"'
    parts = []
    for tick in x.ticks():
        at = x(tick)
        parts.append(f'<line x1="{at:.1f}" x2="{at:.1f}" y1="{TOP}" y2="{bottom}" {grid}/>')
        parts.append(
            f'<text x="{at:.1f}" y="{bottom + 15}" text-anchor="middle">{_number(tick)}</text>'
        )
    for tick in y.ticks():
        at = y(tick)
        parts.append(f'<line x1="{LEFT}" x2="{right}" y1="{at:.1f}" y2="{at:.1f}" {grid}/>')
        parts.append(
            f'<text x="{LEFT - 6}" y="{at + 4:.1f}" text-anchor="end">{_number(tick)}</text>'
        )
    parts.append(
        f'<rect x="{LEFT}" y="{TOP}" width="{right - LEFT}" height="{bottom - TOP}" fill="none" '
        'stroke="currentColor" stroke-opacity="0.5"/>'
    )
    parts.append(
        f'<text x="{(LEFT + right) / 2:.0f}" y="{HEIGHT - 10}" text-anchor="middle" '
        f'font-size="12">{escape(x_label)}</text>'
    )
    middle = (TOP + bottom) / 2
    parts.append(
        f'<text transform="translate(14 {middle:.0f}) rotate(-90)" text-anchor="middle" '
        f'font-size="12">{escape(y_label)}</text>'
    )
    return parts


def _number(value: float) -> str:
    return f"{value:g}" if 1e-3 <= value < 1e5 else f"{value:.0e}".replace("e-0", "e-")


Box = tuple[float, float, float, float]


def _label(text: str, px: float, py: float, taken: list[Box]) -> list[str]:
    """Return the text beside a point where nothing is yet, and add its box to ``taken``."""
    width = LETTER * len(text)
    if not text:
        return []
    places = [
        (px + 8.0, py + 4.0), (px - 8.0 - width, py + 4.0), (px - width / 2.0, py - 8.0),
        (px - width / 2.0, py + 17.0), (px + 6.0, py - 7.0), (px + 6.0, py + 15.0),
        (px - 6.0 - width, py - 7.0), (px - 6.0 - width, py + 15.0),
    ]  # fmt: skip
    for left, base in places:
        box = (left, base - LINE + 2.0, left + width, base + 2.0)
        inside = box[0] >= LEFT and box[2] <= WIDTH - RIGHT
        inside = inside and box[1] >= TOP and box[3] <= HEIGHT - BOTTOM
        if inside and not any(_overlap(box, other) for other in taken):
            taken.append(box)
            return [f'<text x="{left:.1f}" y="{base:.1f}">{escape(text)}</text>']
    return []


def _overlap(a: Box, b: Box) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]
