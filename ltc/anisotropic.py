"""The anisotropic table: axes, what a node holds, symmetries, layout, load and save.

Frame
    x is the tangent, z the normal; the view may have any azimuth. Values are stored
    for alpha_x >= alpha_y and one quadrant of views and serve for all others:

    * A view mirrored in the xz or yz plane mirrors the lobe. What of X is odd in
      v_x or v_y is stored divided by it (below), so views are folded by taking
      |v_x|, |v_y| for the coordinates alone; no matrix is flipped.
    * Exchanging alphas exchanges x and y. M0 is the same formula for both orders; of
      the residual, d changes sign and the entries of x and y change places.

    Nodes where orders or azimuths meet hold one value (`AnisotropicTable` insists),
    so nothing steps at these seams.

Axes, in the order of the arrays, each over [0, 1] with nodes at ``i / (n - 1)``
    0  azimuth   |v_b| / (|v_a| + |v_b|), a the axis of the larger alpha
    1  ratio     (sqrt(alpha_b / alpha_a) - .1) / .9, at least 0: ratios below .01 use the
                 numbers of .01, with M0 and q of their own
    2  view      p / (p + r), p^2 = alpha_e (1 - c), r^2 = c (1 + alpha_e), c = v_z and
                 alpha_e = |(alpha_x v_x, alpha_y v_y)| / |(v_x, v_y)|: the
                 isotropic table's axis for the alpha along the view
    3  alpha     sqrt(alpha_a)

What a node holds
    M = M0 (I + X) with M0 = `ltc.table.closed_form_guess`, and

        X = [p + d + r v_a^2    r v_a v_b          e_a v_a]
            [r v_a v_b          p - d + r v_b^2    e_b v_b]
            [g_a v_a            g_b v_b            0      ]

    Channels p, d, r, e_a, e_b, g_a, g_b. These are smooth where v is along the normal or
    in a plane of symmetry, and at equal alphas they do not depend on the azimuth:
    the lobe there is exactly that of an isotropic table with d = 0, e_a = e_b, g_a = g_b.
    Beside them, on a grid of their own, the directional albedo A and the Fresnel cosine
    u with ``B = A (1 - q u)^5``, ``q = |(alpha_x v_x, alpha_y v_y, v_z)|``, as in
    `ltc.table`.

Interpolation and storage
    Multilinear, of half floats: what is stored is what a GPU samples. `textures`
    gives the arrays of 3D textures with linear filtering: width alpha, height view, depth
    the ratio; slabs of one azimuth are stacked along the depth, and two of them
    are mixed by hand. Within a slab k of n_ratio texels the depth coordinate is
    ``(k n_ratio + 0.5 + t (n_ratio - 1)) / (n_azimuth n_ratio)``; it stays between texel
    centres of the slab, so slabs do not mix.

How it was fitted, its errors and the alternatives: `ltc.anisotropic_fit`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ltc.resources import resource_path
from ltc.table import ALPHA_MIN, closed_form_guess, load_arrays, save_arrays

FloatArray: TypeAlias = NDArray[np.float64]
HalfArray: TypeAlias = NDArray[np.float16]
Shape: TypeAlias = tuple[int, int, int, int]

FORMAT = "ltc-anisotropic/1"
"""Value of ``format`` in the provenance of a file."""

CHANNELS = 7
"""Numbers of X at a node."""

AXES = ("azimuth", "ratio", "view", "alpha")
"""Names of the axes, in the order of the arrays."""

_ROOT_MIN = 0.1  # root of the smallest ratio of alphas that nodes tell apart
_ALPHA_LIMIT = 1e-6  # stands for alpha = 0 at nodes, as in ltc.table
_ARRAYS = ("residual", "albedo", "fresnel")


def _clamped(alpha: ArrayLike) -> FloatArray:
    return np.clip(np.asarray(alpha, dtype=np.float64), ALPHA_MIN, 1.0)


def view_direction(cos_theta: ArrayLike, phi: ArrayLike) -> FloatArray:
    """Return the unit view of this cosine, clamped to [0, 1], and azimuth [rad], (..., 3)."""
    c = np.clip(np.asarray(cos_theta, dtype=np.float64), 0.0, 1.0)
    c, azimuth = np.broadcast_arrays(c, np.asarray(phi, dtype=np.float64))
    s = np.sqrt(1.0 - c * c)
    return np.stack([s * np.cos(azimuth), s * np.sin(azimuth), c], axis=-1)


def table_coordinates(alpha_x: ArrayLike, alpha_y: ArrayLike, v: ArrayLike) -> FloatArray:
    """Return the coordinates in [0, 1], (..., 4), in the order of `AXES`.

    Parameters
    ----------
    alpha_x, alpha_y : (...) float
        GGX parameters, positive, in either order, up to 1.
    v : (..., 3) float
        Unit views, v_z >= 0, any azimuth.

    Notes
    -----
    For a view along the normal the azimuth is 0; nodes there hold one value.
    The formulas need no arctangent and lose nothing in float32.
    """
    ax, ay = np.asarray(alpha_x, dtype=np.float64), np.asarray(alpha_y, dtype=np.float64)
    v = np.asarray(v, dtype=np.float64)
    ax, ay, vx, vy, c = np.broadcast_arrays(ax, ay, np.abs(v[..., 0]), np.abs(v[..., 1]), v[..., 2])
    swap = ax < ay
    a, b = np.where(swap, ay, ax), np.where(swap, ax, ay)
    va, vb = np.where(swap, vy, vx), np.where(swap, vx, vy)
    tilted = va + vb > 0.0
    azimuth = np.divide(vb, va + vb, out=np.zeros(vb.shape), where=tilted)
    s, stretched = np.hypot(va, vb), np.hypot(a * va, b * vb)
    along = np.divide(stretched, s, out=a.copy(), where=s > 0.0)
    p, r = np.sqrt(stretched * s / (1.0 + c)), np.sqrt(c * (1.0 + along))
    ratio = np.clip((np.sqrt(b / a) - _ROOT_MIN) / (1.0 - _ROOT_MIN), 0.0, 1.0)
    return np.stack([azimuth, ratio, p / (p + r), np.sqrt(a)], axis=-1)


def node_views(shape: Sequence[int]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return (alpha_x, alpha_y, v) at the nodes of a table, (*shape) and (*shape, 3).

    alpha_x >= alpha_y and v_x, v_y >= 0. Alphas of 0 are answered with 1e-6: what the table
    holds differs from the limit by about as much.
    """
    nodes = [np.linspace(0.0, 1.0, n) for n in shape]
    azimuth, ratio, view, x = np.meshgrid(*nodes, indexing="ij")
    a = np.maximum(x * x, _ALPHA_LIMIT)
    b = np.maximum(np.square(_ROOT_MIN + (1.0 - _ROOT_MIN) * ratio) * a, _ALPHA_LIMIT)
    direction = np.stack([1.0 - azimuth, azimuth], axis=-1)
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    along = np.hypot(a * direction[..., 0], b * direction[..., 1])
    p, r = view * view * (1.0 + along), along * np.square(1.0 - view)
    c = r / (p + r)
    return a, b, np.concatenate([np.sqrt(1.0 - c * c)[..., None] * direction, c[..., None]], -1)


def multilinear(t: FloatArray, shape: Sequence[int]) -> tuple[NDArray[np.intp], FloatArray]:
    """Return the nodes around points of a table and their weights.

    Parameters
    ----------
    t : (..., k) float64
        Coordinates in [0, 1].
    shape : k ints, >= 2
        Nodes on each axis.

    Returns
    -------
    index : (..., 2^k) int
        Flat indices in C order.
    weight : (..., 2^k) float64
        Non-negative, summing to 1.
    """
    index = np.zeros((*t.shape[:-1], 1), dtype=np.intp)
    weight = np.ones((*t.shape[:-1], 1))
    for axis, n in enumerate(shape):
        x = t[..., axis] * (n - 1)
        low = np.minimum(x.astype(np.intp), n - 2)
        f = x - low
        both = np.stack([low, low + 1], axis=-1)
        ends = np.stack([1.0 - f, f], axis=-1)
        size = 2 * index.shape[-1]
        index = (index[..., :, None] * n + both[..., None, :]).reshape(*t.shape[:-1], size)
        weight = (weight[..., :, None] * ends[..., None, :]).reshape(*t.shape[:-1], size)
    return index, weight


def interpolate(values: NDArray[Any], t: FloatArray) -> FloatArray:
    """Return multilinear interpolation of values (n0, n1, n2, n3, ...) at t (..., 4)."""
    index, weight = multilinear(t, values.shape[:4])
    nodes = values.reshape(-1, *values.shape[4:]).astype(np.float64)[index.reshape(-1, 16)]
    result = np.einsum("nk,nk...->n...", weight.reshape(-1, 16), nodes)
    return np.asarray(result.reshape(*t.shape[:-1], *values.shape[4:]))


def entry_basis(alpha_x: ArrayLike, alpha_y: ArrayLike, v: ArrayLike) -> FloatArray:
    """Return the matrices that a node's seven numbers multiply, (..., 7, 3, 3).

    Inputs as for `table_coordinates`. X is the sum of numbers times matrices, in the
    caller's frame, whichever alpha is larger and whatever the view's quadrant.
    """
    ax, ay = np.asarray(alpha_x, dtype=np.float64), np.asarray(alpha_y, dtype=np.float64)
    v = np.asarray(v, dtype=np.float64)
    swap, vx, vy = np.broadcast_arrays(ax < ay, v[..., 0], v[..., 1])
    basis = np.zeros((*vx.shape, CHANNELS, 3, 3))
    basis[..., 0, 0, 0] = basis[..., 0, 1, 1] = 1.0
    basis[..., 1, 0, 0] = np.where(swap, -1.0, 1.0)
    basis[..., 1, 1, 1] = -basis[..., 1, 0, 0]
    tangential = np.stack([vx, vy], axis=-1)
    basis[..., 2, :2, :2] = tangential[..., :, None] * tangential[..., None, :]
    for axis, w in enumerate((vx, vy)):
        first, second = np.where(swap == axis, w, 0.0), np.where(swap == axis, 0.0, w)
        basis[..., 3, axis, 2] = basis[..., 5, 2, axis] = first
        basis[..., 4, axis, 2] = basis[..., 6, 2, axis] = second
    return basis


def tied(values: NDArray[Any], residual: bool) -> NDArray[Any]:
    """Return node values (n0, n1, n2, n3, ...) with one value where nodes meet.

    Parameters
    ----------
    values : array
        Residual, with seven channels last, or anything that depends on the lobe's
        shape alone, such as A and u.
    residual : bool
        Which of the two.

    Notes
    -----
    The first azimuth's node is copied: at equal alphas to all azimuths, and along the
    normal too. Of the residual along the normal, only p and d are copied, since the others
    are multiplied by zero there; at equal alphas d = 0 and both axes have one value.
    """
    result = values.copy()
    result[:, -1] = result[:1, -1]
    if residual:
        result[:, -1, ..., 1] = 0
        result[:, -1, ..., 4] = result[:, -1, ..., 3]
        result[:, -1, ..., 6] = result[:, -1, ..., 5]
        result[:, :, 0, :, :2] = result[:1, :, 0, :, :2]
    else:
        result[:, :, 0] = result[:1, :, 0]
    return result


@dataclass(frozen=True, eq=False)
class AnisotropicTable:
    """Transforms, albedo and Fresnel term of GGX over both alphas and view.

    Attributes
    ----------
    residual : (n0, n1, n2, n3, 7) float16
        p, d, r, e_a, e_b, g_a, g_b of M = M0 (I + X); axes: `AXES`.
    albedo, fresnel : (m0, m1, m2, m3) float16
        A, the directional albedo for F = 1, and u with B = A (1 - q u)^5.
    provenance : mapping
        What made the table, how, and its measured error.

    Raises
    ------
    ValueError
        If a shape is wrong, a value is not finite, the albedo is outside (0, 1],
        the Fresnel cosine is negative, a determinant is not positive at a node or
        halfway between two, or the values tear at a seam (see `tied`).
    """

    residual: HalfArray
    albedo: HalfArray
    fresnel: HalfArray
    provenance: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        r, a, f = self.residual, self.albedo, self.fresnel
        if r.ndim != 5 or min(r.shape[:4]) < 2 or r.shape[4] != CHANNELS:
            raise ValueError(
                f"residual has shape {r.shape}, expected (n0, n1, n2, n3, {CHANNELS}), each n >= 2"
            )
        if a.ndim != 4 or min(a.shape) < 2:
            raise ValueError(f"albedo has shape {a.shape}, expected (m0, m1, m2, m3), each m >= 2")
        if f.shape != a.shape:
            raise ValueError(f"fresnel has shape {f.shape}, expected that of albedo {a.shape}")
        for name in _ARRAYS:
            values = getattr(self, name)
            if values.dtype != np.float16:
                raise ValueError(f"{name} is {values.dtype}, expected float16")
            bad = ~np.isfinite(values)
            if np.any(bad):
                place = tuple(int(i) for i in np.argwhere(bad)[0])
                raise ValueError(f"{name}{list(place)} is {values[place]}, expected finite numbers")
        if np.any(a <= 0.0) or np.any(a > 1.0):
            raise ValueError(
                f"albedo runs from {a.min()} to {a.max()}, expected values above 0 and up to 1"
            )
        if np.any(f < 0.0):
            raise ValueError(f"fresnel goes down to {f.min()}, expected values of 0 or more")
        for name in _ARRAYS:
            values = getattr(self, name)
            torn = values != tied(values, name == "residual")
            if np.any(torn):
                place = tuple(int(i) for i in np.argwhere(torn)[0])
                raise ValueError(
                    f"{name}{list(place)} is {values[place]}, expected the value of the nodes"
                    " that it meets at equal alphas or along the normal"
                )
        signs = halfway_signs(r)
        wrong = np.argwhere(np.any(signs <= 0.0, axis=-1))
        if wrong.size:
            halfway = [float(i) / 2.0 for i in wrong[0]]
            raise ValueError(
                "residual at node {} has determinant {:.4g} and trace {:.4g}, expected positive"
                " numbers".format(halfway, *signs[tuple(wrong[0])])
            )

    @property
    def payload(self) -> int:
        """Bytes of the textures that a GPU samples."""
        return sum(texture.nbytes for texture in self.textures())

    def matrix(
        self, alpha_x: ArrayLike, alpha_y: ArrayLike, cos_theta: ArrayLike, phi: ArrayLike
    ) -> FloatArray:
        """Return M = M0 (I + X), (..., 3, 3) float64, third column of unit length.

        Parameters
        ----------
        alpha_x, alpha_y : (...) float
            Clamped to [ALPHA_MIN, 1]; either may be the larger.
        cos_theta : (...) float
            Cosine between view and normal, clamped to [0, 1].
        phi : (...) float
            Azimuth of the view from the tangent [rad], any.

        Notes
        -----
        The frame is the tangent frame, not one turned to the view.
        """
        return self.matrix_of_view(alpha_x, alpha_y, view_direction(cos_theta, phi))

    def matrix_of_view(self, alpha_x: ArrayLike, alpha_y: ArrayLike, v: ArrayLike) -> FloatArray:
        """Return `matrix` for unit views v (..., 3) in the tangent frame, v_z >= 0."""
        ax, ay = _clamped(alpha_x), _clamped(alpha_y)
        view = np.asarray(v, dtype=np.float64)
        entries = interpolate(self.residual, table_coordinates(ax, ay, view))
        X = np.einsum("...p,...pij->...ij", entries, entry_basis(ax, ay, view))
        M = closed_form_guess(ax, ay, view) @ (np.eye(3) + X)
        return np.asarray(M / np.linalg.norm(M[..., :, 2], axis=-1)[..., None, None])

    def albedo_terms(
        self, alpha_x: ArrayLike, alpha_y: ArrayLike, cos_theta: ArrayLike, phi: ArrayLike
    ) -> tuple[FloatArray, FloatArray]:
        """Return (A, B), each (...) float64; inputs as for `matrix`.

        Schlick's directional albedo is ``f0 (A - B) + B``.
        """
        return self.albedo_terms_of_view(alpha_x, alpha_y, view_direction(cos_theta, phi))

    def albedo_terms_of_view(
        self, alpha_x: ArrayLike, alpha_y: ArrayLike, v: ArrayLike
    ) -> tuple[FloatArray, FloatArray]:
        """Return `albedo_terms` for unit views v (..., 3) in the tangent frame, v_z >= 0."""
        ax, ay = _clamped(alpha_x), _clamped(alpha_y)
        view = np.asarray(v, dtype=np.float64)
        pair = np.stack([self.albedo, self.fresnel], axis=-1)
        terms = interpolate(pair, table_coordinates(ax, ay, view))
        A, q = np.minimum(terms[..., 0], 1.0), stretched_length(ax, ay, view)
        return A, A * (1.0 - np.minimum(q * terms[..., 1], 1.0)) ** 5

    def textures(self) -> tuple[HalfArray, HalfArray, HalfArray]:
        """Return what the GPU samples, as arrays (depth, height, width, channels).

        Returns
        -------
        first, second : (n0 n1, n2, n3, 4) float16
            Channels p, d, r, e_a and e_b, g_a, g_b, 0.
        albedo : (m0 m1, m2, m3, 2) float16
            A and u.

        Notes
        -----
        The module's docstring has the texture coordinates.
        """
        n, m = self.residual.shape, self.albedo.shape
        padded = np.zeros((n[0] * n[1], n[2], n[3], 8), dtype=np.float16)
        padded[..., :CHANNELS] = self.residual.reshape(n[0] * n[1], n[2], n[3], CHANNELS)
        pair = np.stack([self.albedo, self.fresnel], axis=-1)
        return (
            np.ascontiguousarray(padded[..., :4]),
            np.ascontiguousarray(padded[..., 4:]),
            pair.reshape(m[0] * m[1], m[2], m[3], 2),
        )


def stretched_length(alpha_x: ArrayLike, alpha_y: ArrayLike, v: ArrayLike) -> FloatArray:
    """Return ``q = |(alpha_x v_x, alpha_y v_y, v_z)|``, the view's length after stretching."""
    v = np.asarray(v, dtype=np.float64)
    ax, ay = np.asarray(alpha_x, dtype=np.float64), np.asarray(alpha_y, dtype=np.float64)
    return np.asarray(np.sqrt((ax * v[..., 0]) ** 2 + (ay * v[..., 1]) ** 2 + v[..., 2] ** 2))


def halfway_points(shape: Sequence[int]) -> FloatArray:
    """Return the coordinates of all nodes and of the points halfway, (..., 4)."""
    axes = [np.linspace(0.0, 1.0, 2 * n - 1) for n in shape]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)


def halfway_signs(residual: NDArray[Any]) -> FloatArray:
    """Return determinant and trace that must be positive, (2 n0 - 1, ..., 2).

    At all nodes and halfway between: of the 2 by 2 matrix that I + X becomes when
    its last column is eliminated. Its determinant is that of I + X; with a positive
    trace no two signs have changed at once.
    """
    fine = [2 * n - 1 for n in residual.shape[:4]]
    entries = interpolate(residual, halfway_points(residual.shape[:4]))
    return eliminated(np.einsum("...p,...pij->...ij", entries, entry_basis(*node_views(fine))))


def eliminated(X: FloatArray) -> FloatArray:
    """Return determinant and trace of I + X without its last column and row, (..., 2)."""
    S = np.eye(2) + X[..., :2, :2] - X[..., :2, 2:] * X[..., 2:, :2]
    return np.stack([np.linalg.det(S), S[..., 0, 0] + S[..., 1, 1]], axis=-1)


def save_anisotropic(table: AnisotropicTable, path: str | Path) -> None:
    """Write a table to an npz file, atomically; the same table gives the same bytes.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    arrays = {name: getattr(table, name).astype("<f2") for name in _ARRAYS}
    save_arrays(path, arrays, FORMAT, table.provenance)


def load_anisotropic(path: str | Path | None = None) -> AnisotropicTable:
    """Return the anisotropic table in an npz file.

    Parameters
    ----------
    path : str or Path, optional
        By default the table shipped with the program.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If the file is damaged or something else: one sentence that names the
        file, what was found and what was expected.
    """
    file = resource_path("luts", "ltc_anisotropic.npz") if path is None else Path(path)
    arrays, provenance = load_arrays(file, _ARRAYS, np.float16, FORMAT, "an anisotropic table")
    try:
        return AnisotropicTable(arrays["residual"], arrays["albedo"], arrays["fresnel"], provenance)
    except ValueError as error:
        raise ValueError(f"{file}: {error}") from None
