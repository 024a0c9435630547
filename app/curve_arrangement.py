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
from app.curve_meetings import InconsistentError, Meetings, find_meetings
from app.monotone_pieces import Pieces, is_on, monotone_pieces, ray_crossings
from app.polygon_arrangement import cross, frame, linked, polygon_regions
from app.scene import FillRule

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

TOUCHES = (1e-11, 1e-9, 1e-8, 1e-7, 1e-6)
"""Distances in half extents within which curves meet, tried in turn."""

LAST_RESORT = 1e-6
"""How far lines may be from the curves, in extents, where nothing else succeeds."""

SAMPLES = np.array([0.5, 0.27, 0.71, 0.08, 0.93])
"""Where on an edge a ray may start, until one is clear of all other pieces."""


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
            except InconsistentError:
                continue
        tolerance = LAST_RESORT * 2.0 * float(np.max(extent[1]))
        return _polygon_boundary([curves.flatten(chain, tolerance) for chain in normal], fill_rule)


def _polygon_boundary(contours: Sequence[FloatArray], fill_rule: FillRule) -> list[FloatArray]:
    return [
        curves.line_as_cubic(loop, np.roll(loop, -1, axis=0))
        for region in polygon_regions(contours, fill_rule)
        for loop in region.loops
    ]


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


def _cut(pieces: Pieces, found: Meetings, touch: float) -> tuple[_Edges, IntArray, FloatArray]:
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
            result &= is_on(middle, p[piece[f]], 8.0 * touch)
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
                raise InconsistentError
            used[edge] = True
            chain.append(edge)
            edge = leaving.get(stop[edge]) if passing[stop[edge]] else None
            if edge is None and passing[stop[chain[-1]]]:
                raise InconsistentError
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
                raise InconsistentError
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
        crossings, close = ray_crossings(places[rows], turned, 32.0 * touch)
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
    """Return the boundary of closed chains of curves (n, 4, 2), or raise `InconsistentError`."""
    centre, half = extent
    pieces = monotone_pieces((every - centre) / half)
    p = pieces.controls
    edges, record, points = _cut(pieces, find_meetings(p, touch), touch)
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
        raise InconsistentError
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
