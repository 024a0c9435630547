"""Ground truth: GGX integrated over polygons, several independent ways."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from ltc import brdf
from ltc.polygon import clip_to_horizon

FloatArray: TypeAlias = npt.NDArray[np.float64]
IntArray: TypeAlias = npt.NDArray[np.intp]


def _unit(w: FloatArray) -> FloatArray:
    return np.asarray(w / np.sqrt(np.sum(w * w, axis=-1, keepdims=True)))


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("...i,...i->...", a, b))


def specular_integral_batch(
    vertices: npt.ArrayLike,
    wo: npt.ArrayLike,
    alpha_x: npt.ArrayLike,
    alpha_y: npt.ArrayLike,
    nodes: int = 12,
    chunk: int = 128,
) -> tuple[FloatArray, FloatArray]:
    """Return GGX integrated over many polygon lights of radiance 1.

    Parameters
    ----------
    vertices : (..., N, 3) float64
        Corners of one planar loop each, convex or not, in the tangent frame,
        anywhere about the horizon; positive for counter-clockwise about +z.
    wo : (..., 3) float64
        Unit directions to the viewer.
    alpha_x, alpha_y : (...) float64
        GGX parameters, positive.
    nodes : int
        Gauss-Legendre nodes of a panel, along edges and along chords.
    chunk : int
        Configurations at a time; for speed only.

    Returns
    -------
    one, fresnel : (...) float64
        Integrals over the light above the horizon of `ltc.brdf.evaluate` with
        F = 1 and with the weight (1 - wo.h)^5: for f0 the integral is
        f0 (one - fresnel) + fresnel. Zero where the viewer is below the surface.

    Raises
    ------
    ValueError
        If shapes do not fit or an alpha is not positive.

    Notes
    -----
    The light's outline maps to half vectors h' (see
    `ltc.brdf.stretched_integrand`), where the integrand is smooth; the region
    is a signed fan of chords from a point within it. Panels along the outline
    halve until the poles of the integrand are far enough for geometric convergence,
    panels along chords are graded towards the horizon's layer.

    Largest difference from 30 nodes, 2,000 random rectangles near, far and through the
    horizon, alpha 1e-3 to 1, theta 0 to 89.5 degrees: 1.5e-5 (8 nodes), 9e-7 (10),
    4e-8 (12), 4e-10 (16). A configuration takes 0.4 ms with 12.
    """
    p = np.asarray(vertices, dtype=np.float64)
    wo = np.asarray(wo, dtype=np.float64)
    if p.ndim < 2 or p.shape[-1] != 3 or p.shape[-2] < 3:
        raise ValueError(f"vertices have shape {p.shape}, expected (..., N >= 3, 3)")
    if wo.ndim < 1 or wo.shape[-1] != 3:
        raise ValueError(f"wo has shape {wo.shape}, expected (..., 3)")
    ax, ay = np.asarray(alpha_x, dtype=np.float64), np.asarray(alpha_y, dtype=np.float64)
    if not (np.all(ax > 0.0) and np.all(ay > 0.0)):
        raise ValueError("alpha_x and alpha_y must be positive numbers")
    shape = np.broadcast_shapes(p.shape[:-2], wo.shape[:-1], ax.shape, ay.shape)
    p = np.broadcast_to(p, (*shape, *p.shape[-2:])).reshape(-1, *p.shape[-2:])
    wo = np.broadcast_to(wo, (*shape, 3)).reshape(-1, 3)
    ax, ay = (np.broadcast_to(a, shape).reshape(-1) for a in (ax, ay))
    out = np.zeros((2, p.shape[0]))
    for i in range(0, p.shape[0], chunk):
        part = slice(i, i + chunk)
        out[:, part] = _batch(p[part], wo[part], ax[part], ay[part], nodes)
    return out[0].reshape(shape), out[1].reshape(shape)


_MAX_RADIAL = 24


def _gauss(n: int) -> tuple[FloatArray, FloatArray]:
    """Return Gauss-Legendre nodes and weights on [0, 1]."""
    x, w = np.polynomial.legendre.leggauss(n)
    return 0.5 * (x + 1.0), 0.5 * w


def _graded(k: int, n: int) -> tuple[FloatArray, FloatArray]:
    """Return nodes on [0, 1] in k + 1 panels that halve towards 1."""
    x, w = _gauss(n)
    edges = np.concatenate([1.0 - 0.5 ** np.arange(k + 1.0), [1.0]])
    width = np.diff(edges)[:, None]
    return (edges[:-1, None] + width * x).ravel(), (width * w).ravel()


def _batch(p: FloatArray, wo: FloatArray, ax: FloatArray, ay: FloatArray, nodes: int) -> FloatArray:
    result = np.zeros((2, p.shape[0]))
    a = clip_to_horizon(p)
    b = np.roll(a, -1, axis=-2)
    S = np.stack([1.0 / ax, 1.0 / ay, np.ones_like(ax)], axis=-1)
    normal = np.cross(a, b - a)
    length = np.sqrt(_dot(normal, normal))
    edge = (length > 0.0) & (wo[:, 2] > 0.0)[:, None]
    which = np.nonzero(edge)[0]
    if which.size == 0:
        return result
    a, b, normal, length = a[edge], b[edge], normal[edge], length[edge]
    o0 = _unit(a)
    o1 = np.cross(normal / length[:, None], o0)
    sweep = np.arctan2(length, _dot(a, b))
    # Centre of the fan: mean of the outline's half vectors, weighted by length.
    ua, ub = _unit(S[which] * (wo[which] + o0)), _unit(S[which] * (wo[which] + _unit(b)))
    weight = np.sqrt(_dot(ub - ua, ub - ua))[:, None]
    centre = np.zeros((p.shape[0], 3))
    np.add.at(centre, which, weight * (ua + ub))
    norm = np.sqrt(_dot(centre, centre))
    centre /= np.where(norm > 0.0, norm, 1.0)[:, None]
    # Panels.
    lo, hi = np.zeros_like(sweep), sweep
    e = np.arange(which.size)
    done: list[tuple[IntArray, FloatArray, FloatArray]] = []
    for _level in range(60):
        if e.size == 0:
            break
        m, half = 0.5 * (lo + hi), 0.5 * (hi - lo)
        i = which[e]
        cos, sin = np.cos(m)[:, None], np.sin(m)[:, None]
        o, do = o0[e] * cos + o1[e] * sin, o1[e] * cos - o0[e] * sin
        h, dh = S[i] * (wo[i] + o), S[i] * do
        dh2 = _dot(dh, dh)
        cross = np.cross(h, dh)
        ready = _inverse_rho(-_dot(h, dh) / dh2, np.sqrt(_dot(cross, cross)) / dh2, half) < 0.45
        layer = np.minimum(np.minimum(ax[i], ay[i]), wo[i, 2])
        slope = np.abs(do[:, 2]) + 1e-20
        ready &= _inverse_rho(-o[:, 2] / slope, layer / slope, half) < 0.6
        ready &= half < 0.4
        ready |= half < 1e-12
        done.append((e[ready], lo[ready], hi[ready]))
        e, lo, hi, m = e[~ready], lo[~ready], hi[~ready], m[~ready]
        e, lo, hi = np.concatenate([e, e]), np.concatenate([lo, m]), np.concatenate([m, hi])
    e = np.concatenate([d[0] for d in done])
    lo = np.concatenate([d[1] for d in done])
    hi = np.concatenate([d[2] for d in done])
    x, w = _gauss(nodes)
    phi = (lo[:, None] + (hi - lo)[:, None] * x).ravel()
    w_phi = ((hi - lo)[:, None] * w).ravel()
    e = np.repeat(e, nodes)
    i = which[e]
    cos, sin = np.cos(phi)[:, None], np.sin(phi)[:, None]
    o, do = o0[e] * cos + o1[e] * sin, o1[e] * cos - o0[e] * sin
    h, dh = S[i] * (wo[i] + o), S[i] * do
    h2 = _dot(h, h)
    u = h / np.sqrt(h2)[:, None]
    # Chords must stay away from the origin: from the axis of the horizon's cone they do.
    nearest = np.ones(p.shape[0])
    np.minimum.at(nearest, i, _dot(u, centre[i]))
    far = (nearest < 0.3) & (wo[:, 2] > 0.0)
    if np.any(far):
        centre[far] = brdf.horizon_cone(wo[far], ax[far], ay[far])[0][..., 2]
    c = centre[i]
    k = w_phi * _dot(c, np.cross(h, dh)) / h2
    # Slope of zi along the chord at its end: zi = 2 (v.h) hz / |h|^2 - vz.
    g, dg = u / S[i], (u - c) / S[i]
    g2, v_g, v_dg = _dot(g, g), _dot(wo[i], g), _dot(wo[i], dg)
    dz = 2.0 * (v_dg * g[:, 2] + v_g * dg[:, 2] - 2.0 * v_g * g[:, 2] * _dot(g, dg) / g2) / g2
    layer = np.minimum(np.minimum(ax[i], ay[i]), wo[i, 2])
    distance = np.hypot(o[:, 2], layer) / (np.abs(dz) + 1e-20)
    rank_s = np.clip(np.ceil(np.log2(0.25 / distance)), 0.0, _MAX_RADIAL).astype(np.intp)
    for r in np.unique(rank_s):
        sel = rank_s == r
        s, w_s = _graded(int(r), nodes)
        j = i[sel]
        q = [c[sel, d, None] + s * (u[sel, d] - c[sel, d])[:, None] for d in range(3)]
        density, fresnel = brdf.stretched_integrand(
            (q[0], q[1], q[2]),
            (wo[j, 0, None], wo[j, 1, None], wo[j, 2, None]),
            ax[j, None],
            ay[j, None],
        )
        density *= k[sel, None] * (s * w_s)
        np.add.at(result[0], j, np.sum(density, axis=1))
        np.add.at(result[1], j, np.sum(density * fresnel, axis=1))
    return result


def _inverse_rho(a: FloatArray, b: FloatArray, half: FloatArray) -> FloatArray:
    """Return 1/rho of the Bernstein ellipse through the pole a + ib of [-half, half]."""
    z = np.clip(a / half, -1e6, 1e6) + 1j * np.clip(b / half, 0.0, 1e6)
    root = np.sqrt(z * z - 1.0)
    return np.asarray(1.0 / np.maximum(np.abs(z + root), np.abs(z - root)))
