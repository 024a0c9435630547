"""What the fits of tables share: random lights, the two errors that are minimised, descent.

A table's matrix is M = M0 (I + X) with X linear in a few entries per view: X is the sum
of entries times basis matrices, which carry the factors that make X change sign
with the view. The errors here are functions of the entries at given views;
how entries come from a table's nodes is each fit's own business (`ltc.fit`,
`ltc.anisotropic_fit`).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ltc import brdf, transform
from ltc.polygon import clip_to_horizon
from ltc.reference import specular_integral_batch
from ltc.table import closed_form_guess

FloatArray = NDArray[np.float64]

THETA_MAX = np.radians(89.9)
"""Largest angle between view and normal in the error figures [rad]."""

CHUNK = 2048
"""Configurations per piece of work."""

_EPSILON = 1e-3  # below this error the loss is quadratic, above it absolute
_TAIL = 50.0  # weight of the squared error beside the absolute one
_RELATIVE_FLOOR = 0.05  # relative errors of the density below this count as squares
_DAMPING, _DAMPING_MIN, _DAMPING_MAX = 1e-2, 1e-6, 1e6
_STEP_GAIN = 1e-4  # stop when a step gains less than this share


@dataclass(frozen=True, eq=False)
class Configurations:
    """Views of materials under one light each.

    Attributes
    ----------
    alpha_x, alpha_y : (n,) float64
        GGX parameters along x and y.
    wo : (n, 3) float64
        Unit directions to the viewer, x along the tangent.
    corners : (n, N, 3) float64
        The light in the same frame, counter-clockwise about +z as the
        point sees it; the light's centre or edge is at distance 1.
    """

    alpha_x: FloatArray
    alpha_y: FloatArray
    wo: FloatArray
    corners: FloatArray

    @property
    def count(self) -> int:
        """How many there are."""
        return self.alpha_x.size

    @property
    def alpha(self) -> FloatArray:
        """The larger of the two alphas, (n,)."""
        return np.maximum(self.alpha_x, self.alpha_y)

    @property
    def ratio(self) -> FloatArray:
        """The smaller alpha over the larger one, (n,)."""
        return np.asarray(np.minimum(self.alpha_x, self.alpha_y) / self.alpha)

    @property
    def cos_theta(self) -> FloatArray:
        """Cosine between view and normal, (n,)."""
        return np.asarray(self.wo[:, 2])

    def __getitem__(self, part: slice) -> Configurations:
        return Configurations(
            self.alpha_x[part], self.alpha_y[part], self.wo[part], self.corners[part]
        )


def random_lights(
    rng: np.random.Generator,
    alpha_x: FloatArray,
    alpha_y: FloatArray,
    wo: FloatArray,
    corners: int = 4,
) -> Configurations:
    """Return one random polygon light for each material and view.

    Parameters
    ----------
    rng : numpy.random.Generator
        Source of all randomness.
    alpha_x, alpha_y : (n,) float64
    wo : (n, 3) float64
    corners : int, >= 3
        4 gives rectangles, 8 stretched octagons.

    Notes
    -----
    The light's plane has a uniformly random normal and rotation, its
    half-extents are .1 to 3 along each axis, log-uniform and independent. One third
    of the lights have their centre at distance 1 in a uniformly random
    direction above the horizon, one third in a direction drawn from the GGX lobe;
    the last third have a random point of their border there, so that an edge
    cuts the lobe however thin it is. Many cross the horizon.
    """
    count = alpha_x.size
    z, phi = rng.uniform(0.0, 1.0, count), rng.uniform(0.0, 2.0 * np.pi, count)
    r = np.sqrt(1.0 - z * z)
    hemisphere = np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1)
    h = brdf.sample_visible_normals(wo, rng.random((count, 2)), alpha_x, alpha_y)
    kind = rng.integers(0, 3, count)
    d = np.where((kind == 0)[:, None], hemisphere, brdf.reflect(wo, h))

    n = normalise(rng.normal(size=(count, 3)))
    n *= np.where(np.sum(n * d, axis=-1) > 0.0, 1.0, -1.0)[:, None]  # away from the point
    u = rng.normal(size=(count, 3))
    u = normalise(u - n * np.sum(u * n, axis=-1, keepdims=True))
    v = np.cross(n, u)
    extent = np.exp(rng.uniform(np.log(0.1), np.log(3.0), (count, 2)))
    angle = 2.0 * np.pi * (np.arange(corners) + 0.5) / corners
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=-1) / np.cos(np.pi / corners)
    flat = extent[:, None, :] * circle
    rows, edge, t = np.arange(count), rng.integers(0, corners, count), rng.random((count, 1))
    border = (1.0 - t) * flat[rows, edge] + t * flat[rows, (edge + 1) % corners]
    flat = flat - np.where((kind == 2)[:, None], border, 0.0)[:, None, :]
    place = d[:, None] + flat[..., :1] * u[:, None] + flat[..., 1:] * v[:, None]
    return Configurations(alpha_x, alpha_y, wo, place)


def normalise(w: FloatArray) -> FloatArray:
    """Return unit vectors, (..., 3)."""
    return np.asarray(w / np.linalg.norm(w, axis=-1, keepdims=True))


def exact_integrals(configurations: Configurations) -> FloatArray:
    """Return GGX with F = 1 integrated over each light of radiance 1, (n,) float64."""
    c = configurations
    return specular_integral_batch(c.corners, c.wo, c.alpha_x, c.alpha_y)[0]


ALPHA_BOUNDS = (0.001, 0.01, 0.1, 0.3, 0.6, 1.0)
THETA_BOUNDS = (0.0, 30.0, 60.0, 75.0, 87.0, 90.0)


def error_figures(
    errors: FloatArray, axes: Mapping[str, tuple[FloatArray, tuple[float, ...]]]
) -> dict[str, Any]:
    """Return mean, 95th and 99th percentile and maximum, and means by bins.

    Parameters
    ----------
    errors : (n,) float64
    axes : mapping
        Name to a value per error and the bounds of its ranges.

    Returns
    -------
    dict
        Keys ``mean p95 p99 max``, and each axis' name with the means by
        range; empty ranges are left out.
    """
    result: dict[str, Any] = {
        "mean": rounded(np.mean(errors)),
        "p95": rounded(np.percentile(errors, 95)),
        "p99": rounded(np.percentile(errors, 99)),
        "max": rounded(np.max(errors)),
    }
    for name, (values, bounds) in axes.items():
        bins = {}
        for low, high in itertools.pairwise(bounds):
            inside = (values >= low) & (values <= high)
            if np.any(inside):
                bins[f"{low:g}-{high:g}"] = rounded(np.mean(errors[inside]))
        result[name] = bins
    return result


def rounded(value: np.floating[Any]) -> float:
    """Return a number with the four digits that a file of figures needs."""
    return float(f"{value:.4g}")


class Lobe:
    """I + X at given views, its inverse, and the lobe's share above the horizon.

    Parameters
    ----------
    guess : (n, 3, 3) float64
        M0.
    basis : (n, p, 3, 3) float64
        X is the sum of entries times these.
    entries : (n, p) float64
    """

    def __init__(self, guess: FloatArray, basis: FloatArray, entries: FloatArray) -> None:
        self.residual = np.einsum("np,npij->nij", entries, basis) + np.eye(3)
        self.inverse = transform.invert(self.residual)
        self.basis = basis
        self.bottom = guess[:, 2]  # last row of M0
        self.row = np.einsum("ni,nij->nj", self.bottom, self.residual)
        self.length = np.sqrt(np.sum(self.row * self.row, axis=-1))
        self.above = 0.5 + 0.5 * self.row[:, 2] / self.length

    def above_gradient(self) -> FloatArray:
        """Return d(above)/d(entries), (n, p)."""
        d_row = np.einsum("ni,npij->npj", self.bottom, self.basis)
        direction = self.row / self.length[:, None]
        d_length = np.einsum("npj,nj->np", d_row, direction)
        return np.asarray(
            0.5 * (d_row[..., 2] - direction[:, 2:] * d_length) / self.length[:, None]
        )

    def motion(self, r: FloatArray) -> FloatArray:
        """Return how r = (I + X)^-1 r0, (n, k, 3), moves with each entry, (n, k, 3, p)."""
        velocity = self.inverse[:, None] @ self.basis
        return np.asarray(-np.moveaxis(r[:, None] @ np.swapaxes(velocity, -1, -2), 1, -1))

    def shrinking(self) -> FloatArray:
        """Return the derivative of log det (I + X)^-1, (n, p)."""
        return np.asarray(-np.einsum("nij,npji->np", self.inverse, self.basis))


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


class Term(Protocol):
    """A part of the loss, a sum over cases."""

    count: int

    def normal_equations(
        self, entries: FloatArray, part: slice
    ) -> tuple[float, FloatArray, FloatArray]:
        """Return the loss and, per case, curvature (n, p, p) and slope (n, p)."""


class ShadingError:
    """The technique's error on lights, as rendered, by the residual's entries.

    Parameters
    ----------
    configurations, exact
        The cases and their `exact_integrals`.
    albedo : (n,) float64
        A as the table gives it.
    basis : (n, p, 3, 3) float64
        The entries' basis matrices, see `Lobe`.
    """

    def __init__(
        self,
        configurations: Configurations,
        exact: FloatArray,
        albedo: FloatArray,
        basis: FloatArray,
    ) -> None:
        self.exact, self.albedo, self.basis = exact, albedo, basis
        self.count = exact.size
        self.guess = closed_form_guess(
            configurations.alpha_x, configurations.alpha_y, configurations.wo
        )
        lit = clip_to_horizon(configurations.corners)
        self.corners = transform.apply(transform.invert(self.guess)[:, None], lit)

    def evaluate(self, entries: FloatArray, part: slice) -> tuple[FloatArray, FloatArray]:
        """Return errors (n,) and derivatives (n, p) of the cases in ``part``."""
        lobe = Lobe(self.guess[part], self.basis[part], entries)
        r = clip_to_horizon(transform.apply(lobe.inverse[:, None], self.corners[part]))
        E, dE = form_factor_gradient(r, lobe.motion(r))
        weight = self.albedo[part] / lobe.above
        slope = dE - (E / lobe.above)[:, None] * lobe.above_gradient()
        return weight * E - self.exact[part], weight[:, None] * slope

    def normal_equations(
        self, entries: FloatArray, part: slice
    ) -> tuple[float, FloatArray, FloatArray]:
        """Return the loss and, per case, curvature (n, p, p) and slope (n, p), reweighted."""
        error, slope = self.evaluate(entries, part)
        root = np.sqrt(error * error + _EPSILON * _EPSILON)
        loss = float(np.sum(root - _EPSILON + _TAIL * error * error)) / self.count
        weight = (1.0 / root + 2.0 * _TAIL) / self.count
        curvature = weight[:, None, None] * slope[:, :, None] * slope[:, None, :]
        return loss, curvature, (weight * error)[:, None] * slope


class LobeVariation:
    """Total variation between GGX and the lobe, both normalised above the horizon.

    A Monte Carlo estimate with fixed directions, half of them from the guess's lobe and
    half from GGX's visible normals.

    Parameters
    ----------
    rng : numpy.random.Generator
        Source of the directions.
    alpha_x, alpha_y : (n,) float64
    wo : (n, 3) float64
        Materials and views.
    directions : int
        For each view.
    basis : (n, p, 3, 3) float64
        The entries' basis matrices, see `Lobe`.
    importance : float
        Of the mean total variation beside the other terms of the loss.
    """

    def __init__(
        self,
        rng: np.random.Generator,
        alpha_x: FloatArray,
        alpha_y: FloatArray,
        wo: FloatArray,
        directions: int,
        basis: FloatArray,
        importance: float = 1.0,
    ) -> None:
        self.basis, self.importance = basis, importance
        self.count = alpha_x.size
        self.guess = closed_form_guess(alpha_x, alpha_y, wo)
        inverse = transform.invert(self.guess)
        shape = (self.count, directions // 2)
        z2, phi = rng.random(shape), 2.0 * np.pi * rng.random(shape)
        r = np.sqrt(1.0 - z2)
        cosine = np.stack([r * np.cos(phi), r * np.sin(phi), np.sqrt(z2)], axis=-1)
        from_guess = normalise(transform.apply(self.guess[:, None], cosine))
        wo, ax, ay = wo[:, None], alpha_x[:, None], alpha_y[:, None]
        h = brdf.sample_visible_normals(wo, rng.random((*shape, 2)), ax, ay)
        wi = np.concatenate([from_guess, brdf.reflect(wo, h)], axis=1)
        self.directions = transform.apply(inverse[:, None], wi)
        self.scale = 1.0 / np.linalg.det(self.guess)
        length2 = np.sum(self.directions**2, axis=-1)
        from_guess_pdf = (
            np.maximum(self.directions[..., 2], 0.0) / length2**2 * self.scale[:, None] / np.pi
        )
        density = 0.5 * (from_guess_pdf + brdf.pdf(wo, wi, ax, ay))
        known = (wi[..., 2] > 0.0) & (density > 0.0)
        # GGX above the horizon is normalised by the albedo, estimated by the same samples.
        ggx = brdf.evaluate(wo, wi, ax, ay)
        self.weight = np.where(known, 0.5 / np.where(known, density, 1.0), 0.0) / wi.shape[1]
        total = 2.0 * np.sum(ggx * self.weight, axis=1, keepdims=True)
        self.ggx = ggx / total

    def differences(self, entries: FloatArray, part: slice) -> tuple[FloatArray, FloatArray]:
        """Return weighted differences (n, k) and their derivatives (n, k, p).

        The sum over k of the former's absolute values is the total variation.
        """
        lobe = Lobe(self.guess[part], self.basis[part], entries)
        r = transform.apply(lobe.inverse[:, None], self.directions[part])
        dr = lobe.motion(r)
        length2 = np.sum(r * r, axis=-1)
        scale = self.scale[part] * np.linalg.det(lobe.inverse) / (np.pi * lobe.above)
        lit = r[..., 2] > 0.0
        q = scale[:, None] * np.where(lit, r[..., 2], 0.0) / length2**2
        shrink = lobe.shrinking() - lobe.above_gradient() / lobe.above[:, None]
        dlength = np.sum(r[..., None] * dr, axis=2) / length2[..., None]
        dq = q[..., None] * (shrink[:, None] - 4.0 * dlength)
        dq += (scale[:, None] / length2**2 * lit)[..., None] * dr[..., 2, :]
        weight = self.weight[part]
        return (q - self.ggx[part]) * weight, dq * weight[..., None]

    def normal_equations(
        self, entries: FloatArray, part: slice
    ) -> tuple[float, FloatArray, FloatArray]:
        """Return the loss and, per view, curvature (n, p, p) and slope (n, p), reweighted."""
        error, slope = self.differences(entries, part)
        floor = _RELATIVE_FLOOR * 0.5 / error.shape[1]
        softened = np.sqrt(error * error + floor * floor)
        loss = self.importance * float(np.sum(softened - floor)) / self.count
        w = self.importance / self.count / softened
        weighted = np.swapaxes(slope, 1, 2) * w[:, None, :]
        return loss, weighted @ slope, np.einsum("nk,nki->ni", w * error, slope)


@dataclass(frozen=True, eq=False)
class FitState:
    """Where a fit stands: the residual's nodes, damping, steps, loss."""

    residual: FloatArray
    damping: float = _DAMPING
    steps: int = 0
    loss: float = np.inf
    done: bool = False


class Equations(Protocol):
    """The loss at a point, its slope and its curvature, as far as a step needs them."""

    loss: float

    def step(self, damping: float) -> FloatArray:
        """Return Levenberg-Marquardt's step of the unknowns, to be added."""


def descend(
    state: FitState,
    unknowns: FloatArray,
    equations: Callable[[FloatArray], Equations],
    nodes: Callable[[FloatArray], FloatArray],
    most: int,
) -> Iterator[FitState]:
    """Yield ever better states until nothing is gained, ``most`` steps at the utmost.

    Each step solves Levenberg-Marquardt's equations for all nodes at once, with weights
    that turn squares into absolute values (iteratively reweighted least
    squares). A state fully determines the next; ``unknowns`` are the state's own
    and ``nodes`` returns the residual that belongs to them.
    """
    z, here = unknowns, equations(unknowns)
    damping, steps = state.damping, state.steps
    while not state.done:
        while True:
            change = here.step(damping)
            there = equations(z + change)
            if there.loss < here.loss or damping > _DAMPING_MAX:
                break
            damping *= 5.0
        gain = 0.0
        if there.loss < here.loss:
            gain = (here.loss - there.loss) / here.loss
            z, here = z + change, there
            damping = max(damping / 5.0, _DAMPING_MIN)
        steps += 1
        done = gain < _STEP_GAIN or steps >= most
        state = FitState(nodes(z), damping, steps, here.loss, done)
        yield state
