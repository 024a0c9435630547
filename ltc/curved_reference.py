"""Ground truth for curved lights: GGX integrated along cubic Béziers, two independent ways.

What `ltc.reference` is for polygons: `curve_specular_integral` and, for many lights,
`curve_specular_integral_batch` follow the outline in the space of half vectors
(`ltc.ggx_boundary`), `curve_specular_monte_carlo` samples visible normals. Nothing is flattened.
Lights have radiance 1; contours count positive counter-clockwise about +z.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from ltc import bezier
from ltc.curved_outline import clip_to_horizon, plane_normal
from ltc.ggx_boundary import Specular, Views, dot, integrate_many, integrate_one
from ltc.reference import monte_carlo, plane_hits

FloatArray: TypeAlias = npt.NDArray[np.float64]
IntArray: TypeAlias = npt.NDArray[np.intp]
BoolArray: TypeAlias = npt.NDArray[np.bool_]


def curve_specular_integral(
    contours: Sequence[npt.ArrayLike],
    wo: npt.ArrayLike,
    alpha_x: float,
    alpha_y: float,
    tolerance: float = 1e-9,
) -> Specular:
    """Return GGX integrated over one light with a curved outline, with an error estimate.

    Parameters
    ----------
    contours : sequence of (k, 4, 3) float64
        Closed contours of cubic Béziers in the tangent frame, in one plane, anywhere about the
        horizon; each curve ends where the next begins, holes are wound against the
        outer contours.
    wo, alpha_x, alpha_y, tolerance
        As for `ltc.reference.specular_integral`.

    Returns
    -------
    Specular
        As `ltc.reference.specular_integral`, along the curves themselves: nothing is flattened.

    Raises
    ------
    ValueError
        If shapes do not fit, a contour has gaps or an alpha is not positive.
    """
    view = Views.one(wo, alpha_x, alpha_y)
    return integrate_one(_Cubics.of(contours, view), view, tolerance)


def curve_specular_integral_batch(
    contours: Sequence[npt.ArrayLike],
    wo: npt.ArrayLike,
    alpha_x: npt.ArrayLike,
    alpha_y: npt.ArrayLike,
    nodes: int = 8,
    tolerance: float = 1e-6,
    chunk: int = 64,
) -> tuple[FloatArray, FloatArray]:
    """Return GGX integrated over many lights of radiance 1 with curved outlines.

    Parameters
    ----------
    contours : sequence of (..., k, 4, 3) float64
        As for `curve_specular_integral`, counter-clockwise about +z for positive.
    wo, alpha_x, alpha_y, nodes, tolerance, chunk
        As for `ltc.reference.specular_integral_batch`; all leading axes broadcast.

    Returns
    -------
    one, fresnel : (...) float64
        As `ltc.reference.specular_integral_batch`.

    Raises
    ------
    ValueError
        If shapes do not fit, a contour has gaps or an alpha is not positive.
    """
    _, lead = bezier.broadcast_contours(contours)
    views, shape = Views.broadcast(lead, wo, alpha_x, alpha_y)
    chains, _ = bezier.broadcast_contours(contours, shape)

    def pieces(some: slice, seen: Views) -> _Cubics:
        return _Cubics.of([chain[some] for chain in chains], seen)

    one, fresnel = integrate_many(pieces, views, nodes, tolerance, chunk)
    return one.reshape(shape), fresnel.reshape(shape)


def curve_winding_number(contours: Sequence[npt.ArrayLike], w: npt.ArrayLike) -> FloatArray:
    """Return how often a planar light's curved contours run around directions.

    Parameters
    ----------
    contours : sequence of (k, 4, 3) float64
        Closed contours of cubic Béziers in one plane.
    w : (n, 3) float64
        Directions from the origin.

    Returns
    -------
    (n) float64
        As `ltc.reference.winding_number`.
    """
    w = np.asarray(w, dtype=np.float64)
    count = np.zeros(w.shape[0])
    curves = np.concatenate([np.zeros((0, 4, 3)), *(np.asarray(c) for c in contours)])
    n = plane_normal(curves.reshape(-1, 3))
    if curves.size == 0 or not np.any(n):
        return count
    height = float(curves[0, 0] @ n)
    hits, points, axes = plane_hits(n, height, w)
    plane_curves = curves @ axes
    found = np.zeros(points.shape[0])
    for start in range(0, found.size, 4096):
        part = slice(start, start + 4096)
        about = plane_curves - points[part, None, None]
        crossings = bezier.half_line_crossings(about[..., 0], about[..., 1])
        found[part] = np.sum(crossings, axis=-1)
    count[hits] = found * np.sign(height)
    return count


def curve_specular_monte_carlo(
    contours: Sequence[npt.ArrayLike],
    wo: npt.ArrayLike,
    alpha_x: float,
    alpha_y: float,
    samples: int,
    rng: np.random.Generator,
) -> Specular:
    """Return a Monte Carlo estimate of `curve_specular_integral`, as `specular_monte_carlo`."""
    return monte_carlo(
        lambda w: curve_winding_number(contours, w), wo, alpha_x, alpha_y, samples, rng
    )


class _Cubics(NamedTuple):
    """A `ltc.ggx_boundary.Boundary` of cubic Béziers r(s): o = r/|r|, 0 <= s <= 1."""

    which: IntArray
    curves: FloatArray

    @classmethod
    def of(cls, contours: Sequence[npt.ArrayLike], views: Views) -> _Cubics:
        """Return what is above the horizon of contours (n, k, 4, 3), seen from above."""
        curves, which, _ = clip_to_horizon(contours)
        keep = np.any(np.diff(curves, axis=-2), axis=(-2, -1)) & (views.wo[which, 2] > 0.0)
        return cls(which[keep], curves[keep])

    @property
    def end(self) -> FloatArray:
        return np.ones(self.curves.shape[0])

    def at(self, e: IntArray, s: FloatArray) -> tuple[FloatArray, FloatArray]:
        r, dr = bezier.evaluate(self.curves[e], s), bezier.derivative(self.curves[e], s)
        distance = self._distance(r)
        o = r / distance
        return o, (dr - o * dot(o, dr)[:, None]) / distance

    def ready(self, e: IntArray, m: FloatArray, half: FloatArray) -> tuple[BoolArray, FloatArray]:
        curves = self.curves[e]
        r, dr = bezier.evaluate(curves, m), bezier.derivative(curves, m)
        distance = self._distance(r)
        o, do = self.at(e, m)
        bend = np.diff(curves, n=2, axis=-2)
        ddr = 6.0 * ((1.0 - m)[:, None] * bend[:, 0] + m[:, None] * bend[:, 1])
        # r = |r| o, differentiated twice.
        ddo = ddr - o * (dot(do, dr) + dot(o, ddr))[:, None] - 2.0 * do * dot(o, dr)[:, None]
        offset = bezier.part(curves, m - half, m + half) - r[:, None]
        reach = np.sqrt(np.max(dot(offset, offset), axis=-1))
        return reach <= 0.5 * distance[:, 0], ddo / distance

    def chords(self) -> tuple[IntArray, FloatArray, FloatArray]:
        r = bezier.evaluate(self.curves[:, None], np.arange(5) / 4.0)
        o = r / self._distance(r)
        piece = np.repeat(np.arange(self.curves.shape[0]), 4)
        return piece, o[:, :-1].reshape(-1, 3), o[:, 1:].reshape(-1, 3)

    @staticmethod
    def _distance(r: FloatArray) -> FloatArray:
        # A point on the outline has no integral, but must not stop the others.
        return np.asarray(np.sqrt(np.maximum(dot(r, r), 1e-200))[..., None])
