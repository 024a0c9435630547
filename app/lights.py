"""What one light is and what can be done to it: pure functions to a number or a new light.

Vertices are named by (contour, point). An edit that is not possible raises
`SceneError` with a sentence for the user.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from app.planes import metric_from_plane, normal_of, point_on
from app.scene import AreaLight, Plane, PolygonContour, SceneError, Vec2, Vec3
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


def vertices_of(light: AreaLight) -> list[tuple[tuple[int, int], Vec2]]:
    """Return ((contour, point), (s, t)) for every vertex of the light."""
    return [
        ((c, p), point)
        for c, contour in enumerate(light.outline.contours)
        for p, point in enumerate(contour.points)
    ]


def extent_of(light: AreaLight) -> tuple[Vec2, Vec2]:
    """Return the lower and upper corner of the outline's bounding box, in (s, t)."""
    points = np.concatenate([np.array(contour.points) for contour in light.outline.contours])
    (s0, t0), (s1, t1) = points.min(0).tolist(), points.max(0).tolist()
    return (s0, t0), (s1, t1)


def centre_of(light: AreaLight) -> Vec3:
    """Return the world position of the centre of the outline's bounding box on the plane."""
    return point_on(light.plane, mix(*extent_of(light), 0.5))


def bounds_of(light: AreaLight) -> tuple[Vec3, float]:
    """Return centre and radius [m] of a sphere around the light, about `centre_of`."""
    middle = np.array(mix(*extent_of(light), 0.5))
    points = np.concatenate([np.array(contour.points) for contour in light.outline.contours])
    away = (points - middle) @ np.array([light.plane.u, light.plane.v])
    return centre_of(light), float(np.linalg.norm(away, axis=-1).max())


def _with_contour(light: AreaLight, contour: int, points: Iterable[Vec2]) -> AreaLight:
    contours = list(light.outline.contours)
    contours[contour] = PolygonContour(tuple(points))
    return replace(light, outline=replace(light.outline, contours=tuple(contours)))


def move_vertex(light: AreaLight, vertex: tuple[int, int], to: Vec2) -> AreaLight:
    """Put one vertex at plane coordinates ``to``."""
    contour, point = vertex
    points = list(light.outline.contours[contour].points)
    points[point] = (float(to[0]), float(to[1]))
    return _with_contour(light, contour, points)


def nearest_edge(light: AreaLight, at: Vec2) -> tuple[int, int, float]:
    """Return (contour, edge, position along it in [0, 1]) of the boundary point nearest to ``at``.

    Edge i leads from point i to the next. Distances are metres on the plane,
    so a skew plane is no obstacle.
    """
    metric = metric_from_plane(light.plane)
    target = metric @ np.asarray(at)
    best = (math.inf, (0, 0, 0.0))
    for c, contour in enumerate(light.outline.contours):
        points = np.asarray(contour.points) @ metric.T
        ways = np.roll(points, -1, axis=0) - points
        squares = (ways**2).sum(-1)
        along = ((target - points) * ways).sum(-1) / np.where(squares > 0.0, squares, 1.0)
        along = np.clip(along, 0.0, 1.0)
        distances = np.linalg.norm(points + along[:, None] * ways - target, axis=-1)
        edge = int(distances.argmin())
        best = min(best, (float(distances[edge]), (c, edge, float(along[edge]))))
    return best[1]


def add_vertex(light: AreaLight, contour: int, edge: int, along: float = 0.5) -> AreaLight:
    """Split an edge at the fraction ``along`` of its way; the new point has index edge + 1."""
    points = list(light.outline.contours[contour].points)
    new = mix(points[edge], points[(edge + 1) % len(points)], along)
    points.insert(edge + 1, new)
    return _with_contour(light, contour, points)


def remove_vertex(light: AreaLight, vertex: tuple[int, int]) -> AreaLight:
    """Remove one vertex. A triangle is removed whole if other contours remain.

    Raises
    ------
    SceneError
        If it is the light's last triangle.
    """
    contour, point = vertex
    points = light.outline.contours[contour].points
    if len(points) > 3:
        return _with_contour(light, contour, points[:point] + points[point + 1 :])
    return remove_contour(light, contour)


def remove_contour(light: AreaLight, contour: int) -> AreaLight:
    """Remove one closed curve, a hole for instance.

    Raises
    ------
    SceneError
        If it is the only one.
    """
    contours = light.outline.contours
    if len(contours) == 1:
        raise SceneError(
            f"light '{light.name}' has only this outline of {len(contours[0].points)} corners; "
            "3 is the fewest a light can have"
        )
    rest = contours[:contour] + contours[contour + 1 :]
    return replace(light, outline=replace(light.outline, contours=rest))


def _winding_and_clearance(
    contours: list[FloatArray], points: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return winding numbers (n,) and distances to the boundary (n,) of points (n, 2)."""
    winding = np.zeros(len(points))
    clearance = np.full(len(points), np.inf)
    for loop in contours:
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
    point: the "pole of inaccessibility" without a cell queue.
    """
    metric = metric_from_plane(light.plane)
    contours = [np.asarray(contour.points) @ metric.T for contour in light.outline.contours]
    corners = np.concatenate(contours)
    low, high = corners.min(0), corners.max(0)
    centre, half = (low + high) / 2.0, (high - low) / 2.0
    best = (centre, 0.0, 0)
    for _ in range(5):
        steps = np.linspace(-1.0, 1.0, 33)
        grid = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
        points = centre + grid * half
        winding, clearance = _winding_and_clearance(contours, points)
        filled = winding % 2 != 0 if light.outline.fill_rule == "evenodd" else winding != 0
        clearance = np.where(filled, clearance, 0.0)
        index = int(clearance.argmax())
        if clearance[index] > best[1]:
            best = (points[index], float(clearance[index]), int(winding[index]))
        centre, half = best[0], half / 8.0
    return best


def add_hole(light: AreaLight) -> AreaLight:
    """Cut a square hole into the widest filled place, half as wide as fits.

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
    square = np.array([(-half, -half), (half, -half), (half, half), (-half, half)])
    if winding > 0:
        square = square[::-1]
    points = (place + square) @ np.linalg.inv(metric_from_plane(light.plane)).T
    hole = PolygonContour(tuple((float(s), float(t)) for s, t in points))
    return replace(light, outline=replace(light.outline, contours=(*light.outline.contours, hole)))


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
    """Make the light emit to its other side, the shape unchanged in the world."""
    contours = tuple(
        PolygonContour(tuple((-s, t) for s, t in reversed(contour.points)))
        for contour in light.outline.contours
    )
    return replace(
        light,
        plane=replace(light.plane, u=scale(light.plane.u, -1.0)),
        outline=replace(light.outline, contours=contours),
    )


def regular_polygon(corners: int, radius: float = 1.0) -> PolygonContour:
    """Return a regular polygon about the origin, counter-clockwise, standing on an edge."""
    start = -math.pi / 2.0 - math.pi / corners
    angles = [start + 2.0 * math.pi * i / corners for i in range(corners)]
    return PolygonContour(tuple((radius * math.cos(a), radius * math.sin(a)) for a in angles))
