"""Lights that are hard to integrate: outlines of every kind, and random ones."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from app.curves import line_as_cubic
from app.outline import boundary
from app.presets import disk, heart, ring
from app.scene import AreaLight, BezierContour, Contour, Outline, Plane, PolygonContour, TextSource
from app.stability.points import FloatArray
from app.text import text_outline

SQUARE = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))
STAR = tuple(
    (math.cos(math.pi * i / 5) * r, math.sin(math.pi * i / 5) * r)
    for i in range(10)
    for r in (1.0 if i % 2 else 0.4,)
)
PENTAGRAM = tuple(STAR[(4 * i + 1) % 10] for i in range(5))


def lamp(outline: Outline, plane: Plane = Plane(), two_sided: bool = True) -> AreaLight:
    """Return a light of radiance 1."""
    return AreaLight("light", outline, plane, (1.0, 1.0, 1.0), two_sided)


def polygons(*contours: ArrayLike, rule: str = "evenodd") -> Outline:
    """Return an outline of polygons (k, 2)."""
    loops = tuple(
        PolygonContour(tuple((float(s), float(t)) for s, t in np.asarray(c))) for c in contours
    )
    return Outline(loops, "nonzero" if rule == "nonzero" else "evenodd")


def bezier(curves: ArrayLike) -> BezierContour:
    """Return a closed contour of curves (k, 4, 2), the last end moved onto the first start."""
    p = np.array(curves, dtype=np.float64)
    p[:, 3] = np.roll(p[:, 0], -1, axis=0)
    return BezierContour(
        tuple(tuple((float(s), float(t)) for s, t in curve) for curve in p)  # type: ignore[misc]
    )


def moved(outline: Outline, s: float, t: float, size: float) -> tuple[Contour, ...]:
    """Return an outline's boundary, scaled and then moved."""
    return tuple(bezier(size * loop + (s, t)) for loop in boundary(outline))


def letter(text: str) -> Outline:
    """Return letters of the font in ``assets/``, two units high."""
    return text_outline(TextSource(text, size=2.0))


def wild(rng: np.random.Generator, count: int) -> BezierContour:
    """Return random curves with cusps, loops and inflections, crossing each other."""
    angle = np.arange(count) * 2.0 * np.pi / count
    p = rng.uniform(0.4, 1.2, (count, 1)) * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    q = np.roll(p, -1, axis=0)
    return bezier(
        np.stack([p, p + rng.normal(0, 0.6, p.shape), q + rng.normal(0, 0.6, p.shape), q], axis=1)
    )


def random_plane(rng: np.random.Generator) -> Plane:
    """Return a skew plane near the origin, axes up to 1 long and not perpendicular."""
    u = rng.normal(size=3)
    v = np.cross(u, rng.normal(size=3)) + 0.3 * rng.normal() * u
    scale = rng.uniform(0.3, 1.0) / np.linalg.norm(v)
    origin, u, v = rng.uniform(-1.0, 1.0, 3), u / np.linalg.norm(u), scale * v
    return Plane(*(tuple(a.tolist()) for a in (origin, u, v)))


def random_polygon(rng: np.random.Generator) -> Outline:
    """Return a star-shaped polygon of 3 to 8 corners, convex or not, of radius up to 1."""
    corners = int(rng.integers(3, 9))
    angle = np.sort(rng.uniform(0.0, 2.0 * np.pi, corners))
    radius = rng.uniform(0.3, 1.0, corners)
    return polygons(np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1))


POLYGONS: dict[str, Outline] = {
    "bow tie": polygons([(-1, -1), (1, 1), (1, -1), (-1, 1)]),
    "touching squares": polygons(
        [(-1, -1), (0, -1), (0, 0), (1, 0), (1, 1), (0, 1), (0, 0), (-1, 0)]
    ),
    "repeated corners": polygons([(-1, -1), (-1, -1), (1, -1), (1, 1), (1, 1), (1, 1), (-1, 1)]),
    "collinear corners": polygons([(-1, -1), (0, -1), (0.5, -1), (1, -1), (1, 1), (0, 1), (-1, 1)]),
    "nearly coincident corners": polygons([(-1, -1), (1, -1), (1, -1 + 1e-7), (1, 1), (-1, 1)]),
    "no area": polygons([(-1, -1), (0, 0), (1, 1)]),
    "hole": polygons(SQUARE, np.array(SQUARE) * 0.5),
    "hole, same winding": polygons(SQUARE, np.array(SQUARE[::-1]) * 0.5),
    "island in a hole": polygons(SQUARE, np.array(SQUARE) * 0.6, np.array(SQUARE) * 0.3),
    "frame of a hair": polygons(SQUARE, np.array(SQUARE) * 0.9999),
    "pentagram": polygons(PENTAGRAM),
    "pentagram, nonzero": polygons(PENTAGRAM, rule="nonzero"),
    "1000 corners": polygons(
        [(math.cos(math.pi * i / 500), math.sin(math.pi * i / 500)) for i in range(1000)]
    ),
}
"""Polygons that cross, touch and repeat themselves, with holes."""

_LINE = line_as_cubic((1, 0), (-1, 0))
THIN: dict[str, Outline] = {
    "needle": polygons([(-1.0, 0.0), (1.0, 0.0), (1.0, 1e-5), (-1.0, 1e-5)]),
    "thread": polygons([(-1.0, 0.0), (1.0, 0.0), (1.0, 1e-3), (-1.0, 1e-3)]),
    "sliver": polygons([(-1.0, -1.0), (1.0, 1.0), (1.0, 1.0 + 1e-6)]),
    "spike": polygons([(-1.0, 0.0), (1.0, -1e-4), (1.0, 1e-4)]),
    "comb": polygons(
        [(x, y) for i in range(16) for x, y in ((i / 8 - 1, 0), (i / 8 - 0.999, 1))] + [(1, 0)]
    ),
    "curved needle": Outline(
        (bezier(np.array([[(-1, 0), (-0.3, 1e-4), (0.3, 1e-4), (1, 0)], _LINE])),)
    ),
}
"""Lights hardly wider than nothing."""

_SIDES = [line_as_cubic((1, -1), (0, 1)), line_as_cubic((0, 1), (-1, -1))]
STIFF: dict[str, list[Any]] = {
    "cusp": [[(-1, 0), (1, 1), (-1, 1), (1, 0)], _LINE],
    "loop": [[(-1, 0), (2.5, 1.2), (-2.5, 1.2), (1, 0)], _LINE],
    "closed loop": [[(0, 0), (2, 2), (-2, 2), (0, 0)]],
    "inflections": [
        [(-1, 0), (-0.3, 1.5), (0.3, -1.5), (1, 0)],
        [(1, 0), (1, 2), (-1, 2), (-1, 0)],
    ],
    "coincident controls": [
        [(-1, 0), (-1, 0), (1, 0), (1, 0)],
        [(1, 0), (1, 0), (0, 1), (-1, 0)],
    ],
    "handles of no length": [
        [(-1, 0), (-1, 0), (0, 1), (1, 0)],
        [(1, 0), (0.5, -1), (-1, 0), (-1, 0)],
    ],
    "tiny handles": [
        [(-1, 0), (-1 + 1e-7, 1e-7), (0, 1), (1, 0)],
        [(1, 0), (0.5, -1), (-1, -1e-7), (-1, 0)],
    ],
    "a curve of no length": [
        [(0, 0), (1, 0), (1, 1), (0, 1)],
        [(0, 1), (0, 1), (0, 1), (0, 1)],
        line_as_cubic((0, 1), (0, 0)),
    ],
    "lines as cubics": [line_as_cubic((-1, -1), (1, -1)), *_SIDES],
    "uneven lines": [
        [(-1, -1), (-0.9, -1), (0.5, -1), (1, -1)],
        [(1, -1), (0.9, -0.8), (0.2, 0.6), (0, 1)],
        _SIDES[1],
    ],
    "overshooting line": [[(-1, -1), (3, -1), (-3, -1), (1, -1)], *_SIDES],
    "raised quadratic": [[(-1, 0), (-1 / 3, 2 / 3), (1 / 3, 2 / 3), (1, 0)], _LINE],
    "corner without handles": [
        [(-0.5, 0), (-0.5, 0), (0, 0), (0, -0.5)],
        line_as_cubic((0, -0.5), (-0.5, 0)),
    ],
    "near a cusp": [
        [(-0.8, 0), (-0.2, 0.6), (-0.7, -0.3), (-0.6, -0.9)],
        line_as_cubic((-0.6, -0.9), (-0.8, 0)),
    ],
    "needle": [[(-1, 0), (-0.3, 1e-4), (0.3, 1e-4), (1, 0)], _LINE],
}
"""Curves that cubic formulas stumble over: of lower degree, cusps, loops, handles of no length."""


def curved() -> dict[str, Outline]:
    """Return outlines of curves that are hard, by name."""
    rng = np.random.default_rng(2)
    return {
        **{name: Outline((bezier(np.array(curves)),)) for name, curves in STIFF.items()},
        "wild": Outline((wild(rng, 5),)),
        "wild, nonzero": Outline((wild(rng, 6),), "nonzero"),
        "two holes": Outline(
            (
                *moved(disk(), 0, 0, 1),
                *moved(disk(), -0.4, 0, 0.3),
                *moved(heart(), 0.4, 0, 0.25),
            )
        ),
        "touching disks": Outline(
            (*moved(disk(), -0.5, 0, 0.5), *moved(disk(), 0.5, 0, 0.5)),
        ),
        "square with a round hole": Outline((PolygonContour(SQUARE), *moved(disk(), 0.1, 0, 0.6))),
        "ampersand": letter("&"),  # TrueType's quadratics, raised
        "ring": ring(),
    }


def control_points(light: AreaLight) -> FloatArray:
    """Return the corners and handles of a light's contours in the world, (k, 3)."""
    origin, u, v = (np.array(a) for a in (light.plane.origin, light.plane.u, light.plane.v))
    st = np.concatenate(
        [
            np.array(c.points if isinstance(c, PolygonContour) else c.curves).reshape(-1, 2)
            for c in light.outline.contours
        ]
    )
    return np.asarray(origin + st[:, :1] * u + st[:, 1:] * v)
