"""One lobe fitted to one view of one material: what a table would hold if it had a node there.

The tables' fits (`ltc.fit`, `ltc.anisotropic_fit`) minimise the error over all views at once,
through the interpolation. Here the same two errors, of random lights and of the lobe's shape, are
minimised for each view alone, so that what remains is what no linearly transformed cosine of
this form can do better; what a table errs beyond that is its own doing. The lights are
the same for every view, turned towards its lobe, and the result depends on nothing else.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ltc import brdf
from ltc.anisotropic import entry_basis
from ltc.objective import (
    Configurations,
    LobeVariation,
    ShadingError,
    exact_integrals,
    random_lights,
)
from ltc.table import ALPHA_MIN, closed_form_guess

FloatArray = NDArray[np.float64]

LIGHTS = 96
"""Random lights that a lobe is fitted to; with 400 the error on others is the same to 2 %."""
LEAST_COSINE = 1e-3
"""Views further down are fitted as if they were there, 89.94 degrees from the normal."""

_SEED = 20
_VARIATION = 0.03  # weight of the total variation, as in `ltc.fit`
_DIRECTIONS = 64
_EPSILON, _TAIL = 1e-3, 50.0  # as in `ltc.objective`
_RELATIVE_FLOOR = 0.05
_STEPS = 25
_GAIN = 1e-4  # stop when no view gains a larger share
_LEAST_DETERMINANT = 1e-3


class PointLobes(NamedTuple):
    """Lobes of n views: M (n, 3, 3), third column unit; exact albedo A and its Fresnel part B."""

    matrix: FloatArray
    albedo: FloatArray
    fresnel: FloatArray


def fit_points(
    alpha_x: ArrayLike,
    alpha_y: ArrayLike,
    wo: ArrayLike,
    progress: Callable[[int], None] = lambda done: None,
    lights: int = LIGHTS,
) -> PointLobes:
    """Return the transform that suits each view best, and the exact albedo there.

    Parameters
    ----------
    alpha_x, alpha_y : (n,) float
        GGX parameters, clamped to [`ltc.table.ALPHA_MIN`, 1].
    wo : (n, 3) float
        Unit directions to the viewer, x along the tangent; z at least `LEAST_COSINE` or raised.
    progress : callable
        Gets the number of views done.
    lights : int, >= 8
        Random lights that each is fitted to.

    Returns
    -------
    PointLobes

    Raises
    ------
    ValueError
        If shapes do not fit or there are fewer lights.

    Notes
    -----
    Levenberg-Marquardt on the loss of `ltc.objective`; 0.1 to 0.2 s a view, most of which the
    exact integrals take.
    """
    ax, ay = (np.clip(np.asarray(a, dtype=np.float64), ALPHA_MIN, 1.0) for a in (alpha_x, alpha_y))
    v = np.array(wo, dtype=np.float64)
    if ax.ndim != 1 or ax.shape != ay.shape or v.shape != (ax.size, 3):
        raise ValueError(
            f"shapes are {ax.shape}, {ay.shape} and {v.shape}, expected (n,), (n,) and (n, 3)"
        )
    if lights < 8:
        raise ValueError(f"lights is {lights}, expected 8 or more")
    v[:, 2] = np.maximum(v[:, 2], LEAST_COSINE)
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    matrices = np.zeros((ax.size, 3, 3))
    A, B = np.zeros((2, ax.size))
    for i in range(ax.size):
        one = slice(i, i + 1)
        a, b = brdf.directional_albedo(v[one], ax[one], ay[one])
        A[i], B[i] = min(float(a[0]), 1.0), float(b[0])
        matrices[i] = _fit_one(ax[i], ay[i], v[i], A[i], lights)
        progress(i + 1)
    return PointLobes(matrices, A, B)


class _View:
    """The loss of one view by its seven entries."""

    def __init__(self, ax: float, ay: float, v: FloatArray, albedo: float, lights: int) -> None:
        many = (np.full(lights, ax), np.full(lights, ay), np.tile(v, (lights, 1)))
        cases: Configurations = random_lights(np.random.default_rng([_SEED, 0]), *many)
        self.basis = entry_basis(ax, ay, v)
        basis = np.broadcast_to(self.basis, (lights, *self.basis.shape))
        self.shading = ShadingError(
            cases, exact_integrals(cases), np.full(lights, albedo), np.array(basis)
        )
        self.lobe = LobeVariation(
            np.random.default_rng([_SEED, 1]), many[0][:1], many[1][:1], many[2][:1],
            _DIRECTIONS, self.basis[None], _VARIATION,
        )  # fmt: skip
        self.lights = lights

    def loss(self, entries: FloatArray) -> tuple[float, FloatArray, FloatArray]:
        """Return the loss, its curvature (7, 7) and its slope (7,); infinite where it folds."""
        X = np.einsum("p,pij->ij", entries, self.basis) + np.eye(3)
        if np.linalg.det(X) < _LEAST_DETERMINANT:
            return np.inf, np.eye(entries.size), np.zeros(entries.size)
        all_lights = np.broadcast_to(entries, (self.lights, entries.size))
        value, H, g = self.shading.normal_equations(all_lights, slice(None))
        more, H2, g2 = self.lobe.normal_equations(entries[None], slice(None))
        return value + more, H.sum(axis=0) + H2.sum(axis=0), g.sum(axis=0) + g2.sum(axis=0)


def _fit_one(ax: float, ay: float, v: FloatArray, albedo: float, lights: int) -> FloatArray:
    view = _View(ax, ay, v, albedo, lights)
    z = np.zeros(view.basis.shape[0])
    loss, H, g = view.loss(z)
    damping = 1e-2
    for _ in range(_STEPS):
        # Entries that nothing depends on, an azimuth's in the plane of incidence say, stay.
        scale = np.diag(H) + 1e-3 * np.mean(np.diag(H))
        step = -np.linalg.solve(H + damping * np.diag(scale), g)
        there = view.loss(z + step)
        if not there[0] < loss:
            damping *= 5.0
            if damping > 1e6:
                break
            continue
        gain = (loss - there[0]) / loss
        z, (loss, H, g) = z + step, there
        damping = max(damping / 5.0, 1e-6)
        if gain < _GAIN:
            break
    X = np.einsum("p,pij->ij", z, view.basis)
    M = closed_form_guess(ax, ay, v) @ (np.eye(3) + X)
    return np.asarray(M / np.linalg.norm(M[:, 2]))
