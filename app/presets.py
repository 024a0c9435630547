"""Outlines to begin with, drawn about the origin.

Round shapes are cubic Bézier arcs with handles of 4/3 tan(angle / 4): the arc's
middle lies on the circle, and elsewhere it is outside by at most
2/27 sin⁶(angle/4) / cos²(angle/4) radii (Goldapp 1991): 2.7e-4 with four arcs,
4.2e-6 with eight, 3.7e-7 with twelve. `ARCS` is chosen for less than 1e-6.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from app.scene import (
    AnchorKind,
    BezierContour,
    Contour,
    CubicCurve,
    Outline,
    PolygonContour,
    SceneError,
    Vec2,
)

ARCS = 12
"""Arcs of a full turn; a multiple of four, so that quarters are whole."""

SYMMETRIC: AnchorKind = "symmetric"


def disk(radius: float = 1.0) -> Outline:
    """Return a disk; radius above 0."""
    _positive(radius=radius)
    return ellipse(radius, radius)


def ellipse(a: float = 1.0, b: float = 0.6) -> Outline:
    """Return an ellipse with half axes a along s and b along t, above 0."""
    return Outline((_ellipse_contour(a, b),))


def ring(outer: float = 1.0, inner: float = 0.6) -> Outline:
    """Return the area between two circles; 0 < inner < outer."""
    _positive(inner=inner)
    if not outer > inner:
        raise SceneError(f"ring: outer is {outer:g}, expected more than inner, {inner:g}")
    return Outline((_ellipse_contour(outer, outer), _ellipse_contour(inner, inner)))


def rounded_rectangle(width: float = 2.0, height: float = 1.2, radius: float = 0.3) -> Outline:
    """Return a rectangle whose corners are quarter circles, at most half the shorter side."""
    _positive(width=width, height=height, radius=radius)
    if radius > 0.5 * min(width, height):
        raise SceneError(
            f"rounded rectangle: radius is {radius:g}, expected at most half the shorter side, "
            f"{0.5 * min(width, height):g}"
        )
    right, top = 0.5 * width - radius, 0.5 * height - radius
    curves: list[CubicCurve] = []
    kinds: list[AnchorKind] = []
    quarter = ARCS // 4
    for turn, (s, t) in enumerate(((right, top), (-right, top), (-right, -top), (right, -top))):
        arcs = _arcs((s, t), radius, radius, turn * quarter, quarter)
        if curves and curves[-1][3] != arcs[0][0]:
            curves.append(_line(curves[-1][3], arcs[0][0]))
            kinds.append("smooth")
        curves += arcs
        kinds.append("smooth")
        kinds.extend([SYMMETRIC] * (quarter - 1))
    if curves[-1][3] != curves[0][0]:
        curves.append(_line(curves[-1][3], curves[0][0]))
        kinds.append("smooth")
    return Outline((BezierContour(tuple(curves), tuple(kinds)),))


def heart(size: float = 2.0) -> Outline:
    """Return a heart about ``size`` high and wide, above 0."""
    _positive(size=size)
    # Anchors: the tip, the right side, the top of the right lobe, the notch; then mirrored.
    right = (
        ((0.0, -0.5), (0.1, -0.36), (0.5, -0.14), (0.5, 0.18)),
        ((0.5, 0.18), (0.5, 0.36), (0.39, 0.47), (0.25, 0.47)),
        ((0.25, 0.47), (0.13, 0.47), (0.04, 0.4), (0.0, 0.27)),
    )
    left = tuple(tuple((-s, t) for s, t in reversed(curve)) for curve in reversed(right))
    curves = tuple(
        (_at(a, size), _at(b, size), _at(c, size), _at(d, size)) for a, b, c, d in (*right, *left)
    )
    kinds: tuple[AnchorKind, ...] = ("corner", "smooth", "smooth", "corner", "smooth", "smooth")
    return Outline((BezierContour(curves, kinds),))


def star(
    points: int = 5, outer: float = 1.0, inner: float = 0.45, roundness: float = 0.0
) -> Outline:
    """Return a star with its first tip up.

    Parameters
    ----------
    points : int
        Tips, 2 or more.
    outer, inner : float
        Distances of the tips and of the notches from the middle, above 0.
    roundness : float
        0 for straight edges, as a polygon; up to 1 for tips and notches that
        turn along circles about the middle.
    """
    _positive(outer=outer, inner=inner)
    if points < 2:
        raise SceneError(f"star: points is {points}, expected 2 or more")
    if not 0.0 <= roundness <= 1.0:
        raise SceneError(f"star: roundness is {roundness:g}, expected between 0 and 1")
    count = 2 * points
    radii = [outer if k % 2 == 0 else inner for k in range(count)]
    turns = [0.25 + k / count for k in range(count)]
    corners = [_on_circle(r, r, turn) for r, turn in zip(radii, turns, strict=True)]
    if roundness == 0.0:
        return Outline((PolygonContour(tuple(corners)),))
    curves = []
    for k in range(count):
        following = (k + 1) % count
        reach = roundness * math.pi / count
        ahead = _along_circle(corners[k], turns[k], radii[k] * reach)
        behind = _along_circle(corners[following], turns[following], -radii[following] * reach)
        curves.append((corners[k], ahead, behind, corners[following]))
    return Outline((BezierContour(tuple(curves), (SYMMETRIC,) * count),))


PRESETS: dict[str, Callable[[], Outline]] = {
    "Disk": disk,
    "Ellipse": ellipse,
    "Ring": ring,
    "Rounded rectangle": rounded_rectangle,
    "Heart": heart,
    "Star": star,
    "Round star": lambda: star(roundness=1.0),
}
"""By the name that a menu shows."""


def _positive(**lengths: float) -> None:
    for name, value in lengths.items():
        if not value > 0.0:
            raise SceneError(f"{name} is {value:g}, expected a number above 0")


def _ellipse_contour(a: float, b: float) -> Contour:
    _positive(a=a, b=b)
    return BezierContour(tuple(_arcs((0.0, 0.0), a, b, 0, ARCS)), (SYMMETRIC,) * ARCS)


def _arcs(centre: Vec2, a: float, b: float, first: int, count: int) -> list[CubicCurve]:
    """Return arcs of an ellipse, counter-clockwise from arc ``first`` of `ARCS`."""
    reach = 4.0 / 3.0 * math.tan(math.tau / ARCS / 4.0)
    arcs = []
    for k in range(first, first + count):
        s0, t0 = _on_circle(1.0, 1.0, (k % ARCS) / ARCS)
        s1, t1 = _on_circle(1.0, 1.0, ((k + 1) % ARCS) / ARCS)
        corners = (
            (s0, t0),
            (s0 - reach * t0, t0 + reach * s0),
            (s1 + reach * t1, t1 - reach * s1),
            (s1, t1),
        )
        p0, p1, p2, p3 = ((centre[0] + a * s, centre[1] + b * t) for s, t in corners)
        arcs.append((p0, p1, p2, p3))
    return arcs


def _on_circle(a: float, b: float, turn: float) -> Vec2:
    """Return (a cos, b sin) of a fraction of a full turn, exact at the quarters."""
    quarter, rest = divmod(4.0 * (turn % 1.0), 1.0)
    cos, sin = math.cos(0.5 * math.pi * rest), math.sin(0.5 * math.pi * rest)
    for _ in range(int(quarter)):
        cos, sin = -sin, cos
    return (a * cos, b * sin)


def _along_circle(point: Vec2, turn: float, distance: float) -> Vec2:
    cos, sin = _on_circle(1.0, 1.0, turn)
    return (point[0] - distance * sin, point[1] + distance * cos)


def _line(a: Vec2, b: Vec2) -> CubicCurve:
    third = ((b[0] - a[0]) / 3.0, (b[1] - a[1]) / 3.0)
    return (a, (a[0] + third[0], a[1] + third[1]), (b[0] - third[0], b[1] - third[1]), b)


def _at(point: Vec2, size: float) -> Vec2:
    return (size * point[0], size * point[1])
