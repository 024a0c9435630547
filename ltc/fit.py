"""Fit the isotropic table to GGX: ``python -m ltc fit isotropic``.

What is minimised
    M = M0 (I + X), X bicubic between nodes (`ltc.table`). The unknowns are the nodes,
    all at once, so a node gets the value that interpolates best rather than
    the one that fits best where it stands. The loss is the mean error of the
    technique as rendered (light clipped at the surface, transformed, clipped, form
    factor, times A / (1 - leak)) over random rectangles, absolute above 1e-3
    and with the square added at weight 50; plus .03 of the mean total
    variation between lobe and GGX, which holds where few rectangles look; plus a
    little smoothness. Targets are exact (`ltc.reference`), derivatives
    analytic, steps Levenberg-Marquardt on reweighted normal equations.

Measured (`random_configurations`, 4,000 rectangles and 2,000 octagons with seeds
of their own, read through the GPU's textures; absolute error, radiance 1)

    ==========  ======  =====  =====  =====
    lights      mean    p95    p99    max
    ==========  ======  =====  =====  =====
    rectangles  .00195  .0087  .0202  .076
    octagons    .00192  .0086  .0200  .050
    ==========  ======  =====  =====  =====

    Rectangles by theta 0-30, 30-60, 60-75, 75-87, 87-89.9 degrees: .00064, .00101,
    .00254, .0052, .0098; by alpha .001-.01-.1-.3-.6-1: .0003, .0016, .0033,
    .0023, .0010. At alpha 1e-4 to 1e-3 with an edge through every lobe: .0003.
    Above 87 degrees one lobe has not the shape of GGX: at the views of the three
    largest errors, lights with an edge in the lobe are in error by .0135 to .0163
    in the mean, and a lobe refitted to that view alone by .0133 to .0155.

Compared (mean, p99, max on the same rectangles)

    ===============================  ======  =====  ====
    M0 alone                         .0111   .094   .192
    bicubic 4^2 nodes (256 bytes)    .00226  .0224  .068
    bicubic 6^2                      .00197  .0191  .080
    bicubic 8^2 (1 KB), the default  .00195  .0202  .076
    bicubic 10^2                     .00195  .0203  .073
    bicubic 16^2                     .00195  .0202  .076
    bilinear 8^2                     .00197  .0200  .084
    bilinear 16^2                    .00195  .0198  .080
    bilinear 24^2                    .00198  .0206  .084
    8^2 without / (1 - leak)         .00214  .0236  .054
    8^2, no squared error            .00194  .0201  .076
    8^2, total variation at .3       .0025   .028   .072
    ===============================  ======  =====  ====

    Differences under .0001 are noise: what is left is the lobe's shape, not the
    table. The last two rows were taken with a slightly weaker smoothness.

Time: 44 to 57 s on two busy cores (25 s the exact integrals of 40,000 rectangles, 10 s
nine steps, 5 s the error figures). The result depends on the seed and the library
versions alone; a checkpoint beside the output lets an interrupted fit go on.
"""

from __future__ import annotations

import io
import itertools
import json
import platform
import time
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from ltc import brdf, transform
from ltc.polygon import clip_to_horizon, ltc_specular
from ltc.reference import specular_integral_batch
from ltc.table import (
    RESIDUAL_SIZE,
    IsotropicTable,
    alpha_and_cosine,
    bicubic_weights,
    closed_form_guess,
    node_grid,
    npz_bytes,
    residual_matrix,
    sample_textures,
    save_isotropic,
    stretched_length,
    table_coordinates,
    write_atomically,
)

FloatArray = NDArray[np.float64]
Report = Callable[[str], None]

SIZE = 8
"""Default nodes on each axis of the residual."""
CONFIGURATIONS = 40_000
"""Default number of rectangles fitted to."""
ALBEDO_NODES = 32
"""Nodes on each axis of the albedo and Fresnel tables."""

THETA_MAX = np.radians(89.9)
"""Largest angle between view and normal in the error figures [rad]."""

_ENTRIES = ((0, 0), (0, 2), (1, 1), (2, 0))  # of X, in the order of the table's channels
_ALBEDO_COSINE = 1e-7  # in units of alpha; stands for a view exactly in the surface
_CHUNK = 2048  # configurations per piece of work
_SAVE_EVERY = 1.0  # seconds between checkpoints while the exact integrals are computed
_EPSILON = 1e-3  # below this error the loss is quadratic, above it absolute
_TAIL = 50.0  # weight of the squared error beside the absolute one
_VARIATION = 0.03  # weight of the total variation
_RELATIVE_FLOOR = 0.05  # relative errors of the density below this count as squares
_SMOOTHNESS = 1e-5  # weight of squared second differences of the residual
_LOBES, _DIRECTIONS = 2000, 64  # views, and directions each, in the total variation
_FACTOR_MARGIN = 0.15  # factors of det(I + X) smaller than this are penalised, by squares
_DAMPING, _DAMPING_MIN, _DAMPING_MAX = 1e-2, 1e-6, 1e6
_DAMPING_FLOOR = 0.1  # damping of unknowns that little depends on, in mean curvatures
_STEPS, _STEP_GAIN = 40, 1e-4  # most steps; stop when a step gains less than this share

_TRAIN, _TEST, _OCTAGONS, _VARIATION_STREAM = range(4)  # independent streams of one seed


@dataclass(frozen=True, eq=False)
class Configurations:
    """Views of materials under one light each.

    Attributes
    ----------
    alpha, cos_theta : (n,) float64
        GGX alpha, and the cosine between view and normal.
    corners : (n, N, 3) float64
        The light in the shading frame, counter-clockwise about +z as the
        point sees it; the light's centre or edge is at distance 1.
    """

    alpha: FloatArray
    cos_theta: FloatArray
    corners: FloatArray

    @property
    def wo(self) -> FloatArray:
        """Unit directions to the viewer, (n, 3), in the xz half-plane x >= 0."""
        c = self.cos_theta
        return np.stack([np.sqrt(1.0 - c * c), np.zeros_like(c), c], axis=-1)


def random_configurations(
    rng: np.random.Generator, count: int, corners: int = 4, training: bool = False
) -> Configurations:
    """Return random materials, views and polygon lights.

    Parameters
    ----------
    rng : numpy.random.Generator
        Source of all randomness.
    count : int
        Number of configurations.
    corners : int, >= 3
        4 gives rectangles, 8 stretched octagons.
    training : bool
        Spread over the whole table instead of the range of the error figures.

    Notes
    -----
    sqrt(alpha) is uniform from sqrt(.001) to 1 and theta from 0 to 89.9 degrees; for
    training sqrt(alpha) from .01 to 1 and, for a fifth of the views, the
    table's row uniform instead of theta.

    The light's plane has a uniformly random normal and rotation, its
    half-extents are .1 to 3 along each axis, log-uniform and independent. One third
    of the lights have their centre at distance 1 in a uniformly random
    direction above the horizon, one third in a direction drawn from the GGX lobe;
    the last third have a random point of their border there, so that an edge
    cuts the lobe however thin it is. Many cross the horizon.
    """
    low = 0.01 if training else np.sqrt(1e-3)
    x = rng.uniform(low, 1.0, count)
    alpha = x * x
    c = np.cos(rng.uniform(0.0, THETA_MAX, count))
    if training:
        by_row = alpha_and_cosine(x, rng.uniform(0.0, 1.0, count))[1]
        c = np.where(rng.random(count) < 0.2, np.maximum(by_row, np.cos(THETA_MAX)), c)
    s = np.sqrt(1.0 - c * c)
    wo = np.stack([s, np.zeros_like(c), c], axis=-1)

    z, phi = rng.uniform(0.0, 1.0, count), rng.uniform(0.0, 2.0 * np.pi, count)
    r = np.sqrt(1.0 - z * z)
    hemisphere = np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1)
    h = brdf.sample_visible_normals(wo, rng.random((count, 2)), alpha, alpha)
    kind = rng.integers(0, 3, count)
    d = np.where((kind == 0)[:, None], hemisphere, brdf.reflect(wo, h))

    n = _normalise(rng.normal(size=(count, 3)))
    n *= np.where(np.sum(n * d, axis=-1) > 0.0, 1.0, -1.0)[:, None]  # away from the point
    u = rng.normal(size=(count, 3))
    u = _normalise(u - n * np.sum(u * n, axis=-1, keepdims=True))
    v = np.cross(n, u)
    extent = np.exp(rng.uniform(np.log(0.1), np.log(3.0), (count, 2)))
    angle = 2.0 * np.pi * (np.arange(corners) + 0.5) / corners
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=-1) / np.cos(np.pi / corners)
    flat = extent[:, None, :] * circle
    rows, edge, t = np.arange(count), rng.integers(0, corners, count), rng.random((count, 1))
    border = (1.0 - t) * flat[rows, edge] + t * flat[rows, (edge + 1) % corners]
    flat = flat - np.where((kind == 2)[:, None], border, 0.0)[:, None, :]
    place = d[:, None] + flat[..., :1] * u[:, None] + flat[..., 1:] * v[:, None]
    return Configurations(alpha, c, place)


def _normalise(w: FloatArray) -> FloatArray:
    return np.asarray(w / np.linalg.norm(w, axis=-1, keepdims=True))


def exact_integrals(configurations: Configurations) -> FloatArray:
    """Return GGX with F = 1 integrated over each light of radiance 1, (n,) float64."""
    a = configurations.alpha
    return specular_integral_batch(configurations.corners, configurations.wo, a, a)[0]


def shading_errors(
    table: IsotropicTable, configurations: Configurations, exact: FloatArray
) -> FloatArray:
    """Return the technique's absolute errors, (n,), read from the GPU's textures.

    Parameters
    ----------
    table : IsotropicTable
        Sampled as `ltc.table.sample_textures` does.
    configurations, exact
        The cases and their `exact_integrals`.
    """
    M, A, _ = sample_textures(table.textures(), configurations.alpha, configurations.cos_theta)
    return np.abs(ltc_specular(M, [configurations.corners], A) - exact)


def error_figures(errors: FloatArray, configurations: Configurations) -> dict[str, Any]:
    """Return mean, 95th and 99th percentile and maximum, and means by bins.

    Keys ``mean p95 p99 max``, and ``theta`` and ``alpha`` with the means by
    ranges of theta in degrees and of alpha; empty ranges are left out.
    """
    theta = np.degrees(np.arccos(configurations.cos_theta))
    result: dict[str, Any] = {
        "mean": _rounded(np.mean(errors)),
        "p95": _rounded(np.percentile(errors, 95)),
        "p99": _rounded(np.percentile(errors, 99)),
        "max": _rounded(np.max(errors)),
    }
    for name, values, bounds in (
        ("theta", theta, (0.0, 30.0, 60.0, 75.0, 87.0, 90.0)),
        ("alpha", configurations.alpha, (0.001, 0.01, 0.1, 0.3, 0.6, 1.0)),
    ):
        bins = {}
        for low, high in itertools.pairwise(bounds):
            inside = (values >= low) & (values <= high)
            if np.any(inside):
                bins[f"{low:g}-{high:g}"] = _rounded(np.mean(errors[inside]))
        result[name] = bins
    return result


def _rounded(value: np.floating[Any]) -> float:
    return float(f"{value:.4g}")


def albedo_tables(size: int = ALBEDO_NODES) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return A and the Fresnel cosine u at the nodes of a table, (size, size) each.

    Exact to float32 (`ltc.brdf.directional_albedo`), 2 ms a node.
    """
    alpha, c = node_grid(size)
    c = np.maximum(c, _ALBEDO_COSINE * alpha)
    wo = np.stack([np.sqrt(1.0 - c * c), np.zeros_like(c), c], axis=-1)
    A, B = brdf.directional_albedo(wo, alpha, alpha)
    A = np.minimum(A, 1.0)
    u = (1.0 - (B / A) ** 0.2) / stretched_length(alpha, c)
    return A.astype(np.float32), u.astype(np.float32)


class _Model:
    """I + X at given views, its inverse, and the lobe's share above the horizon.

    Entries are X00, X02, X11, X20 themselves, (n, 4), with the factor s applied.
    """

    def __init__(self, guess: FloatArray, entries: FloatArray) -> None:
        ones = np.ones(entries.shape[0])
        self.residual = residual_matrix(entries, ones)
        self.inverse = transform.invert(self.residual)
        self.bottom = guess[:, 2]  # last row of M0
        self.row = np.einsum("ni,nij->nj", self.bottom, self.residual)
        self.length = np.sqrt(np.sum(self.row * self.row, axis=-1))
        self.above = 0.5 + 0.5 * self.row[:, 2] / self.length

    def above_gradient(self) -> FloatArray:
        """Return d(above)/d(entries), (n, 4)."""
        d_row2 = [self.bottom[:, i] if j == 2 else 0.0 * self.length for i, j in _ENTRIES]
        d_length = [self.bottom[:, i] * self.row[:, j] / self.length for i, j in _ENTRIES]
        quotient = self.row[:, 2] / self.length
        change = [d2 - quotient * dl for d2, dl in zip(d_row2, d_length, strict=True)]
        return np.asarray(0.5 * np.stack(change, axis=-1) / self.length[:, None])

    def motion(self, r: FloatArray) -> FloatArray:
        """Return how r = (I + X)^-1 r0, (n, k, 3), moves with each entry, (n, k, 3, 4)."""
        return np.stack(
            [-self.inverse[:, None, :, i] * r[..., j, None] for i, j in _ENTRIES], axis=-1
        )


def form_factor_gradient(r: FloatArray, dr: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the form factor of loops above the horizon and its derivatives.

    Parameters
    ----------
    r : (n, k, 3) float64
        Corners, clipped to z >= 0, counter-clockwise about +z; repeats allowed.
    dr : (n, k, 3, p) float64
        Their derivatives by p parameters under a linear motion of space.

    Returns
    -------
    (n,), (n, p) float64

    Notes
    -----
    Lambert's sum, each term (a x b)_z theta/|a x b| differentiated. Corners made by
    clipping are moved like fixed points of their edge although they slide along
    it: the sliver between lies at z = 0, where the cosine vanishes.
    """
    q, dq = np.roll(r, -1, axis=1), np.roll(dr, -1, axis=1)
    n = np.cross(r, q)
    sine, cosine = np.sqrt(np.sum(n * n, axis=-1)), np.sum(r * q, axis=-1)
    scale = np.sqrt(np.sum(r * r, axis=-1) * np.sum(q * q, axis=-1))
    live = sine > 1e-13 * scale
    safe = np.where(live, sine, 1.0)
    ratio = np.where(live, np.arctan2(sine, cosine) / safe, 0.0)
    dn = np.cross(dr, q[..., None], axis=2) + np.cross(r[..., None], dq, axis=2)
    dcosine = np.sum(dr * q[..., None] + r[..., None] * dq, axis=2)
    dsine = np.sum(n[..., None] * dn, axis=2) / safe[..., None]
    dtheta = cosine[..., None] * dsine - sine[..., None] * dcosine
    dtheta /= np.where(live, sine * sine + cosine * cosine, 1.0)[..., None]
    dratio = np.where(live[..., None], (dtheta - ratio[..., None] * dsine) / safe[..., None], 0.0)
    value = np.sum(n[..., 2] * ratio, axis=1) / (2.0 * np.pi)
    slope = dn[:, :, 2] * ratio[..., None] + n[..., 2, None] * dratio
    return value, np.sum(slope, axis=1) / (2.0 * np.pi)


class ShadingError:
    """The technique's error on lights, as rendered, by the residual's entries.

    Parameters
    ----------
    configurations, exact
        The cases and their `exact_integrals`.
    albedo : (n,) float64
        A as the table gives it.
    """

    def __init__(
        self, configurations: Configurations, exact: FloatArray, albedo: FloatArray
    ) -> None:
        a, wo = configurations.alpha, configurations.wo
        self.sine = wo[:, 0]
        self.x, self.y = table_coordinates(a, configurations.cos_theta)
        self.exact, self.albedo = exact, albedo
        self.guess = closed_form_guess(a, a, wo)
        lit = clip_to_horizon(configurations.corners)
        self.corners = transform.apply(transform.invert(self.guess)[:, None], lit)

    def evaluate(self, entries: FloatArray, part: slice) -> tuple[FloatArray, FloatArray]:
        """Return errors (n,) and derivatives (n, 4) of the cases in ``part``."""
        model = _Model(self.guess[part], entries)
        r = clip_to_horizon(transform.apply(model.inverse[:, None], self.corners[part]))
        E, dE = form_factor_gradient(r, model.motion(r))
        weight = self.albedo[part] / model.above
        slope = dE - (E / model.above)[:, None] * model.above_gradient()
        return weight * E - self.exact[part], weight[:, None] * slope

    def normal_equations(
        self, entries: FloatArray, part: slice
    ) -> tuple[float, FloatArray, FloatArray]:
        """Return the loss and, per case, curvature (n, 4, 4) and slope (n, 4), reweighted."""
        error, slope = self.evaluate(entries, part)
        root = np.sqrt(error * error + _EPSILON * _EPSILON)
        n = self.exact.size
        loss = float(np.sum(root - _EPSILON + _TAIL * error * error)) / n
        weight = (1.0 / root + 2.0 * _TAIL) / n
        curvature = weight[:, None, None] * slope[:, :, None] * slope[:, None, :]
        return loss, curvature, (weight * error)[:, None] * slope


class LobeVariation:
    """Total variation between GGX and the lobe, both normalised above the horizon.

    A Monte Carlo estimate with fixed directions, half of them from the guess's lobe and
    half from GGX's visible normals, at random views over the table.
    """

    def __init__(self, rng: np.random.Generator, views: int, directions: int) -> None:
        x = rng.uniform(0.01, 1.0, views)
        c = np.where(
            np.arange(views) % 2 == 0,
            np.cos(rng.uniform(0.0, THETA_MAX, views)),
            np.maximum(alpha_and_cosine(x, rng.random(views))[1], np.cos(THETA_MAX)),
        )
        alpha = x * x
        self.sine = np.sqrt(1.0 - c * c)
        self.x, self.y = table_coordinates(alpha, c)
        wo = np.stack([self.sine, np.zeros_like(c), c], axis=-1)
        self.guess = closed_form_guess(alpha, alpha, wo)
        inverse = transform.invert(self.guess)
        shape = (views, directions // 2)
        z2, phi = rng.random(shape), 2.0 * np.pi * rng.random(shape)
        r = np.sqrt(1.0 - z2)
        cosine = np.stack([r * np.cos(phi), r * np.sin(phi), np.sqrt(z2)], axis=-1)
        from_guess = _normalise(transform.apply(self.guess[:, None], cosine))
        wo, alpha = wo[:, None], alpha[:, None]
        h = brdf.sample_visible_normals(wo, rng.random((*shape, 2)), alpha, alpha)
        wi = np.concatenate([from_guess, brdf.reflect(wo, h)], axis=1)
        self.directions = transform.apply(inverse[:, None], wi)
        self.scale = 1.0 / np.linalg.det(self.guess)
        length2 = np.sum(self.directions**2, axis=-1)
        from_guess_pdf = (
            np.maximum(self.directions[..., 2], 0.0) / length2**2 * self.scale[:, None] / np.pi
        )
        density = 0.5 * (from_guess_pdf + brdf.pdf(wo, wi, alpha, alpha))
        known = (wi[..., 2] > 0.0) & (density > 0.0)
        # GGX above the horizon is normalised by the albedo, estimated by the same samples.
        ggx = brdf.evaluate(wo, wi, alpha, alpha)
        self.weight = np.where(known, 0.5 / np.where(known, density, 1.0), 0.0) / wi.shape[1]
        total = 2.0 * np.sum(ggx * self.weight, axis=1, keepdims=True)
        self.ggx = ggx / total

    def normal_equations(
        self, entries: FloatArray, part: slice
    ) -> tuple[float, FloatArray, FloatArray]:
        """Return the loss and, per view, curvature (n, 4, 4) and slope (n, 4), reweighted."""
        model = _Model(self.guess[part], entries)
        r = transform.apply(model.inverse[:, None], self.directions[part])
        dr = model.motion(r)
        length2 = np.sum(r * r, axis=-1)
        scale = self.scale[part] * np.linalg.det(model.inverse) / (np.pi * model.above)
        lit = r[..., 2] > 0.0
        q = scale[:, None] * np.where(lit, r[..., 2], 0.0) / length2**2
        shrink = -np.stack([model.inverse[:, j, i] for i, j in _ENTRIES], axis=-1)
        shrink -= model.above_gradient() / model.above[:, None]
        dlength = np.sum(r[..., None] * dr, axis=2) / length2[..., None]
        dq = q[..., None] * (shrink[:, None] - 4.0 * dlength)
        dq += (scale[:, None] / length2**2 * lit)[..., None] * dr[..., 2, :]

        weight = self.weight[part]
        error, slope = (q - self.ggx[part]) * weight, dq * weight[..., None]
        views, directions = self.x.size, weight.shape[1]
        floor = _RELATIVE_FLOOR * 0.5 / directions
        softened = np.sqrt(error * error + floor * floor)
        loss = _VARIATION * float(np.sum(softened - floor)) / views
        w = _VARIATION / views / softened
        curvature = np.einsum("nk,nki,nkj->nij", w, slope, slope, optimize=True)
        return loss, curvature, np.einsum("nk,nki->ni", w * error, slope)


@dataclass(frozen=True, eq=False)
class FitState:
    """Where a fit stands: the residual's nodes (n, n, 4), damping, steps, loss."""

    residual: FloatArray
    damping: float = _DAMPING
    steps: int = 0
    loss: float = np.inf
    done: bool = False


def fit_steps(state: FitState, shading: ShadingError, lobes: LobeVariation) -> Iterator[FitState]:
    """Yield ever better states until nothing is gained.

    Each step solves Levenberg-Marquardt's equations for all nodes at once, with weights
    that turn squares into absolute values (iteratively reweighted least
    squares). A state fully determines the next.
    """
    size = state.residual.shape[0]
    tie = _tie(size)
    bending = _bending(size) @ tie
    smoothness = _SMOOTHNESS * bending.T @ bending
    nodes = np.linspace(0.0, 1.0, max(RESIDUAL_SIZE, 4 * size))
    guard = [g.ravel() for g in np.broadcast_arrays(nodes[None, :], nodes[:, None])]
    guard_weights = bicubic_weights(guard[0], guard[1], size)
    guard_cosine = alpha_and_cosine(guard[0], guard[1])[1]

    def equations(z: FloatArray) -> tuple[float, FloatArray, FloatArray]:
        p = (tie @ z).reshape(size * size, 4)
        loss = 0.5 * float(z @ smoothness @ z)
        H = np.zeros((size * size, 4, size * size, 4))
        g = np.zeros((size * size, 4))
        X00, X02, X11, X20 = (guard_weights @ p).T
        s2 = 1.0 - guard_cosine**2
        for factor, change in (
            (1.0 + X00 - s2 * X02 * X20, (np.ones_like(s2), -s2 * X20, 0.0 * s2, -s2 * X02)),
            (1.0 + X11, (0.0 * s2, 0.0 * s2, np.ones_like(s2), 0.0 * s2)),
        ):
            if np.min(factor) <= 0.0:
                return np.inf, smoothness, z
            near = factor < _FACTOR_MARGIN
            short = factor[near] - _FACTOR_MARGIN
            loss += 0.5 * float(short @ short)
            J = np.stack(change, axis=-1)[near][:, None, :] * guard_weights[near][:, :, None]
            flat = J.reshape(-1, 4 * size * size)
            H += (flat.T @ flat).reshape(H.shape)
            g += (short @ flat).reshape(g.shape)
        for term in (shading, lobes):
            for first in range(0, term.x.size, _CHUNK):
                part = slice(first, first + _CHUNK)
                W = bicubic_weights(term.x[part], term.y[part], size)
                s = term.sine[part]
                scale = np.stack([np.ones_like(s), s, np.ones_like(s), s], axis=-1)
                value, curvature, slope = term.normal_equations((W @ p) * scale, part)
                loss += value
                curvature *= scale[:, :, None] * scale[:, None, :]
                g += W.T @ (slope * scale)
                for i in range(4):
                    for j in range(i, 4):
                        block = W.T @ (W * curvature[:, i, j, None])
                        H[:, i, :, j] += block
                        if i != j:
                            H[:, j, :, i] += block
        full = tie.T @ H.reshape(4 * size * size, -1) @ tie + smoothness
        return loss, full, tie.T @ g.ravel() + smoothness @ z

    z = tie.T @ state.residual.ravel() / np.sum(tie, axis=0)
    loss, H, g = equations(z)
    damping, steps = state.damping, state.steps
    while not state.done:
        diagonal = np.diag(H) + _DAMPING_FLOOR * np.mean(np.diag(H))
        while True:
            trial = z - cho_solve(cho_factor(H + np.diag(damping * diagonal)), g)
            new_loss, new_H, new_g = equations(trial)
            if new_loss < loss or damping > _DAMPING_MAX:
                break
            damping *= 5.0
        gain = 0.0
        if new_loss < loss:
            gain = (loss - new_loss) / loss
            z, loss, H, g = trial, new_loss, new_H, new_g
            damping = max(damping / 5.0, _DAMPING_MIN)
        steps += 1
        done = gain < _STEP_GAIN or steps >= _STEPS
        state = FitState((tie @ z).reshape(size, size, 4), damping, steps, loss, done)
        yield state


def _tie(size: int) -> FloatArray:
    """Return the map from free unknowns to nodes: X00 = X11 on the row of normal incidence."""
    tie = np.eye(4 * size * size)
    twins = 4 * np.arange(size)
    tie[twins + 2, twins] = 1.0
    return np.delete(tie, twins + 2, axis=1)


def _bending(size: int) -> FloatArray:
    """Return second differences along both axes of every channel."""
    d = np.diff(np.eye(size), n=2, axis=0)
    both = np.concatenate([np.kron(d, np.eye(size)), np.kron(np.eye(size), d)])
    return np.kron(both, np.eye(4))


class CheckpointError(ValueError):
    """A checkpoint cannot be continued; the message is one sentence for the user."""


@dataclass
class _Work:
    """Everything a fit has computed so far; what a checkpoint holds."""

    settings: dict[str, int]
    exact: FloatArray
    albedo: NDArray[np.float32] | None = None
    fresnel: NDArray[np.float32] | None = None
    state: FitState | None = None

    def save(self, path: Path) -> None:
        arrays: dict[str, NDArray[Any]] = {
            "settings": np.frombuffer(json.dumps(self.settings).encode(), dtype=np.uint8),
            "exact": self.exact,
        }
        if self.albedo is not None and self.fresnel is not None:
            arrays |= {"albedo": self.albedo, "fresnel": self.fresnel}
        if self.state is not None:
            s = self.state
            arrays["residual"] = s.residual
            arrays["progress"] = np.array([s.damping, s.steps, s.loss, s.done])
        write_atomically(path, npz_bytes(arrays))

    @classmethod
    def load(cls, path: Path, settings: dict[str, int]) -> _Work:
        try:
            with np.load(io.BytesIO(path.read_bytes()), allow_pickle=False) as file:
                arrays = {name: file[name] for name in file.files}
            found = json.loads(arrays["settings"].tobytes())
            exact = arrays["exact"]
        except (ValueError, KeyError, EOFError, OSError, zipfile.BadZipFile):
            raise CheckpointError(
                f"{path}: damaged, expected the checkpoint of a fit; --fresh discards it"
            ) from None
        if found != settings:
            raise CheckpointError(
                f"{path}: belongs to a fit with {_words(found)}, expected {_words(settings)};"
                " --fresh discards it"
            )
        work = cls(settings, exact, arrays.get("albedo"), arrays.get("fresnel"))
        if "progress" in arrays:
            damping, steps, loss, done = (float(p) for p in arrays["progress"])
            work.state = FitState(arrays["residual"], damping, int(steps), loss, bool(done))
        return work


def _words(settings: Any) -> str:
    if not isinstance(settings, dict):
        return "unknown settings"
    return ", ".join(f"{key} {value}" for key, value in settings.items())


def checkpoint_path(output: Path) -> Path:
    """Return where a fit of ``output`` keeps its checkpoint, beside it."""
    return output.with_name(output.name + ".checkpoint")


def fit_isotropic(
    output: str | Path,
    size: int = SIZE,
    seed: int = 1,
    configurations: int = CONFIGURATIONS,
    resume: bool | None = None,
    report: Report = lambda message: None,
) -> IsotropicTable:
    """Fit the isotropic table, write it, and return it.

    Parameters
    ----------
    output : str or Path
        The npz file to write, atomically, at the end. Until then a checkpoint lies
        beside it, brought up to date every second or so.
    size : int, 4 to 32
        Nodes on each axis of the residual.
    seed : int, >= 0
        Determines everything random.
    configurations : int, >= 16
        Rectangles fitted to.
    resume : bool, optional
        True: continue from the checkpoint, which must exist; False: discard it;
        by default continue if there is one.
    report : callable
        Takes lines of progress.

    Raises
    ------
    ValueError
        If an argument is out of range, or (CheckpointError) a checkpoint is missing,
        damaged, or of a fit with other settings.
    OSError
        If a file cannot be written.
    """
    output = Path(output)
    for name, value, low, high in (
        ("size", size, 4, 32),
        ("seed", seed, 0, 2**32 - 1),
        ("configurations", configurations, 16, 10**7),
    ):
        if not low <= value <= high:
            raise ValueError(f"{name} is {value}, expected {low} to {high}")
    settings = {"size": size, "seed": seed, "configurations": configurations}
    checkpoint = checkpoint_path(output)
    if resume and not checkpoint.exists():
        raise CheckpointError(f"{checkpoint}: no such checkpoint, so there is nothing to resume")
    if resume is not False and checkpoint.exists():
        work = _Work.load(checkpoint, settings)
        report(f"continuing from {checkpoint}")
    else:
        work = _Work(settings, np.zeros(0))

    if work.albedo is None or work.fresnel is None:
        report(f"albedo: {ALBEDO_NODES}^2 nodes")
        work.albedo, work.fresnel = albedo_tables()
        work.save(checkpoint)
    cases = random_configurations(
        np.random.default_rng([seed, _TRAIN]), configurations, training=True
    )
    _add_targets(work, cases, checkpoint, report)
    table = IsotropicTable(np.zeros((size, size, 4), np.float32), work.albedo, work.fresnel)
    A, _ = table.albedo_terms(cases.alpha, cases.cos_theta)
    shading = ShadingError(cases, work.exact, A)
    lobes = LobeVariation(
        np.random.default_rng([seed, _VARIATION_STREAM]),
        min(_LOBES, configurations),
        _DIRECTIONS,
    )
    state = start = work.state or FitState(np.zeros((size, size, 4)))
    begin = time.monotonic()
    for count, state in enumerate(fit_steps(start, shading, lobes), 1):
        work.state = state
        work.save(checkpoint)
        pace = (time.monotonic() - begin) / count
        report(
            f"fit: step {state.steps}, loss {state.loss:.6f},"
            f" at most {pace * (_STEPS - state.steps):.0f} s left, usually a third of that"
        )
    table = IsotropicTable(state.residual.astype(np.float32), work.albedo, work.fresnel)
    report("error: 4000 rectangles and 2000 octagons that were not fitted to")
    figures = measure(table, seed)
    provenance = {
        "what": "isotropic GGX, height-correlated Smith; axes and layout: ltc.table",
        "how": "python -m ltc fit isotropic; objective: ltc.fit",
        "settings": settings,
        "versions": {
            "numpy": np.__version__,
            "scipy": scipy.__version__,
            "python": platform.python_version(),
        },
        "loss": _rounded(np.float64(state.loss)),
        "steps": state.steps,
        "error": figures,
    }
    table = IsotropicTable(table.residual, table.albedo, table.fresnel, provenance)
    save_isotropic(table, output)
    checkpoint.unlink(missing_ok=True)
    return table


def _add_targets(work: _Work, cases: Configurations, checkpoint: Path, report: Report) -> None:
    """Complete ``work.exact``, saving it now and then."""
    begin, start, saved = time.monotonic(), work.exact.size, 0.0
    count = cases.alpha.size
    try:
        for first in range(start, count, _CHUNK):
            part = slice(first, first + _CHUNK)
            chunk = Configurations(cases.alpha[part], cases.cos_theta[part], cases.corners[part])
            work.exact = np.concatenate([work.exact, exact_integrals(chunk)])
            now, done = time.monotonic() - begin, work.exact.size
            if now - saved > _SAVE_EVERY or done == count:
                saved = now
                work.save(checkpoint)
                left = now / (done - start) * (count - done)
                report(f"exact integrals: {done} of {count}, {left:.0f} s left")
    except KeyboardInterrupt:
        work.save(checkpoint)
        raise


def measure(
    table: IsotropicTable, seed: int, rectangles: int = 4000, octagons: int = 2000
) -> dict[str, Any]:
    """Return `error_figures` on lights that no fit with this seed has seen.

    Keys ``rectangles`` and ``octagons``.
    """
    result = {}
    for name, stream, count, corners in (
        ("rectangles", _TEST, rectangles, 4),
        ("octagons", _OCTAGONS, octagons, 8),
    ):
        cases = random_configurations(np.random.default_rng([seed, stream]), count, corners)
        result[name] = error_figures(shading_errors(table, cases, exact_integrals(cases)), cases)
    return result
