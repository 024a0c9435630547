"""The isotropic table: axes, texel mapping, what a texel holds, load and save.

This is the one place that knows them; ``shaders/ltc/table.glsl`` is the GPU's
translation of `sample_textures`.

Axes
    Both run over [0, 1], nodes and texels at ``i / (size - 1)``, ends
    included. Column (second array axis): ``x = sqrt(alpha)``. Row (first array
    axis): ``y = p / (p + r)``, ``p = sqrt(alpha (1 - c))``,
    ``r = sqrt(c (1 + alpha))``, c the cosine between view and normal. y = 0 is
    normal incidence, y = 1 grazing. The lobe changes shape where c is about
    alpha, and p/r resolves that at every alpha; the square roots spread the
    nodes at both ends, where albedo and Fresnel term bend. Measured at 64^2,
    largest error of albedo, B and of M in cosine space: .0003, .0004, .002; with
    ``p^2 / (p^2 + r^2)`` instead .0027, .0051, .014.

What the file holds
    M = M0 (I + X) with M0 = `closed_form_guess` and X a small smooth residual:
    X00, X02 / s, X11, X20 / s with s the sine of the view's angle (X02 and X20
    change sign with the view). On the row of normal incidence X00 = X11,
    where the lobe is round. Beside it the directional albedo A and the
    Fresnel cosine u, from which B follows (below). All bicubic between nodes
    (not-a-knot splines), float32, 9 KB.

What the GPU samples
    The residual resampled to 16^2 and (A, u) resampled to 64^2, both then
    interpolated bilinearly (`IsotropicTable.textures`);
    ``B = A (1 - q u)^5`` with ``q = sqrt(alpha^2 s^2 + c^2)``, the view's length
    after stretching by alpha. M0 is computed per pixel: about 70 operations,
    once for all lights. Baking M itself into a 64^2 texture cannot work,
    because at low alpha the lobe follows the view while the y axis squeezes most
    views into few rows; baked relative to the mirror direction it does, at
    an error of .002 in M that computing avoids. Resampling (A, u) costs .0003
    in A and .0009 in B at most (at 32^2: .0011, .0032); resampling X
    changes M in cosine space by .003 in the mean and .02 at most (alpha 1e-4 to 1,
    theta to 89.9 degrees), the mean shading error of .0019 by 1e-5.

Shading
    A = integral of f cos(theta) with F = 1; B = the same with the weight
    (1 - wo.h)^5; so Schlick's albedo is ``f0 (A - B) + B``. The shading integral
    over a light for F = 1 is `ltc.polygon.ltc_specular`: A E / (1 - leak), E the
    form factor of M^-1 times the light clipped to the surface's z > 0.
"""

from __future__ import annotations

import io
import json
import os
import tempfile
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray
from scipy.interpolate import RectBivariateSpline, make_interp_spline

from ltc.resources import resource_path

FloatArray = NDArray[np.float64]
Textures = tuple[NDArray[np.float32], NDArray[np.float32]]

ALPHA_MIN = 1e-4
"""Smallest alpha that lookups tell apart; below, the lobe of ALPHA_MIN is used."""

FORMAT = "ltc-isotropic/1"
"""Value of ``format`` in the provenance of a file."""

RESIDUAL_SIZE, ALBEDO_SIZE = 16, 64
"""Texels on each axis of the textures that the GPU samples."""

_ALPHA_LIMIT = 1e-6  # stands for alpha = 0 in the first column: entries differ by about as much
_ARRAYS = ("residual", "albedo", "fresnel")
_TILT = 0.7  # see closed_form_guess


def closed_form_guess(alpha_x: ArrayLike, alpha_y: ArrayLike, v: ArrayLike) -> FloatArray:
    """Return a closed-form approximation M0 of the GGX lobe's transform.

    Parameters
    ----------
    alpha_x, alpha_y : (...) float, > 0
        GGX parameters along x and y.
    v : (..., 3) float
        Unit view direction in the shading frame, v_z >= 0, x along the tangent.

    Returns
    -------
    (..., 3, 3) float64
        ``shading_from_cosine``; third column of unit length, determinant > 0.

    Raises
    ------
    ValueError
        If v has no 3 components, an alpha is not positive or v_z is negative.

    Notes
    -----
    Visible normals of GGX are a clamped cosine about ``v' = normalise(D v)``,
    D = diag(alpha_x, alpha_y, 1), cut by z > 0 and mapped by D (Heitz 2018,
    "Sampling the GGX distribution of visible normals"). A cosine cut to a
    lune is again nearly a cosine, about a direction m tilted up from v', and
    narrower by half along the view at grazing incidence:
    ``m = normalise(v' + 0.7 (1 - v'_z) e_z)``, columns x and y of the shortest
    rotation R from z to m scaled by ``I - v'_xy v'_xy^T / (2 (1 + v'_z))``.

    With W = D R, the lobe's half vectors are W times cosine-distributed ones, with
    centre h = W e_z. Reflection, ``l(h) = 2 (v.h) h - |h|^2 v`` up to length,
    has at h the value T h and the derivative 2 T with
    ``T = c I + h v^T - v h^T``, c = v.h. To first order about its centre the lobe
    is therefore ``M0 = T W diag(2, 2, 1)``, here divided by the length of
    its third column.

    The determinant cannot vanish: h v^T - v h^T is a cross-product matrix of
    length |v x h|, so det T = c (c^2 + |v x h|^2) = c |h|^2; c = (D v).m is
    positive because v'.m is; det W = alpha_x alpha_y (1 + v'_z) / 2.
    M0 is smooth in v, normal incidence included, so no frame has to be aligned.
    Alone, without any residual, it errs .011 on the shading integral (mean
    over random rectangles, see `ltc.fit`; with it .0019).
    """
    ax = np.asarray(alpha_x, dtype=np.float64)
    ay = np.asarray(alpha_y, dtype=np.float64)
    view = np.asarray(v, dtype=np.float64)
    if view.ndim == 0 or view.shape[-1] != 3:
        raise ValueError(f"v must have shape (..., 3), not {view.shape}")
    if not (np.all(ax > 0.0) and np.all(ay > 0.0)):
        raise ValueError("alpha_x and alpha_y must be positive")
    if np.any(view[..., 2] < 0.0):
        raise ValueError("v must not point below the surface (v_z < 0)")
    ax, ay, vx = np.broadcast_arrays(ax, ay, view[..., 0])
    view = np.broadcast_to(view, (*vx.shape, 3))
    D = np.stack([ax, ay, np.ones_like(ax)], axis=-1)

    vp = D * view
    vp = vp / np.linalg.norm(vp, axis=-1, keepdims=True)
    m = vp.copy()
    m[..., 2] += _TILT * (1.0 - vp[..., 2])
    m /= np.linalg.norm(m, axis=-1, keepdims=True)

    # Shortest rotation from z to m: I + [k]x + [k]x^2 / (1 + m_z), k = z x m.
    W = np.zeros((*vx.shape, 3, 3))
    f = 1.0 / (1.0 + m[..., 2])
    W[..., 0, 0] = 1.0 - m[..., 0] * m[..., 0] * f
    W[..., 1, 1] = 1.0 - m[..., 1] * m[..., 1] * f
    W[..., 0, 1] = W[..., 1, 0] = -m[..., 0] * m[..., 1] * f
    W[..., 2, :2] = -m[..., :2]
    W[..., :, 2] = m
    narrow = (
        np.eye(2)
        - vp[..., :2, None] * vp[..., None, :2] / (2.0 + 2.0 * vp[..., 2])[..., None, None]
    )
    W[..., :, :2] = W[..., :, :2] @ narrow
    W *= D[..., :, None]

    h = W[..., :, 2]
    c = np.sum(view * h, axis=-1)
    T = h[..., :, None] * view[..., None, :] - view[..., :, None] * h[..., None, :]
    T[..., range(3), range(3)] += c[..., None]
    M0 = (T @ W) * np.array([2.0, 2.0, 1.0])
    return np.asarray(M0 / np.linalg.norm(M0[..., :, 2], axis=-1)[..., None, None])


def table_coordinates(alpha: ArrayLike, cos_theta: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return the table coordinates (x, y) in [0, 1] of alpha and view.

    Parameters
    ----------
    alpha, cos_theta : (...) float
        GGX alpha, clamped to [ALPHA_MIN, 1], and the cosine between view and
        normal, clamped to [0, 1].

    Notes
    -----
    The module's docstring says why; `alpha_and_cosine` is the inverse.
    """
    a = np.clip(np.asarray(alpha, dtype=np.float64), ALPHA_MIN, 1.0)
    c = np.clip(np.asarray(cos_theta, dtype=np.float64), 0.0, 1.0)
    a, c = np.broadcast_arrays(a, c)
    p, r = np.sqrt(a * (1.0 - c)), np.sqrt(c * (1.0 + a))
    return np.sqrt(a), p / (p + r)


def alpha_and_cosine(x: ArrayLike, y: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return (alpha, cos_theta) at table coordinates (x, y) in [0, 1].

    x = 0 stands for the limit alpha -> 0 and is answered with alpha = 1e-6;
    what the tables hold differs from the limit by about as much.
    """
    a = np.maximum(np.square(np.asarray(x, dtype=np.float64)), _ALPHA_LIMIT)
    t = np.asarray(y, dtype=np.float64)
    a, t = np.broadcast_arrays(a, t)
    p, r = t * t * (1.0 + a), a * np.square(1.0 - t)
    return a, r / (p + r)


def node_grid(size: int) -> tuple[FloatArray, FloatArray]:
    """Return (alpha, cos_theta), each (size, size), at the nodes of a table.

    Row: view, column: alpha, as in the module's docstring. size is at least 2.
    """
    if size < 2:
        raise ValueError(f"a table needs at least 2 nodes an axis, not {size}")
    nodes = np.linspace(0.0, 1.0, size)
    return alpha_and_cosine(nodes[None, :], nodes[:, None])


def bilinear_weights(
    x: FloatArray, y: FloatArray, size: int
) -> tuple[NDArray[np.intp], FloatArray]:
    """Return the four nodes around (x, y) and their bilinear weights.

    Parameters
    ----------
    x, y : (...) float64
        Table coordinates in [0, 1].
    size : int
        Nodes on each axis.

    Returns
    -------
    index : (..., 4) int
        Flat indices ``row * size + column``.
    weight : (..., 4) float64
        Non-negative, summing to 1.
    """
    tx, ty = x * (size - 1), y * (size - 1)
    column = np.minimum(tx.astype(np.intp), size - 2)
    row = np.minimum(ty.astype(np.intp), size - 2)
    fx, fy = tx - column, ty - row
    first = row * size + column
    index = np.stack([first, first + 1, first + size, first + size + 1], axis=-1)
    weight = np.stack([(1.0 - fx) * (1.0 - fy), fx * (1.0 - fy), (1.0 - fx) * fy, fx * fy], axis=-1)
    return index, weight


def bicubic_weights(x: FloatArray, y: FloatArray, size: int) -> FloatArray:
    """Return the weight of every node in the bicubic interpolation at (x, y).

    Parameters
    ----------
    x, y : (...) float64
        Table coordinates in [0, 1].
    size : int, >= 4
        Nodes on each axis.

    Returns
    -------
    (..., size * size) float64
        In the order ``row * size + column``; summing to 1.

    Notes
    -----
    Products of cardinal not-a-knot cubic splines: the very interpolation of
    the tables, as a linear map that a fit can use.
    """
    cardinal = make_interp_spline(np.linspace(0.0, 1.0, size), np.eye(size), k=3)
    w = cardinal(y)[..., :, None] * cardinal(x)[..., None, :]
    return np.asarray(w.reshape(*w.shape[:-2], size * size))


def _smooth(values: NDArray[Any], x: FloatArray, y: FloatArray) -> FloatArray:
    """Bicubic interpolation of values (n, n, ...), n >= 4, at (x, y)."""
    nodes = np.linspace(0.0, 1.0, values.shape[0])
    channels = values.astype(np.float64).reshape(*values.shape[:2], -1)
    result = [
        RectBivariateSpline(nodes, nodes, channels[..., i]).ev(y, x)
        for i in range(channels.shape[-1])
    ]
    return np.asarray(np.stack(result, axis=-1).reshape(*x.shape, *values.shape[2:]))


def _interpolate(values: NDArray[Any], x: FloatArray, y: FloatArray) -> FloatArray:
    """Bilinear interpolation of values (n, n, ...) at (x, y)."""
    size = values.shape[0]
    index, weight = bilinear_weights(x, y, size)
    nodes = np.asarray(values, dtype=np.float64).reshape(size * size, -1)[index]
    shape = (*x.shape, *values.shape[2:])
    return np.asarray(np.einsum("...k,...kc->...c", weight, nodes).reshape(shape))


def residual_matrix(entries: FloatArray, s: FloatArray) -> FloatArray:
    """Return I + X, (..., 3, 3), of the entries (X00, X02 / s, X11, X20 / s), (..., 4)."""
    m = np.zeros((*entries.shape[:-1], 3, 3))
    m[..., 0, 0] = 1.0 + entries[..., 0]
    m[..., 0, 2] = s * entries[..., 1]
    m[..., 1, 1] = 1.0 + entries[..., 2]
    m[..., 2, 0] = s * entries[..., 3]
    m[..., 2, 2] = 1.0
    return m


def stretched_length(alpha: ArrayLike, cos_theta: ArrayLike) -> FloatArray:
    """Return ``q = sqrt(alpha^2 sin^2 + cos^2)``, the view's length after stretching."""
    a = np.asarray(alpha, dtype=np.float64)
    c = np.asarray(cos_theta, dtype=np.float64)
    return np.asarray(np.sqrt(a * a * (1.0 - c * c) + c * c))


@dataclass(frozen=True, eq=False)
class IsotropicTable:
    """Transforms, albedo and Fresnel term of isotropic GGX over alpha and view.

    Attributes
    ----------
    residual : (n, n, 4) float32
        X00, X02 / s, X11, X20 / s of M = M0 (I + X); row: view, column: alpha.
    albedo : (k, k) float32
        A, the directional albedo for F = 1.
    fresnel : (k, k) float32
        u with B = A (1 - q u)^5; B is the albedo's part under (1 - wo.h)^5.
    provenance : mapping
        What made the table, how, and its measured error.

    Raises
    ------
    ValueError
        If a shape is wrong, a value is not finite, the albedo is outside
        (0, 1], the Fresnel cosine is negative, or a node's determinant is
        not positive.
    """

    residual: NDArray[np.float32]
    albedo: NDArray[np.float32]
    fresnel: NDArray[np.float32]
    provenance: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        r, a, f = self.residual, self.albedo, self.fresnel
        if r.ndim != 3 or r.shape[0] != r.shape[1] or r.shape[0] < 4 or r.shape[2] != 4:
            raise ValueError(f"residual has shape {r.shape}, expected (n, n, 4) with n >= 4")
        if a.ndim != 2 or a.shape[0] != a.shape[1] or a.shape[0] < 4:
            raise ValueError(f"albedo has shape {a.shape}, expected (k, k) with k >= 4")
        if f.shape != a.shape:
            raise ValueError(f"fresnel has shape {f.shape}, expected that of albedo {a.shape}")
        for name in ("residual", "albedo", "fresnel"):
            values = getattr(self, name)
            bad = ~np.isfinite(values)
            if np.any(bad):
                place = tuple(int(i) for i in np.argwhere(bad)[0])
                raise ValueError(f"{name}{list(place)} is {values[place]}, expected finite numbers")
        if np.any(a <= 0.0) or np.any(a > 1.0 + 1e-6):
            raise ValueError(
                f"albedo runs from {a.min()} to {a.max()}, expected values above 0 and up to 1"
            )
        if np.any(f < 0.0):
            raise ValueError(f"fresnel goes down to {f.min()}, expected values of 0 or more")
        for texels, what in ((r, "residual"), (self.textures()[0], "residual between nodes")):
            factors = _determinant_factors(texels)
            wrong = np.any(factors <= 0.0, axis=-1)
            if np.any(wrong):
                row, column = (int(i) for i in np.argwhere(wrong)[0])
                raise ValueError(
                    f"{what} at [{row}, {column}] of {texels.shape[0]}^2 has determinant"
                    " {:.4g} * {:.4g}, expected two positive factors".format(*factors[row, column])
                )

    @property
    def payload(self) -> int:
        """Bytes of the three arrays."""
        return int(self.residual.nbytes + self.albedo.nbytes + self.fresnel.nbytes)

    def matrix(self, alpha: ArrayLike, cos_theta: ArrayLike) -> FloatArray:
        """Return M = M0 (I + X), (..., 3, 3) float64, third column of unit length.

        Parameters
        ----------
        alpha, cos_theta : (...) float
            Clamped to [ALPHA_MIN, 1] and [0, 1].
        """
        a = np.clip(np.asarray(alpha, dtype=np.float64), ALPHA_MIN, 1.0)
        c = np.clip(np.asarray(cos_theta, dtype=np.float64), 0.0, 1.0)
        x, y = table_coordinates(a, c)
        return self._matrix(a, c, x, y)

    def _matrix(self, a: FloatArray, c: FloatArray, x: FloatArray, y: FloatArray) -> FloatArray:
        a, c = np.broadcast_arrays(a, c)
        s = np.sqrt(1.0 - c * c)
        v = np.stack([s, np.zeros_like(c), c], axis=-1)
        M = closed_form_guess(a, a, v) @ residual_matrix(_smooth(self.residual, x, y), s)
        return np.asarray(M / np.linalg.norm(M[..., :, 2], axis=-1)[..., None, None])

    def albedo_terms(self, alpha: ArrayLike, cos_theta: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Return (A, B), each (...) float64; inputs as for `matrix`.

        Schlick's directional albedo is ``f0 (A - B) + B``.
        """
        a = np.clip(np.asarray(alpha, dtype=np.float64), ALPHA_MIN, 1.0)
        c = np.clip(np.asarray(cos_theta, dtype=np.float64), 0.0, 1.0)
        x, y = table_coordinates(a, c)
        A, u = _smooth(self.albedo, x, y), _smooth(self.fresnel, x, y)
        return A, A * (1.0 - np.minimum(stretched_length(a, c) * u, 1.0)) ** 5

    def textures(
        self, residual_size: int = RESIDUAL_SIZE, albedo_size: int = ALBEDO_SIZE
    ) -> Textures:
        """Return what the GPU samples bilinearly, resampled from the bicubic tables.

        Parameters
        ----------
        residual_size, albedo_size : int, >= 2
            Texels on each axis of the two textures.

        Returns
        -------
        residual : (residual_size, residual_size, 4) float32
            X00, X02 / s, X11, X20 / s; row: view, column: alpha.
        albedo : (albedo_size, albedo_size, 2) float32
            A and u.
        """
        residual = _resample(self.residual, residual_size)
        pair = np.stack([self.albedo, self.fresnel], axis=-1)
        return residual, _resample(pair, albedo_size)


def _resample(values: NDArray[np.float32], size: int) -> NDArray[np.float32]:
    """Return bicubic values (n, n, ...) at the nodes of a table of another size."""
    nodes = np.linspace(0.0, 1.0, size)
    x, y = np.broadcast_arrays(nodes[None, :], nodes[:, None])
    return _smooth(values, x, y).astype(np.float32)


def _determinant_factors(residual: NDArray[np.float32]) -> FloatArray:
    """Return the determinants in xz and along y of I + X at the nodes, (n, n, 2)."""
    _, c = node_grid(residual.shape[0])
    X00, X02, X11, X20 = np.moveaxis(residual.astype(np.float64), -1, 0)
    return np.stack([1.0 + X00 - (1.0 - c * c) * X02 * X20, 1.0 + X11], axis=-1)


def sample_textures(
    textures: Textures, alpha: ArrayLike, cos_theta: ArrayLike
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return (M, A, B) as the GPU looks them up.

    Parameters
    ----------
    textures : pair of (n, n, 4) and (k, k, 2) float32
        From `IsotropicTable.textures`.
    alpha, cos_theta : (...) float
        Clamped to [ALPHA_MIN, 1] and [0, 1].

    Returns
    -------
    M : (..., 3, 3) float64
        ``shading_from_cosine``, view in the xz half-plane x >= 0.
    A, B : (...) float64
        Albedo and its part under (1 - wo.h)^5.

    Raises
    ------
    ValueError
        If the textures' shapes are wrong.

    Notes
    -----
    Twins: ``shaders/ltc/table.glsl`` and ``shaders/ltc/lobe.glsl``. In float32 take
    s from the length of the view's tangential part, not from sqrt(1 - c^2), which
    loses 3e-4 rad at normal incidence.
    """
    residual, albedo = textures
    for name, texels, channels in (("residual", residual, 4), ("albedo", albedo, 2)):
        if texels.ndim != 3 or texels.shape[0] != texels.shape[1] or texels.shape[2] != channels:
            raise ValueError(
                f"texture {name} has shape {texels.shape}, expected (n, n, {channels})"
            )
    a = np.clip(np.asarray(alpha, dtype=np.float64), ALPHA_MIN, 1.0)
    c = np.clip(np.asarray(cos_theta, dtype=np.float64), 0.0, 1.0)
    a, c = np.broadcast_arrays(a, c)
    x, y = table_coordinates(a, c)
    s = np.sqrt(1.0 - c * c)
    v = np.stack([s, np.zeros_like(c), c], axis=-1)
    M = closed_form_guess(a, a, v) @ residual_matrix(_interpolate(residual, x, y), s)
    pair = _interpolate(albedo, x, y)
    A, u = pair[..., 0], pair[..., 1]
    B = A * (1.0 - np.minimum(stretched_length(a, c) * u, 1.0)) ** 5
    return M / np.linalg.norm(M[..., :, 2], axis=-1)[..., None, None], A, B


def write_atomically(path: Path, data: bytes) -> None:
    """Write data to path so that a reader sees the old file or the new, never a part.

    The folder must exist; an interrupted write leaves the old file.
    """
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    temporary = Path(name)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(0o666 & ~umask)
        temporary.replace(path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def npz_bytes(arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """Return an uncompressed npz of the arrays, the same bytes for the same input."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as archive:
        for name, values in arrays.items():
            member = io.BytesIO()
            np.lib.format.write_array(member, np.ascontiguousarray(values), allow_pickle=False)
            archive.writestr(zipfile.ZipInfo(f"{name}.npy"), member.getvalue())
    return buffer.getvalue()


def save_arrays(
    path: str | Path,
    arrays: Mapping[str, NDArray[Any]],
    file_format: str,
    provenance: Mapping[str, Any],
) -> None:
    """Write a table's arrays and provenance to an npz file, atomically.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    text = json.dumps({"format": file_format, **provenance}, indent=1, sort_keys=True)
    record = np.frombuffer(text.encode(), dtype=np.uint8)
    write_atomically(Path(path), npz_bytes({**arrays, "provenance": record}))


def load_arrays(
    file: Path, expected: Sequence[str], dtype: DTypeLike, file_format: str, what: str
) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """Return the arrays and the provenance of a file that `save_arrays` wrote.

    Parameters
    ----------
    file : Path
    expected : sequence of str
        Names of the arrays.
    dtype : dtype
        What all of them must be.
    file_format : str
        What the file must say that it is.
    what : str
        The same in words, for messages.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If the file is damaged or something else, in one sentence.
    """
    arrays: dict[str, NDArray[Any]] = {}
    data = file.read_bytes()
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            names = archive.namelist()
    except zipfile.BadZipFile as error:
        raise ValueError(
            f"{file}: not an npz archive ({len(data)} bytes, {error}), expected {what}"
        ) from None
    for name in (*expected, "provenance"):
        if f"{name}.npy" not in names:
            found = ", ".join(sorted(n.removesuffix(".npy") for n in names)) or "nothing"
            raise ValueError(f"{file}: array '{name}' is missing, found {found}")
        try:
            with np.load(io.BytesIO(data), allow_pickle=False) as archive_arrays:
                arrays[name] = archive_arrays[name]
        except (ValueError, OSError, EOFError, zipfile.BadZipFile) as error:
            raise ValueError(f"{file}: array '{name}' cannot be read ({error})") from None
    for name in expected:
        if arrays[name].dtype != dtype:
            raise ValueError(
                f"{file}: array '{name}' is {arrays[name].dtype}, expected {np.dtype(dtype)}"
            )
    try:
        provenance = json.loads(arrays.pop("provenance").astype(np.uint8).tobytes())
    except ValueError:
        raise ValueError(f"{file}: provenance is not JSON text, expected an object") from None
    found_format = provenance.pop("format", None) if isinstance(provenance, dict) else None
    if found_format != file_format:
        raise ValueError(f"{file}: format is {found_format!r}, expected {file_format!r}")
    return arrays, provenance


def save_isotropic(table: IsotropicTable, path: str | Path) -> None:
    """Write a table to an npz file, atomically; the same table gives the same bytes.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    arrays = {name: getattr(table, name).astype("<f4") for name in _ARRAYS}
    save_arrays(path, arrays, FORMAT, table.provenance)


def load_isotropic(path: str | Path | None = None) -> IsotropicTable:
    """Return the isotropic table in an npz file.

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
    file = resource_path("luts", "ltc_isotropic.npz") if path is None else Path(path)
    arrays, provenance = load_arrays(file, _ARRAYS, np.float32, FORMAT, "an isotropic table")
    try:
        return IsotropicTable(arrays["residual"], arrays["albedo"], arrays["fresnel"], provenance)
    except ValueError as error:
        raise ValueError(f"{file}: {error}") from None
