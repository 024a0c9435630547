"""Linearly transformed spherical distributions (Heitz et al. 2016, section 3).

A direction of an original distribution, multiplied by a matrix and normalised,
follows a new distribution that keeps the original's norm, its sampling and
its integrals over polygons. The matrix M of the paper is
``shading_from_cosine`` here, for all four originals of its supplement.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

FloatArray: TypeAlias = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Original:
    """A distribution that is symmetric about +z, before the transform.

    ``density`` maps the cosine z to the density [1/sr]; ``cosine`` maps a uniform
    number in [0, 1) to the cosine of a sample.
    """

    name: str
    density: Callable[[FloatArray], FloatArray]
    cosine: Callable[[FloatArray], FloatArray]


def _uniform_sphere(z: FloatArray) -> FloatArray:
    return np.full(z.shape, 1.0 / (4.0 * np.pi))


def _uniform_hemisphere(z: FloatArray) -> FloatArray:
    return np.where(z >= 0.0, 1.0 / (2.0 * np.pi), 0.0)


def _clamped_cosine(z: FloatArray) -> FloatArray:
    return np.maximum(z, 0.0) / np.pi


def _squared_clamped_cosine(z: FloatArray) -> FloatArray:
    return np.maximum(z, 0.0) ** 2 * (3.0 / (2.0 * np.pi))


UNIFORM_SPHERE = Original("uniform sphere", _uniform_sphere, lambda u: 2.0 * u - 1.0)
UNIFORM_HEMISPHERE = Original("uniform hemisphere", _uniform_hemisphere, lambda u: u)
CLAMPED_COSINE = Original("clamped cosine", _clamped_cosine, np.sqrt)
SQUARED_CLAMPED_COSINE = Original("squared clamped cosine", _squared_clamped_cosine, np.cbrt)

ORIGINALS = (UNIFORM_SPHERE, UNIFORM_HEMISPHERE, CLAMPED_COSINE, SQUARED_CLAMPED_COSINE)
"""The supplement's original distributions, sections 1.1 to 1.4."""


def _matrix(name: str, m: npt.ArrayLike) -> FloatArray:
    m = np.asarray(m, dtype=np.float64)
    if m.ndim < 2 or m.shape[-2:] != (3, 3):
        raise ValueError(f"{name} has shape {m.shape}, expected (..., 3, 3)")
    return m


def invert(shading_from_cosine: npt.ArrayLike) -> FloatArray:
    """Return cosine_from_shading, the paper's M^-1.

    Parameters
    ----------
    shading_from_cosine : (..., 3, 3) float64
        Any regular matrices.

    Returns
    -------
    (..., 3, 3) float64
        The inverses: cross products of the columns over the determinant, so
        that rows which are zero but for one entry stay exactly so.

    Raises
    ------
    ValueError
        If the shape is not (..., 3, 3) or a determinant is zero.
    """
    m = _matrix("shading_from_cosine", shading_from_cosine)
    a, b, c = m[..., :, 0], m[..., :, 1], m[..., :, 2]
    rows = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=-2)
    det = np.sum(a * rows[..., 0, :], axis=-1)
    if np.any(det == 0.0):
        raise ValueError("shading_from_cosine is singular, expected a regular matrix")
    return np.asarray(rows / det[..., None, None])


def apply(matrix: npt.ArrayLike, w: npt.ArrayLike) -> FloatArray:
    """Return ``matrix @ w`` for directions or points, not normalised.

    Parameters
    ----------
    matrix : (..., 3, 3) float64
    w : (..., 3) float64
        Leading axes broadcast against the matrices'.

    Returns
    -------
    (..., 3) float64

    Raises
    ------
    ValueError
        For other shapes.
    """
    matrix, w = _matrix("matrix", matrix), np.asarray(w, dtype=np.float64)
    if w.ndim < 1 or w.shape[-1] != 3:
        raise ValueError(f"w has shape {w.shape}, expected (..., 3)")
    return np.asarray(np.einsum("...ij,...j->...i", matrix, w))


def evaluate(
    w: npt.ArrayLike, shading_from_cosine: npt.ArrayLike, original: Original = CLAMPED_COSINE
) -> FloatArray:
    """Return the density D(w) [1/sr] of a linearly transformed distribution.

    Parameters
    ----------
    w : (..., 3) float64
        Unit directions in the shading frame.
    shading_from_cosine : (..., 3, 3) float64
        Regular matrices; their scale is irrelevant.
    original : Original
        One of `ORIGINALS`.

    Returns
    -------
    (...) float64
        Its integral over the sphere is 1. It is also the pdf of `sample`.

    Raises
    ------
    ValueError
        For other shapes or a singular matrix.

    Notes
    -----
    Heitz et al. 2016, eq. 1: with p = M^-1 w, D = D_o(p/|p|) |det M^-1| / |p|^3.
    """
    m = _matrix("shading_from_cosine", shading_from_cosine)
    inverse = invert(m)
    p = apply(inverse, w)
    length = np.sqrt(np.sum(p * p, axis=-1))
    jacobian = np.abs(np.linalg.det(inverse)) / length**3
    return np.asarray(original.density(p[..., 2] / length) * jacobian)


def sample(
    u: npt.ArrayLike, shading_from_cosine: npt.ArrayLike, original: Original = CLAMPED_COSINE
) -> FloatArray:
    """Return directions distributed like `evaluate`.

    Parameters
    ----------
    u : (..., 2) float64
        Uniform random numbers in [0, 1): the first gives the cosine, the
        second the azimuth of the original's sample.
    shading_from_cosine : (..., 3, 3) float64
        Regular matrices.
    original : Original
        One of `ORIGINALS`.

    Returns
    -------
    (..., 3) float64
        Unit directions in the shading frame, possibly below the surface.

    Raises
    ------
    ValueError
        For other shapes.

    Notes
    -----
    Heitz et al. 2016, supplement, algorithm 1.
    """
    u = np.asarray(u, dtype=np.float64)
    if u.ndim < 1 or u.shape[-1] != 2:
        raise ValueError(f"u has shape {u.shape}, expected (..., 2)")
    z = original.cosine(u[..., 0])
    r = np.sqrt(np.clip(1.0 - z * z, 0.0, 1.0))
    phi = 2.0 * np.pi * u[..., 1]
    w = apply(shading_from_cosine, np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1))
    return np.asarray(w / np.sqrt(np.sum(w * w, axis=-1, keepdims=True)))


def leak(shading_from_cosine: npt.ArrayLike) -> FloatArray:
    """Return the share of a transformed clamped cosine below the surface.

    Parameters
    ----------
    shading_from_cosine : (..., 3, 3) float64
        Regular matrices.

    Returns
    -------
    (...) float64
        In [0, 1]: (1 - m22/|row 2|)/2 with rows and columns counted from 0.

    Raises
    ------
    ValueError
        If the shape is not (..., 3, 3).

    Notes
    -----
    z of M w is row 2 . w, so the surface is, before the transform, the plane with
    normal n = row 2. A clamped cosine projects the hemisphere onto the unit
    disc; the part with n.w < 0 is half a disc less half an ellipse with the
    semi-axis n_z/|n|, so its share is (1 - n_z/|n|)/2, and with the opposite sign
    of n_z half a disc plus it.
    """
    row = _matrix("shading_from_cosine", shading_from_cosine)[..., 2, :]
    return np.asarray(0.5 * (1.0 - row[..., 2] / np.sqrt(np.sum(row * row, axis=-1))))
