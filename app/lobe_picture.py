"""The pictures of lobes: values to colours, and the lines and marks that belong over them.

Everything is in the coordinates of `ltc.lobe`'s disk, so that the panel and the figures of
``ltc-viewer lobe`` draw the same things, each in its own way.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.colour_maps import BERLIN, MAGMA, colours_at
from ltc.lobe import Case, LobePair, Window, disk_from_direction, pictures

FloatArray = NDArray[np.float64]
Kind: TypeAlias = Literal["rim", "grid", "angle"]
Ticks: TypeAlias = tuple[tuple[float, str], ...]

DECADES, DIFFERENCE_DECADES = 4, 2
"""Powers of ten below the peak that logarithmic scales show: of the lobes, of the difference,
which is black below a hundredth of the peak."""

ANGLES = (60, 30, 20, 10, 5, 2, 1, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002)
"""Radii of rings about the mirror direction [degrees]."""

NAMES = ("GGX", "LTC", "LTC − GGX")
"""The pictures of `lobe_images`."""


@dataclass(frozen=True, slots=True)
class Scale:
    """From values to places on a map: one scale for both lobes and their difference.

    Attributes
    ----------
    peak : float, > 0
        The largest value [1/sr].
    logarithmic : bool
        Over powers of ten, or linear from 0.
    """

    peak: float
    logarithmic: bool

    def place(self, values: FloatArray) -> FloatArray:
        """Return the places in [0, 1] of values of 0 or more."""
        return self._place(values, DECADES)

    def signed_place(self, differences: FloatArray) -> FloatArray:
        """Return the places in [0, 1] of differences; 0 is in the middle."""
        reach = self._place(np.abs(differences), DIFFERENCE_DECADES)
        return np.asarray(0.5 + 0.5 * np.sign(differences) * reach)

    def _place(self, values: FloatArray, decades: int) -> FloatArray:
        share = np.maximum(values / self.peak, 10.0**-decades if self.logarithmic else 0.0)
        return np.asarray(1.0 + np.log10(share) / decades if self.logarithmic else share)

    def ticks(self) -> Ticks:
        """Return places and texts of the lobes' scale, the most wanted first."""
        if not self.logarithmic:
            return tuple((share, number(share * self.peak)) for share in (1.0, 0.0, 0.5))
        values = self._powers(DECADES)
        return tuple((float(self.place(np.array(value))), number(value)) for value in values)

    def signed_ticks(self) -> Ticks:
        """Return the same of the difference's scale."""
        high = self._powers(DIFFERENCE_DECADES) if self.logarithmic else [self.peak]
        upper = [(float(self.signed_place(np.array(value))), number(value)) for value in high]
        both = [
            tick for place, text in upper for tick in ((place, text), (1.0 - place, f"−{text}"))
        ]
        return ((0.5, "0"), *both)

    def _powers(self, decades: int) -> list[float]:
        """Return the powers of ten on a logarithmic scale, the largest first."""
        last = math.floor(math.log10(self.peak) + 1e-9)
        powers = [10.0**power for power in range(last, last - decades - 1, -1)]
        return [power for power in powers if power > self.peak * 10.0**-decades]


def number(value: float) -> str:
    """Return a number of the scale: plain where that is short, else with its power of ten."""
    text = f"{value:.3g}"
    if "e" not in text and (value == 0.0 or value >= 1e-3):
        return text
    mantissa, power = f"{value:.1e}".split("e")
    return f"{mantissa.removesuffix('.0')}e{int(power)}"


def lobe_images(
    pair: LobePair, size: int, window: Window, scale: Scale
) -> tuple[NDArray[np.uint8], NDArray[np.uint8], NDArray[np.uint8]]:
    """Return GGX, LTC, and LTC less GGX as pictures, (size, size, 4) sRGB and coverage.

    Row 0 is at the top; the disk's rim is smooth.
    """
    ggx, ltc = pictures(pair, size, window)
    outside = np.isnan(ggx)
    ggx, ltc = np.where(outside, 0.0, ggx), np.where(outside, 0.0, ltc)
    step = window.half * ((2.0 * np.arange(size) + 1.0) / size - 1.0)
    x, y = np.meshgrid(window.x + step, window.y - step)
    edge = (1.0 - np.hypot(x, y)) / (2.0 * window.half / size)  # in pixels
    alpha = np.rint(255.0 * np.clip(edge + 0.5, 0.0, 1.0)).astype(np.uint8)[..., None]
    layers = (
        (MAGMA, scale.place(ggx)),
        (MAGMA, scale.place(ltc)),
        (BERLIN, scale.signed_place(ltc - ggx)),
    )
    first, second, third = (
        np.concatenate([np.rint(colours_at(*layer)).astype(np.uint8), alpha], axis=-1)
        for layer in layers
    )
    return first, second, third


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """A line over the disk, (n, 2), and what to write at its last point."""

    kind: Kind
    points: FloatArray
    label: str = ""


@dataclass(frozen=True, slots=True)
class Mark:
    """A direction that matters: its name and its place in the disk."""

    name: Literal["normal", "view", "mirror", "tangent"]
    x: float
    y: float


def marks(case: Case) -> tuple[Mark, ...]:
    """Return the marks of normal, view, its mirror direction, and the tangent in the horizon.

    Without the tangent where it does not matter.
    """
    places = (("view", case.wo), ("mirror", case.mirror))
    found = [Mark("normal", 0.0, 0.0)]
    for name, w in places:
        x, y = disk_from_direction(w).tolist()
        found.append(Mark(name, x, y))  # type: ignore[arg-type]
    return (*found, Mark("tangent", 1.0, 0.0)) if case.is_anisotropic else tuple(found)


def graticule(case: Case, window: Window) -> tuple[Line, ...]:
    """Return the horizon, circles at 30 and 60 degrees to the normal, axes; or angles.

    Where the window is a small part of the disk, circles about the mirror direction take the
    place of the others: the outer one fits into the window.
    """
    t = np.linspace(0.0, 2.0 * np.pi, 361)
    circle = np.stack([np.cos(t), np.sin(t)], axis=-1)
    lines = [Line("rim", _near(circle, window))]
    if window.zoom <= 2:
        lines += [
            Line("grid", circle * math.sqrt(1.0 - math.cos(math.radians(degrees))), f"{degrees}°")
            for degrees in (30, 60)
        ]
        ends = np.array([[-1.0, 0.0], [1.0, 0.0]])
        return (*lines, Line("grid", ends), Line("grid", ends[:, ::-1]))
    m = case.mirror
    e1 = np.array([m[2], 0.0, -m[0]]) / math.hypot(m[0], m[2])
    ring = np.cos(t)[:, None] * e1 + np.sin(t)[:, None] * np.cross(m, e1)
    # The disk is narrowed and stretched by up to 2 at the horizon, by 1/sqrt(2) at the normal.
    wanted = [d for d in ANGLES if math.radians(d) < 1.2 * window.half][:2]
    for degrees in wanted:
        rho = math.radians(degrees)
        w = math.cos(rho) * m + math.sin(rho) * ring
        for run in _above(w):
            lines.append(Line("angle", disk_from_direction(run), f"{degrees:g}°"))
    return tuple(lines)


def _near(points: FloatArray, window: Window) -> FloatArray:
    """Return a circle's points, many where the window shows a little of it."""
    if window.zoom == 1:
        return points
    middle = math.atan2(window.y, window.x)
    t = middle + 4.0 * window.half * np.linspace(-1.0, 1.0, 65)
    return np.stack([np.cos(t), np.sin(t)], axis=-1)


def _above(w: FloatArray) -> list[FloatArray]:
    """Return the runs of a line of directions (n, 3) that are above the surface."""
    up = w[:, 2] > 0.0
    ends = np.flatnonzero(np.diff(up.astype(np.int8))) + 1
    return [run for run in np.split(w, ends) if run[0, 2] > 0.0 and len(run) > 1]


def directions_above(
    world: FloatArray, position: FloatArray, frame: FloatArray
) -> list[FloatArray]:
    """Return what a point sees above its surface of lines in space.

    Parameters
    ----------
    world : (n, 3) float64
        Points of one line, one after the other [m].
    position : (3,) float64
    frame : (3, 3) float64
        Rows x, y, z of the point's shading frame.

    Returns
    -------
    list of (k, 2) float64
        Places in the disk; a line that goes below the surface ends at the horizon.
    """
    local = (world - position) @ frame.T
    a, b = local[:-1], local[1:]
    crossing = (a[:, 2] > 0.0) != (b[:, 2] > 0.0)
    share = a[crossing, 2] / (a[crossing, 2] - b[crossing, 2])
    ends = a[crossing] + share[:, None] * (b[crossing] - a[crossing])
    # Both runs that meet at a crossing end at it, a hair above the surface.
    at = np.flatnonzero(crossing) + 1
    lengths = np.linalg.norm(local, axis=-1, keepdims=True)
    unit = local / np.maximum(lengths, 1e-300)
    ends = ends / np.maximum(np.linalg.norm(ends, axis=-1, keepdims=True), 1e-300)
    ends[:, 2] = 1e-12
    return [disk_from_direction(run) for run in _above(np.insert(unit, at, ends, axis=0))]
