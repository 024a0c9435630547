"""Pictures of lights, filtered beforehand so that a few fetches average them under a lobe.

What a clamped cosine puts on a plane right below it has the density of T = 1/(1 + r^2/d^2)^2,
r the distance on the plane and d that of the plane. So levels are filtered with T, each twice as
wide as the one before (the Gaussian that Heitz et al. 2016, section 5.3, suggest has other
tails; `ltc.published_prefilter` has it). What is fetched is premultiplied: radiance times
coverage, and coverage c, the share of the area that is light. Their quotient is the mean over the
light, also where the filter hangs over an edge, reaches into holes, or lies outside: no filter has
to be renormalised or widened in a margin, and edges leave no lines.

Conventions
    The light's picture covers the rectangle [0, 1]^2 of its plane's coordinates (u, v), and its
    outline lies inside. Texel [j, i] has its centre at ((i + 1/2)/columns, (j + 1/2)/rows),
    between centres values are bilinear, beyond the outermost ones the edge goes on. Radiance is
    linear, not negative, premultiplied with the picture's own alpha. All levels cover
    [-PAD, 1 + PAD]^2, so a place (u, v) is at ((u, v) + PAD)/(1 + 2 PAD) of each.
Sizes
    Level 0 has the next power of two at or above the picture's size on each axis, at least
    SMALLEST and at most a limit; each further level half of that, down to 1 x 1. It is a mip
    chain as every GPU knows it. Level k is T with d = RADIUS texels of level k.
    Detail finer than level 0 is in ``picture``, which is the picture itself, premultiplied.
How
    Texels of level 0 are exact averages of the bilinear picture, times the outline's exact area.
    Downwards G_{k+1} is G_k filtered with [1 3 3 1]/8 on each axis, one pass for a level; upwards
    T_k = .37 G_k + up(.38 G_{k+1} + .25 T_{k+1}), ``up`` bilinear. Beyond the stored area
    arrays go on for four texels, which the widest filter's support never leaves.

Measured with five taps of least error, mean error of the shading integral x 1000
(`docs/textures.md`): 3.3; PAD 1/8 or 1/2 with as many texels 3.3, 3.5; level 0 at twice the size
3.2, at four times 3.2; (.33 .40 .27) or (.30 .42 .28) for the three weights 3.4, 3.5.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from ltc.picture_cells import coverage

FloatArray: TypeAlias = npt.NDArray[np.float64]
Image: TypeAlias = npt.NDArray[np.float32]

PAD = 0.25
"""Of the light's size, what levels store beyond it on each side."""

RADIUS = 1.3
"""d of level k's filter, in its texels."""

SMALLEST, LARGEST = 32, 4096
"""Bounds of level 0's texels on each axis."""

WEIGHTS = (0.37, 0.38, 0.25)
"""Of G_k, G_{k+1} and T_{k+1} in T_k."""

HALF_SCALE = 2.0**14
"""What the largest value of a picture, and full coverage, become in half floats (most: 65504)."""

_EDGE = 4  # texels beyond the stored area


@dataclass(frozen=True, eq=False, slots=True)
class Pyramid:
    """A prefiltered picture, premultiplied; the last channel is coverage.

    Attributes
    ----------
    picture : (rows, columns, C + 1) float32
        The picture times its outline's coverage, on [0, 1]^2.
    levels : tuple of (rows_k, columns_k, C + 1) float32
        T_0 to T_K, on [-PAD, 1 + PAD]^2.
    """

    picture: Image
    levels: tuple[Image, ...]

    @property
    def size(self) -> FloatArray:
        """Texels of level 0 for 1 of (u, v): (2) float64."""
        rows, columns = self.levels[0].shape[:2]
        return np.array([columns, rows]) / (1.0 + 2.0 * PAD)

    @property
    def nbytes(self) -> int:
        """Bytes as float32; half floats take half of them."""
        return sum(a.nbytes for a in (self.picture, *self.levels))

    def half(self) -> tuple[Pyramid, float]:
        """Return the pyramid as half floats hold it, still in float32, and the picture's scale.

        A GPU stores radiance / scale * HALF_SCALE and coverage * HALF_SCALE, and the quotient
        of what it fetches times the scale is radiance. Coverage of 1e-8 is still above
        the least half float; without a scale it would be lost at 6e-8.
        """
        largest = max(float(np.max(self.picture[..., :-1], initial=0.0)), 1e-30)
        scale = np.full(self.picture.shape[2], HALF_SCALE / largest, dtype=np.float32)
        scale[-1] = HALF_SCALE

        def rounded(a: Image) -> Image:
            with np.errstate(under="ignore"):
                halves = (a * scale).astype(np.float16)
            return np.asarray(halves.astype(np.float32) / scale, dtype=np.float32)

        levels = tuple(rounded(level) for level in self.levels)
        return Pyramid(rounded(self.picture), levels), largest


def level_size(texels: int, limit: int = LARGEST) -> int:
    """Return the size of level 0 on an axis where the picture has so many texels."""
    return min(max(1 << (texels - 1).bit_length(), SMALLEST), limit)


def prefilter(
    picture: npt.ArrayLike,
    outline: Sequence[npt.ArrayLike] | None = None,
    limit: int = LARGEST,
    threads: int = 2,
) -> Pyramid:
    """Return a picture's pyramid.

    Parameters
    ----------
    picture : (rows, columns, C) float
        Linear radiance, finite and not negative, premultiplied with its own alpha.
        Any size from 1 x 1.
    outline : sequence of (k, 4, 2) float64, optional
        Closed contours of cubic Béziers that do not cross, in [0, 1]^2, counter-clockwise
        about u x v, holes the other way; the whole rectangle if it is left out.
    limit : int
        Largest size of level 0, a power of two.
    threads : int
        How many work at it.

    Returns
    -------
    Pyramid

    Raises
    ------
    ValueError
        If a shape does not fit, or a value is negative or not finite: the message says where.

    Notes
    -----
    See the module. 1024 x 1024 with three channels take 0.2 s of CPU time.
    """
    L = np.asarray(picture, dtype=np.float32)
    if L.ndim != 3 or 0 in L.shape:
        raise ValueError(f"picture has shape {L.shape}, expected (rows, columns, channels)")
    bad = ~(np.isfinite(L) & (L >= 0.0))
    if np.any(bad):
        place = tuple(int(i) for i in np.argwhere(bad)[0])
        raise ValueError(
            f"picture{list(place)} is {L[place]}, expected finite radiance of 0 or more"
        )
    rows, columns = L.shape[:2]
    width, height = level_size(columns, limit), level_size(rows, limit)
    curves = None
    if outline is not None:
        contours = [np.asarray(c, dtype=np.float64) for c in outline]
        for k, c in enumerate(contours):
            if c.ndim != 3 or c.shape[1:] != (4, 2):
                raise ValueError(f"contour {k} has shape {c.shape}, expected (k, 4, 2)")
        curves = np.concatenate([np.zeros((0, 4, 2)), *contours])
    cover = _covers(curves, columns, rows, 0.0)
    padded = _covers(curves, width, height, PAD)

    # Channels go their own ways: planes are contiguous, and threads share them out.
    across, down = _average_rows(columns, width), _average_rows(rows, height)

    def of_plane(plane: Image | None) -> tuple[Image, list[Image]]:
        if plane is None:
            return cover, _chain(padded)
        even = _apply(_apply(plane, down, 0), across, 1)
        even *= padded
        return plane * cover, _chain(even)

    planes: list[Image | None] = [np.ascontiguousarray(plane) for plane in np.moveaxis(L, -1, 0)]
    done = _map(of_plane, [*planes, None], threads)
    levels = tuple(np.stack(level, axis=-1) for level in zip(*(d[1] for d in done), strict=True))
    return Pyramid(np.stack([d[0] for d in done], axis=-1), levels)


def _map(function: Callable[[Any], Any], items: list[Any], threads: int) -> list[Any]:
    if threads < 2:
        return [function(item) for item in items]
    with ThreadPoolExecutor(threads) as executor:
        return list(executor.map(function, items))


def _covers(curves: FloatArray | None, columns: int, rows: int, pad: float) -> Image:
    """Return the coverage of texels on [-pad, 1 + pad]^2."""
    if curves is not None:
        moved = (curves + pad) / (1.0 + 2.0 * pad)
        return coverage(moved, columns, rows).astype(np.float32)
    sides = []
    for n in (rows, columns):
        border = np.linspace(-pad, 1.0 + pad, n + 1)
        inside = np.diff(np.clip(border, 0.0, 1.0)) / np.diff(border)
        sides.append(inside.astype(np.float32))
    return np.outer(*sides)


_Bands = list[tuple[npt.NDArray[np.intp], Image]]


def _average_rows(n: int, size: int) -> _Bands:
    """Return how ``size`` texels on [-PAD, 1 + PAD] average a bilinear row of n texels on [0, 1].

    As pairs of an index (size) into the n texels and a weight (size), to be summed.
    """
    border = np.linspace(-PAD, 1.0 + PAD, size + 1) * n - 0.5  # 0 is the first texel's centre
    lo, hi = border[:-1], border[1:]
    first = np.clip(np.floor(lo), 0, n - 1).astype(np.intp)
    count = int(np.max(np.clip(np.ceil(hi), 0, n - 1) - first)) + 1

    def integral(x: FloatArray, k: npt.NDArray[np.intp]) -> FloatArray:
        """Return that of texel k's weight from its centre to x; the outermost ones go on."""
        d = x - k
        inner = np.clip(d, -1.0, 1.0)
        hat = inner - 0.5 * inner * np.abs(inner)
        goes_on = ((k == 0) & (d < 0.0)) | ((k == n - 1) & (d > 0.0))
        return np.where(goes_on, d, hat)

    bands: _Bands = []
    for j in range(count):
        k = np.minimum(first + j, n - 1)
        weight = (integral(hi, k) - integral(lo, k)) / (hi - lo)
        weight[first + j > n - 1] = 0.0
        bands.append((k, weight.astype(np.float32)))
    return bands


def _apply(plane: Image, bands: _Bands, axis: int) -> Image:
    out: Image | None = None
    for k, weight in bands:
        part = np.take(plane, k, axis=axis)
        part *= weight[:, None] if axis == 0 else weight
        out = part if out is None else np.add(out, part, out=out)
    assert out is not None
    return out


def _chain(even: Image) -> list[Image]:
    """Return T_0 to T_K of a plane G_0."""
    G = [np.pad(even, _EDGE)]
    while max(G[-1].shape) > 1 + 2 * _EDGE:
        G.append(_halve(_halve(G[-1], 0), 1))
    fine, next_fine, next_wide = (np.float32(w) for w in WEIGHTS)
    T = [G[-1]]
    for k in range(len(G) - 2, -1, -1):
        wide = next_fine * G[k + 1] + next_wide * T[-1]
        level = _double(_double(wide, G[k].shape[0], 0), G[k].shape[1], 1)
        level += fine * G[k]
        T.append(level)
    inner = slice(_EDGE, -_EDGE)
    return [level[inner, inner] for level in reversed(T)]


def _part(a: Image, axis: int, start: int, stop: int, step: int = 1) -> Image:
    return a[start:stop:step] if axis == 0 else a[:, start:stop:step]


def _halve(a: Image, axis: int) -> Image:
    """Return an array filtered with [1 3 3 1]/8 and halved; a single texel stays as it is."""
    size = a.shape[axis] - 2 * _EDGE
    if size == 1:
        return a
    half, edge = size // 2, _EDGE // 2
    shape = list(a.shape)
    shape[axis] = half + 2 * _EDGE
    out = np.zeros(shape, dtype=np.float32)
    # Texel c lies on texels 2c - 4 and 2c - 3; those with two more about them are done.
    count = half + 2 * _EDGE - 2 * edge - 2
    target = _part(out, axis, edge + 1, edge + 1 + count)
    first = 2 * (edge + 1) - _EDGE
    np.add(_tail(a, axis, first, count), _tail(a, axis, first + 1, count), out=target)
    target *= np.float32(3.0)
    target += _tail(a, axis, first - 1, count)
    target += _tail(a, axis, first + 2, count)
    target *= np.float32(0.125)
    return out


def _tail(a: Image, axis: int, first: int, count: int) -> Image:
    """Return every second texel, ``count`` of them."""
    return _part(a, axis, first, first + 2 * count - 1, 2)


def _double(a: Image, size: int, axis: int) -> Image:
    """Return an array at twice the texels, bilinear; ``size`` with edges."""
    if a.shape[axis] == size:
        return a
    shape = list(a.shape)
    shape[axis] = size
    out = np.empty(shape, dtype=np.float32)
    n = size // 2
    middle = _part(a, axis, 2, n + 2) * np.float32(0.75)
    quarter = a * np.float32(0.25)
    np.add(middle, _part(quarter, axis, 1, n + 1), out=_part(out, axis, 0, size, 2))
    np.add(middle, _part(quarter, axis, 3, n + 3), out=_part(out, axis, 1, size, 2))
    return out
