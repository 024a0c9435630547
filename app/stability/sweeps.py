"""The sweeps: which lights are seen from which points, as functions of numbers in [0, 1).

A sweep has *clouds*, points that fill a region of parameters, given by `DIMENSIONS` numbers
each, and *series*, along which one parameter runs finely, so that a jump between neighbours shows.
Numbers are low-discrepancy in ``ltc-viewer stability`` and drawn by hypothesis in
``tests/gl/test_stability.py``.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri

from app.curves import evaluate
from app.outline import boundary
from app.presets import heart, ring
from app.scene import ALPHA_MIN, AreaLight, Outline, Plane
from app.stability.lights import (
    POLYGONS,
    SQUARE,
    STAR,
    THIN,
    control_points,
    curved,
    lamp,
    letter,
    polygons,
    random_plane,
    random_polygon,
)
from app.stability.points import FloatArray, Points, across, unit

DIMENSIONS = 12
"""Numbers that a point of a cloud is made from."""

STEEPEST = 89.9
"""Of the views' angles from the normal [degrees]."""

Placing: TypeAlias = Callable[[FloatArray], Points]


@dataclass(frozen=True, slots=True)
class Cloud:
    """A light and points about it; ``place`` takes numbers (n, `DIMENSIONS`) in [0, 1).

    Where ``defined`` is false the integral has no value, because points lie on the outline.
    """

    name: str
    light: AreaLight
    place: Placing
    defined: bool = True


@dataclass(frozen=True, slots=True)
class Series:
    """A light and points along a path; ``place`` takes places (n) in [0, 1]."""

    name: str
    light: AreaLight
    place: Placing


@dataclass(frozen=True, slots=True)
class Sweep:
    """One way into the extreme; ``about`` says which, in a sentence for the page."""

    name: str
    about: str
    clouds: tuple[Cloud, ...]
    series: tuple[Series, ...]


@dataclass(frozen=True, slots=True)
class Ranges:
    """From where to where clouds go.

    ``alpha`` logarithmic, ``theta`` of the view [degrees], ``distance`` from the light in its
    sizes, logarithmic; ``edge`` is the share of lobes that point at the outline itself, ``ratio``
    the smallest of the two alphas, the larger being in ``alpha``.
    """

    alpha: tuple[float, float] = (1e-3, 1.0)
    theta: tuple[float, float] = (0.0, 80.0)
    distance: tuple[float, float] = (0.03, 10.0)
    edge: float = 0.5
    ratio: float = 1.0


def _log(u: FloatArray, limits: tuple[float, float]) -> FloatArray:
    return np.asarray(np.exp(np.log(limits[0]) + u * np.log(limits[1] / limits[0])))


def _linear(u: FloatArray, limits: tuple[float, float]) -> FloatArray:
    return np.asarray(limits[0] + u * (limits[1] - limits[0]))


def _world(light: AreaLight, st: FloatArray) -> FloatArray:
    origin, u, v = (np.array(a) for a in (light.plane.origin, light.plane.u, light.plane.v))
    return np.asarray(origin + st[:, :1] * u + st[:, 1:] * v)


def _size(light: AreaLight) -> float:
    corners = control_points(light)
    return float(np.max(np.linalg.norm(corners - corners.mean(axis=0), axis=1)))


def _on_outline(light: AreaLight, u: FloatArray, edge: float = 1.0) -> FloatArray:
    """Return places (n, 3) on a light's outline, a share ``edge`` of them; others about it."""
    loops = boundary(light.outline)
    if not loops:  # it encloses nothing
        corners = control_points(light)
        return np.asarray(corners[(u[:, 0] * len(corners)).astype(np.intp)])
    curves = np.concatenate(loops)
    st = evaluate(curves[(u[:, 0] * len(curves)).astype(np.intp)], u[:, 1])
    middle = curves[:, 0].mean(axis=0)
    off = np.clip((u[:, 2] - edge) / max(1.0 - edge, 1e-9), 0.0, 1.0)[:, None]
    away = (u[:, 2] >= edge)[:, None]
    return _world(light, np.where(away, middle + 1.5 * off * (st - middle), st))


def _direction(u: FloatArray) -> FloatArray:
    z, phi = 1.0 - 2.0 * u[:, 0], 2.0 * np.pi * u[:, 1]
    r = np.sqrt(np.maximum(1.0 - z * z, 0.0))
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1)


def _about(normal: FloatArray, first: FloatArray, angle: FloatArray) -> FloatArray:
    """Return ``first`` turned about unit normals by angles (n), perpendicular ones assumed."""
    return np.asarray(
        np.cos(angle)[:, None] * first + np.sin(angle)[:, None] * np.cross(normal, first)
    )


def _alphas(u: FloatArray, ranges: Ranges) -> FloatArray:
    """Return alphas (n, 2) from two numbers each."""
    a = _log(u[:, 0], ranges.alpha)
    swap = u[:, 1] < 0.5
    share = np.where(swap, 2.0 * u[:, 1], 2.0 * u[:, 1] - 1.0)
    b = np.maximum(a * _log(share, (ranges.ratio, 1.0)), ALPHA_MIN)
    return np.stack([np.where(swap, b, a), np.where(swap, a, b)], axis=-1)


def aimed_from(target: FloatArray, position: FloatArray, u: FloatArray, ranges: Ranges) -> Points:
    """Return points whose lobes point at targets (n, 3), give or take their width.

    That is where errors show. Of ``u`` the last seven numbers are used.
    """
    theta, alpha, roll, tangent = u[:, 6], _alphas(u[:, [7, 10]], ranges), u[:, 8], u[:, 11]
    d = unit(target - position)
    side = _about(d, across(d, np.zeros(d.shape)), 2.0 * np.pi * roll)
    t = np.radians(_linear(theta, ranges.theta))
    n = unit(np.cos(t)[:, None] * d + np.sin(t)[:, None] * side)
    back = -across(n, np.where(t[:, None] > 1e-6, d, side))
    off = alpha.max(axis=1) * ndtri(np.clip(u[:, 9], 1e-3, 1.0 - 1e-3))
    t = np.clip(t + off, 0.0, math.radians(STEEPEST))
    view = np.cos(t)[:, None] * n + np.sin(t)[:, None] * back
    return Points.of(position, n, view, alpha, _about(n, back, 2.0 * np.pi * tangent))


def aimed(light: AreaLight, ranges: Ranges = Ranges()) -> Placing:
    """Return points about a light, with lobes that point at it and its outline."""

    def place(u: FloatArray) -> Points:
        target = _on_outline(light, u, ranges.edge)
        reach = _size(light) * _log(u[:, 5], ranges.distance)
        return aimed_from(target, target + _direction(u[:, 3:5]) * reach[:, None], u, ranges)

    return place


def beside(light: AreaLight, distance: float, ranges: Ranges = Ranges()) -> Placing:
    """Return points ``distance`` [m] from the outline in any direction, normals and views any."""

    def place(u: FloatArray) -> Points:
        position = _on_outline(light, u) + distance * _direction(u[:, 3:5])
        aim = position + _direction(np.stack([u[:, 5], u[:, 2]], axis=-1))
        return aimed_from(aim, position, u, ranges)

    return place


def on_vertex(light: AreaLight) -> Placing:
    """Return points on a light's corners and handles."""

    def place(u: FloatArray) -> Points:
        corners = control_points(light)
        position = corners[(u[:, 0] * len(corners)).astype(np.intp)]
        aim = position + _direction(u[:, 3:5])
        return aimed_from(aim, position, u, Ranges())

    return place


def in_plane(light: AreaLight) -> Placing:
    """Return points in a light's plane, outside its outline: they see it from the edge."""

    def place(u: FloatArray) -> Points:
        phi = 2.0 * np.pi * u[:, 0]
        radius = _linear(u[:, 1], (1.5, 5.0))
        st = radius[:, None] * np.stack([np.cos(phi), np.sin(phi)], axis=-1)
        return aimed_from(_on_outline(light, u[:, 2:5]), _world(light, st), u, Ranges())

    return place


def behind(light: AreaLight) -> Placing:
    """Return points behind a light, with lobes that point at it."""

    def place(u: FloatArray) -> Points:
        target = _on_outline(light, u, 0.5)
        away = unit(np.cross(light.plane.u, light.plane.v))
        reach = _log(u[:, 5], (1e-3, 3.0))
        return aimed_from(target, target - reach[:, None] * away, u, Ranges())

    return place


def on_floor(u: FloatArray) -> Points:
    """Return points of the floor y = 0 within 3 m, with views anywhere above it."""
    position = np.stack([6.0 * u[:, 0] - 3.0, np.zeros(len(u)), 6.0 * u[:, 1] - 3.0], axis=-1)
    theta, phi = np.radians(_linear(u[:, 6], (0.0, STEEPEST))), 2.0 * np.pi * u[:, 8]
    sin = np.sin(theta)
    view = np.stack([sin * np.cos(phi), np.cos(theta), sin * np.sin(phi)], axis=-1)
    side = np.stack([np.cos(phi), np.zeros(len(u)), np.sin(phi)], axis=-1)
    return Points.of(position, (0.0, 1.0, 0.0), view, _log(u[:, 7], (1e-3, 1.0)), side)


def along_normal(light: AreaLight, alpha: tuple[float, float]) -> Placing:
    """Return points whose viewers stand exactly over them."""

    def place(u: FloatArray) -> Points:
        points = aimed(light, Ranges(alpha, (0.0, 1e-3), ratio=0.1))(u)
        return replace(points, view=points.normal)

    return place


def at_quadrants(light: AreaLight) -> Placing:
    """Return anisotropic points whose views lie in a plane of symmetry of the lobe, exactly."""

    def place(u: FloatArray) -> Points:
        points = aimed(light, Ranges((0.01, 1.0), (5.0, 80.0), ratio=0.05))(u)
        side = across(points.normal, points.view)
        quarter = np.floor(4.0 * u[:, 11])
        return replace(points, tangent=_about(points.normal, side, 0.5 * np.pi * quarter))

    return place


# --- Series -------------------------------------------------------------------------------

WALL = Plane((0.0, 1.0, -1.5), (1.0, 0.0, 0.0), (0.0, 0.5, 0.0))
"""Upright behind the origin, half as high as wide, its lower edge .5 m over the floor."""

UP = np.array([0.0, 1.0, 0.0])


def _mirrored(position: ArrayLike, normal: ArrayLike, target: ArrayLike) -> FloatArray:
    d = unit(np.asarray(target, float) - np.asarray(position, float))
    n = np.asarray(normal, dtype=np.float64)
    return np.asarray(2.0 * n * np.sum(n * d, axis=-1, keepdims=True) - d)


def _sharpening(t: FloatArray) -> Points:
    """From alpha 1 to .0001, the lobe on the lower edge of a light on the wall."""
    view = _mirrored((0.0, 0.0, 0.0), UP, (0.1, 0.5, -1.5))
    return Points.of(np.zeros(3), UP, view, 10.0 ** (-4.0 * t))


def _grazing(alpha: float) -> Placing:
    """View and light sink towards the surface together, from 0 to 89.9 degrees."""

    def place(t: FloatArray) -> Points:
        d = unit(np.array([0.2, 1.0, -1.5]))
        side = across(d[None], UP[None])
        angle = np.radians(STEEPEST * t)[:, None]
        n = unit(np.cos(angle) * d + np.sin(angle) * side)
        return Points.of(np.zeros(3), n, _mirrored((0.0, 0.0, 0.0), n, d), alpha)

    return place


def _receding(alpha: float) -> Placing:
    """From .00001 to 100,000 sizes of a light at the origin."""

    def place(t: FloatArray) -> Points:
        toward = unit(np.array([0.5, 0.2, 1.0]))
        normal = unit(np.array([0.6, 0.1, 0.3]) - toward)
        position = 10.0 ** (-5.0 + 10.0 * t)[:, None] * toward + np.array([0.1, 0.05, 0.0])
        view = 2.0 * normal * (normal @ -toward) + toward
        return Points.of(position, normal, view, alpha)

    return place


def _rising(t: FloatArray) -> Points:
    """A surface rises past a light that stands upright: it crosses the horizon."""
    position = np.stack([0.0 * t, 3.0 * t - 1.5, 0.5 + 0.0 * t], axis=-1)
    return Points.of(position, UP, (0.1, 0.6, 0.8), 0.2)


def _through_plane(t: FloatArray) -> Points:
    """Through the plane of a light, from one side to the other, beside it."""
    position = np.stack([1.5 + 0.0 * t, 0.2 + 0.0 * t, 0.02 * t - 0.01], axis=-1)
    normal = unit(np.array([-1.0, 0.1, 0.05]))
    return Points.of(position, normal, _mirrored(position, normal, (0.5, 0.1, 0.0)), 0.1)


def _passing(alpha: float, height: float = 1.2) -> Placing:
    """Over the floor under a light that hangs there."""

    def place(t: FloatArray) -> Points:
        position = np.stack([4.0 * t - 2.0, 0.0 * t - height, 0.15 + 0.0 * t], axis=-1)
        return Points.of(position, UP, (0.2, 0.9, 0.35), alpha)

    return place


def _past_edge(t: FloatArray) -> Points:
    """Past the edge of a light, 1 mm in front of its plane."""
    position = np.stack([0.98 + 0.04 * t, 0.1 + 0.0 * t, 1e-3 + 0.0 * t], axis=-1)
    return Points.of(position, (0.3, 0.2, -1.0), (0.1, 0.3, -1.0), 0.1)


def _turning(alpha: tuple[float, float]) -> Placing:
    """The viewer walks once around the point."""

    def place(t: FloatArray) -> Points:
        phi, theta = 2.0 * np.pi * t, math.radians(50.0)
        s, c = math.sin(theta), math.cos(theta)
        view = np.stack([s * np.sin(phi), c + 0.0 * phi, s * np.cos(phi)], axis=-1)
        a = np.broadcast_to(alpha, (len(t), 2))
        return Points.of(np.zeros(3), UP, view, a, (0.0, 0.0, 1.0))

    return place


def _through_normal(alpha: tuple[float, float]) -> Placing:
    """The viewer passes over the point, from 5 degrees on one side to 5 on the other."""

    def place(t: FloatArray) -> Points:
        theta = np.radians(10.0 * t - 5.0)
        view = np.stack([0.3 * np.sin(theta), np.cos(theta), np.sin(theta)], axis=-1)
        a = np.broadcast_to(alpha, (len(t), 2))
        return Points.of(np.zeros(3), (0.0, 0.8, -0.6), view @ _TILT.T, a, (0.6, 0.0, 0.8))

    return place


_TILT = np.array([[1.0, 0.0, 0.0], [0.0, 0.8, 0.6], [0.0, -0.6, 0.8]])
"""Takes +y to the normal of `_through_normal`."""


def _through_equal(t: FloatArray) -> Points:
    """alpha_y from half of alpha_x to twice it."""
    a = np.stack([0.15 + 0.0 * t, 0.15 * 2.0 ** (2.0 * t - 1.0)], axis=-1)
    view = _mirrored((0.0, 0.0, 0.0), UP, (0.1, 0.5, -1.5))
    return Points.of(np.zeros(3), UP, view, a, (0.8, 0.0, 0.6))


def _stretching(swap: bool) -> Placing:
    """From round to a hundred times as long as wide."""

    def place(t: FloatArray) -> Points:
        a = np.stack([0.4 + 0.0 * t, 0.4 * 10.0 ** (-2.0 * t)], axis=-1)
        view = _mirrored((0.0, 0.0, 0.0), UP, (0.1, 0.5, -1.5))
        return Points.of(np.zeros(3), UP, view, a[:, ::-1] if swap else a, (0.8, 0.0, 0.6))

    return place


# --- The sweeps ---------------------------------------------------------------------------


def _hanging(outline: Outline) -> AreaLight:
    """Return a light at the origin that shines down."""
    return lamp(outline, Plane((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)))


def _upright(outline: Outline, height: float = 0.0) -> AreaLight:
    return lamp(outline, Plane((0.0, height, 0.0)))


def _scaled(light: AreaLight, factor: float) -> AreaLight:
    u, v = (tuple(factor * x for x in axis) for axis in (light.plane.u, light.plane.v))
    return replace(light, plane=Plane(light.plane.origin, u, v))  # type: ignore[arg-type]


@dataclass(frozen=True, slots=True)
class _Usual:
    """Lights of the usual kind, in random planes."""

    rng: np.random.Generator
    lights: dict[str, AreaLight] = field(default_factory=dict)

    def made(self, polygon_count: int, curves: dict[str, Outline]) -> dict[str, AreaLight]:
        outlines = {f"polygon {i}": random_polygon(self.rng) for i in range(polygon_count)}
        return {
            name: lamp(outline, random_plane(self.rng))
            for name, outline in {**outlines, **curves}.items()
        }


def make_sweeps(seed: int = 0) -> dict[str, Sweep]:
    """Return all sweeps by name; ``seed`` is that of the random lights among them."""
    rng = np.random.default_rng(seed)
    curves = {"heart": heart(), "ampersand": letter("&")}
    usual = _Usual(rng).made(6, curves)
    square, star, hearts = polygons(SQUARE), polygons(STAR), heart()
    floor_lights = {
        f"{name} at {height:+g}": _upright(outline, height)
        for name, outline in (("square", square), ("star", star), ("heart", hearts))
        for height in (1.0, 0.5, 0.0, -0.5, -0.999)
    }
    hidden = {
        "touches from below": _upright(square, -1.0),
        "below": _upright(hearts, -1.01),
        "1 mm below": lamp(square, replace(_hanging(square).plane, origin=(0.0, -1e-3, 0.0))),
        "lies in the floor": _hanging(square),
        "1 mm above": lamp(square, replace(_hanging(square).plane, origin=(0.0, 1e-3, 0.0))),
    }
    one_sided = {
        name: replace(light, two_sided=False) for name, light in usual.items() if name != "heart"
    }
    wall = lamp(square, WALL)
    heart_wall = lamp(hearts, WALL)

    def clouds(
        lights: dict[str, AreaLight], place: Callable[[AreaLight], Placing]
    ) -> tuple[Cloud, ...]:
        return tuple(Cloud(name, light, place(light)) for name, light in lights.items())

    sizes = {
        f"{name}, {ratio:g} times the distance": (_scaled(light, ratio), ratio)
        for ratio in (1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0, 1e2, 1e3, 1e4, 1e5)
        for name, light in (
            ("star", lamp(star, random_plane(rng))),
            ("heart", lamp(hearts, random_plane(rng))),
        )
    }
    thin = {name: lamp(outline, random_plane(rng)) for name, outline in THIN.items()}
    knots = {name: lamp(outline, random_plane(rng)) for name, outline in POLYGONS.items()}
    stiff = {name: lamp(outline, random_plane(rng)) for name, outline in curved().items()}
    hard = {name: lamp(outline) for name, outline in curved().items()}
    near = {name: usual[name] for name in ("polygon 0", "polygon 1", "heart", "ampersand")}
    on_edges = tuple(
        Cloud(f"on {what} of {name}", light, place, defined=False)
        for name, light in near.items()
        for what, place in (("the outline", beside(light, 0.0)), ("vertices", on_vertex(light)))
    )
    sweeps = (
        Sweep(
            "alpha",
            "Roughness from α = 1 to 0.0001, lobes on and about the outline.",
            clouds(usual, lambda x: aimed(x, Ranges((ALPHA_MIN, 1.0), edge=0.7))),
            (
                Series("sharpening, square", wall, _sharpening),
                Series("sharpening, heart", heart_wall, _sharpening),
            ),
        ),
        Sweep(
            "theta",
            "Views from 75° to 89.9° off the normal.",
            clouds(usual, lambda x: aimed(x, Ranges(theta=(75.0, STEEPEST)))),
            tuple(
                Series(f"grazing, {name}, alpha {alpha:g}", light, _grazing(alpha))
                for name, light in (("square", wall), ("heart", heart_wall))
                for alpha in (0.3, 0.03)
            ),
        ),
        Sweep(
            "distance",
            "Lights of 10⁻⁵ to 10⁵ times their distance.",
            tuple(
                Cloud(name, light, aimed(light, Ranges(distance=(0.5 / ratio, 2.0 / ratio))))
                for name, (light, ratio) in sizes.items()
            ),
            tuple(
                Series(f"receding, {name}, alpha {alpha:g}", light, _receding(alpha))
                for name, light in (
                    ("star", lamp(star, Plane((0, 0, 0)))),
                    ("heart", lamp(hearts, Plane((0, 0, 0)))),
                )
                for alpha in (0.5, 0.05)
            ),
        ),
        Sweep(
            "thin",
            "Needles, slivers, threads and spikes, 10⁻⁶ to 10⁻³ wide.",
            clouds(thin, aimed),
            tuple(
                Series(f"passing, {name}", _hanging(THIN[name]), _passing(0.03, 0.05))
                for name in ("thread", "spike", "comb", "curved needle")
            ),
        ),
        Sweep(
            "horizon",
            "Lights that touch, cross and lie below the surface, points in the plane of the light "
            "and behind it.",
            (
                *(Cloud(name, light, on_floor) for name, light in floor_lights.items()),
                *(Cloud(name, light, on_floor) for name, light in hidden.items()),
                *clouds({f"behind {n}": x for n, x in one_sided.items()}, behind),
                *clouds({f"in the plane of {n}": x for n, x in near.items()}, in_plane),
            ),
            (
                Series("rising past a star", _upright(star), _rising),
                Series("rising past a square", _upright(square), _rising),
                Series("rising past a ring", _upright(ring()), _rising),
                Series("through the plane of a star", _upright(star), _through_plane),
                Series("through the plane of a heart", _upright(hearts), _through_plane),
            ),
        ),
        Sweep(
            "polygons",
            "Polygons that cross, touch and repeat themselves, with holes, and 1,000 corners.",
            clouds(knots, aimed),
            tuple(
                Series(f"passing, {name}", _hanging(POLYGONS[name]), _passing(0.1))
                for name in ("bow tie", "island in a hole", "pentagram", "frame of a hair")
            ),
        ),
        Sweep(
            "curves",
            "Curves with cusps, loops, coincident and tiny handles; lines and raised quadratics; "
            "holes.",
            clouds(stiff, aimed),
            (
                *(
                    Series(f"rising past {name}", hard[name], _rising)
                    for name in ("cusp", "loop", "two holes", "ampersand", "raised quadratic")
                ),
                *(
                    Series(f"passing {name}", _hanging(hard[name].outline), _passing(0.1))
                    for name in ("wild", "near a cusp", "touching disks")
                ),
            ),
        ),
        Sweep(
            "near",
            "Points 1 mm to 1 µm from the outline, on it and on its vertices.",
            (
                *(
                    Cloud(f"{distance:g} m from {name}", light, beside(light, distance))
                    for distance in (1e-3, 1e-4, 1e-5, 1e-6)
                    for name, light in near.items()
                ),
                *on_edges,
            ),
            (
                Series("past the edge of a square", lamp(square, Plane((0, 0, 0))), _past_edge),
                Series("past the edge of a ring", lamp(ring(), Plane((0, 0, 0))), _past_edge),
            ),
        ),
        Sweep(
            "seams",
            "Views along the normal and in the lobe's planes of symmetry, equal alphas, every "
            "azimuth.",
            (
                *clouds(
                    {f"along the normal, {n}": x for n, x in near.items()},
                    lambda x: along_normal(x, (1e-3, 1.0)),
                ),
                *clouds({f"quadrants, {n}": x for n, x in near.items()}, at_quadrants),
                *clouds(
                    {f"alpha 1, {n}": x for n, x in near.items()},
                    lambda x: aimed(x, Ranges((0.999999, 1.0))),
                ),
            ),
            (
                *(
                    Series(f"{what}, alpha {a[0]:g} and {a[1]:g}", wall, place(a))
                    for what, place in (
                        ("turning", _turning),
                        ("through the normal", _through_normal),
                    )
                    for a in ((0.1, 0.1), (0.3, 0.05), (0.05, 0.3))
                ),
                Series("alphas become equal", wall, _through_equal),
            ),
        ),
        Sweep(
            "anisotropy",
            "αy from a hundredth of αx to a hundred times it.",
            clouds(usual, lambda x: aimed(x, Ranges((1e-2, 1.0), (0.0, 85.0), ratio=0.01))),
            (
                Series("stretching across, square", wall, _stretching(False)),
                Series("stretching along, square", wall, _stretching(True)),
                Series("stretching, heart", heart_wall, _stretching(False)),
            ),
        ),
    )
    return {sweep.name: sweep for sweep in sweeps}
