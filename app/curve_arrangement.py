"""The boundary of what Bézier curves enclose, as loops of curves that do not cross.

Closed chains of cubics may cross themselves and each other, touch, overlap along
lines or curves, and wind as they like; the fill rule says what is inside.

1. Curves are cut where they turn in x or y. The pieces are monotone: their boxes
   are those of their ends, a ray meets each once at most, none crosses itself.
2. Pairs of pieces whose boxes overlap are searched for where they meet: ends that
   lie on the other piece, stretches where both coincide, and crossings. These by
   bisection, which drops what two hulls separate and stops where no tangent of one
   part is parallel to any of the other: there is one crossing at most, and Newton's
   method finds it. Parts that stay within `TOUCHES` of each other touch.
3. Points within that distance become one vertex, pieces are cut there, and those
   that coincide are merged, their directions added up.
4. Pieces between vertices where anything meets are joined to chains. Rays from up to
   four places of a chain count the winding numbers on its two sides, exactly,
   because pieces are monotone; the counts must agree.
5. Chains that separate inside from outside are linked to loops, turning into the
   interior at every vertex, and given the caller's curves back: cut, but not
   otherwise changed, and whole where nothing meets them.

All of it happens in the unit square, each axis with its own scale. Should the
winding numbers not agree, or loops not close, a larger distance counts as
touching; and if none does, the curves are drawn as lines within `LAST_RESORT`
and resolved as polygons, which cannot fail.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from app import curves
from app.polygon_arrangement import cross, frame, linked, overlapping_boxes, polygon_regions
from app.scene import FillRule

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

TOUCHES = (1e-11, 1e-9, 1e-8, 1e-7, 1e-6)
"""Distances in half extents within which curves meet, tried in turn."""

LAST_RESORT = 1e-6
"""How far lines may be from the curves, in extents, where nothing else succeeds."""

ROOT_ROUNDS = 80
"""Of the search for where a ray meets a piece; Newton's method needs about six."""

NEWTON_ROUNDS = 8
"""From the middle of two parts that cross once; four are usual."""

MAX_DEPTH = 60
MAX_PARTS = 20_000
"""Of the bisection, and as many more for each thousand pairs; what exceeds it are curves
that run side by side for long, closer than its square: a larger distance joins them."""

LONG_TOUCH = 1e-3
"""Half extents from which a touching stretch is cut at both ends and not in its middle."""

SAMPLES = np.array([0.5, 0.27, 0.71, 0.08, 0.93])
"""Where on an edge a ray may start, until one is clear of all other pieces."""


class _InconsistentError(Exception):
    """The arrangement contradicts itself at this distance of touching."""


def curve_boundary(chains: Sequence[FloatArray], fill_rule: FillRule) -> list[FloatArray]:
    """Return the loops between inside and outside of closed chains of cubics.

    Parameters
    ----------
    chains : sequence of (k, 4, 2) float64
        Each curve ends exactly where the next one begins, the last where the first does.
    fill_rule : {"evenodd", "nonzero"}

    Returns
    -------
    list of (k, 4, 2) float64
        As `app.outline.boundary` says.
    """
    # Divisions by zero and underflow are expected below, and what they give is not used.
    with np.errstate(all="ignore"):
        normal = [_normal_form(chain) for chain in chains]
        normal = [chain for chain in normal if len(chain)]
        extent = frame(np.concatenate(normal).reshape(-1, 2)) if normal else None
        if extent is None:
            return []
        if all(np.all(curves.is_straight(chain)) for chain in normal):
            return _polygon_boundary([chain[:, 0] for chain in normal], fill_rule)
        every = np.concatenate(normal)
        for touch in TOUCHES:
            try:
                return arranged(every, extent, fill_rule, touch)
            except _InconsistentError:
                continue
        tolerance = LAST_RESORT * 2.0 * float(np.max(extent[1]))
        return _polygon_boundary([curves.flatten(chain, tolerance) for chain in normal], fill_rule)


def winding_number(every: FloatArray, point: FloatArray) -> int:
    """Return how often closed chains of cubics (n, 4, 2) turn counter-clockwise about a point."""
    with np.errstate(all="ignore"):
        pieces = monotone_pieces(every).controls
        crossings, _ = _ray_crossings(point[None], pieces, 0.0)
    return int(crossings.sum())


def _polygon_boundary(contours: Sequence[FloatArray], fill_rule: FillRule) -> list[FloatArray]:
    return [
        curves.line_as_cubic(loop, np.roll(loop, -1, axis=0))
        for region in polygon_regions(contours, fill_rule)
        for loop in region.loops
    ]


# Normal form and monotone pieces


def _normal_form(chain: FloatArray) -> FloatArray:
    """Drop curves of zero length, and make those with collinear controls straight pieces."""
    chain = chain[np.any(chain != chain[:, :1], axis=(1, 2))]
    if not len(chain):
        return chain
    straight = curves.is_straight(chain)
    lines = curves.line_as_cubic(chain[:, 0], chain[:, 3])
    chain = np.where(straight[:, None, None], lines, chain)
    from_start = chain - chain[:, :1]
    lengths = np.hypot(from_start[..., 0], from_start[..., 1])
    farthest = np.argmax(lengths, axis=1)
    rows = np.arange(len(chain))
    direction = from_start[rows, farthest] / lengths[rows, farthest][:, None]
    off = np.max(np.abs(cross(direction[:, None], from_start)), axis=1)
    rounding = 4.0 * np.finfo(np.float64).eps * np.max(np.abs(chain), axis=(1, 2))
    collinear = (off <= curves.STRAIGHT * lengths[rows, farthest] + rounding) & ~straight
    if not np.any(collinear):
        return chain
    result = []
    for curve, is_line in zip(chain, collinear.tolist(), strict=True):
        if not is_line:
            result.append(curve[None])
            continue
        # A point that runs back and forth along a line turns where dp/dt vanishes.
        axis = int(np.argmax(np.ptp(curve, axis=0)))
        turns = np.unique(curves.extrema(curve)[axis])
        turns = turns[np.isfinite(turns)]
        points = np.concatenate((curve[:1], curves.evaluate(curve, turns), curve[3:]))
        lines = curves.line_as_cubic(points[:-1], points[1:])
        result.append(lines[np.any(points[:-1] != points[1:], axis=1)])
    return np.concatenate(result)


@dataclass(frozen=True)
class Pieces:
    """Parts of curves that turn neither in x nor in y.

    ``controls`` (m, 4, 2), neighbours meeting in the same point to the bit;
    ``source`` (m,) the curve of each, ``begin`` and ``end`` (m,) its parameters there.
    """

    controls: FloatArray
    source: IntArray
    begin: FloatArray
    end: FloatArray


def monotone_pieces(every: FloatArray) -> Pieces:
    """Cut curves (n, 4, 2) where they turn in x or y."""
    t = np.sort(curves.extrema(every).reshape(len(every), 4), axis=1)  # NaN last
    t = np.concatenate((np.zeros((len(every), 1)), t, np.full((len(every), 1), np.nan)), axis=1)
    last = np.sum(np.isfinite(t), axis=1)
    t[np.arange(len(every)), last] = 1.0
    keep = np.isfinite(t)
    keep[:, 1:] &= t[:, 1:] > t[:, :-1]
    source, column = np.nonzero(keep)
    stops = t[source, column]
    inner = source[:-1] == source[1:]
    source, begin, end = source[:-1][inner], stops[:-1][inner], stops[1:][inner]
    whole = (begin == 0.0) & (end == 1.0)
    pieces = every[source].copy()
    cut = ~whole
    cut_source = pieces[cut]
    pieces[cut] = curves.part(cut_source, begin[cut], end[cut])
    pieces[cut, 0] = curves.evaluate(cut_source, begin[cut])
    pieces[cut, 3] = curves.evaluate(cut_source, end[cut])
    return Pieces(pieces, source, begin, end)


def _parameter_at(p: FloatArray, value: FloatArray) -> FloatArray:
    """Return t (n,) where monotone cubics (n, 4) in one variable take values between their ends."""
    p0, p1, p2, p3 = (p[:, i] for i in range(4))
    a, b, c = p1 - p0, p2 - p1, p3 - p2
    rising = p3 > p0
    span = p3 - p0
    rounding = np.finfo(np.float64).eps * np.maximum(np.abs(p0), np.abs(p3))
    low, high = np.zeros(len(p)), np.ones(len(p))
    t = np.clip((value - p0) / np.where(span == 0.0, 1.0, span), 0.0, 1.0)
    for _ in range(ROOT_ROUNDS):
        u = 1.0 - t
        # From the start, so that values near it keep their digits.
        here = p0 + t * (3.0 * u * u * a + 3.0 * u * t * (a + b) + t * t * span)
        slope = 3.0 * (u * u * a + 2.0 * u * t * b + t * t * c)
        below = (here < value) == rising
        low, high = np.where(below, t, low), np.where(below, high, t)
        following = t + (value - here) / slope
        outside = ~((following > low) & (following < high))
        following = np.where(outside, 0.5 * (low + high), following)
        following = np.where(np.abs(here - value) <= rounding, t, following)
        if np.all(np.abs(following - t) <= 1e-15):
            break
        t = following
    return t


def _parameter_along(pieces: FloatArray, points: FloatArray) -> FloatArray:
    """Return t (n,) of the points on monotone pieces (n, 4, 2) that are beside ``points`` (n, 2).

    Where the diagonal that falls across the piece's direction meets it: for a
    point on the piece its own parameter, for one beside it a point at most √2
    times as far as the closest one.
    """
    sign = np.sign(pieces[:, 3] - pieces[:, 0])
    along = np.sum(pieces * sign[:, None], axis=-1)
    value = np.sum(points * sign, axis=-1)
    return _parameter_at(along, np.clip(value, along[:, 0], along[:, 3]))


def _ray_crossings(
    points: FloatArray, pieces: FloatArray, near: float
) -> tuple[NDArray[np.int8], BoolArray]:
    """Count how rays from points (k, 2) along +x meet monotone pieces (m, 4, 2).

    Returns
    -------
    crossings : (k, m) int8
        1 where a piece crosses the ray upwards, -1 downwards, else 0.
    close : (k, m) bool
        Whether it does so within ``near`` of the point, on either side.
    """
    x, y = points[:, :1], points[:, 1:]
    y0, y1 = pieces[:, 0, 1], pieces[:, 3, 1]
    upward = (y0 <= y) & (y1 > y)
    spans = upward | ((y1 <= y) & (y0 > y))
    crossings = np.where(spans, np.where(upward, 1, -1), 0).astype(np.int8)
    left = np.minimum(pieces[:, 0, 0], pieces[:, 3, 0])
    right = np.maximum(pieces[:, 0, 0], pieces[:, 3, 0])
    crossings[right < x - near] = 0
    close = np.zeros(spans.shape, dtype=bool)
    which, piece = np.nonzero(spans & (left <= x + near) & (right >= x - near))
    if len(which):
        chosen = pieces[piece]
        t = _parameter_at(chosen[..., 1], points[which, 1])
        beyond = curves.evaluate(chosen, t)[:, 0] - points[which, 0]
        crossings[which[beyond <= 0.0], piece[beyond <= 0.0]] = 0
        close[which, piece] = np.abs(beyond) <= near
    return crossings, close


# Where pieces meet


@dataclass
class _Meetings:
    """Places where pieces must be cut: lists of arrays, one row per cut."""

    piece: list[IntArray]
    t: list[FloatArray]
    point: list[FloatArray]

    def add(self, piece: IntArray, t: FloatArray, point: FloatArray) -> None:
        self.piece.append(piece)
        self.t.append(t)
        self.point.append(point)


def _meetings(p: FloatArray, touch: float) -> _Meetings:
    """Find where monotone pieces (m, 4, 2) meet but in common ends."""
    low = np.minimum(p[:, 0], p[:, 3]) - touch
    high = np.maximum(p[:, 0], p[:, 3]) + touch
    one, two = overlapping_boxes(low, high)
    found = _Meetings([], [], [])

    # Ends that lie on the other piece.
    known = np.full((len(one), 4, 2), np.nan)
    at = np.full((len(one), 4), np.nan)  # parameters of these on piece one
    on_other = np.zeros(len(one), dtype=bool)  # not just a common end
    for column, (host, guest, tip) in enumerate(
        ((two, one, 0), (two, one, 3), (one, two, 0), (one, two, 3))
    ):
        point = p[guest, tip]
        first = np.all(point == p[host, 0], axis=1)
        last = np.all(point == p[host, 3], axis=1)
        t = np.where(first, 0.0, 1.0)
        inside = np.all((point >= low[host]) & (point <= high[host]), axis=1) & ~first & ~last
        rows = np.flatnonzero(inside)
        if len(rows):
            hosts = p[host[rows]]
            t[rows] = _parameter_along(hosts, point[rows])
            off = curves.evaluate(hosts, t[rows]) - point[rows]
            inside[rows] = np.hypot(off[:, 0], off[:, 1]) <= 2.0 * touch
            rows = np.flatnonzero(inside)
            found.add(host[rows], t[rows], point[rows])
            on_other |= inside
        met = inside | first | last
        known[met, column] = point[met]
        at[met, column] = t[met] if host is one else (0.0 if tip == 0 else 1.0)

    is_known = np.isfinite(at)
    coincide = _coincide(p, one, two, at, is_known, touch)
    # Boxes that only touch, at a common point: nothing more to find between these pieces.
    overlap = np.minimum(high[one], high[two]) - np.maximum(low[one], low[two])
    thin = np.any(overlap <= 4.0 * touch, axis=1) & np.any(is_known, axis=1)
    rest = ~(coincide | thin)
    _cross_pieces(p, one[rest], two[rest], known[rest], touch, found)
    return found


def _coincide(
    p: FloatArray, one: IntArray, two: IntArray, at: FloatArray, is_known: BoolArray, touch: float
) -> BoolArray:
    """Tell which pairs run along each other between two of their known common points.

    Curves of the third degree that agree in more than nine points are the same,
    and what they share ends only where one of them does.
    """
    result = np.zeros(len(one), dtype=bool)
    rows = np.flatnonzero(np.count_nonzero(is_known, axis=1) >= 2)
    if not len(rows):
        return result
    stops = np.sort(at[rows], axis=1)
    begin, end = stops[:, :-1].ravel(), stops[:, 1:].ravel()
    rows = np.repeat(rows, 3)
    exists = np.isfinite(end)
    rows, begin, end = rows[exists], begin[exists], end[exists]
    a = p[one[rows]]
    chord = curves.evaluate(a, end) - curves.evaluate(a, begin)
    has_length = np.hypot(chord[:, 0], chord[:, 1]) > 16.0 * touch
    rows, begin, end, a = rows[has_length], begin[has_length], end[has_length], a[has_length]
    if not len(rows):
        return result
    near = np.ones(len(rows), dtype=bool)
    for fraction in (0.5, 0.1, 0.2, 0.3, 0.4, 0.6, 0.7, 0.8, 0.9):
        left = np.flatnonzero(near)
        if not len(left):
            break
        near[left] = _is_on(
            curves.evaluate(a[left], begin[left] + fraction * (end[left] - begin[left])),
            p[two[rows[left]]],
            4.0 * touch,
        )
    result[rows[near]] = True
    return result


def _is_on(points: FloatArray, pieces: FloatArray, within: float) -> BoolArray:
    off = curves.evaluate(pieces, _parameter_along(pieces, points)) - points
    return np.asarray(np.hypot(off[:, 0], off[:, 1]) <= within)


@dataclass(frozen=True)
class _Parts:
    """Parts of two pieces each: the pair, the controls, and the parameters on the pieces."""

    pair: IntArray
    a: FloatArray
    b: FloatArray
    range_a: FloatArray
    range_b: FloatArray

    def __getitem__(self, rows: BoolArray | IntArray) -> _Parts:
        return _Parts(
            self.pair[rows], self.a[rows], self.b[rows], self.range_a[rows], self.range_b[rows]
        )

    def bisected(self, bisect_a: BoolArray, bisect_b: BoolArray) -> _Parts:
        """Return the halves of all parts, of piece a, piece b or both."""
        rows, a, range_a = _halves(self.a, self.range_a, bisect_a)
        parts = _Parts(self.pair[rows], a, self.b[rows], range_a, self.range_b[rows])
        rows, b, range_b = _halves(parts.b, parts.range_b, bisect_b[rows])
        return _Parts(parts.pair[rows], parts.a[rows], b, parts.range_a[rows], range_b)


def _halves(
    controls: FloatArray, span: FloatArray, halve: BoolArray
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Halve the chosen ones of parts; return from which row each result comes, and the results."""
    kept, cut = np.flatnonzero(~halve), np.flatnonzero(halve)
    before, after = curves.split(controls[cut], 0.5)
    low, high = span[cut, 0], span[cut, 1]
    middle = 0.5 * (low + high)
    spans = (span[kept], np.stack((low, middle), axis=1), np.stack((middle, high), axis=1))
    return (
        np.concatenate((kept, cut, cut)),
        np.concatenate((controls[kept], before, after)),
        np.concatenate(spans),
    )


def _cross_pieces(
    p: FloatArray,
    one: IntArray,
    two: IntArray,
    known: FloatArray,
    touch: float,
    found: _Meetings,
) -> None:
    """Find the crossings and touches of pairs of pieces, but at points known already."""
    count = len(one)
    whole = np.tile([0.0, 1.0], (count, 1))
    parts = _Parts(np.arange(count), p[one], p[two], whole, whole)
    touching: list[_Parts] = []
    left_to_do = MAX_PARTS * (1.0 + 1e-3 * count)
    for _ in range(MAX_DEPTH):
        parts = parts[_may_meet(parts.a, parts.b, known[parts.pair], touch)]
        if not len(parts.pair):
            break
        left_to_do -= len(parts.pair)
        if left_to_do < 0.0:
            raise _InconsistentError
        transversal = _is_transversal(parts.a, parts.b)
        done = np.zeros(len(transversal), dtype=bool)
        if np.any(transversal):
            rows = np.flatnonzero(transversal)
            once = parts[rows]
            u, v, succeeded = _newton(once.a, once.b, touch)
            once, u, v = once[succeeded], u[succeeded], v[succeeded]
            done[rows[succeeded]] = True
            s = once.range_a[:, 0] + u * (once.range_a[:, 1] - once.range_a[:, 0])
            t = once.range_b[:, 0] + v * (once.range_b[:, 1] - once.range_b[:, 0])
            point = curves.evaluate(p[one[once.pair]], s)
            found.add(one[once.pair], s, point)
            found.add(two[once.pair], t, point)
        size_a, size_b = (_size(controls) for controls in (parts.a, parts.b))
        # Nearly straight, and no farther apart at the shorter one's other end.
        flat = (_bulge(parts.a) <= 0.25 * touch) & (_bulge(parts.b) <= 0.25 * touch)
        chord_a, chord_b = (ends[:, 3] - ends[:, 0] for ends in (parts.a, parts.b))
        widening = np.abs(cross(chord_a, chord_b)) / np.maximum(size_a, size_b)
        is_touch = ~done & flat & (widening <= 4.0 * touch)
        is_touch |= ~done & (size_a <= touch) & (size_b <= touch)
        if np.any(is_touch):
            touching.append(parts[is_touch])
        left = ~(done | is_touch)
        parts, size_a, size_b = parts[left], size_a[left], size_b[left]
        parts = parts.bisected(2.0 * size_a >= size_b, 2.0 * size_b >= size_a)
    else:
        raise _InconsistentError
    if touching:
        _add_touches(p, one, two, touching, touch, found)


def _size(controls: FloatArray) -> FloatArray:
    return np.asarray(np.max(np.abs(controls[:, 3] - controls[:, 0]), axis=1))


def _bulge(controls: FloatArray) -> FloatArray:
    """Return a bound for how far curves are from their chords."""
    bend = np.abs(np.diff(controls, n=2, axis=1))
    return np.asarray(0.75 * np.max(bend, axis=(1, 2)))


def _may_meet(a: FloatArray, b: FloatArray, known: FloatArray, touch: float) -> BoolArray:
    """Tell which parts may come within ``touch`` of each other but near known points."""
    low = np.maximum(np.minimum(a[:, 0], a[:, 3]), np.minimum(b[:, 0], b[:, 3]))
    high = np.minimum(np.maximum(a[:, 0], a[:, 3]), np.maximum(b[:, 0], b[:, 3]))
    may: BoolArray = np.all(low <= high + touch, axis=1)
    # All of the overlap is at a known point.
    reach = np.maximum(
        np.max(np.abs(low[:, None] - known), axis=2), np.max(np.abs(high[:, None] - known), axis=2)
    )
    may &= ~np.any(reach <= 8.0 * touch, axis=1)
    rows = np.flatnonzero(may)
    for p, q in ((a[rows], b[rows]), (b[rows], a[rows])):
        # Between two lines along the chord there is p, and q is not.
        chord = p[:, 3] - p[:, 0]
        length = np.hypot(chord[:, 0], chord[:, 1])
        chord = chord / np.where(length > 0.0, length, 1.0)[:, None]
        own = cross(chord[:, None], p - p[:, :1])
        other = cross(chord[:, None], q - p[:, :1])
        apart = (other.min(axis=1) > own.max(axis=1) + touch) | (
            other.max(axis=1) < own.min(axis=1) - touch
        )
        may[rows[apart]] = False
    return may


def _is_transversal(a: FloatArray, b: FloatArray) -> BoolArray:
    """Tell where no tangent of a is parallel to one of b: they meet once at most.

    The difference a(s) − b(t) is then one-to-one, as its mean derivatives over
    any box lie in the tangents' cones.
    """
    da, db = np.diff(a, axis=1), np.diff(b, axis=1)
    turns = cross(da[:, :, None], db[:, None])
    # Handles of length zero leave their tangents to the others'.
    scale = np.max(np.abs(da), axis=(1, 2)) * np.max(np.abs(db), axis=(1, 2))
    least = 1e-13 * scale[:, None, None]
    nothing = (np.all(da == 0.0, axis=2)[:, :, None]) | (np.all(db == 0.0, axis=2)[:, None])
    ok = np.all((turns > least) | nothing, axis=(1, 2))
    ok |= np.all((turns < -least) | nothing, axis=(1, 2))
    return np.asarray(ok & ~np.all(nothing, axis=(1, 2)))


def _newton(a: FloatArray, b: FloatArray, touch: float) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Find u, v with a(u) = b(v), and tell where they are within both parts."""
    u, v = np.full(len(a), 0.5), np.full(len(a), 0.5)
    off = curves.evaluate(a, u) - curves.evaluate(b, v)
    for _ in range(NEWTON_ROUNDS):
        da, db = curves.derivative(a, u), curves.derivative(b, v)
        det = cross(da, db)
        u = np.clip(u - cross(off, db) / det, -0.25, 1.25)
        v = np.clip(v - cross(off, da) / det, -0.25, 1.25)
        off = curves.evaluate(a, u) - curves.evaluate(b, v)
    # What lies beyond an end by less than the distance of touching is at the end.
    inside = np.hypot(off[:, 0], off[:, 1]) <= 1e-3 * touch
    for t, controls in ((u, a), (v, b)):
        beyond = np.maximum(-t, t - 1.0)
        speed = np.max(np.abs(curves.derivative(controls, np.clip(t, 0.0, 1.0))), axis=1)
        inside &= beyond * speed <= touch
    return np.clip(u, 0.0, 1.0), np.clip(v, 0.0, 1.0), inside


def _add_touches(
    p: FloatArray,
    one: IntArray,
    two: IntArray,
    touching: list[_Parts],
    touch: float,
    found: _Meetings,
) -> None:
    """Join parts that touch to stretches, and let both pieces have the same vertices there.

    Where pieces touch like curves of the same tangent, they are indistinguishable
    over the square root of the distance of touching. A vertex that one has in such
    a stretch the other gets too; only without any a new one is made in its middle.
    Several pieces that touch in one place thus share one vertex.
    """
    pair = np.concatenate([parts.pair for parts in touching])
    range_a = np.concatenate([parts.range_a for parts in touching])
    range_b = np.concatenate([parts.range_b for parts in touching])
    order = np.lexsort((range_a[:, 0], pair))
    pair, range_a, range_b = pair[order], range_a[order], range_b[order]
    involved = np.unique(np.concatenate((one[pair], two[pair])))
    cuts: dict[int, list[tuple[float, FloatArray]]] = {
        index: [(0.0, p[index, 0]), (1.0, p[index, 3])] for index in involved.tolist()
    }
    for pieces, places, points in zip(found.piece, found.t, found.point, strict=True):
        for row in np.flatnonzero(np.isin(pieces, involved)).tolist():
            cuts[int(pieces[row])].append((float(places[row]), points[row]))

    def share(host: int, point: FloatArray) -> bool:
        """Cut a piece at a point of another one, if it is on both."""
        if any(np.array_equal(point, known) for _, known in cuts[host]):
            return True
        place = _parameter_along(p[host][None], point[None])
        if np.hypot(*(curves.evaluate(p[host], place[0]) - point)) > 4.0 * touch:
            return False
        found.add(np.array([host]), place, point[None])
        cuts[host].append((float(place[0]), point))
        return True

    begins = np.ones(len(pair), dtype=bool)
    begins[1:] = pair[1:] != pair[:-1]
    # Ends of the parts so far: within a pair, parts in order of their beginnings.
    for row in range(1, len(pair)):
        if not begins[row]:
            begins[row] = range_a[row, 0] > range_a[row - 1, 1] + 1e-12
            range_a[row, 1] = max(range_a[row, 1], range_a[row - 1, 1])
    firsts = np.flatnonzero(begins)
    lasts = np.append(firsts[1:], len(pair)) - 1
    # The second time round for what a later stretch gave to a piece of an earlier one.
    for is_first_round in (True, False):
        for first, last in zip(firsts.tolist(), lasts.tolist(), strict=True):
            a, b = int(one[pair[first]]), int(two[pair[first]])
            begin, end = float(range_a[first, 0]), float(range_a[last, 1])
            others = range_b[first : last + 1]
            shared = False
            for here, other, low, high in (
                (a, b, begin, end),
                (b, a, float(others.min()), float(others.max())),
            ):
                length = high - low
                for t, point in list(cuts[here]):
                    if low - length <= t <= high + length:
                        shared |= share(other, point)
            if not is_first_round:
                continue
            tips = curves.evaluate(p[a], np.array([begin, end]))
            is_long = float(np.max(np.abs(tips[1] - tips[0]))) > LONG_TOUCH
            middle = () if shared else (0.5 * (begin + end),)
            for at in (begin, end) if is_long else middle:
                new = curves.evaluate(p[a], at)
                if share(b, new):
                    found.add(np.array([a]), np.array([at]), new[None])
                    cuts[a].append((at, new))


# Edges between vertices


@dataclass(frozen=True)
class _Edges:
    """Parts of pieces between vertices.

    ``piece`` (n,) and ``begin``, ``end`` (n,) its parameters on the piece;
    ``start``, ``stop`` (n,) the vertices there; ``count`` (n,) how often the edge
    was drawn in its direction, more than in the other; ``owners`` the pieces that
    were merged into each.
    """

    piece: IntArray
    begin: FloatArray
    end: FloatArray
    start: IntArray
    stop: IntArray
    count: IntArray
    owners: list[list[int]]


def _cut(pieces: Pieces, found: _Meetings, touch: float) -> tuple[_Edges, IntArray, FloatArray]:
    """Cut pieces at vertices and merge what coincides.

    Returns
    -------
    edges : _Edges
    record : (v,) int64
        For each vertex the first place that became it: an end of a piece (its
        starts first, then its ends), if there is one.
    points : (v, 2) float64
        The vertices.
    """
    p = pieces.controls
    total = len(p)
    piece = np.concatenate((np.arange(total), np.arange(total), *found.piece))
    t = np.concatenate((np.zeros(total), np.ones(total), *found.t))
    point = np.concatenate((p[:, 0], p[:, 3], *found.point))
    vertex, vertices = _vertices(point, 4.0 * touch)

    order = np.lexsort((t, piece))
    piece, t, stop = piece[order], t[order], vertex[order]
    inner = (piece[:-1] == piece[1:]) & (stop[:-1] != stop[1:])
    edge_piece, begin, end = piece[:-1][inner], t[:-1][inner], t[1:][inner]
    edges = _merged(p, edge_piece, begin, end, stop[:-1][inner], stop[1:][inner], touch)

    # Anchors of the caller come first, then other ends of pieces, then crossings.
    anchor = np.concatenate((pieces.begin == 0.0, pieces.end == 1.0))
    rank = np.full(len(point), 2)
    rank[: 2 * total] = np.where(anchor, 0, 1)
    by_rank = np.lexsort((np.arange(len(point)), rank))[::-1]
    record = np.zeros(vertices, dtype=np.int64)
    record[vertex[by_rank]] = by_rank
    return edges, record, point[record]


def _vertices(points: FloatArray, within: float) -> tuple[IntArray, int]:
    """Number points alike that are within a distance of each other, or linked by such points."""
    distinct, number = np.unique(points, axis=0, return_inverse=True)
    number = number.reshape(-1)
    close = cKDTree(distinct).query_pairs(within, output_type="ndarray")
    if not len(close):
        return number, len(distinct)
    size = len(distinct)
    links = coo_matrix((np.ones(len(close)), (close[:, 0], close[:, 1])), shape=(size, size))
    count, label = connected_components(links, directed=False)
    return label.astype(np.int64)[number], int(count)


def _merged(
    p: FloatArray,
    piece: IntArray,
    begin: FloatArray,
    end: FloatArray,
    start: IntArray,
    stop: IntArray,
    touch: float,
) -> _Edges:
    """Add up the directions of edges that coincide, and drop what cancels."""
    low, high = np.minimum(start, stop), np.maximum(start, stop)
    order = np.lexsort((piece, high, low))
    same = (low[order][1:] == low[order][:-1]) & (high[order][1:] == high[order][:-1])
    count = np.ones(len(piece), dtype=np.int64)
    owners = [[index] for index in piece.tolist()]
    alive = np.ones(len(piece), dtype=bool)

    def coincide(e: IntArray, f: IntArray) -> BoolArray:
        result = np.ones(len(e), dtype=bool)
        for fraction in (0.5, 0.2, 0.8):
            middle = curves.evaluate(p[piece[e]], begin[e] + fraction * (end[e] - begin[e]))
            result &= _is_on(middle, p[piece[f]], 8.0 * touch)
        return result

    if np.any(same):
        group = np.concatenate(([0], np.cumsum(~same)))
        sizes = np.bincount(group)
        firsts = np.concatenate(([0], np.cumsum(sizes)[:-1]))
        multiple = np.flatnonzero(sizes > 1)
        # All against the first of their group at once; what differs, one by one.
        rows = np.flatnonzero(sizes[group] > 1)
        rows = rows[rows != firsts[group[rows]]]
        to_first = dict(
            zip(
                order[rows].tolist(),
                coincide(order[rows], order[firsts[group[rows]]]).tolist(),
                strict=True,
            )
        )
        for k in multiple.tolist():
            members = order[firsts[k] : firsts[k] + sizes[k]].tolist()
            kept = members[:1]
            for edge in members[1:]:
                match = kept[0] if to_first[edge] else None
                for other in kept[1:] if match is None else ():
                    if coincide(np.array([edge]), np.array([other]))[0]:
                        match = other
                        break
                if match is None:
                    kept.append(edge)
                else:
                    count[match] += 1 if start[edge] == start[match] else -1
                    owners[match] += owners[edge]
                    alive[edge] = False
    alive &= count != 0
    flip = count < 0
    begin, end = np.where(flip, end, begin), np.where(flip, begin, end)
    start, stop = np.where(flip, stop, start), np.where(flip, start, stop)
    rows = np.flatnonzero(alive)
    return _Edges(
        piece[rows],
        begin[rows],
        end[rows],
        start[rows],
        stop[rows],
        np.abs(count[rows]),
        [owners[row] for row in rows.tolist()],
    )


def _chains(edges: _Edges, vertices: int) -> list[list[int]]:
    """Join edges through vertices where only two meet; closed chains begin anywhere."""
    degree = np.bincount(edges.start, minlength=vertices)
    degree += np.bincount(edges.stop, minlength=vertices)
    passing = (degree == 2).tolist()
    start, stop, count = edges.start.tolist(), edges.stop.tolist(), edges.count.tolist()
    leaving = {start[edge]: edge for edge in range(len(start)) if passing[start[edge]]}
    used = [False] * len(start)
    chains = []
    beginnings = [edge for edge in range(len(start)) if not passing[start[edge]]]
    for first in (*beginnings, *range(len(start))):
        if used[first]:
            continue
        chain = []
        edge: int | None = first
        while edge is not None and not used[edge]:
            if count[edge] != count[first]:
                raise _InconsistentError
            used[edge] = True
            chain.append(edge)
            edge = leaving.get(stop[edge]) if passing[stop[edge]] else None
            if edge is None and passing[stop[chain[-1]]]:
                raise _InconsistentError
        chains.append(chain)
    return chains


# Inside and outside


def _windings(p: FloatArray, edges: _Edges, chains: list[list[int]], touch: float) -> IntArray:
    """Return the winding numbers (chains, 2) on the left and right of chains."""
    result = np.zeros((len(chains), 2), dtype=np.int64)
    settled = np.zeros(len(chains), dtype=bool)
    fallback = np.zeros((len(chains), 2), dtype=np.int64)
    for round_, fraction in enumerate(SAMPLES):
        rows = np.flatnonzero(~settled)
        if not len(rows):
            break
        places = [
            (row, edge)
            for row in rows.tolist()
            for edge in {chains[row][(len(chains[row]) - 1) * k // 3] for k in range(4)}
        ]
        chain, edge = np.array(places).T
        left, right, clear = _sides(p, edges, edge, float(fraction), touch)
        pair = np.stack((left, right), axis=1)
        if round_ == 0:
            fallback[chain] = pair
        for row, numbers in zip(chain[clear].tolist(), pair[clear], strict=True):
            if settled[row] and np.any(result[row] != numbers):
                raise _InconsistentError
            result[row] = numbers
            settled[row] = True
    # Chains nowhere clear of others are as short as the distance of touching, or run along one.
    result[~settled] = fallback[~settled]
    return result


def _sides(
    p: FloatArray, edges: _Edges, edge: IntArray, fraction: float, touch: float
) -> tuple[IntArray, IntArray, BoolArray]:
    """Return winding numbers left and right of edges at a place, and if no piece is near it."""
    piece = p[edges.piece[edge]]
    t = edges.begin[edge] + fraction * (edges.end[edge] - edges.begin[edge])
    point = curves.evaluate(piece, t)
    step = curves.derivative(piece, t) * np.sign(edges.end[edge] - edges.begin[edge])[:, None]
    still = np.all(step == 0.0, axis=1)
    step = np.where(still[:, None], curves.evaluate(piece, edges.end[edge]) - point, step)
    left, right = np.zeros(len(edge), dtype=np.int64), np.zeros(len(edge), dtype=np.int64)
    clear = np.zeros(len(edge), dtype=bool)
    level = np.abs(step[:, 0]) > np.abs(step[:, 1])
    for is_level in (False, True):
        rows = np.flatnonzero(level == is_level)
        if not len(rows):
            continue
        # A flat edge sends its ray up: the plane turned by -90 degrees, the ray along +x.
        turned = np.stack((p[..., 1], -p[..., 0]), axis=-1) if is_level else p
        places = np.stack((point[:, 1], -point[:, 0]), axis=1) if is_level else point
        upward = np.where(is_level, -step[rows, 0], step[rows, 1]) > 0.0
        crossings, close = _ray_crossings(places[rows], turned, 32.0 * touch)
        for k, row in enumerate(rows.tolist()):
            own = edges.owners[edge[row]]
            crossings[k, own] = 0
            close[k, own] = False
        ahead = np.sum(crossings, axis=1, dtype=np.int64)
        count = edges.count[edge[rows]]
        # The ray leaves an upward edge on its right, a downward one on its left.
        right[rows] = np.where(upward, ahead, ahead - count)
        left[rows] = right[rows] + count
        clear[rows] = ~np.any(close, axis=1)
    return left, right, clear


# All together


def arranged(
    every: FloatArray, extent: tuple[FloatArray, FloatArray], fill_rule: FillRule, touch: float
) -> list[FloatArray]:
    """Return the boundary of closed chains of curves (n, 4, 2), or raise `_InconsistentError`."""
    centre, half = extent
    pieces = monotone_pieces((every - centre) / half)
    p = pieces.controls
    edges, record, points = _cut(pieces, _meetings(p, touch), touch)
    if not len(edges.piece):
        return []
    chains = _chains(edges, len(record))
    windings = _windings(p, edges, chains, touch)
    inside = (windings % 2 != 0) if fill_rule == "evenodd" else (windings != 0)
    kept = np.flatnonzero(inside[:, 0] != inside[:, 1])
    # Directed edges: the edge and whether it is travelled backwards.
    steps: list[list[tuple[int, bool]]] = []
    for index in kept.tolist():
        if inside[index, 0]:
            steps.append([(edge, False) for edge in chains[index]])
        else:
            steps.append([(edge, True) for edge in reversed(chains[index])])
    if not steps:
        return []
    begins = np.array([_start(edges, *step[0]) for step in steps])
    ends = np.array([_stop(edges, *step[-1]) for step in steps])
    if np.any(
        np.bincount(begins, minlength=len(record)) != np.bincount(ends, minlength=len(record))
    ):
        raise _InconsistentError
    ahead, back = _directions(p, edges, points, steps, begins, ends)
    coordinates = points * half + centre
    # The caller's own coordinates where a curve of theirs begins or ends.
    total = len(p)
    of_start = (record < total) & (pieces.begin[np.minimum(record, total - 1)] == 0.0)
    coordinates[of_start] = every[pieces.source[record[of_start]], 0]
    of_end = (record >= total) & (record < 2 * total)
    of_end &= pieces.end[np.clip(record - total, 0, total - 1)] == 1.0
    coordinates[of_end] = every[pieces.source[record[of_end] - total], 3]

    loops = []
    for order in linked(begins, ends, ahead, back):
        loop = _as_drawn(
            every, pieces, edges, coordinates, [step for chain in order for step in steps[chain]]
        )
        unit = (loop - centre) / half
        length = float(np.sum(np.abs(np.diff(unit, axis=1))))
        if abs(float(np.sum(curves.signed_areas(unit - unit[0, 0])))) > 4.0 * touch * length:
            loops.append(loop)
    return loops


def _start(edges: _Edges, edge: int, is_backward: bool) -> int:
    return int((edges.stop if is_backward else edges.start)[edge])


def _stop(edges: _Edges, edge: int, is_backward: bool) -> int:
    return int((edges.start if is_backward else edges.stop)[edge])


def _directions(
    p: FloatArray,
    edges: _Edges,
    points: FloatArray,
    steps: list[list[tuple[int, bool]]],
    begins: IntArray,
    ends: IntArray,
) -> tuple[FloatArray, FloatArray]:
    """Return where chains leave their first vertices, and where they came from at their last.

    Monotone edges move away from their ends, so each meets a circle about a
    vertex once, if it is no larger than its shortest edge: around it they are in
    the order in which they leave, tangent edges too.
    """
    count = len(steps)
    ahead, back = np.zeros((count, 2)), np.zeros((count, 2))
    busy = np.bincount(begins, minlength=len(points)) > 1
    first = np.array([step[0] for step in steps])
    last = np.array([step[-1] for step in steps])
    # Of each edge end: the edge, the vertex, and if the piece's parameter grows away from it.
    at_start, at_end = np.flatnonzero(busy[begins]), np.flatnonzero(busy[ends])
    if not len(at_start):
        return ahead, back
    edge = np.concatenate((first[at_start, 0], last[at_end, 0]))
    vertex = np.concatenate((begins[at_start], ends[at_end]))
    from_begin = np.concatenate((first[at_start, 1] == 0, last[at_end, 1] == 1))
    near = np.where(from_begin, edges.begin[edge], edges.end[edge])
    far = np.where(from_begin, edges.end[edge], edges.begin[edge])
    piece = p[edges.piece[edge]]
    origin = curves.evaluate(piece, near)
    chord = curves.evaluate(piece, far) - origin
    radius = np.full(len(points), np.inf)
    np.minimum.at(radius, vertex, 0.5 * np.hypot(chord[:, 0], chord[:, 1]))
    low, high = near, far
    for _ in range(50):
        middle = 0.5 * (low + high)
        off = curves.evaluate(piece, middle) - origin
        within = np.hypot(off[:, 0], off[:, 1]) < radius[vertex]
        low, high = np.where(within, middle, low), np.where(within, high, middle)
    direction = curves.evaluate(piece, 0.5 * (low + high)) - points[vertex]
    ahead[at_start] = direction[: len(at_start)]
    back[at_end] = direction[len(at_start) :]
    return ahead, back


def _as_drawn(
    every: FloatArray,
    pieces: Pieces,
    edges: _Edges,
    coordinates: FloatArray,
    steps: list[tuple[int, bool]],
) -> FloatArray:
    """Return a loop of edges as parts of the caller's curves, as long as possible."""
    edge = np.array([index for index, _ in steps])
    backward = np.array([is_backward for _, is_backward in steps])
    start = np.where(backward, edges.stop[edge], edges.start[edge])
    piece = edges.piece[edge]
    source = pieces.source[piece]
    # From parameters on the piece to parameters on the curve.
    begin = np.where(backward, edges.end[edge], edges.begin[edge])
    end = np.where(backward, edges.begin[edge], edges.end[edge])
    span = pieces.end[piece] - pieces.begin[piece]
    t0, t1 = (
        np.where(t == 1.0, pieces.end[piece], pieces.begin[piece] + t * span) for t in (begin, end)
    )
    # An edge continues the one before it if the curve does.
    before = np.roll(np.arange(len(edge)), 1)
    continues = (source == source[before]) & (np.abs(t0 - t1[before]) <= 1e-9)
    continues &= np.sign(t1 - t0) == np.sign(t1 - t0)[before]
    breaks = np.flatnonzero(~continues)
    if not len(breaks):
        breaks = np.zeros(1, dtype=np.int64)
    last = np.roll(breaks, -1) - 1
    source, t0, t1 = source[breaks], t0[breaks], t1[last]
    vertex = start[breaks]
    loop: FloatArray = every[source].copy()
    whole = (t0 == 0.0) & (t1 == 1.0)
    turned = (t0 == 1.0) & (t1 == 0.0)
    loop[turned] = loop[turned][:, ::-1]
    cut = ~(whole | turned)
    loop[cut] = curves.part(every[source[cut]], t0[cut], t1[cut])
    loop[:, 0] = coordinates[vertex]
    loop[:, 3] = coordinates[np.roll(vertex, -1)]
    straight = curves.is_straight(every[source])
    loop[straight] = curves.line_as_cubic(loop[straight, 0], loop[straight, 3])
    return loop
