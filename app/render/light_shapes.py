"""The visible lights as the G-buffer pass draws them: triangles, or curves in bands.

A polygon light is drawn as the triangles of its inside. A light with curves is one
triangle around its outline, and the fragment shader decides what is inside: the
boundary (`app.outline.boundary`) never crosses itself, so a point is inside where a
ray from it meets the boundary an odd number of times. That is exact at any zoom,
needs no stencil and no flattening. After Lengyel 2017, "GPU-Centered Font Rendering
Directly from Glyph Outlines" (JCGT 6:2), but for cubics and any number of them:

1. The outline is moved and scaled, each axis on its own, to the box from -1 to 1,
   (p, q): insideness does not change under affine maps, and a needle keeps its
   thickness. The ray goes towards +p.
2. Every cubic is cut where it turns in p or q. Such a piece meets the ray at most
   once, and at all only if q0 <= q < q3 (or the other way round); seldom more than
   the box of its ends must be looked at. Ends are rounded to float32 once and shared
   by neighbours, so of two pieces that join exactly one counts, whatever q is: no
   wrong lines.
3. The box is cut along q into equal bands. Each has a list of the pieces that cross
   it, in order of their least p there: how many of them are wholly beyond a pixel is
   found by halving. The few that begin or end in the band follow, the farthest first,
   so that a pixel stops where the rest is behind it. Only a piece whose box within the
   band holds the pixel needs the solution of its cubic.

Whether p runs along s or along t is chosen by the expected number of looks: a word
is cut into columns, a comb across its teeth.

Bands depend on the outline only; where it is in the picture is a matrix from pixels
to (p, q), computed in float64 for every picture. So the shape is exact to float32
in its own box, a ten-millionth of its size, however far or near it is seen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.caching import ByteCache
from app.curves import bounds, evaluate, extrema, part
from app.outline import boundary, resolve, triangulate
from app.render.camera import CameraFrame
from app.render.pack import CACHED_BYTES, is_curved, plane_basis
from app.scene import AreaLight, Outline

FloatArray = NDArray[np.float64]
Texels = NDArray[np.float32]

LIGHT_VERTEX = np.dtype([("position", "<f4", 3), ("normal", "<f4", 3), ("id", "<f4")])
"""A vertex of a visible light: world position, emitting normal, G-buffer id."""

OUTLINE_PIECE = np.dtype(
    [
        ("q_ends", "<f4", 2),
        ("p_range", "<f4", 2),
        ("p", "<f4", 4),
        ("q_handles", "<f4", 2),
        ("unused", "<f4", 2),
    ]
)
"""A cubic with monotone p and q, three texels: q of its ends; its least p in the band
and the greatest there of it and those that follow; p of its control points; q of its
handles."""

TEXELS_PER_PIECE = OUTLINE_PIECE.itemsize // 16
LEAST_BANDS, MOST_BANDS = 16, 256
MOST_COPIES = 16
"""Lists may hold each piece so often on average; fewer bands, to `LEAST_BANDS`, if it is more."""
BAND_MARGIN = 1e-6
"""By how much a piece reaches into the neighbouring bands [box]: a few roundings of q."""
HALVINGS = 24
"""Of a piece, to find where it enters and leaves a band: to a rounding of float32."""
TRIANGLE_MARGIN = 1.0 + 2.0**-10
"""Half the box that the triangle covers: its corners are rounded, the shape is not."""
EDGE_ON = 1e-12
"""Sine of the angle to its plane at which a light has no area in any picture."""


def has_triangles(lights: Sequence[AreaLight]) -> bool:
    """Return whether a visible light is drawn as triangles."""
    return any(
        light.visible and not is_curved(light) and resolve(light.outline) for light in lights
    )


def curve_texels(lights: Sequence[AreaLight]) -> int:
    """Return how many texels `pack_light_curves` makes."""
    return sum(
        len(outline_bands(light.outline).texels)
        for light in lights
        if light.visible and is_curved(light)
    )


# Triangles


@dataclass(frozen=True, eq=False)
class LightTriangles:
    """Triangles of visible lights, counter-clockwise seen from the emitting side.

    ``vertices[:one_sided]`` show that side only, the rest both sides.
    """

    vertices: NDArray[np.void]
    one_sided: int


def pack_light_triangles(lights: Sequence[AreaLight]) -> LightTriangles:
    """Return the triangles of all visible polygon lights; light i has the id -1 - i."""
    one: list[NDArray[np.void]] = []
    two: list[NDArray[np.void]] = []
    for index, light in enumerate(lights):
        if light.visible and not is_curved(light):
            (two if light.two_sided else one).append(_triangles(light, index))
    every = np.concatenate([np.zeros(0, dtype=LIGHT_VERTEX), *one, *two])
    return LightTriangles(every, sum(len(vertices) for vertices in one))


def _light_triangles(light: AreaLight, index: int) -> NDArray[np.void]:
    points, triangles = triangulate(light.outline)
    e1, e2, to_metres = plane_basis(light.plane)
    plane = points @ to_metres.T
    positions = np.array(light.plane.origin) + plane[:, :1] * e1 + plane[:, 1:] * e2
    vertices = np.zeros(3 * len(triangles), dtype=LIGHT_VERTEX)
    vertices["position"] = positions[_counter_clockwise(points, triangles).reshape(-1)]
    vertices["normal"] = np.cross(e1, e2)
    vertices["id"] = -1 - index
    return vertices


def _counter_clockwise(points: FloatArray, triangles: NDArray[np.int32]) -> NDArray[np.int32]:
    a, b, c = (points[triangles[:, i]] for i in range(3))
    area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    return np.where(area[:, None] < 0.0, triangles[:, ::-1], triangles)


# Curves


@dataclass(frozen=True, eq=False)
class OutlineBands:
    """An outline's boundary in bands.

    Attributes
    ----------
    texels : (n, 4) float32, read-only
        First ``bands`` texels (first texel of the list, pieces that cross the band,
        pieces that do not, 0), then the lists of `OUTLINE_PIECE`. Indices count
        from the first of these texels.
    bands : int
        0 if nothing is inside.
    centre, half : (2,) float64
        The box around the boundary, in the plane's (s, t).
    swapped : bool
        (p, q) run along (t, s) instead of (s, t).
    looks : float
        Pieces that a pixel in the middle of the box looks at, on average over bands.
    """

    texels: Texels
    bands: int
    centre: FloatArray
    half: FloatArray
    swapped: bool
    looks: float


def outline_bands(outline: Outline) -> OutlineBands:
    """Return the bands of an outline, from the last time if it is known."""
    return _bands(outline)


def _outline_bands(outline: Outline) -> OutlineBands:
    loops = boundary(outline)
    if not loops:
        return OutlineBands(np.zeros((0, 4), np.float32), 0, np.zeros(2), np.ones(2), False, 0.0)
    curves = np.concatenate(loops)
    lows, highs = bounds(curves)
    low, high = lows.min(axis=0), highs.max(axis=0)
    centre = 0.5 * low + 0.5 * high
    half = np.maximum(high - centre, centre - low)
    pieces = _monotone_pieces((curves - centre) / half).astype(np.float32)
    lists = [_listed(axes) for axes in (pieces, pieces[..., ::-1])]
    swapped = lists[1].looks < lists[0].looks
    texels = _texels(lists[swapped])
    texels.setflags(write=False)
    return OutlineBands(texels, lists[swapped].bands, centre, half, swapped, lists[swapped].looks)


def _monotone_pieces(curves: FloatArray) -> FloatArray:
    """Return curves (n, 4, 2) cut where they turn along either axis, (5 n, 4, 2).

    Pieces that are not needed have no length. Neighbours share their ends to the bit.
    """
    turns = np.sort(np.nan_to_num(extrema(curves), nan=1.0).reshape(-1, 4), axis=1)
    ends = np.ones((len(curves), 1))
    stops = np.hstack([0.0 * ends, turns, ends])
    return np.concatenate([part(curves, stops[:, i], stops[:, i + 1]) for i in range(5)])


@dataclass(frozen=True, eq=False)
class _Lists:
    """Which pieces (m, 4, 2), of (p, q), are in which band: pairs (n,) of piece and band."""

    pieces: Texels
    bands: int
    piece: NDArray[np.int64]
    band: NDArray[np.int64]
    crosses: NDArray[np.bool_]
    bottom: FloatArray
    top: FloatArray

    @property
    def counts(self) -> NDArray[np.int64]:
        """How many cross each band, and how many do not, (bands, 2)."""
        group = 2 * self.band + ~self.crosses
        return np.bincount(group, minlength=2 * self.bands).reshape(self.bands, 2)

    @property
    def looks(self) -> float:
        """From the middle: a search among those that cross, half of the rest in turn."""
        return float(np.mean(np.log2(self.counts[:, 0] + 1.0) + 0.5 * self.counts[:, 1]))


def _listed(pieces: Texels) -> _Lists:
    # Without extent along q, as rounded, a piece is met by no ray.
    pieces = pieces[pieces[:, 0, 1] != pieces[:, 3, 1]]
    low, high = np.sort(pieces[:, (0, 3), 1].astype(np.float64), axis=1).T
    bands = min(MOST_BANDS, max(LEAST_BANDS, 1 << (2 * len(pieces)).bit_length()))
    while True:
        first, last = (
            np.clip(np.floor((q + 1.0) * 0.5 * bands), 0, bands - 1).astype(np.int64)
            for q in (low - BAND_MARGIN, high + BAND_MARGIN)
        )
        reach = last - first + 1
        if bands <= LEAST_BANDS or reach.sum() <= MOST_COPIES * len(pieces):
            break
        bands //= 2
    piece = np.repeat(np.arange(len(pieces)), reach)
    band = first[piece] + np.arange(len(piece)) - np.repeat(np.cumsum(reach) - reach, reach)
    bottom = band * (2.0 / bands) - 1.0 - BAND_MARGIN
    top = (band + 1) * (2.0 / bands) - 1.0 + BAND_MARGIN
    crosses = (low[piece] <= bottom) & (high[piece] > top)
    return _Lists(pieces, bands, piece, band, crosses, bottom, top)


def _texels(lists: _Lists) -> Texels:
    """Return what `OutlineBands` describes."""
    pieces, piece, band, crosses = lists.pieces, lists.piece, lists.band, lists.crosses
    least, greatest = _p_between(pieces.astype(np.float64)[piece], lists.bottom, lists.top)
    order = np.lexsort((-np.where(crosses, least, greatest), ~crosses, band))
    # Pieces do not cross, so those that cross the band are in order of both their
    # least and their greatest p but for roundings: no greater one may follow.
    greatest = _greatest_to_come(greatest[order], (2 * band + ~crosses)[order])
    sorted_pieces = pieces[piece[order]]
    records = np.zeros(len(order), dtype=OUTLINE_PIECE)
    records["q_ends"] = sorted_pieces[:, (0, 3), 1]
    records["p_range"] = np.stack([least[order], greatest], axis=1)
    records["p"] = sorted_pieces[..., 0]
    records["q_handles"] = sorted_pieces[:, 1:3, 1]
    counts = lists.counts
    heads = np.zeros((lists.bands, 4), dtype=np.float32)
    heads[:, 0] = lists.bands + TEXELS_PER_PIECE * (np.cumsum(counts.sum(1)) - counts.sum(1))
    heads[:, 1:3] = counts
    return np.concatenate([heads, records.view(np.float32).reshape(-1, 4)])


def _p_between(
    pieces: FloatArray, bottom: FloatArray, top: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the least and greatest p (n,) of pieces (n, 4, 2) where q is between two values.

    By halving, and from the outer sides of what is left.
    """
    rising = pieces[:, 3, 1] > pieces[:, 0, 1]
    below, above = np.where(rising, (bottom, top), (top, bottom))
    # In powers of x, which is faster; it rounds in the sixteenth digit.
    a, b, c, d = _powers(pieces[..., 1])
    q = np.stack([below, above])
    low, high = np.zeros_like(q), np.ones_like(q)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        value = ((a * middle + b) * middle + c) * middle + d
        before = (value < q) == rising
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    ends = np.stack([evaluate(pieces, low[0])[:, 0], evaluate(pieces, high[1])[:, 0]])
    return ends.min(axis=0), ends.max(axis=0)


def _powers(f: FloatArray) -> tuple[FloatArray, ...]:
    """Return the coefficients of x^3, x^2, x and 1 of cubics (n, 4) in Bézier form."""
    p0, p1, p2, p3 = f.T
    return p3 - p0 + 3.0 * (p1 - p2), 3.0 * (p0 - 2.0 * p1 + p2), 3.0 * (p1 - p0), p0


def _greatest_to_come(values: FloatArray, group: NDArray[np.int64]) -> FloatArray:
    """Return of values (n,), and those after them in their group, the greatest.

    Groups are runs of ascending numbers; values are from -2 to 2.
    """
    # Offsets make every later group smaller than all before it, seen from the end.
    offset = 8.0 * group
    return np.asarray(np.maximum.accumulate((values - offset)[::-1])[::-1] + offset)


@dataclass(frozen=True, eq=False)
class CurvedShape:
    """A visible light that is drawn from its curves.

    Attributes
    ----------
    id : int
        As in the G-buffer, -1 - i for light i.
    two_sided : bool
    origin, p_axis, q_axis : (3,) float64
        World; (p, q) of the box is origin + p p_axis + q q_axis.
    normal : (3,) float64
        Of the emitting side, unit.
    first, bands : int
        Where its texels begin, and how many bands it has.
    """

    id: int
    two_sided: bool
    origin: FloatArray
    p_axis: FloatArray
    q_axis: FloatArray
    normal: FloatArray
    first: int
    bands: int

    def corners(self) -> FloatArray:
        """Return (3, 3) the corners of a triangle around the box, world."""
        reach = TRIANGLE_MARGIN * np.array([[-1.0, -1.0], [3.0, -1.0], [-1.0, 3.0]])
        return np.asarray(self.origin + reach @ np.stack([self.p_axis, self.q_axis]))

    def faces(self, eye: FloatArray) -> float:
        """Return 1 for an eye that sees the emitting side, -1 for the other, 0 for edge-on."""
        away = eye - self.origin
        height = float(self.normal @ away)
        return 0.0 if abs(height) <= EDGE_ON * np.linalg.norm(away) else float(np.sign(height))

    def box_from_pixel(
        self,
        frame: CameraFrame,
        window: tuple[float, float, float, float],
        size: tuple[int, int],
    ) -> FloatArray:
        """Return the (3, 3) matrix from pixels to where their rays meet the plane.

        Parameters
        ----------
        frame : CameraFrame
            Must not see the plane edge-on.
        window, size
            As `app.render.gbuffer.GBufferPass.draw` takes them; the target's size.

        Returns
        -------
        (3, 3) float64
            Takes (x, y, 1), pixels from the middle of the target, right and up, to
            (p, q, 1) / depth: Cramer's rule for eye + depth ray = origin + p p_axis
            + q q_axis.
        """
        away = frame.eye - self.origin
        normal = np.cross(self.p_axis, self.q_axis)
        rows = np.stack([np.cross(away, self.q_axis), np.cross(self.p_axis, away), normal])
        rows /= -(normal @ away)
        scale_x, scale_y, offset_x, offset_y = window
        middle = (
            frame.forward - (offset_x / scale_x) * frame.right - (offset_y / scale_y) * frame.up
        )
        ray = np.stack(
            [
                2.0 / (size[0] * scale_x) * frame.right,
                2.0 / (size[1] * scale_y) * frame.up,
                middle,
            ],
            axis=1,
        )
        return np.asarray(rows @ ray)


def pack_light_curves(lights: Sequence[AreaLight]) -> tuple[Texels, tuple[CurvedShape, ...]]:
    """Return the texels (n, 4) of all visible lights with curves, and where each one is."""
    texels = [np.zeros((0, 4), dtype=np.float32)]
    shapes = []
    first = 0
    for index, light in enumerate(lights):
        if not (light.visible and is_curved(light)):
            continue
        held = outline_bands(light.outline)
        if not held.bands:
            continue
        u, v = np.array(light.plane.u), np.array(light.plane.v)
        origin = np.array(light.plane.origin) + held.centre[0] * u + held.centre[1] * v
        axes = (held.half[0] * u, held.half[1] * v)
        p_axis, q_axis = axes[::-1] if held.swapped else axes
        e1, e2, _ = plane_basis(light.plane)
        normal = np.cross(e1, e2)
        shapes.append(
            CurvedShape(
                -1 - index, light.two_sided, origin, p_axis, q_axis, normal, first, held.bands
            )
        )
        texels.append(held.texels)
        first += len(held.texels)
    return np.concatenate(texels), tuple(shapes)


# Hashing and per-entry overhead are worth about 1 KB.
_triangles = ByteCache(_light_triangles, lambda t: 1024 + t.nbytes, CACHED_BYTES)
_bands = ByteCache(_outline_bands, lambda b: 1024 + b.texels.nbytes, CACHED_BYTES)
