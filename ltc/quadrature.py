"""Quadrature rules that several integrals share, and panels that halve until they are fit."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.intp]
BoolArray: TypeAlias = NDArray[np.bool_]


@lru_cache(maxsize=16)
def gauss_legendre(n: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the nodes and weights, each (n,) float64, of Gauss-Legendre on [0, 1]."""
    x, w = np.polynomial.legendre.leggauss(n)
    return 0.5 * (x + 1.0), 0.5 * w


@lru_cache(maxsize=16)
def legendre_matrix(nodes: int) -> FloatArray:
    """Return the matrix that takes values at Gauss nodes to Legendre coefficients."""
    x, w = np.polynomial.legendre.leggauss(nodes)
    degrees = np.arange(nodes)
    return np.polynomial.legendre.legvander(x, nodes - 1) * w[:, None] * (degrees + 0.5)


def tail(values: FloatArray, legendre: FloatArray) -> FloatArray:
    """Return an estimate of Gauss quadrature's error on panels of length 1, (m).

    Coefficients c_k that fall geometrically to r c_0 at k = n leave an error of r^2 c_0,
    since the rule is exact to degree 2n - 1.
    """
    coefficients = np.abs(values @ legendre)
    largest = np.max(coefficients, axis=-1)
    end = np.maximum(coefficients[:, -1], coefficients[:, -2])
    ratio = end / np.where(largest > 0.0, largest, 1.0)
    return np.asarray(ratio * np.maximum(ratio, 1e-12) * largest)


def halve(
    item: IntArray, lo: FloatArray, hi: FloatArray
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return both halves of panels [lo, hi] of items, all first halves first."""
    m = 0.5 * (lo + hi)
    return np.concatenate([item, item]), np.concatenate([lo, m]), np.concatenate([m, hi])


def panels(
    end: FloatArray, ready: Callable[[IntArray, FloatArray, FloatArray], BoolArray]
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return (item, low, high) of the panels that halving [0, end] makes ready.

    ``ready`` gets items, middles and half widths.
    """
    item = np.arange(end.size)
    lo, hi = np.zeros_like(end), end
    done: list[tuple[IntArray, FloatArray, FloatArray]] = [(item[:0], lo[:0], hi[:0])]
    while item.size:
        m, half = 0.5 * (lo + hi), 0.5 * (hi - lo)
        ok = ready(item, m, half) | (half < 1e-13)
        done.append((item[ok], lo[ok], hi[ok]))
        item, lo, hi = halve(item[~ok], lo[~ok], hi[~ok])
    return (
        np.concatenate([panel[0] for panel in done]),
        np.concatenate([panel[1] for panel in done]),
        np.concatenate([panel[2] for panel in done]),
    )
