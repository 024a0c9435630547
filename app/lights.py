"""What one light is and what can be done to it: pure functions to a number or a new light.

Vertices, a polygon's corners and a curve's anchors, are named by (contour,
point), segments by (contour, segment); `app.contours` says what can be done to
them. What changes the outline itself forgets what it was made from (`source`).
An edit that is not possible raises `SceneError` with a sentence for the user.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import lru_cache
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app import contours, presets
from app.planes import metric_from_plane, normal_of, point_on
from app.scene import (
    AnchorKind,
    AreaLight,
    BezierContour,
    Contour,
    FillRule,
    Outline,
    Plane,
    PolygonContour,
    SceneError,
    Vec2,
    Vec3,
)
from app.vectors import (
    add,
    cross,
    dot,
    length,
    mix,
    normalize,
    perpendicular,
    rotate,
    scale,
    subtract,
)

FloatArray = NDArray[np.float64]
Vertex: TypeAlias = tuple[int, int]
Hole: TypeAlias = Literal["square", "round"]

FINE = 1e-3
"""How far `widest_place` and `bounds_of` may miss a curve, in sizes of the outline."""

FINENESS = {"coarse": 1e-2, "medium": 1e-3, "fine": 1e-4}
"""How far polygons made of curves may miss them, in sizes of the light; for `to_polygon`."""


def vertices_of(light: AreaLight) -> list[tuple[Vertex, Vec2]]:
    """Return ((contour, point), (s, t)) for every vertex of the light."""
    return [
        ((c, p), point)
        for c, contour in enumerate(light.outline.contours)
        for p, point in enumerate(contours.points_of(contour))
    ]


def is_curved(light: AreaLight) -> bool:
    """Tell whether the light has a contour of curves, be they straight."""
    return any(isinstance(contour, BezierContour) for contour in light.outline.contours)


def word_for_vertex(contour: Contour) -> str:
    """Return what people call a vertex of the contour: a corner, or an anchor of curves."""
    return "corner" if isinstance(contour, PolygonContour) else "anchor"


def extent_of(light: AreaLight) -> tuple[Vec2, Vec2]:
    """Return the lower and upper corner of the outline's bounding box, in (s, t)."""
    return contours.bounds(light.outline)


def centre_of(light: AreaLight) -> Vec3:
    """Return the world position of the centre of the outline's bounding box on the plane."""
    return point_on(light.plane, mix(*extent_of(light), 0.5))


def bounds_of(light: AreaLight) -> tuple[Vec3, float]:
    """Return centre and radius [m] of a sphere around the light, about `centre_of`."""
    return centre_of(light), _radius(light.outline, light.plane)


@lru_cache(maxsize=64)
def _radius(outline: Outline, plane: Plane) -> float:
    middle = np.array(mix(*contours.bounds(outline), 0.5)) @ metric_from_plane(plane).T
    loops, tolerance = _loops(outline, plane)
    away = np.concatenate(loops) - middle
    return float(np.linalg.norm(away, axis=-1).max()) + tolerance


def _loops(outline: Outline, plane: Plane) -> tuple[list[FloatArray], float]:
    """Return the contours as polygons (n, 2) [m] and how far they may miss curves [m]."""
    metric = metric_from_plane(plane)
    (s0, t0), (s1, t1) = contours.bounds(outline)
    size = float(np.abs(metric @ np.diag((s1 - s0, t1 - t0))).sum())
    tolerance = FINE * max(size, 1e-30)
    loops = [
        contours.flatten(contour, tolerance, metric) @ metric.T for contour in outline.contours
    ]
    curved = any(isinstance(contour, BezierContour) for contour in outline.contours)
    return loops, tolerance if curved else 0.0


def _with_contours(light: AreaLight, changed: Iterable[Contour]) -> AreaLight:
    return replace(light, outline=replace(light.outline, contours=tuple(changed)), source=None)


def _with_contour(light: AreaLight, contour: int, *by: Contour) -> AreaLight:
    """Return the light with others in the place of a contour, itself if it is the same one."""
    own = light.outline.contours
    if by == (own[contour],):
        return light
    return _with_contours(light, (*own[:contour], *by, *own[contour + 1 :]))


# Vertices, handles and segments


def move_vertex(light: AreaLight, vertex: Vertex, to: Vec2) -> AreaLight:
    """Put one vertex at plane coordinates ``to``; handles move along."""
    contour, point = vertex
    old = light.outline.contours[contour]
    metric = metric_from_plane(light.plane)
    return _with_contour(light, contour, contours.move_point(old, point, to, metric))


def move_handle(
    light: AreaLight, contour: int, segment: int, which: int, to: Vec2, *, free: bool = False
) -> AreaLight:
    """Put a handle at plane coordinates ``to``, see `contours.move_handle`."""
    old = _bezier(light, contour)
    metric = metric_from_plane(light.plane)
    moved = contours.move_handle(old, segment, which, to, free=free, metric=metric)
    return _with_contour(light, contour, moved)


def retract_handle(light: AreaLight, contour: int, segment: int, which: int) -> AreaLight:
    """Lay a handle on its anchor."""
    old = _bezier(light, contour)
    return _with_contour(light, contour, contours.retract_handle(old, segment, which))


def _bezier(light: AreaLight, contour: int) -> BezierContour:
    found = light.outline.contours[contour]
    if isinstance(found, BezierContour):
        return found
    raise SceneError(f"light '{light.name}': contour {contour} is a polygon and has no handles")


def set_kind(light: AreaLight, vertex: Vertex, kind: AnchorKind) -> AreaLight:
    """Make a vertex a corner, smooth or symmetric; a polygon becomes curves unless a corner."""
    contour, point = vertex
    old = light.outline.contours[contour]
    if isinstance(old, PolygonContour) and kind == "corner":
        return light
    metric = metric_from_plane(light.plane)
    return _with_contour(light, contour, contours.set_kind(old, point, kind, metric))


def nearest_edge(light: AreaLight, at: Vec2) -> tuple[int, int, float]:
    """Return (contour, segment, parameter along it) of the boundary point nearest to ``at``.

    Segment i leads from point i to the next. Distances are metres on the plane,
    so a skew plane is no obstacle.
    """
    metric = metric_from_plane(light.plane)
    found = [contours.nearest(contour, at, metric) for contour in light.outline.contours]
    best = min(range(len(found)), key=lambda index: found[index][0])
    return best, found[best][1], found[best][2]


def point_along(light: AreaLight, contour: int, segment: int, along: float) -> Vec2:
    """Return the plane coordinates of a place on a segment."""
    return contours.point_at(light.outline.contours[contour], segment, along)


def add_vertex(light: AreaLight, contour: int, segment: int, along: float = 0.5) -> AreaLight:
    """Split a segment at the parameter ``along``, the shape unchanged.

    The new point has index segment + 1.
    """
    old = light.outline.contours[contour]
    return _with_contour(light, contour, contours.insert(old, segment, along))


def remove_vertex(light: AreaLight, vertex: Vertex) -> AreaLight:
    """Remove one vertex. A contour without an inside is removed whole if others remain.

    Raises
    ------
    SceneError
        If it is the light's last contour, and has no vertex to spare.
    """
    contour, point = vertex
    rest = contours.remove(light.outline.contours[contour], point)
    if rest is not None:
        return _with_contour(light, contour, rest)
    return remove_contour(light, contour)


def straighten(light: AreaLight, contour: int, segment: int) -> AreaLight:
    """Make a segment a straight line."""
    old = light.outline.contours[contour]
    return _with_contour(light, contour, contours.straighten(old, segment))


def bend(light: AreaLight, contour: int, segment: int) -> AreaLight:
    """Give a straight segment handles; a polygon becomes curves. The shape stays."""
    old = light.outline.contours[contour]
    return _with_contour(light, contour, contours.bend(old, segment))


# Contours


def remove_contour(light: AreaLight, contour: int) -> AreaLight:
    """Remove one closed curve, a hole for instance.

    Raises
    ------
    SceneError
        If it is the only one.
    """
    own = light.outline.contours
    if len(own) == 1:
        count, word = contours.size_of(own[0]), word_for_vertex(own[0])
        fewest = 3 if isinstance(own[0], PolygonContour) else 2
        raise SceneError(
            f"light '{light.name}' has only this outline of {count} {word}s; "
            f"{fewest} is the fewest a light can have"
        )
    return _with_contours(light, own[:contour] + own[contour + 1 :])


def reverse_contour(light: AreaLight, contour: int) -> AreaLight:
    """Let a contour wind the other way, which matters under the nonzero rule."""
    return _with_contour(light, contour, contours.reverse(light.outline.contours[contour]))


def split_contour(light: AreaLight, contour: int, first: int, second: int) -> AreaLight:
    """Cut a contour in two along the line between two of its points.

    The second part comes right after the first.

    Raises
    ------
    SceneError
        If a part would have no inside.
    """
    parts = contours.split(light.outline.contours[contour], first, second)
    return _with_contour(light, contour, *parts)


def to_bezier(light: AreaLight, contour: int | None = None) -> AreaLight:
    """Make curves of a polygon, or of all, the shape unchanged."""
    return _with_each(light, contour, contours.to_bezier)


def to_polygon(light: AreaLight, fineness: float, contour: int | None = None) -> AreaLight:
    """Make a polygon of curves, or of all, within ``fineness`` times the light's size."""
    metric = metric_from_plane(light.plane)
    tolerance = fineness * size_of(light)
    return _with_each(light, contour, lambda old: contours.to_polygon(old, tolerance, metric))


def set_fill_rule(light: AreaLight, rule: FillRule) -> AreaLight:
    """Decide anew what is inside where contours overlap."""
    return replace(light, outline=replace(light.outline, fill_rule=rule), source=None)


def size_of(light: AreaLight) -> float:
    """Return the longer side [m] of the outline's bounding box, as the plane stretches it."""
    (s0, t0), (s1, t1) = extent_of(light)
    return max((s1 - s0) * length(light.plane.u), (t1 - t0) * length(light.plane.v), 1e-30)


def _with_each(
    light: AreaLight, contour: int | None, change: Callable[[Contour], Contour]
) -> AreaLight:
    own = light.outline.contours
    changed = tuple(change(old) if contour in (None, i) else old for i, old in enumerate(own))
    return _with_contours(light, changed) if changed != own else light


# Holes


def _winding_and_clearance(
    loops: list[FloatArray], points: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return winding numbers (n,) and distances to the boundary (n,) of points (n, 2)."""
    winding = np.zeros(len(points))
    clearance = np.full(len(points), np.inf)
    for loop in loops:
        a = loop[None] - points[:, None]
        way = np.roll(loop, -1, axis=0) - loop
        b = a + way
        turn = np.arctan2(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0], (a * b).sum(-1))
        winding += np.rint(turn.sum(-1) / (2.0 * np.pi))
        squares = (way**2).sum(-1)
        along = np.clip(-(a * way).sum(-1) / np.where(squares > 0.0, squares, 1.0), 0.0, 1.0)
        gap = np.linalg.norm(a + along[..., None] * way, axis=-1)
        clearance = np.minimum(clearance, gap.min(-1))
    return winding, clearance


def widest_place(light: AreaLight) -> tuple[FloatArray, float, int]:
    """Return the filled point farthest from the outline, its distance, its winding number.

    Returns
    -------
    point : (2,) float64
        In metres, by `metric_from_plane`.
    clearance : float
        [m], to about a hundredth; 0 if nothing is filled.
    winding : int
        How often the contours go around the point, counter-clockwise.

    Notes
    -----
    A grid of 33 x 33 over the bounding box, refined five times about its best
    point: the "pole of inaccessibility" without a cell queue. Curves count as
    polygons within `FINE`.
    """
    loops, _ = _loops(light.outline, light.plane)
    corners = np.concatenate(loops)
    low, high = corners.min(0), corners.max(0)
    centre, half = (low + high) / 2.0, (high - low) / 2.0
    best = (centre, 0.0, 0)
    for _ in range(5):
        steps = np.linspace(-1.0, 1.0, 33)
        grid = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
        points = centre + grid * half
        winding, clearance = _winding_and_clearance(loops, points)
        filled = winding % 2 != 0 if light.outline.fill_rule == "evenodd" else winding != 0
        clearance = np.where(filled, clearance, 0.0)
        index = int(clearance.argmax())
        if clearance[index] > best[1]:
            best = (points[index], float(clearance[index]), int(winding[index]))
        centre, half = best[0], half / 8.0
    return best


def add_hole(light: AreaLight, shape: Hole = "square") -> AreaLight:
    """Cut a hole into the widest filled place, half as wide as fits.

    Raises
    ------
    SceneError
        If the outline is empty, or contours overlap there under the nonzero rule.
    """
    place, clearance, winding = widest_place(light)
    if clearance <= 0.0:
        raise SceneError(f"light '{light.name}' has no filled part to cut a hole into")
    if light.outline.fill_rule == "nonzero" and abs(winding) != 1:
        raise SceneError(
            f"light '{light.name}': {abs(winding)} contours overlap where the hole would be; "
            "change the fill rule to even-odd first"
        )
    half = 0.5 * clearance
    hole: Contour = PolygonContour(((-half, -half), (half, -half), (half, half), (-half, half)))
    if shape == "round":
        (hole,) = presets.disk(half).contours
    if winding > 0:
        hole = contours.reverse(hole)
    to_plane = np.asarray(np.linalg.inv(metric_from_plane(light.plane)), dtype=np.float64)
    hole = contours.transform(hole, to_plane, to_plane @ place)
    return _with_contours(light, (*light.outline.contours, hole))


# Placement


def move_light(light: AreaLight, shift: Vec3) -> AreaLight:
    """Move the light's plane by a vector [m]."""
    return replace(light, plane=replace(light.plane, origin=add(light.plane.origin, shift)))


def rotate_light(light: AreaLight, axis: Vec3, angle: float) -> AreaLight:
    """Turn the light about its centre by ``angle`` [rad] around a world axis."""
    centre, axis = centre_of(light), normalize(axis)
    plane = light.plane
    return replace(
        light,
        plane=Plane(
            add(centre, rotate(subtract(plane.origin, centre), axis, angle)),
            rotate(plane.u, axis, angle),
            rotate(plane.v, axis, angle),
        ),
    )


def aim(light: AreaLight, at: Vec3) -> AreaLight:
    """Turn the light about its centre, by the shortest way, so that it faces a point.

    Raises
    ------
    SceneError
        If the point is the light's centre.
    """
    way = subtract(at, centre_of(light))
    if length(way) < 1e-9:
        raise SceneError(f"light '{light.name}' cannot be aimed at its own centre")
    normal, wanted = normal_of(light.plane), normalize(way)
    axis = cross(normal, wanted)
    angle = math.atan2(length(axis), dot(normal, wanted))
    if length(axis) < 1e-12:
        axis = perpendicular(normal)
    return rotate_light(light, axis, angle)


def flip_light(light: AreaLight) -> AreaLight:
    """Make the light emit to its other side, the shape unchanged in the world.

    Text and drawings are turned about instead, so that they can be read from
    the side that shines now.
    """
    if light.source is not None:
        return rotate_light(light, normalize(light.plane.v), math.pi)
    return replace(
        light,
        plane=replace(light.plane, u=scale(light.plane.u, -1.0)),
        outline=replace(
            light.outline, contours=tuple(map(contours.mirror, light.outline.contours))
        ),
    )


def regular_polygon(corners: int, radius: float = 1.0) -> PolygonContour:
    """Return a regular polygon about the origin, counter-clockwise, standing on an edge."""
    start = -math.pi / 2.0 - math.pi / corners
    angles = [start + 2.0 * math.pi * i / corners for i in range(corners)]
    return PolygonContour(tuple((radius * math.cos(a), radius * math.sin(a)) for a in angles))
