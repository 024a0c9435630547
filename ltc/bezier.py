"""Cubic Bézier curves in space: points, parts, where they change sign, what is above a plane.

Curves are arrays (..., 4, d) of control points. A contour is a (..., k, 4, d) array
of curves, each ending where the next begins. Straight edges and quadratics are
raised to cubics, exactly. What lights with such outlines send is `ltc.curved_outline`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

FloatArray: TypeAlias = npt.NDArray[np.float64]
IntArray: TypeAlias = npt.NDArray[np.intp]
BoolArray: TypeAlias = npt.NDArray[np.bool_]


def _curves(curves: npt.ArrayLike) -> FloatArray:
    p = np.asarray(curves, dtype=np.float64)
    if p.ndim < 2 or p.shape[-2] != 4:
        raise ValueError(f"curves have shape {p.shape}, expected (..., 4, d)")
    return p


def from_line(a: npt.ArrayLike, b: npt.ArrayLike) -> FloatArray:
    """Return straight segments a -> b, (..., d) each, as cubics (..., 4, d), evenly run through."""
    a, b = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    a, b = np.broadcast_arrays(a, b)
    return np.stack([a, (2.0 * a + b) / 3.0, (a + 2.0 * b) / 3.0, b], axis=-2)


def from_polygon(vertices: npt.ArrayLike) -> FloatArray:
    """Return the edges of closed polygons (..., N, d) as a contour of cubics (..., N, 4, d)."""
    p = np.asarray(vertices, dtype=np.float64)
    return from_line(p, np.roll(p, -1, axis=-2))


def from_quadratic(control: npt.ArrayLike) -> FloatArray:
    """Return the same curves as cubics.

    Parameters
    ----------
    control : (..., 3, d) float64
        Control points of quadratic Béziers.

    Returns
    -------
    (..., 4, d) float64
        Their cubic control points: the inner ones are 2/3 of the way from an end to the
        quadratic's middle point.

    Raises
    ------
    ValueError
        If the shape is not (..., 3, d).
    """
    q = np.asarray(control, dtype=np.float64)
    if q.ndim < 2 or q.shape[-2] != 3:
        raise ValueError(f"control has shape {q.shape}, expected (..., 3, d)")
    a, m, b = q[..., 0, :], q[..., 1, :], q[..., 2, :]
    return np.stack([a, (a + 2.0 * m) / 3.0, (2.0 * m + b) / 3.0, b], axis=-2)


def _blend(p: FloatArray, t: FloatArray) -> FloatArray:
    """Return one step of de Casteljau on (..., j, d) with t (...): (..., j - 1, d)."""
    t = t[..., None, None]
    return (1.0 - t) * p[..., :-1, :] + t * p[..., 1:, :]


def evaluate(curves: npt.ArrayLike, t: npt.ArrayLike) -> FloatArray:
    """Return points of curves by de Casteljau's steps, exact at t = 0 and 1.

    Parameters
    ----------
    curves : (..., 4, d) float64
        Control points.
    t : (...) float64
        Parameters, broadcast against the curves' leading axes.

    Returns
    -------
    (..., d) float64

    Raises
    ------
    ValueError
        If the curves' shape is not (..., 4, d).
    """
    p, t = _curves(curves), np.asarray(t, dtype=np.float64)
    return np.asarray(_blend(_blend(_blend(p, t), t), t)[..., 0, :])


def derivative(curves: npt.ArrayLike, t: npt.ArrayLike) -> FloatArray:
    """Return d/dt of curves: shapes as for `evaluate`."""
    p, t = _curves(curves), np.asarray(t, dtype=np.float64)
    return np.asarray(3.0 * _blend(_blend(np.diff(p, axis=-2), t), t)[..., 0, :])


def split(curves: npt.ArrayLike, t: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return the parts (..., 4, d) of curves before and after t (...), sharing their point at t."""
    p, t = _curves(curves), np.asarray(t, dtype=np.float64)
    a = _blend(p, t)
    b = _blend(a, t)
    c = _blend(b, t)
    p = np.broadcast_to(p, (*c.shape[:-2], 4, c.shape[-1]))
    before = np.stack([p[..., 0, :], a[..., 0, :], b[..., 0, :], c[..., 0, :]], axis=-2)
    after = np.stack([c[..., 0, :], b[..., 1, :], a[..., 2, :], p[..., 3, :]], axis=-2)
    return before, after


def part(curves: npt.ArrayLike, lo: npt.ArrayLike, hi: npt.ArrayLike) -> FloatArray:
    """Return the part of curves between the parameters lo and hi (...), as curves (..., 4, d).

    Control points are the blossom at (lo, lo, lo), (lo, lo, hi), (lo, hi, hi), (hi, hi, hi):
    no division, the curve itself for 0 and 1, a point for lo = hi.
    """
    p = _curves(curves)
    lo, hi = np.asarray(lo, dtype=np.float64), np.asarray(hi, dtype=np.float64)
    at_lo, at_hi = _blend(p, lo), _blend(p, hi)
    ll, hh = _blend(at_lo, lo), _blend(at_hi, hi)
    blossom = [_blend(ll, lo), _blend(ll, hi), _blend(hh, lo), _blend(hh, hi)]
    return np.concatenate(np.broadcast_arrays(*blossom), axis=-2)


def flatten(contour: npt.ArrayLike, steps: int) -> FloatArray:
    """Return a polygon (..., k steps, d) inscribed in a contour (..., k, 4, d)."""
    p = _curves(contour)
    t = np.arange(steps) / steps
    points = evaluate(p[..., None, :, :], t)
    return points.reshape(*p.shape[:-3], -1, p.shape[-1])


def sign_changes(coefficients: npt.ArrayLike) -> tuple[FloatArray, IntArray]:
    """Return where cubics pass between positive and not positive on [0, 1].

    Parameters
    ----------
    coefficients : (..., 4) float64
        Bernstein coefficients; lines and quadratics raised to cubics too.

    Returns
    -------
    places : (..., 3) float64
        Ascending parameters in [0, 1], filled up with 1.
    count : (...) intp
        How many of them are sign changes. It is odd exactly if one of
        the first and last coefficient is positive and the other is not.

    Raises
    ------
    ValueError
        If the shape is not (..., 4).

    Notes
    -----
    The derivative's roots, in Bernstein form and without dividing by a leading coefficient that
    may vanish, cut [0, 1] into monotone parts; on each with a change of sign
    Newton's method is kept within a bracket. Zero counts as not positive, and an end
    that is exactly zero is returned exactly. Double roots are no sign changes.
    """
    b = np.asarray(coefficients, dtype=np.float64)
    if b.ndim < 1 or b.shape[-1] != 4:
        raise ValueError(f"coefficients have shape {b.shape}, expected (..., 4)")
    shape = b.shape[:-1]
    b = b.reshape(-1, 4)
    # A power of two changes no sign and no digit, and keeps squares in range.
    _, exponent = np.frexp(np.max(np.abs(b), axis=-1, initial=0.0))
    with np.errstate(under="ignore"):
        b = np.ldexp(b, -exponent[:, None])
        places, changes = _monotone_roots(b)
    count = np.sum(changes, axis=-1)
    places = np.sort(np.where(changes, places, 1.0), axis=-1)
    return places.reshape(*shape, 3), np.asarray(count.reshape(shape), dtype=np.intp)


def _bernstein(b: FloatArray, t: FloatArray) -> FloatArray:
    """Return cubics with coefficients (m, 4) at t (m, n), exactly b_0 and b_3 at the ends."""
    s = 1.0 - t
    b0, b1, b2, b3 = (b[:, j, None] for j in range(4))
    p, q, r = s * b0 + t * b1, s * b1 + t * b2, s * b2 + t * b3
    return s * (s * p + t * q) + t * (s * q + t * r)


def _monotone_roots(b: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Return (m, 3): a place on each monotone part of cubics (m, 4), and whether it is a root."""
    d = np.diff(b, axis=-1)
    # d_0 (1-t)^2 + 2 d_1 t (1-t) + d_2 t^2 = a t^2 + 2 h t + d_0
    a, h, c = d[:, 0] - 2.0 * d[:, 1] + d[:, 2], d[:, 1] - d[:, 0], d[:, 0]
    q = -(h + np.copysign(np.sqrt(np.maximum(d[:, 1] ** 2 - d[:, 0] * d[:, 2], 0.0)), h))
    turns = []
    for over, under in ((q, a), (c, q)):
        inside = (np.abs(over) < np.abs(under)) & (over * np.sign(under) > 0.0)
        turns.append(np.where(inside, over / np.where(inside, under, 1.0), 1.0))
    low, high = np.minimum(*turns), np.maximum(*turns)
    zero, one = np.zeros_like(low), np.ones_like(low)
    lo, hi = np.stack([zero, low, high], axis=-1), np.stack([low, high, one], axis=-1)
    f_lo, f_hi = _bernstein(b, lo), _bernstein(b, hi)
    rising = f_hi > 0.0
    changes = (f_lo > 0.0) != rising
    # An end that is zero is the root.
    hi = np.where(changes & (f_lo == 0.0), lo, hi)
    lo = np.where(changes & (f_hi == 0.0), hi, lo)
    places = np.ones_like(lo)
    row = np.nonzero(changes)[0]
    places[changes] = _bracketed_newton(b[row], lo[changes], hi[changes], rising[changes])
    return places, changes


def _bracketed_newton(
    b: FloatArray, lo: FloatArray, hi: FloatArray, rising: BoolArray
) -> FloatArray:
    """Return the sign changes (m) of cubics (m, 4) in brackets, to about 1e-15."""
    places = 0.5 * (lo + hi)
    d = np.diff(b, axis=-1)
    item = np.flatnonzero(hi > lo)
    step = 0
    while item.size:  # every other step halves the bracket, so it ends
        t, low, high = places[item], lo[item], hi[item]
        f = _bernstein(b[item], t[:, None])[:, 0]
        beyond = (f > 0.0) == rising[item]
        low, high = np.where(beyond, low, t), np.where(beyond, t, high)
        s = 1.0 - t
        d0, d1, d2 = (d[item, j] for j in range(3))
        slope = 3.0 * (s * (s * d0 + t * d1) + t * (s * d1 + t * d2))
        flat = np.abs(slope) <= np.abs(f)
        newton = t - np.where(flat, 0.0, f) / np.where(flat, 1.0, slope)
        # A little past the root, so that the other end of the bracket follows.
        newton += np.copysign(4e-16, newton - t)
        good = (newton > low) & (newton < high) & ~flat & (step % 2 == 0)
        # Once the bracket is as narrow as doubles are, both ends are the root.
        left = (f != 0.0) & (high - low > 1e-15)
        places[item] = np.where(f == 0.0, t, np.where(good, newton, 0.5 * (low + high)))
        lo[item], hi[item] = low, high
        item = item[left]
        step += 1
    return places


class Parts(NamedTuple):
    """Parts of curves, in the order of their curves and along each."""

    points: FloatArray
    """(p, 4, 3): cubics."""
    curve: IntArray
    """(p): which curve each is a part of."""
    enters: BoolArray
    """(p): whether it begins where the curve comes above the plane, at z = 0 exactly."""
    leaves: BoolArray
    """(p): whether it ends where the curve goes below, at z = 0 exactly."""


def parts_above(curves: FloatArray) -> Parts:
    """Return the parts above z = 0 of curves (m, 4, 3). A point at z = 0 counts as below.

    If curves end with the same bits as others begin, as many parts enter as leave.
    """
    m = curves.shape[0]
    places, count = sign_changes(curves[:, :, 2])
    bounds = np.concatenate([np.zeros((m, 1)), places, np.ones((m, 1))], axis=-1)
    # The sign alternates, so that a part as short as nothing is still counted.
    starts_above = curves[:, :1, 2] > 0.0
    above = (starts_above != (np.arange(4) % 2 == 1)) & (np.arange(4) <= count[:, None])
    curve, j = np.nonzero(above)
    enters, leaves = j > 0, j < count[curve]
    points, cut = curves[curve], enters | leaves
    points[cut] = part(points[cut], bounds[curve, j][cut], bounds[curve, j + 1][cut])
    points[enters, 0, 2] = 0.0
    points[leaves, 3, 2] = 0.0
    return Parts(points, curve, enters, leaves)


def half_line_crossings(x: FloatArray, y: FloatArray) -> FloatArray:
    """Return how often plane curves pass the half line +x, with rising y less with falling, (...).

    ``x`` and ``y`` (..., 4) are the coordinates of their control points. Over closed contours the
    sum is how often they run around the origin.
    """
    places, count = sign_changes(y)
    at = evaluate(x[..., None, :, None], places)[..., 0]
    rises = (y[..., :1] > 0.0) == (np.arange(3) % 2 == 1)
    passes = (np.arange(3) < count[..., None]) & (at > 0.0)
    return np.asarray(np.sum(np.where(rises, 1.0, -1.0) * passes, axis=-1))


def broadcast_contours(
    contours: Sequence[npt.ArrayLike], lead: tuple[int, ...] = ()
) -> tuple[list[FloatArray], tuple[int, ...]]:
    """Return contours (..., k, 4, 3) as arrays (n, k, 4, 3) each, and the shape n stands for.

    ``lead`` is broadcast with their leading axes. Raises ValueError if a shape does not fit.
    """
    arrays = [np.asarray(contour, dtype=np.float64) for contour in contours]
    for i, p in enumerate(arrays):
        if p.ndim < 3 or p.shape[-2:] != (4, 3):
            raise ValueError(f"contour {i} has shape {p.shape}, expected (..., k, 4, 3)")
    shape = np.broadcast_shapes(lead, *(p.shape[:-3] for p in arrays))
    n = int(np.prod(shape))
    flat = [np.broadcast_to(p, (*shape, *p.shape[-3:])) for p in arrays]
    return [p.reshape(n, *p.shape[-3:]) for p in flat], shape
