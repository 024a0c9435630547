"""Surface points to shade, and lights as these see them, in float64."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from app.curves import line_as_cubic
from app.outline import boundary, resolve
from app.scene import AreaLight, PolygonContour
from ltc.curved_outline import positive_winding

FloatArray: TypeAlias = NDArray[np.float64]
BoolArray: TypeAlias = NDArray[np.bool_]
IntArray: TypeAlias = NDArray[np.intp]

ROUNDING = 2.0**-24
"""What a float32 number is off by at most, relative to its size."""

MARGIN = 1e-6
"""How far, relative to distances, a light must be below a surface or show its back to a point to
be certainly dark there: 16 roundings."""


def unit(vectors: ArrayLike) -> FloatArray:
    """Return vectors (..., 3), none of them zero, divided by their lengths."""
    v = np.asarray(vectors, dtype=np.float64)
    # Scaled first: the squares of tiny ones would underflow.
    v = v / np.max(np.abs(v), axis=-1, keepdims=True)
    return np.asarray(v / np.sqrt(np.sum(v * v, axis=-1, keepdims=True)))


def across(normal: FloatArray, toward: FloatArray) -> FloatArray:
    """Return unit vectors (n, 3) perpendicular to ``normal``, nearest to ``toward`` if they can."""
    axis = np.where(np.abs(normal[:, :1]) < 0.5, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    x = toward - normal * np.sum(normal * toward, axis=-1, keepdims=True)
    length2 = np.sum(toward * toward, axis=-1, keepdims=True)
    lost = np.sum(x * x, axis=-1, keepdims=True) <= 1e-24 * length2
    x = np.where(lost, np.cross(normal, axis), x)
    x = x - normal * np.sum(normal * x, axis=-1, keepdims=True)
    return unit(x)


@dataclass(frozen=True, slots=True)
class Points:
    """Points to shade, as for `app.render.renderer.Renderer.probe`, but float64.

    ``position``, ``normal``, ``tangent`` and ``view`` are (n, 3), directions unit and the
    tangent perpendicular to the normal; ``alpha`` is (n, 2).
    """

    position: FloatArray
    normal: FloatArray
    tangent: FloatArray
    view: FloatArray
    alpha: FloatArray

    @classmethod
    def of(
        cls,
        position: ArrayLike,
        normal: ArrayLike,
        view: ArrayLike,
        alpha: ArrayLike,
        tangent: ArrayLike | None = None,
    ) -> Points:
        """Return points, everything broadcast to (n, ...) and directions made unit.

        ``alpha`` is (n) or (n, 2) or one number; ``tangent`` is made perpendicular, and is
        that of the view by default.
        """
        p, n, v = (np.atleast_2d(np.asarray(a, dtype=np.float64)) for a in (position, normal, view))
        a = np.asarray(alpha, dtype=np.float64)
        a = a if a.ndim == 2 else np.repeat(a.reshape(-1, 1), 2, axis=1)
        count = max(len(p), len(n), len(v), len(a))
        p, n, v = (np.broadcast_to(x, (count, 3)) for x in (p, n, v))
        n, v = unit(n), unit(v)
        t = v if tangent is None else np.broadcast_to(np.asarray(tangent, float), (count, 3))
        return cls(np.array(p), n, across(n, t), v, np.array(np.broadcast_to(a, (count, 2))))

    def __len__(self) -> int:
        return len(self.position)

    def inputs(self) -> dict[str, FloatArray]:
        """Return the arrays of a point file, by name."""
        return {
            "position": self.position,
            "normal": self.normal,
            "tangent": self.tangent,
            "view": self.view,
            "alpha": self.alpha,
        }

    def pick(self, which: IntArray | BoolArray | slice) -> Points:
        """Return some of them."""
        return Points(*(array[which] for array in self.inputs().values()))

    def rounded(self) -> Points:
        """Return what the GPU gets, in float64 again and directions unit again."""
        p, n, t, v, a = (
            array.astype(np.float32).astype(np.float64) for array in self.inputs().values()
        )
        n = unit(n)
        return Points(p, n, across(n, t), unit(v), a)

    @property
    def anisotropic(self) -> bool:
        """Whether some lobe is."""
        return bool(np.any(self.alpha[:, 0] != self.alpha[:, 1]))


def frames(points: Points) -> FloatArray:
    """Return tangent_from_world, (n, 3, 3): rows tangent, bitangent, normal."""
    n, x = points.normal, points.tangent
    return np.stack([x, np.cross(n, x), n], axis=-2)


@dataclass(frozen=True, slots=True)
class Seen:
    """A light as points see it, in their tangent frames.

    Attributes
    ----------
    contours : tuple of (n, k, 4, 3)
        The boundary of its inside as cubics, the way that points in front of it count positive.
    straight : bool
        Whether all of them are edges of polygons.
    wo : (n, 3)
        Unit directions to the viewers.
    alpha : (n, 2)
    sign : (n)
        1 where points see its face, -1 where the back of a two-sided one, else 0.
    """

    contours: tuple[FloatArray, ...]
    straight: bool
    wo: FloatArray
    alpha: FloatArray
    sign: FloatArray

    @classmethod
    def of(cls, light: AreaLight, points: Points) -> Seen:
        """Return how the points, as given, see a light."""
        axes = frames(points)
        normal = np.cross(light.plane.u, light.plane.v)
        front = (points.position - np.array(light.plane.origin)) @ normal > 0.0
        straight = all(isinstance(contour, PolygonContour) for contour in light.outline.contours)
        # Polygons from the corners at which the GPU begins: how it closes what the horizon cuts
        # depends on them.
        inside = (
            [line_as_cubic(p, np.roll(p, -1, axis=0)) for p in resolve(light.outline)]
            if straight
            else boundary(light.outline)
        )
        origin, u, v = (np.array(a) for a in (light.plane.origin, light.plane.u, light.plane.v))
        contours = []
        for loop in inside:
            world = positive_winding(origin + loop[..., :1] * u + loop[..., 1:] * v)
            away = world - points.position[:, None, None]
            contours.append(np.einsum("nij,nkcj->nkci", axes, away))
        return cls(
            tuple(contours),
            straight,
            np.einsum("nij,nj->ni", axes, points.view),
            points.alpha,
            np.where(front, 1.0, -1.0 if light.two_sided else 0.0),
        )

    def __len__(self) -> int:
        return len(self.wo)

    @property
    def loops(self) -> list[FloatArray]:
        """The corners (n, k, 3) of polygons."""
        return [contour[:, :, 0] for contour in self.contours]

    @property
    def anisotropic(self) -> bool:
        """Whether some lobe is."""
        return bool(np.any(self.alpha[:, 0] != self.alpha[:, 1]))

    def pick(self, which: IntArray | BoolArray | slice) -> Seen:
        """Return what some of the points see."""
        contours = tuple(contour[which] for contour in self.contours)
        wo, alpha, sign = self.wo[which], self.alpha[which], self.sign[which]
        return Seen(contours, self.straight, wo, alpha, sign)

    def facing_view(self) -> Seen:
        """Return it in frames where the view lies in the xz half-plane x >= 0."""
        side = self.wo[:, :2]
        length = np.hypot(side[:, 0], side[:, 1])
        tilted = length > 0.0
        cos, sin = np.where(tilted, side.T / np.where(tilted, length, 1.0), [[1.0], [0.0]])
        zero, one = np.zeros(len(self)), np.ones(len(self))
        rows = [[cos, sin, zero], [-sin, cos, zero], [zero, zero, one]]
        turn = np.moveaxis(np.array(rows), -1, 0)
        wo = np.stack([length, zero, self.wo[:, 2]], axis=-1)
        return replace(self, contours=_mapped(turn, self.contours), wo=wo)

    def jittered(self, rng: np.random.Generator) -> Seen:
        """Return it as if everything that is known to float32 was rounded anew.

        Space about the points is sheared and scaled, views and alphas are moved, all by
        `ROUNDING` (standard deviation); so are the control points of curves, by as much of the
        curve's size, because a place on a curve is a sum of them. What no float32 computation can
        avoid changes the value by about as much.
        """
        count = len(self)
        contours = self.contours
        if not self.straight:
            contours = tuple(_bent(contour, rng) for contour in contours)
        shear = np.eye(3) + ROUNDING * rng.standard_normal((count, 3, 3))
        wo = self.wo + ROUNDING * rng.standard_normal((count, 3))
        wo[:, 2] = np.where(self.wo[:, 2] > 0.0, np.maximum(wo[:, 2], 1e-9), wo[:, 2])
        factor = 1.0 + ROUNDING * rng.standard_normal((count, 1))
        alpha = np.minimum(self.alpha * factor, 1.0)
        return replace(self, contours=_mapped(shear, contours), wo=unit(wo), alpha=alpha)


def _bent(contour: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Return curves (n, k, 4, 3) with control points moved in their plane, ends still joined."""
    way = contour - contour[:, :, :1]
    size = np.sqrt(np.max(np.sum(way * way, axis=-1), axis=-1))
    # Two directions of the plane, from its farthest points: planes must stay planes.
    flat = contour.reshape(len(contour), -1, 3)
    off = flat - flat[:, :1]
    first = np.argmax(np.sum(off * off, axis=-1), axis=-1)
    rows = np.arange(len(flat))
    a = off[rows, first]
    a = a / np.maximum(np.sqrt(np.sum(a * a, axis=-1)), 1e-300)[:, None]
    rest = off - np.sum(off * a[:, None], axis=-1, keepdims=True) * a[:, None]
    b = rest[rows, np.argmax(np.sum(rest * rest, axis=-1), axis=-1)]
    b = b / np.maximum(np.sqrt(np.sum(b * b, axis=-1)), 1e-300)[:, None]
    draw = ROUNDING * size[:, :, None, None] * rng.standard_normal((*contour.shape[:2], 3, 2))
    moves = draw[..., :1] * a[:, None, None] + draw[..., 1:] * b[:, None, None]
    moves = np.concatenate([moves, np.roll(moves[:, :, :1], -1, axis=1)], axis=2)
    return np.asarray(contour + moves)


def _mapped(matrix: FloatArray, contours: Sequence[FloatArray]) -> tuple[FloatArray, ...]:
    return tuple(np.einsum("nij,nkcj->nkci", matrix, contour) for contour in contours)


def certainly_dark(light: AreaLight, points: Points) -> BoolArray:
    """Return where a light sends nothing, (n), by a margin that float32 tells: `MARGIN`.

    It shows its back to the point, one-sided, or all of it is below the surface.
    """
    origin, u, v = (np.array(a) for a in (light.plane.origin, light.plane.u, light.plane.v))
    controls = np.concatenate(
        [np.zeros((0, 2))]
        + [
            np.array(c.points if isinstance(c, PolygonContour) else c.curves).reshape(-1, 2)
            for c in light.outline.contours
        ]
    )
    way = origin + controls[:, :1] * u + controls[:, 1:] * v - points.position[:, None]
    farthest = np.max(np.sqrt(np.sum(way * way, axis=-1)), axis=-1)
    height = np.max(np.einsum("nkj,nj->nk", way, points.normal), axis=-1)
    depth = (points.position - origin) @ unit(np.cross(u, v))
    behind = (depth < -MARGIN * farthest) & (not light.two_sided)
    return np.asarray(behind | (height < -MARGIN * farthest))
