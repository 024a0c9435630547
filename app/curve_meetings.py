"""Where monotone pieces of curves meet: ends on other pieces, crossings, touches.

Pairs whose boxes overlap are bisected until two hulls separate their parts, or
no tangent of one part is parallel to any of the other, so that they cross once
at most and Newton's method finds where; or until they are straight and stay
within a given distance of each other, which is called touching.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app import curves
from app.monotone_pieces import is_on, parameter_along
from app.polygon_arrangement import cross, overlapping_boxes

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

NEWTON_ROUNDS = 8
"""From the middle of two parts that cross once; four are usual."""

MAX_DEPTH = 60
MAX_PARTS = 20_000
"""Of the bisection, and as many more for each thousand pairs; what exceeds it are curves
that run side by side for long, closer than its square: a larger distance joins them."""

LONG_TOUCH = 1e-3
"""Half extents from which a touching stretch is cut at both ends and not in its middle."""


class InconsistentError(Exception):
    """At this distance of touching, the arrangement contradicts itself or has no end."""


@dataclass
class Meetings:
    """Places where pieces must be cut: lists of arrays, one row per cut."""

    piece: list[IntArray]
    t: list[FloatArray]
    point: list[FloatArray]

    def add(self, piece: IntArray, t: FloatArray, point: FloatArray) -> None:
        self.piece.append(piece)
        self.t.append(t)
        self.point.append(point)


def find_meetings(p: FloatArray, touch: float) -> Meetings:
    """Find where monotone pieces (m, 4, 2) meet but in common ends."""
    low = np.minimum(p[:, 0], p[:, 3]) - touch
    high = np.maximum(p[:, 0], p[:, 3]) + touch
    one, two = overlapping_boxes(low, high)
    found = Meetings([], [], [])

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
            t[rows] = parameter_along(hosts, point[rows])
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
        near[left] = is_on(
            curves.evaluate(a[left], begin[left] + fraction * (end[left] - begin[left])),
            p[two[rows[left]]],
            4.0 * touch,
        )
    result[rows[near]] = True
    return result


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
    found: Meetings,
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
            raise InconsistentError
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
        raise InconsistentError
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
    found: Meetings,
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
        place = parameter_along(p[host][None], point[None])
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
