"""Formulas instead of tables: X of ``M = M0 (I + X)`` as polynomials, fitted as tables are."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from ltc import objective
from ltc.anisotropic import (
    AXES,
    CHANNELS,
    eliminated,
    entry_basis,
    halfway_points,
    node_views,
    table_coordinates,
)
from ltc.objective import Configurations, FitState, LobeVariation, ShadingError
from ltc.table import closed_form_guess

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Formula:
    """X as polynomials: coefficients (terms, 7) of products of Legendre polynomials."""

    degree: int
    coefficients: FloatArray

    def matrix(self, c: Configurations) -> FloatArray:
        """Return M, (n, 3, 3)."""
        t = table_coordinates(c.alpha_x, c.alpha_y, c.wo)
        X = np.einsum(
            "np,npij->nij",
            monomials(t, self.degree) @ self.coefficients,
            entry_basis(c.alpha_x, c.alpha_y, c.wo),
        )
        return closed_form_guess(c.alpha_x, c.alpha_y, c.wo) @ (np.eye(3) + X)


def monomials(t: FloatArray, degree: int) -> FloatArray:
    """Return products of Legendre polynomials over [0, 1], (n, terms), of total degree."""
    single = legendre.legvander(2.0 * t - 1.0, degree)  # (n, 4, degree + 1)
    powers = [p for p in itertools.product(range(degree + 1), repeat=len(AXES)) if sum(p) <= degree]
    columns = [np.prod([single[:, i, n] for i, n in enumerate(p)], axis=0) for p in powers]
    return np.stack(columns, axis=-1)


class _Dense:
    """Normal equations at one point."""

    def __init__(self, loss: float, curvature: FloatArray, slope: FloatArray) -> None:
        self.loss, self._H, self._g = loss, curvature, slope

    def step(self, damping: float) -> FloatArray:
        diagonal = np.diag(self._H)
        extra = damping * (diagonal + 0.1 * np.mean(diagonal))
        return -cho_solve(cho_factor(self._H + np.diag(extra)), self._g)


def fit_formula(
    degree: int, shading: ShadingError, cases: Configurations, lobes: LobeVariation,
    lobe_views: tuple[FloatArray, ...],
) -> Formula:  # fmt: skip
    """Return the polynomials of this degree that a table's own loss likes best."""
    terms = (
        (shading, monomials(table_coordinates(cases.alpha_x, cases.alpha_y, cases.wo), degree)),
        (lobes, monomials(table_coordinates(*lobe_views), degree)),
    )
    shape = (5, 5, 7, 7)
    guard = monomials(halfway_points(shape).reshape(-1, 4), degree)
    views = node_views([2 * n - 1 for n in shape])
    guard_basis = entry_basis(*views).reshape(-1, CHANNELS, 3, 3)
    size = guard.shape[1]

    def equations(z: FloatArray) -> objective.Equations:
        p = z.reshape(size, CHANNELS)
        if np.min(eliminated(np.einsum("np,npij->nij", guard @ p, guard_basis))) <= 0.0:
            return _Dense(np.inf, np.eye(z.size), z)
        loss, g = 0.0, np.zeros((size, CHANNELS))
        H = 1e-9 * np.eye(z.size).reshape(size, CHANNELS, size, CHANNELS)
        for term, phi in terms:
            for first in range(0, term.count, objective.CHUNK):
                part = slice(first, first + objective.CHUNK)
                value, square, slope = term.normal_equations(phi[part] @ p, part)
                loss += value
                g += phi[part].T @ slope
                for i, j in itertools.combinations_with_replacement(range(CHANNELS), 2):
                    block = phi[part].T @ (phi[part] * square[:, i, j, None])
                    H[:, i, :, j] += block
                    if i != j:
                        H[:, j, :, i] += block
        return _Dense(loss, H.reshape(z.size, z.size), g.ravel())

    start = FitState(np.zeros((size, CHANNELS)))
    states: Iterator[FitState] = objective.descend(
        start, np.zeros(size * CHANNELS), equations, lambda z: z.reshape(size, CHANNELS), 30
    )
    for last in states:
        print(f"formula of degree {degree}: step {last.steps}, loss {last.loss:.5f}", flush=True)
    return Formula(degree, last.residual)
