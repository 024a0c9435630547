"""The sweeps: which lights are seen from which points, as functions of numbers in [0, 1).

A sweep has *clouds*, points that fill a region of parameters, given by `DIMENSIONS` numbers
each, and *series*, along which one parameter runs finely, so that a jump between neighbours shows.
Numbers are low-discrepancy in ``ltc-viewer stability`` and drawn by hypothesis in
``tests/gl/test_stability.py``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from app.presets import heart, ring
from app.scene import ALPHA_MIN, AreaLight, Outline, Plane
from app.stability.clouds import (
    STEEPEST,
    Placing,
    Ranges,
    aimed,
    along_normal,
    at_quadrants,
    behind,
    beside,
    in_plane,
    on_floor,
    on_vertex,
)
from app.stability.lights import (
    POLYGONS,
    SQUARE,
    STAR,
    THIN,
    curved,
    lamp,
    letter,
    polygons,
    random_plane,
    random_polygon,
)
from app.stability.paths import (
    WALL,
    grazing,
    passing,
    past_edge,
    receding,
    rising,
    sharpening,
    stretching,
    through_equal,
    through_normal,
    through_plane,
    turning,
)


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


def _hanging(outline: Outline) -> AreaLight:
    """Return a light at the origin that shines down."""
    return lamp(outline, Plane((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)))


def _upright(outline: Outline, height: float = 0.0) -> AreaLight:
    return lamp(outline, Plane((0.0, height, 0.0)))


def _scaled(light: AreaLight, factor: float) -> AreaLight:
    u, v = (tuple(factor * x for x in axis) for axis in (light.plane.u, light.plane.v))
    return replace(light, plane=Plane(light.plane.origin, u, v))  # type: ignore[arg-type]


def make_sweeps(seed: int = 0) -> dict[str, Sweep]:
    """Return all sweeps by name; ``seed`` is that of the random lights among them."""
    rng = np.random.default_rng(seed)
    curves = {"heart": heart(), "ampersand": letter("&")}
    outlines = {f"polygon {i}": random_polygon(rng) for i in range(6)} | curves
    usual = {name: lamp(outline, random_plane(rng)) for name, outline in outlines.items()}
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
                Series("sharpening, square", wall, sharpening),
                Series("sharpening, heart", heart_wall, sharpening),
            ),
        ),
        Sweep(
            "theta",
            "Views from 75° to 89.9° off the normal.",
            clouds(usual, lambda x: aimed(x, Ranges(theta=(75.0, STEEPEST)))),
            tuple(
                Series(f"grazing, {name}, alpha {alpha:g}", light, grazing(alpha))
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
                Series(f"receding, {name}, alpha {alpha:g}", light, receding(alpha))
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
                Series(f"passing, {name}", _hanging(THIN[name]), passing(0.03, 0.05))
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
                Series("rising past a star", _upright(star), rising),
                Series("rising past a square", _upright(square), rising),
                Series("rising past a ring", _upright(ring()), rising),
                Series("through the plane of a star", _upright(star), through_plane),
                Series("through the plane of a heart", _upright(hearts), through_plane),
            ),
        ),
        Sweep(
            "polygons",
            "Polygons that cross, touch and repeat themselves, with holes, and 1,000 corners.",
            clouds(knots, aimed),
            tuple(
                Series(f"passing, {name}", _hanging(POLYGONS[name]), passing(0.1))
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
                    Series(f"rising past {name}", hard[name], rising)
                    for name in ("cusp", "loop", "two holes", "ampersand", "raised quadratic")
                ),
                *(
                    Series(f"passing {name}", _hanging(hard[name].outline), passing(0.1))
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
                Series("past the edge of a square", lamp(square, Plane((0, 0, 0))), past_edge),
                Series("past the edge of a ring", lamp(ring(), Plane((0, 0, 0))), past_edge),
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
                        ("turning", turning),
                        ("through the normal", through_normal),
                    )
                    for a in ((0.1, 0.1), (0.3, 0.05), (0.05, 0.3))
                ),
                Series("alphas become equal", wall, through_equal),
            ),
        ),
        Sweep(
            "anisotropy",
            "αy from a hundredth of αx to a hundred times it.",
            clouds(usual, lambda x: aimed(x, Ranges((1e-2, 1.0), (0.0, 85.0), ratio=0.01))),
            (
                Series("stretching across, square", wall, stretching(False)),
                Series("stretching along, square", wall, stretching(True)),
                Series("stretching, heart", heart_wall, stretching(False)),
            ),
        ),
    )
    return {sweep.name: sweep for sweep in sweeps}
