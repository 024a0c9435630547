"""Lights bounded by cubic Bézier curves, seen from the origin: clip to the horizon, form factor.

A light is one or more closed contours in a common plane, holes wound against the outer
contours, as in `ltc.polygon`; a contour is a (..., k, 4, 3) array of cubics (`ltc.bezier`).
Everything here is a sum over directed curves: contours are not joined and their order
does not matter. Counter-clockwise about +z is positive.

The contour integral. For a region on the unit sphere with the boundary o,
Stokes gives the clamped-cosine integral  E = 1/(2 pi) int (o x do)_z: half the
boundary's moment. With o = r/|r|, the part of dr along r drops out of the cross product, so

    E = 1/(2 pi) int (x y' - y x') / |r|^2 dt

over any parametrisation of the outline r(t). Lambert's edge term is this integral over a
straight segment. For a cubic it is a rational function, degree 4 over degree 6.

The horizon. The region above z = 0 is bounded by the outline's parts above and by
segments of the line where the light's plane meets z = 0. There |r|^2 = x^2 + y^2 and the
form is the differential of the azimuth phi, so a segment adds its azimuth / (2 pi). Written
per crossing k of an outline with z = 0, this is +phi_k/(2 pi) where it rises and -phi_k/(2 pi)
where it sinks: each crossing by itself, no entry and exit to be matched. All crossings lie
on one line, so azimuths measured from its normal never wrap. `clip_to_horizon` forms
the segments themselves: sorted along the line, the count of sinking less rising
crossings up to a place is how often the boundary runs through it.

The same without crossings. Below the horizon replace o by its azimuth, (x, y)/|(x, y)|:

    E = 1/(2 pi) int (x y' - y x') / (x^2 + y^2 + max(z, 0)^2) dt  -  w,

since the azimuth along the outline below and along the line differ by whole turns: w is
the number of times that the light covers the nadir.

The closed form. In s = 2t - 1 let N = x y' - y x' and D = |r|^2, with the complex roots s_k.
Partial fractions give N/D = sum c_k / (s - s_k), c_k = N(s_k)/D'(s_k), and each
integrates to c_k log((1 - s_k)/(-1 - s_k)). Roots come in conjugate pairs, so it is twice
the real part over those with Im s_k > 0, whose 1 - s_k and -1 - s_k both lie below the real
axis: the principal logarithm is the right one. The leading coefficients of D vanish for
lines and raised quadratics, its constant |r(middle)|^2 does not; so w_k = 1/s_k are taken,
roots of the reversed polynomial, and a missing root is w_k = 0, which adds nothing:
c_k = -N~(w_k)/D~'(w_k), logarithm log((1 - w_k)/(1 + w_k)), Im w_k < 0.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from ltc import transform
from ltc.bezier import (
    broadcast_contours,
    derivative,
    evaluate,
    from_line,
    half_line_crossings,
    part,
    parts_above,
)
from ltc.quadrature import gauss_legendre, halve, legendre_matrix, panels, tail

FloatArray: TypeAlias = npt.NDArray[np.float64]
IntArray: TypeAlias = npt.NDArray[np.intp]
BoolArray: TypeAlias = npt.NDArray[np.bool_]

CLOSURE = 1e-9
"""Largest gap between a curve's end and the next one's start, in parts of the coordinates."""


# --- The horizon --------------------------------------------------------------------------


class Region(NamedTuple):
    """What bounds the parts of several lights above z = 0, as one list."""

    curves: FloatArray
    """(m, 4, 3): the outlines' parts above."""
    light: IntArray
    """(m): which light each belongs to."""
    segments: FloatArray
    """(l, 2, 3): segments of the horizon that close them, z = 0."""
    segment_light: IntArray
    """(l)."""
    times: FloatArray
    """(l): how often the boundary runs along each segment, negative for backwards."""


def _flat(
    contours: Sequence[npt.ArrayLike], lead: tuple[int, ...] = ()
) -> tuple[FloatArray, IntArray, tuple[int, ...]]:
    """Return all curves (m, 4, 3), the light of each (m), and the shape of the lights.

    ``lead`` is broadcast with the contours' leading axes. Each end is replaced by the next start,
    so that both have the same bits: whether they are above the horizon must not depend on
    rounding.
    """
    chains, shape = broadcast_contours(contours, lead)
    n = int(np.prod(shape))
    joined = np.concatenate([np.zeros((n, 0, 4, 3)), *chains], axis=1)
    first = 0
    for k, p in enumerate(chains):
        following = np.roll(p[:, :, 0], -1, axis=1)
        gap = np.max(np.abs(p[:, :, 3] - following), initial=0.0)
        if gap > CLOSURE * np.max(np.abs(p), initial=0.0):
            raise ValueError(
                f"contour {k} has a gap of {gap:g}, expected each curve to end "
                "where the next one begins"
            )
        joined[:, first : first + p.shape[1], 3] = following
        first += p.shape[1]
    return joined.reshape(-1, 4, 3), np.repeat(np.arange(n), joined.shape[1]), shape


def _clip(curves: FloatArray, light: IntArray) -> Region:
    """Return what bounds the parts above z = 0 of closed outlines (m, 4, 3) in planes."""
    above = parts_above(curves)
    owner = light[above.curve]
    sinking, rising = above.points[above.leaves, 3], above.points[above.enters, 0]
    segments, segment_light, times = _horizon_segments(
        np.concatenate([sinking, rising]),
        np.concatenate([owner[above.leaves], owner[above.enters]]),
        np.repeat([1.0, -1.0], [len(sinking), len(rising)]),
    )
    return Region(above.points, owner, segments, segment_light, times)


def _horizon_segments(
    points: FloatArray, light: IntArray, flow: FloatArray
) -> tuple[FloatArray, IntArray, FloatArray]:
    """Return (segments (l, 2, 3), their light, how often each is run through).

    ``points`` (c, 3) are crossings, ``flow`` is 1 where an outline sinks, so that the boundary
    goes on along the horizon, and -1 where it rises. Those of one light are on one line.
    """
    n = int(np.max(light, initial=-1)) + 1
    first, last = np.zeros((n, 3)), np.zeros((n, 3))
    first[light] = points
    offset = points - first[light]
    order = np.argsort(np.sum(offset * offset, axis=-1))
    last[light[order]] = points[order]  # the farthest from ``first`` is written last
    along = np.sum(offset * (last - first)[light], axis=-1)
    order = np.lexsort((along, light))
    points, light, flow = points[order], light[order], np.cumsum(flow[order])
    # The flow of a light sums to nothing, so none runs over to the next light.
    used = np.flatnonzero(flow[:-1])
    segments = np.stack([points[used], points[used + 1]], axis=-2)
    return segments, light[used], flow[used]


def _azimuths(region: Region, n: int) -> FloatArray:
    """Return the lights' sums (n) of azimuths [rad] along the horizon."""
    a, b = region.segments[:, 0], region.segments[:, 1]
    d = b - a
    turn = np.arctan2(a[:, 0] * d[:, 1] - a[:, 1] * d[:, 0], a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1])
    # Through the very origin: on neither side, as in `ltc.polygon`.
    turn = np.where(np.abs(turn) == np.pi, 0.0, turn)
    return _sums(region.segment_light, region.times * turn, n)


def _closed_curves(region: Region) -> tuple[FloatArray, IntArray]:
    """Return a region's whole boundary as closed curves (m, 4, 3) and their lights (m)."""
    a, b = region.segments[:, 0], region.segments[:, 1]
    backwards = (region.times < 0.0)[:, None]
    lines = from_line(np.where(backwards, b, a), np.where(backwards, a, b))
    times = np.abs(region.times).astype(np.intp)
    return (
        np.concatenate([region.curves, np.repeat(lines, times, axis=0)]),
        np.concatenate([region.light, np.repeat(region.segment_light, times)]),
    )


def clip_to_horizon(
    contours: Sequence[npt.ArrayLike],
) -> tuple[FloatArray, IntArray, tuple[int, ...]]:
    """Return what bounds the parts of lights above the plane z = 0.

    Parameters
    ----------
    contours : sequence of (..., k, 4, 3) float64
        As for `form_factor`.

    Returns
    -------
    curves : (m, 4, 3) float64
        Cubics that form closed contours with z >= 0: parts of the outlines, and segments
        of the horizon, where z is exactly 0. None for a light below the horizon.
    light : (m) intp
        The light that each belongs to, counted over the leading axes in C order.
    shape : tuple of int
        The leading axes.

    Raises
    ------
    ValueError
        If a shape does not fit or a contour has gaps.
    """
    curves, light, shape = _flat(contours)
    return *clip_curves(curves, light), shape


def clip_curves(curves: FloatArray, light: IntArray) -> tuple[FloatArray, IntArray]:
    """Return `clip_to_horizon` of curves (m, 4, 3) that belong to lights (m).

    Those of a light form closed contours, in any order, each curve ending with the same bits
    as another begins with.
    """
    return _closed_curves(_clip(curves, light))


def _sums(item: IntArray, values: npt.ArrayLike, n: int) -> FloatArray:
    """Return the sums (n) of the values of each item."""
    return np.asarray(np.bincount(item, values, n), dtype=np.float64)


# --- The integral over a curve, three ways ------------------------------------------------


def _moment(r: FloatArray, dr: FloatArray) -> FloatArray:
    return np.asarray(r[..., 0] * dr[..., 1] - r[..., 1] * dr[..., 0])


def _square(r: FloatArray) -> FloatArray:
    return np.asarray(r[..., 0] ** 2 + r[..., 1] ** 2 + r[..., 2] ** 2)


def _quotient(over: FloatArray, under: FloatArray) -> FloatArray:
    """Return over/under, 0 where under is 0."""
    out = np.zeros(under.shape)
    np.divide(over, under, out=out, where=under > 0.0)
    return out


def _reach(curves: FloatArray, m: FloatArray, half: FloatArray) -> FloatArray:
    """Return the square of how far curves (p, 4, 3) get from their points at m within +- half.

    An upper bound, of the part's control points: it shrinks with the velocity at a cusp.
    """
    offset = part(curves, m - half, m + half) - evaluate(curves, m)[:, None]
    return np.asarray(np.max(_square(offset), axis=-1))


_NODES = 16

_MAX_SPLITS = 4
"""Rounds of halving that an error estimate may ask for: what is left then is rounding."""


def _integrate(
    integrand: Callable[[IntArray, FloatArray], FloatArray],
    panel: tuple[IntArray, FloatArray, FloatArray],
    m: int,
    tolerance: float,
    analytic: bool = True,
) -> tuple[FloatArray, FloatArray]:
    """Return the integrals (m) of items over their panels and error estimates (m).

    ``integrand`` takes items (p) and parameters (p, nodes). Panels are halved
    until the Legendre coefficients of the values promise the tolerance: their tail, or
    the last of them where the integrand has kinks.
    """
    legendre = legendre_matrix(_NODES)
    x, w = gauss_legendre(_NODES)
    total, errors = np.zeros(m), np.zeros(m)
    item, lo, hi = panel
    for last in range(_MAX_SPLITS, -1, -1):
        again = []
        for start in range(0, item.size, 8192):
            chunk = slice(start, start + 8192)
            i, low, width = item[chunk], lo[chunk], (hi - lo)[chunk]
            values = integrand(i, low[:, None] + width[:, None] * x) * width[:, None]
            if analytic:
                error = tail(values, legendre)
            else:
                error = np.max(np.abs(values @ legendre)[:, -4:], axis=-1)
            bad = error > (tolerance if last else np.inf)
            total += _sums(i, np.where(bad, 0.0, values @ w), m)
            errors += _sums(i, np.where(bad, 0.0, error), m)
            again.append(bad)
        if not again or not np.any(bad := np.concatenate(again)):
            break
        item, lo, hi = halve(item[bad], lo[bad], hi[bad])
    return total, errors


def _by_quadrature(curves: FloatArray, tolerance: float) -> tuple[FloatArray, FloatArray]:
    """Return (integrals of the form (m), error estimates (m)) of curves (m, 4, 3)."""

    def short(i: IntArray, m: FloatArray, half: FloatArray) -> BoolArray:
        # Within half its distance from the origin a panel has no pole near.
        c = curves[i]
        return np.asarray(_reach(c, m, half) <= 0.25 * _square(evaluate(c, m)))

    def form(i: IntArray, t: FloatArray) -> FloatArray:
        c = curves[i, None]
        r = evaluate(c, t)
        return _quotient(_moment(r, derivative(c, t)), _square(r))

    panel = panels(np.ones(curves.shape[0]), short)
    return _integrate(form, panel, curves.shape[0], tolerance)


def _by_roots(curves: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return (integrals (m), error estimates (m)) by the closed form."""
    size = np.max(np.abs(curves), axis=(-2, -1), initial=0.0)
    p = curves / np.where(size > 0.0, size, 1.0)[:, None, None]
    p0, p1, p2, p3 = (p[:, j] for j in range(4))
    c = [
        (p0 + 3.0 * p1 + 3.0 * p2 + p3) / 8.0,
        3.0 * (p3 + p2 - p1 - p0) / 8.0,
        3.0 * (p0 - p1 - p2 + p3) / 8.0,
        (p3 - 3.0 * p2 + 3.0 * p1 - p0) / 8.0,
    ]
    m = curves.shape[0]
    N, D = np.zeros((m, 5)), np.zeros((m, 7))
    for i in range(4):
        for j in range(4):
            D[:, i + j] += np.sum(c[i] * c[j], axis=-1)
            if i < j:
                N[:, i + j - 1] += (j - i) * _moment(c[i], c[j])
    value, error = np.zeros(m), np.zeros(m)
    keep = D[:, 0] > 0.0  # else the middle is the origin: the form is odd about it
    N, D = N[keep], D[keep]
    companion = np.zeros((N.shape[0], 6, 6))
    companion[:, 0] = -D[:, 1:] / D[:, :1]
    companion[:, np.arange(1, 6), np.arange(5)] = 1.0
    w = np.linalg.eigvals(companion).astype(np.complex128)
    w = np.take_along_axis(w, np.argsort(w.imag, axis=-1), axis=-1)
    gap = w[:, :3, None] - w[:, None, :]
    gap[:, np.arange(3), np.arange(3)] = 1.0
    w = w[:, :3]
    slope = D[:, :1] * np.prod(gap, axis=-1)
    top = N[:, :1] * w**4 + N[:, 1:2] * w**3 + N[:, 2:3] * w**2 + N[:, 3:4] * w + N[:, 4:]
    regular = (slope != 0.0) & (w * w != 1.0)
    residue = np.where(regular, -top / np.where(regular, slope, 1.0), 0.0)
    term = residue * np.log(np.where(regular, (1.0 - w) / (1.0 + w), 1.0))
    value[keep] = 2.0 * np.sum(term.real, axis=-1)
    # Roots are off by rounding times their condition, which a small gap magnifies.
    powers = np.abs(w[..., None]) ** np.arange(6, -1, -1)
    off = np.sum(np.abs(D)[:, None, :] * powers, axis=-1) / np.where(regular, np.abs(slope), 1.0)
    spread = np.sum(1.0 / np.maximum(np.abs(gap), 1e-30), axis=-1)
    error[keep] = 1e-15 * np.sum(np.abs(term) * (1.0 + off * spread), axis=-1)
    return value, error


# --- Form factors -------------------------------------------------------------------------


class Estimate(NamedTuple):
    """Form factors and estimates of their absolute errors."""

    value: FloatArray
    error: FloatArray


def _estimate(sums: FloatArray, errors: FloatArray, shape: tuple[int, ...]) -> Estimate:
    turn = 2.0 * np.pi
    value, error = np.asarray(sums / turn), np.asarray((errors + 1e-15) / turn)
    return Estimate(value.reshape(shape), error.reshape(shape))


def _per_light(
    curves: FloatArray,
    light: IntArray,
    shape: tuple[int, ...],
    integral: Callable[[FloatArray], tuple[FloatArray, FloatArray]],
) -> Estimate:
    n = int(np.prod(shape))
    region = _clip(curves, light)
    value, error = integral(region.curves)
    sums = _sums(region.light, value, n) + _azimuths(region, n)
    return _estimate(sums, _sums(region.light, error, n), shape)


def positive_winding(contour: npt.ArrayLike) -> FloatArray:
    """Return a light's contour (..., k, 4, 3) in the order that this module counts positive.

    As `ltc.polygon.positive_winding`: scenes store outlines counter-clockwise seen from
    the emitting side, which is clockwise about +z for a point that the light faces.
    """
    p = np.asarray(contour, dtype=np.float64)
    if p.ndim < 3 or p.shape[-2] != 4:
        raise ValueError(f"contour has shape {p.shape}, expected (..., k, 4, 3)")
    return p[..., ::-1, ::-1, :]


def form_factor(contours: Sequence[npt.ArrayLike], tolerance: float = 1e-13) -> Estimate:
    """Return the form factors of lights with curved outlines, seen from the origin.

    Parameters
    ----------
    contours : sequence of (..., k, 4, 3) float64
        Closed contours of cubics in the shading frame, those of one light in one
        plane, anywhere about the horizon; each curve ends where the next begins. Holes are
        wound against the outer contours. Leading axes broadcast.
    tolerance : float
        Estimated error above which a panel is halved.

    Returns
    -------
    Estimate
        value (...), in [0, 1] for outlines that run once counter-clockwise about +z,
        negative for the other winding, exactly 0 where nothing is above the horizon; and an
        estimate of its absolute error.

    Raises
    ------
    ValueError
        If a shape does not fit or a contour has gaps.

    Notes
    -----
    Quadrature: panels are halved while they are longer than their distance from the origin, so
    that no peak can lie between the nodes, and then where 16 nodes did not do.
    A point in the light's plane is on neither side of it.
    """
    curves, light, shape = _flat(contours)
    return _per_light(curves, light, shape, lambda c: _by_quadrature(c, tolerance))


def closed_form_factor(contours: Sequence[npt.ArrayLike]) -> Estimate:
    """Return `form_factor` by the six complex roots of |r|^2 a curve.

    Its error grows where two roots nearly meet; ``error`` says so.
    """
    curves, light, shape = _flat(contours)
    return _per_light(curves, light, shape, _by_roots)


def azimuth_form_factor(contours: Sequence[npt.ArrayLike], tolerance: float = 1e-12) -> Estimate:
    """Return `form_factor` from whole contours, without crossings: the form with max(z, 0).

    Slower, and for tests: it has no roots of z and no horizon in common with the others.
    Undefined where an outline passes through the nadir itself.
    """
    curves, light, shape = _flat(contours)
    n, m = int(np.prod(shape)), curves.shape[0]
    # On the z axis itself there is no azimuth to speak of.
    axis = np.all(np.abs(curves[..., :2]) <= 1e-12 * np.abs(curves[..., 2:]), axis=(-2, -1))
    curves = np.where(axis[:, None, None], 0.0, curves)

    def square(r: FloatArray) -> FloatArray:
        return np.asarray(r[..., 0] ** 2 + r[..., 1] ** 2 + np.maximum(r[..., 2], 0.0) ** 2)

    def short(i: IntArray, t: FloatArray, half: FloatArray) -> BoolArray:
        # The second derivative jumps where z changes sign, so such panels must be tiny.
        c = curves[i]
        before, after = (evaluate(c, t + side * half)[:, 2] > 0.0 for side in (-1.0, 1.0))
        limit = np.where(before == after, 0.5, 1e-5)
        return np.asarray(_reach(c, t, half) <= limit**2 * square(evaluate(c, t)))

    def form(i: IntArray, t: FloatArray) -> FloatArray:
        c = curves[i, None]
        r = evaluate(c, t)
        return _quotient(_moment(r, derivative(c, t)), square(r))

    value, error = _integrate(form, panels(np.ones(m), short), m, tolerance, analytic=False)
    turns = 2.0 * np.pi * _nadir_winding(curves, light, n)
    return _estimate(_sums(light, value, n) - turns, _sums(light, error, n), shape)


def _nadir_winding(curves: FloatArray, light: IntArray, n: int) -> FloatArray:
    """Return how often lights (m, 4, 3) cover the nadir, signed (n)."""
    crossings = half_line_crossings(curves[:, :, 0], curves[:, :, 1])
    turns = _sums(light, crossings, n)
    for k in np.flatnonzero(turns):
        points = curves[light == k].reshape(-1, 3)
        normal = plane_normal(points)
        if not normal[2] * (normal @ points[0]) < 0.0:
            turns[k] = 0.0  # the plane passes above the origin, so the light covers the zenith
    return turns


def plane_normal(points: FloatArray) -> FloatArray:
    """Return the unit normal (3) of the plane of points (m, 3), either way; 0 if on one line."""
    if points.size == 0:
        return np.zeros(3)
    offset = points - points[0]
    normals = np.cross(offset[np.argmax(_square(offset))], offset)
    normal = normals[np.argmax(_square(normals))]
    length = np.sqrt(normal @ normal)
    return np.asarray(normal / length if length > 0.0 else normal)


def guided_form_factor(
    contours: Sequence[npt.ArrayLike], nodes: int = 8, limit: float = 0.5
) -> tuple[FloatArray, IntArray]:
    """Return `form_factor` by quadrature guided by poles, and what it cost.

    Parameters
    ----------
    contours : sequence of (..., k, 4, 3) float64
        As for `form_factor`.
    nodes : int
        Gauss-Legendre nodes a panel.
    limit : float
        A panel is halved while 1/rho exceeds this.

    Returns
    -------
    value : (...) float64
        Form factors.
    evaluations : (...) intp
        Nodes spent, over all curves.

    Notes
    -----
    If the curve was straight, |r|^2 would vanish at t - r.r'/|r'|^2 +- i |r x r'|/|r'|^2. With w
    that place in units of the panel's half width from its middle, rho = |w + sqrt(w^2 - 1)|,
    and n nodes err like rho^(-2n). The pole is estimated from the panel's start, middle
    and end: the middle alone misses what a curve that bends comes close to with its
    ends. No threshold depends on roughness.

    Errors of circle, heart, glyph and ring about the mirror direction under the lobes
    of the table, theta 0 to 85 degrees, many through the horizon, 1,000 lights each:

    ================================  ==========  ==========  ==========  =============
    rule, 1/rho <= .5                 alpha .001  alpha .01   alpha .1    alpha .5
    ================================  ==========  ==========  ==========  =============
    three estimates, 8 nodes: p95     4.5e-6      4.0e-6      2.5e-6      8.7e-7
    largest                           1.1e-5      1.1e-5      8.5e-6      6.1e-6
    evaluations a light               87          85          73          59
    three estimates, 6 nodes: p95     8.2e-5      8.2e-5      4.9e-5      1.8e-5
    largest                           1.8e-4      1.7e-4      1.7e-4      1.0e-4
    evaluations a light               65          63          55          44
    middle alone, 8 nodes: p95        6.1e-4      4.8e-4      6.3e-5      3.4e-6
    largest                           .69         .53         .075        .0012
    evaluations a light               79          77          67          56
    the roots themselves, 8 nodes:    1.2e-5      1.2e-5      8.1e-6      4.2e-6
    largest, evaluations a light      82          80          69          57
    ================================  ==========  ==========  ==========  =============
    """
    curves, light, shape = _flat(contours)
    n = int(np.prod(shape))
    evaluations = np.zeros(n, dtype=np.intp)
    region = _clip(curves, light)

    def guided(c: FloatArray) -> tuple[FloatArray, FloatArray]:
        def ready(i: IntArray, m: FloatArray, half: FloatArray) -> BoolArray:
            ok = np.ones(i.shape, dtype=np.bool_)
            for side in (-1.0, 0.0, 1.0):
                t = m + side * half
                ok &= _rho(evaluate(c[i], t), derivative(c[i], t), half, side) >= 1.0 / limit
            return ok

        item, lo, hi = panels(np.ones(c.shape[0]), ready)
        x, w = gauss_legendre(nodes)
        value = np.zeros(c.shape[0])
        for start in range(0, item.size, 8192):
            chunk = slice(start, start + 8192)
            i, low, width = item[chunk], lo[chunk], (hi - lo)[chunk]
            t = low[:, None] + width[:, None] * x
            r, dr = evaluate(c[i, None], t), derivative(c[i, None], t)
            sums = (_quotient(_moment(r, dr), _square(r)) @ w) * width
            value += _sums(i, sums, c.shape[0])
        evaluations[:] = nodes * np.bincount(region.light[item], minlength=n)
        return value, np.zeros_like(value)

    value = _per_light(curves, light, shape, guided).value
    return value, evaluations.reshape(shape)


def _rho(r: FloatArray, dr: FloatArray, half: FloatArray, side: float) -> FloatArray:
    """Return the size rho of the ellipse about [-half, half] through a pole.

    The pole is that of 1/|r + (s - side half) dr|^2. Large where the velocity vanishes.
    """
    cross = np.cross(r, dr)
    reach = half * _square(dr)
    tiny = reach <= 1e-12 * np.sqrt(_square(r) * _square(dr))
    reach = np.where(tiny, 1.0, reach)
    w = side + (1j * np.sqrt(_square(cross)) - np.sum(r * dr, axis=-1)) / reach
    root = np.sqrt(w * w - 1.0)
    rho = np.maximum(np.abs(w + root), np.abs(w - root))
    return np.asarray(np.where(tiny, 1e12, rho))


# --- Linearly transformed cosines ---------------------------------------------------------


def ltc_form_factor(
    cosine_from_shading: npt.ArrayLike, contours: Sequence[npt.ArrayLike]
) -> Estimate:
    """Return the integral of a linearly transformed cosine over lights with curved outlines.

    Parameters
    ----------
    cosine_from_shading : (..., 3, 3) float64
        The paper's M^-1, of positive determinant.
    contours : sequence of (..., k, 4, 3) float64
        As for `form_factor`, in the shading frame; leading axes broadcast with the matrices'.

    Returns
    -------
    Estimate
        As `ltc.polygon.ltc_polygon_form_factor` for polygons: the lobe's share that falls on the
        light's part above the surface, at most 1 - `ltc.transform.leak`.

    Raises
    ------
    ValueError
        If a shape does not fit or a contour has gaps.

    Notes
    -----
    The light is clipped at the surface's horizon, its boundary transformed, clipped at the
    lobe's horizon and integrated.
    """
    matrix = np.asarray(cosine_from_shading, dtype=np.float64)
    if matrix.ndim < 2 or matrix.shape[-2:] != (3, 3):
        raise ValueError(f"cosine_from_shading has shape {matrix.shape}, expected (..., 3, 3)")
    curves, light, shape = _flat(contours, matrix.shape[:-2])
    curves, light = _closed_curves(_clip(curves, light))
    m = np.broadcast_to(matrix, (*shape, 3, 3)).reshape(-1, 3, 3)
    # Term by term: equal points must stay equal to the last bit, which einsum does not promise.
    row = m[light, None]
    moved = row[..., 0] * curves[..., :1] + row[..., 1] * curves[..., 1:2]
    moved = moved + row[..., 2] * curves[..., 2:]
    return _per_light(moved, light, shape, lambda c: _by_quadrature(c, 1e-13))


def ltc_specular(
    shading_from_cosine: npt.ArrayLike,
    contours: Sequence[npt.ArrayLike],
    albedo: npt.ArrayLike,
) -> FloatArray:
    """Return the reflected radiance of a light of radiance 1 by the technique ``ltc``.

    Parameters
    ----------
    shading_from_cosine : (..., 3, 3) float64
        The paper's M, of positive determinant.
    contours : sequence of (..., k, 4, 3) float64
        As for `form_factor`, positive for counter-clockwise about +z.
    albedo : (...) float64
        Directional albedo, f0 (A - B) + B of `ltc.brdf.directional_albedo`.

    Returns
    -------
    (...) float64
        albedo E / (1 - leak), as `ltc.polygon.ltc_specular`.

    Raises
    ------
    ValueError
        For other shapes, a contour with gaps or a singular matrix.
    """
    share = ltc_form_factor(transform.invert(shading_from_cosine), contours).value
    return np.asarray(
        np.asarray(albedo, dtype=np.float64) * share / (1.0 - transform.leak(shading_from_cosine))
    )
