"""GGX integrated over lights that are given by their boundary, whatever that is made of.

What `ltc.reference` for polygons and `ltc.curved_reference` for curves have in common: they
cut their lights at the horizon and hand over the `Boundary` of what is left.

Why the boundary suffices. Let S = diag(1/ax, 1/ay, 1), v' = S^-1 v normalised
and h' = S (v + o) for the light direction o. GGX's visible normals then have the
density 2/(1 + v'_z) (v'.h')/pi over the directions of h': a cosine about v',
cut at the horizon. The map from o to h' is one to one above the surface, so the
light's image is the region inside the image of its outline, and the integral of
f cos is that of density times G2/G1 over it. Those light directions that are above
the surface fill a convex cone (`ltc.brdf.horizon_cone`), so chords from a
point of the cone to the outline stay where the integrand is smooth, and the signed
fan of chords covers the region once, whatever its shape and its holes.

Of the boundary it takes points and derivatives, and whether o(s) has poles near.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from ltc import brdf
from ltc.quadrature import gauss_legendre, halve, legendre_matrix, panels, tail

FloatArray: TypeAlias = npt.NDArray[np.float64]
IntArray: TypeAlias = npt.NDArray[np.intp]
BoolArray: TypeAlias = npt.NDArray[np.bool_]

_MAX_SPLITS = 20
"""Rounds of halving that an error estimate may ask for."""


def unit(w: FloatArray) -> FloatArray:
    """Return vectors (..., 3) divided by their lengths."""
    return np.asarray(w / np.sqrt(np.sum(w * w, axis=-1, keepdims=True)))


def dot(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the scalar products (...) of vectors (..., d)."""
    return np.asarray(np.einsum("...i,...i->...", a, b))


class Specular(NamedTuple):
    """A light's specular integral for F = 1, its (1 - wo.h)^5 part, and the first one's error."""

    one: float
    fresnel: float
    error: float


class Views(NamedTuple):
    """Views and materials of several integrals: unit wo (n, 3) and GGX's alphas (n)."""

    wo: FloatArray
    alpha_x: FloatArray
    alpha_y: FloatArray

    @classmethod
    def one(cls, wo: npt.ArrayLike, alpha_x: float, alpha_y: float) -> Views:
        """Return a single view wo (3,). Raises ValueError for others and for bad alphas."""
        wo = np.asarray(wo, dtype=np.float64)
        if wo.shape != (3,):
            raise ValueError(f"wo has shape {wo.shape}, expected (3,)")
        if not (alpha_x > 0.0 and alpha_y > 0.0):
            raise ValueError(f"alphas are {(alpha_x, alpha_y)}, expected positive numbers")
        return cls(wo[None], *(np.array([a], dtype=np.float64) for a in (alpha_x, alpha_y)))

    @classmethod
    def broadcast(
        cls,
        lead: tuple[int, ...],
        wo: npt.ArrayLike,
        alpha_x: npt.ArrayLike,
        alpha_y: npt.ArrayLike,
    ) -> tuple[Views, tuple[int, ...]]:
        """Return views (..., 3) and alphas (...) in a row, and their common shape.

        ``lead`` are the axes of the lights. Raises ValueError if shapes or alphas do not fit.
        """
        wo = np.asarray(wo, dtype=np.float64)
        if wo.ndim < 1 or wo.shape[-1] != 3:
            raise ValueError(f"wo has shape {wo.shape}, expected (..., 3)")
        ax, ay = np.asarray(alpha_x, dtype=np.float64), np.asarray(alpha_y, dtype=np.float64)
        if not (np.all(ax > 0.0) and np.all(ay > 0.0)):
            raise ValueError("alpha_x and alpha_y must be positive numbers")
        shape = np.broadcast_shapes(lead, wo.shape[:-1], ax.shape, ay.shape)
        wo = np.broadcast_to(wo, (*shape, 3)).reshape(-1, 3)
        return cls(wo, *(np.broadcast_to(a, shape).reshape(-1) for a in (ax, ay))), shape


class Boundary(Protocol):
    """Pieces of the boundary of lights as curves o(s) of directions, 0 <= s <= end.

    They are above the horizon, seen by views that are above the surface, and those of
    one view form closed loops.
    """

    @property
    def which(self) -> IntArray:
        """(m): the view that each piece belongs to."""

    @property
    def end(self) -> FloatArray:
        """(m): where the pieces end."""

    def at(self, e: IntArray, s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return (o, do/ds), (p, 3) each, of pieces e (p)."""

    def ready(self, e: IntArray, m: FloatArray, half: FloatArray) -> tuple[BoolArray, FloatArray]:
        """Return whether o has no pole near panels, and d2o/ds2 (p, 3) at their middles m."""

    def chords(self) -> tuple[IntArray, FloatArray, FloatArray]:
        """Return (piece, direction, next direction) of chords that follow the pieces."""


def integrate_one(boundary: Boundary, view: Views, tolerance: float) -> Specular:
    """Return the integral for a single view, with 12 nodes a panel."""
    one, fresnel, error = _integrate(boundary, view, 12, tolerance)[:, 0]
    return Specular(float(one), float(fresnel), float(error) + 1e-13)


def integrate_many(
    boundary: Callable[[slice, Views], Boundary],
    views: Views,
    nodes: int,
    tolerance: float,
    chunk: int,
) -> tuple[FloatArray, FloatArray]:
    """Return the integrals (n) for F = 1 and their Fresnel parts, ``chunk`` at a time.

    ``boundary`` gets a slice of the lights and the views of these.
    """
    out = np.zeros((3, views.wo.shape[0]))
    for i in range(0, views.wo.shape[0], chunk):
        some = slice(i, i + chunk)
        seen = Views(*(a[some] for a in views))
        out[:, some] = _integrate(boundary(some, seen), seen, nodes, tolerance)
    return out[0], out[1]


def _integrate(boundary: Boundary, views: Views, nodes: int, tolerance: float) -> FloatArray:
    """Return (3, n): the integrals for F = 1, the Fresnel parts, and estimates of the error.

    Panels along the boundary and along the chords of its fan are halved until the poles of the
    integrand are far, then where its Legendre coefficients miss the tolerance.
    """
    which, (wo, ax, ay) = boundary.which, views
    n = wo.shape[0]
    result = np.zeros((3, n))
    if which.size == 0:
        return result
    S = np.stack([1.0 / ax, 1.0 / ay, np.ones_like(ax)], axis=-1)
    L = np.stack([ax, ay, np.ones_like(ax)], axis=-1)

    def edge_ready(e: IntArray, m: FloatArray, half: FloatArray) -> BoolArray:
        i = which[e]
        o, do = boundary.at(e, m)
        ready, ddo = boundary.ready(e, m, half)
        # h' and (ax o_x, ay o_y, o_z), the roots of whose squares are the poles, bend by o''.
        for x, dx, bend in ((wo[i] + o, do, S[i]), (o, do, L[i])):
            x, dx = bend * x, bend * dx
            curve = 0.5 * half * half * np.sqrt(dot(bend * ddo, bend * ddo))
            size = np.sqrt(dot(x, x) + half * half * dot(dx, dx))
            ready = ready & _line_poles(x, dx, half) & (curve < 0.25 * size)
        for t in (-half, np.zeros_like(half), half):
            o, do = boundary.at(e, m + t)
            ready &= _smith_pole(o, do[:, 2], wo[i], L[i], half, t)
        return ready

    legendre = legendre_matrix(nodes)
    x, w = gauss_legendre(nodes)
    centre: FloatArray | None = None
    e, lo, hi = panels(boundary.end, edge_ready)
    for last in range(_MAX_SPLITS, -1, -1):
        phi = (lo[:, None] + (hi - lo)[:, None] * x).ravel()
        w_phi = ((hi - lo)[:, None] * w).ravel()
        e_phi = np.repeat(e, nodes)
        i = which[e_phi]
        o, do = boundary.at(e_phi, phi)
        h, dh = S[i] * (wo[i] + o), S[i] * do
        h2 = dot(h, h)
        u = h / np.sqrt(h2)[:, None]
        if centre is None:
            piece, start, stop = boundary.chords()
            centre = _centres(which[piece], S, wo, start, stop, ax, ay, i, u)
        k = w_phi * dot(centre[i], np.cross(h, dh)) / h2
        values, inner_error = _chords(centre[i], u, k, wo[i], L[i], nodes, tolerance)
        values = values.reshape(2, -1, nodes)
        outer_error = tail(values[0] / w, legendre)
        bad = outer_error > (tolerance if last else np.inf)
        total = np.sum(np.where(bad[:, None], 0.0, values), axis=-1)
        error = outer_error + np.sum(inner_error.reshape(-1, nodes), axis=-1)
        for row, part in zip(result, (*total, np.where(bad, 0.0, error)), strict=True):
            row += np.bincount(which[e], part, n)
        if not np.any(bad):
            break
        e, lo, hi = halve(e[bad], lo[bad], hi[bad])
    return result


def _chords(
    c: FloatArray,
    u: FloatArray,
    k: FloatArray,
    wo: FloatArray,
    stretch: FloatArray,
    nodes: int,
    tolerance: float,
) -> tuple[FloatArray, FloatArray]:
    """Return k times the integrals along the chords from c to u, (2, n), and their errors, (n)."""
    du = u - c
    Lc, dg = stretch * c, stretch * du
    v_dg = dot(wo, dg)

    def ready(f: IntArray, m: FloatArray, half: FloatArray) -> BoolArray:
        v, sf, dgf, v_dgf = wo[f], stretch[f], dg[f], v_dg[f, None]
        g = Lc[f] + m[:, None] * dgf
        ok = _line_poles(c[f] + m[:, None] * du[f], du[f], half) & _line_poles(g, dgf, half)
        for t in (-half, np.zeros_like(half), half):
            h = g + t[:, None] * dgf
            h2, v_h = dot(h, h)[:, None], dot(v, h)[:, None]
            wi = 2.0 * v_h * h / h2 - v
            dwi = 2.0 * (v_dgf * h + v_h * dgf - 2.0 * v_h * h * dot(h, dgf)[:, None] / h2) / h2
            ok &= _line_poles(sf * wi, sf * dwi, half, t)
            ok &= _smith_pole(wi, dwi[:, 2], v, sf, half, t)
        return ok

    x, w = gauss_legendre(nodes)
    legendre = legendre_matrix(nodes)
    sums, errors = np.zeros((2, k.size)), np.zeros(k.size)
    f, lo, hi = panels(np.ones(k.shape), ready)
    for last in range(_MAX_SPLITS, -1, -1):
        bad = np.zeros(f.shape, dtype=np.bool_)
        for start in range(0, f.size, 4096):
            part = slice(start, start + 4096)
            j, low, width = f[part], lo[part], hi[part] - lo[part]
            s = low[:, None] + width[:, None] * x
            density, fresnel = brdf.stretched_integrand(
                (
                    c[j, 0, None] + s * du[j, 0, None],
                    c[j, 1, None] + s * du[j, 1, None],
                    c[j, 2, None] + s * du[j, 2, None],
                ),
                (wo[j, 0, None], wo[j, 1, None], wo[j, 2, None]),
                stretch[j, 0, None],
                stretch[j, 1, None],
            )
            density *= (k[j] * width)[:, None] * s
            error = tail(density, legendre)
            bad[part] = error > (0.01 * tolerance if last else np.inf)
            good = ~bad[part]
            density *= w
            sums[0] += np.bincount(j[good], np.sum(density[good], axis=1), k.size)
            density *= fresnel
            sums[1] += np.bincount(j[good], np.sum(density[good], axis=1), k.size)
            errors += np.bincount(j[good], error[good], k.size)
        if not np.any(bad):
            break
        f, lo, hi = halve(f[bad], lo[bad], hi[bad])
    return sums, errors


def _centres(
    which: IntArray,
    S: FloatArray,
    wo: FloatArray,
    o_a: FloatArray,
    o_b: FloatArray,
    ax: FloatArray,
    ay: FloatArray,
    i: IntArray,
    u: FloatArray,
) -> FloatArray:
    """Return the centre of each configuration's fan, (n, 3), in the horizon's cone.

    It is the mean of the outline's half vectors, weighted by length, so that tiny lights
    keep their relative accuracy; but chords must stay away from the origin,
    and from the axis of the cone they always do.
    """
    ua, ub = unit(S[which] * (wo[which] + o_a)), unit(S[which] * (wo[which] + o_b))
    weight = np.sqrt(dot(ub - ua, ub - ua))[:, None]
    centre = np.zeros(wo.shape)
    np.add.at(centre, which, weight * (ua + ub))
    norm = np.sqrt(dot(centre, centre))
    centre /= np.where(norm > 0.0, norm, 1.0)[:, None]
    nearest = np.ones(wo.shape[0])
    np.minimum.at(nearest, i, dot(u, centre[i]))
    far = (nearest < 0.3) & (wo[:, 2] > 0.0)
    if np.any(far):
        centre[far] = brdf.horizon_cone(wo[far], ax[far], ay[far])[0][..., 2]
    return centre


def _line_poles(
    x: FloatArray, dx: FloatArray, half: FloatArray, at: FloatArray | float = 0.0
) -> BoolArray:
    """Return whether the roots of |x + (t - at) dx|^2 are far from [-half, half]."""
    dx2 = dot(dx, dx) + 1e-300
    cross = np.cross(x, dx)
    return _far(at - dot(x, dx) / dx2, np.sqrt(dot(cross, cross)) / dx2, half)


def _smith_pole(
    wi: FloatArray,
    slope: FloatArray,
    wo: FloatArray,
    stretch: FloatArray,
    half: FloatArray,
    at: FloatArray,
) -> BoolArray:
    """Return whether the pole of G2 at z_i R_o = -z_o R_i is far from [-half, half].

    Squared, it is z_i = -z_o a_i/a_o with a = |(ax x, ay y)|; z_i is taken as
    straight about ``at``.
    """
    a_i = np.hypot(stretch[:, 0] * wi[:, 0], stretch[:, 1] * wi[:, 1])
    a_o = np.hypot(stretch[:, 0] * wo[:, 0], stretch[:, 1] * wo[:, 1])
    depth = np.where(a_o > a_i * 1e-9, wo[:, 2] * a_i / np.maximum(a_o, 1e-300), 1e9)
    slope = np.where(np.abs(slope) > 1e-20, slope, 1e-20)
    return _far(at - (wi[:, 2] + depth) / slope, np.zeros_like(depth), half)


def _far(a: FloatArray, b: FloatArray, half: FloatArray) -> BoolArray:
    """Return whether a pole a + ib lies outside the ellipse of [-half, half] with 1/rho = 0.45."""
    z = np.clip(a / half, -1e6, 1e6) + 1j * np.clip(b / half, 0.0, 1e6)
    root = np.sqrt(z * z - 1.0)
    return np.asarray(np.maximum(np.abs(z + root), np.abs(z - root)) > 1.0 / 0.45)
