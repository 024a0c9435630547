"""Tables of transforms from files of any known layout, as one kind of object.

`read` returns a `Grid`: stored numbers over axes, what material and view each node
stands for, and how to look up between nodes. `ltc.check` examines it without
knowing the file. Layouts, read off public files and their descriptions:

Heitz et al. 2016, ``ltc_1.dds`` and ``ltc_2.dds`` (or ``ltc.js`` with both)
    Row: ``sqrt(1 - cos theta)``, theta at most 1.57; column: ``sqrt(alpha)``,
    alpha at least 1e-4; both from 0 to 1. First image: entries 00, 20, 02, 22 (row,
    column) of M^-1 divided by its middle entry, the others being 0, 1, 0. Second: the
    amplitude A, the Fresnel part B, nothing, and a table of spheres. Interpolated
    as stored.
The same, ``ltc.inc``
    C arrays over the same axes: ``tabM`` with M column by column, ``tabMinv`` (not
    read), and ``tabMagnitude`` or ``tabAmplitude``. No Fresnel part.
KT et al. 2022, ``*.npy``
    Arrays (alpha, lambda, theta, phi, 3, 3) of M, third column of unit length:
    ``alpha_x = max(alpha, 1e-4)``, ``alpha_y = max(alpha lambda, 1e-4)``, alpha and
    lambda from 0 to 1, theta from 0 to .9999 pi/2, phi from 0 to pi/2, all uniform.
    Another file has (alpha_x, alpha_y) for (alpha, lambda), another spans all of
    phi; shapes do not tell them apart, so the one is taken whose lobes look like
    GGX. (alpha, theta, 3, 3) is the isotropic one, alpha at least .01, theta to
    .99 pi/2. Amplitude and Fresnel part, where wanted, are arrays of the grid's
    shape in files of their own.

A published table is used without clipping lights at the surface, as its authors
do; the tables of this project with it (`ltc.polygon.ltc_specular`).
"""

from __future__ import annotations

import io
import json
import re
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ltc.anisotropic import AXES, CHANNELS, AnisotropicTable, load_anisotropic, node_views
from ltc.anisotropic import FORMAT as ANISOTROPIC_FORMAT
from ltc.containers import read_dds
from ltc.table import (
    ALPHA_MIN,
    FORMAT,
    IsotropicTable,
    Textures,
    alpha_and_cosine,
    closed_form_guess,
    load_arrays,
    load_isotropic,
    sample_textures,
)

FloatArray = NDArray[np.float64]
Table = TypeVar("Table", IsotropicTable, AnisotropicTable)

POWERS = (1.0, 2.0, 0.5)
"""What alpha may have been raised to by mistake: nothing, squared, its root taken."""

_ALPHA_FLOOR = 1e-4  # of both published fits
_THETA_LIMIT = 1.57  # of Heitz et al.
_LARGEST = 50_000_000  # numbers in one table


class Samples(NamedTuple):
    """M (..., 3, 3), NaN where there is none, and A and B (...), None if the table lacks them."""

    matrix: FloatArray
    albedo: FloatArray | None
    fresnel: FloatArray | None


class Grid(Protocol):
    """A table over axes that run from 0 to 1, nodes evenly spaced, ends included."""

    @property
    def layout(self) -> str:
        """What the table is, for people."""

    @property
    def axes(self) -> tuple[str, ...]:
        """What each axis is."""

    @property
    def view_axis(self) -> int:
        """The axis whose last node is the grazing view."""

    @property
    def circle_axis(self) -> int | None:
        """The axis that runs over all of phi, if one does."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Nodes on each axis."""

    @property
    def anisotropic(self) -> bool:
        """Whether alpha_x and alpha_y may differ."""

    @property
    def clips(self) -> bool:
        """Whether lights are clipped at the surface, and the lobe's leak divided out."""

    @property
    def decimals(self) -> int | None:
        """Decimals that all numbers were rounded to, if they were."""

    @property
    def power(self) -> float:
        """Power of the axis' alpha that the lobes are of; 1 if all is well."""

    @property
    def entries(self) -> FloatArray | None:
        """The stored matrices (*shape, 3, 3), either way round; None if others are stored."""

    def configuration(self, u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return (alpha_x, alpha_y, wo) of coordinates (..., axes)."""

    def at(self, u: FloatArray) -> Samples:
        """Return what lies at coordinates (..., axes)."""

    def lookup(self, alpha_x: FloatArray, alpha_y: FloatArray, wo: FloatArray) -> Samples:
        """Return what a renderer looks up."""

    def halved(self) -> Grid:
        """Return the same table with its numbers as half floats."""

    def amplitude_misread(self) -> tuple[FloatArray, FloatArray, FloatArray] | None:
        """Return the other (alpha_x, alpha_y, wo) that nodes' amplitudes may belong to."""


def nodes(grid: Grid) -> FloatArray:
    """Return the coordinates of all nodes, (*shape, axes)."""
    axes = [np.linspace(0.0, 1.0, n) for n in grid.shape]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)


def _view(theta: FloatArray, phi: ArrayLike = 0.0) -> FloatArray:
    s = np.sin(theta)
    return np.stack([s * np.cos(phi), s * np.sin(phi), np.cos(theta) + 0.0 * s], axis=-1)


@dataclass(frozen=True)
class Layout:
    """Axes of a published table: where a node is, and where a view is on them.

    ``configuration`` maps coordinates (..., axes) to (alpha_x, alpha_y, wo), and
    ``coordinates`` back; views come folded as the axes need it.
    """

    name: str
    axes: tuple[str, ...]
    view_axis: int
    circle_axis: int | None
    power: float
    swaps: bool
    configuration: Callable[[FloatArray], tuple[FloatArray, FloatArray, FloatArray]]
    coordinates: Callable[[FloatArray, FloatArray, FloatArray], FloatArray]


def heitz_layout(power: float = 1.0) -> Layout:
    """Return the axes of Heitz et al. 2016."""

    def configuration(u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        theta = np.minimum(np.arccos(1.0 - u[..., 0] ** 2), _THETA_LIMIT)
        alpha = np.maximum(u[..., 1] ** 2, _ALPHA_FLOOR) ** power
        return alpha, alpha, _view(theta)

    def coordinates(ax: FloatArray, ay: FloatArray, wo: FloatArray) -> FloatArray:
        x = np.sqrt(1.0 - np.minimum(wo[..., 2], 1.0))
        return np.stack(np.broadcast_arrays(x, np.sqrt(ax ** (1.0 / power))), axis=-1)

    axes = ("sqrt(1 - cos theta)", "sqrt(alpha)")
    name = "Heitz et al. 2016"
    return Layout(name, axes, 0, None, power, False, configuration, coordinates)


def kt_layout(power: float = 1.0, ratio: bool = True, circle: bool = False) -> Layout:
    """Return the axes of KT et al. 2022: (alpha, lambda) or (alpha_x, alpha_y), theta, phi."""
    theta_limit = 0.9999 * np.pi / 2.0
    phi_limit = 2.0 * np.pi if circle else np.pi / 2.0

    def configuration(u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        second = u[..., 0] * u[..., 1] if ratio else u[..., 1]
        ax = np.maximum(u[..., 0], _ALPHA_FLOOR) ** power
        ay = np.maximum(second, _ALPHA_FLOOR) ** power
        return ax, ay, _view(u[..., 2] * theta_limit, u[..., 3] * phi_limit)

    def coordinates(ax: FloatArray, ay: FloatArray, wo: FloatArray) -> FloatArray:
        x, y = ax ** (1.0 / power), ay ** (1.0 / power)
        theta = np.arctan2(np.hypot(wo[..., 0], wo[..., 1]), wo[..., 2]) / theta_limit
        phi = np.mod(np.arctan2(wo[..., 1], wo[..., 0]), 2.0 * np.pi) / phi_limit
        second = y / x if ratio else y
        return np.stack(np.broadcast_arrays(x, second, theta, phi), axis=-1)

    names = ("alpha", "lambda") if ratio else ("alpha_x", "alpha_y")
    return Layout(
        "KT et al. 2022" + (", all of phi" if circle else ""),
        (*names, "theta", "phi"),
        2,
        3 if circle else None,
        power,
        ratio,
        configuration,
        coordinates,
    )


def kt_isotropic_layout(power: float = 1.0) -> Layout:
    """Return the axes of the isotropic table of KT et al. 2022."""
    limit = 0.99 * np.pi / 2.0

    def configuration(u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        alpha = np.maximum(u[..., 0], 0.01) ** power
        return alpha, alpha, _view(u[..., 1] * limit)

    def coordinates(ax: FloatArray, ay: FloatArray, wo: FloatArray) -> FloatArray:
        theta = np.arctan2(np.hypot(wo[..., 0], wo[..., 1]), wo[..., 2]) / limit
        return np.stack(np.broadcast_arrays(ax ** (1.0 / power), theta), axis=-1)

    axes = ("alpha", "theta")
    name = "KT et al. 2022, isotropic"
    return Layout(name, axes, 1, None, power, False, configuration, coordinates)


def fold(
    alpha_x: FloatArray, alpha_y: FloatArray, wo: FloatArray, swap: bool, quadrant: bool
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return (alpha_x, alpha_y, wo, F) with the view in the first quadrant, alpha_x >= alpha_y.

    Either fold only if asked for. The transform sought is F M F^T, M the folded
    one's: GGX is symmetric about x and y, and swapping the axes swaps the alphas. (The
    paper multiplies by F on the left alone, Eqs. 13 and 15; the cosine does not mind
    F^T on the right, and the determinant keeps its sign.)
    """
    ax, ay, x, y = np.broadcast_arrays(alpha_x, alpha_y, wo[..., 0], wo[..., 1])
    swapped = (ay > ax) & swap
    sx = np.where((x < 0.0) & quadrant, -1.0, 1.0)
    sy = np.where((y < 0.0) & quadrant, -1.0, 1.0)
    x, y = x * sx, y * sy
    F = np.zeros((*x.shape, 3, 3))
    F[..., 0, 0], F[..., 1, 1], F[..., 2, 2] = sx, sy, 1.0
    turned = F[..., [1, 0, 2]]  # columns swapped: first swap back, then flip
    F = np.where(swapped[..., None, None], turned, F)
    view = np.stack(
        [np.where(swapped, y, x), np.where(swapped, x, y), np.broadcast_to(wo[..., 2], x.shape)],
        axis=-1,
    )
    return np.where(swapped, ay, ax), np.where(swapped, ax, ay), view, F


def invert_where_regular(m: FloatArray) -> FloatArray:
    """Return inverses of (..., 3, 3), NaN for those that are singular or not finite."""
    result = np.full(m.shape, np.nan)
    finite = np.all(np.isfinite(m), axis=(-2, -1))
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        regular = finite & (np.linalg.det(np.where(finite[..., None, None], m, 0.0)) != 0.0)
        result[regular] = np.linalg.inv(m[regular])
    return result


@dataclass(frozen=True, eq=False)
class PublishedGrid:
    """A table of a published layout, interpolated linearly along every axis.

    Attributes
    ----------
    values : (*shape, 3, 3) float64
        M, or its inverse where ``inverse`` is set.
    albedo, fresnel : (*shape) float64, optional
    decimals : int, optional
        Decimals that the file's numbers were rounded to.
    """

    described: Layout
    values: FloatArray
    inverse: bool
    albedo: FloatArray | None = None
    fresnel: FloatArray | None = None
    decimals: int | None = None
    clips: bool = False

    @property
    def layout(self) -> str:
        stored = "inverses" if self.inverse else "matrices"
        return f"{self.described.name}, {stored} over ({', '.join(self.axes)})"

    @property
    def axes(self) -> tuple[str, ...]:
        return self.described.axes

    @property
    def view_axis(self) -> int:
        return self.described.view_axis

    @property
    def circle_axis(self) -> int | None:
        return self.described.circle_axis

    @property
    def power(self) -> float:
        return self.described.power

    @property
    def entries(self) -> FloatArray:
        return self.values

    @property
    def shape(self) -> tuple[int, ...]:
        return self.values.shape[:-2]

    @property
    def anisotropic(self) -> bool:
        return len(self.axes) == 4

    def configuration(self, u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        return self.described.configuration(u)

    def at(self, u: FloatArray) -> Samples:
        u = np.clip(u, 0.0, 1.0)
        values = multilinear(self.values, u)
        matrix = invert_where_regular(values) if self.inverse else values
        return Samples(
            matrix,
            None if self.albedo is None else multilinear(self.albedo, u),
            None if self.fresnel is None else multilinear(self.fresnel, u),
        )

    def lookup(self, alpha_x: FloatArray, alpha_y: FloatArray, wo: FloatArray) -> Samples:
        if not self.anisotropic:
            return self.at(self.described.coordinates(alpha_x, alpha_y, wo))
        ax, ay, view, F = fold(alpha_x, alpha_y, wo, self.described.swaps, self.circle_axis is None)
        found = self.at(self.described.coordinates(ax, ay, view))
        with np.errstate(invalid="ignore"):  # no lobe is no number
            return found._replace(matrix=F @ found.matrix @ np.swapaxes(F, -1, -2))

    def halved(self) -> PublishedGrid:
        def half(x: FloatArray) -> FloatArray:
            with np.errstate(over="ignore", under="ignore", invalid="ignore"):
                return x.astype(np.float16).astype(np.float64)

        return replace(
            self,
            values=half(self.values),
            albedo=None if self.albedo is None else half(self.albedo),
            fresnel=None if self.fresnel is None else half(self.fresnel),
        )

    def amplitude_misread(self) -> tuple[FloatArray, FloatArray, FloatArray] | None:
        if not self.anisotropic:
            return None
        ratio = self.axes[0] == "alpha"
        other = kt_layout(self.power, not ratio, self.circle_axis is not None)
        return other.configuration(nodes(self))


def multilinear(values: NDArray[Any], u: FloatArray) -> FloatArray:
    """Return values (n_1, ..., n_k, ...) interpolated linearly at u (..., k) in [0, 1].

    Nodes of weight zero are not looked at, so that one bad node spoils no others.
    """
    k = u.shape[-1]
    shape = values.shape[:k]
    flat = np.asarray(values, dtype=np.float64).reshape(int(np.prod(shape)), -1)
    place = u * (np.array(shape) - 1.0)
    base = np.clip(np.floor(place), 0, np.maximum(np.array(shape) - 2, 0)).astype(np.intp)
    # Coordinates that are nodes up to rounding are nodes.
    f = place - base
    f = np.where(np.abs(f - np.round(f)) < 1e-12, np.round(f), f)
    result = np.zeros((*u.shape[:-1], flat.shape[1]))
    with np.errstate(invalid="ignore", over="ignore", under="ignore"):
        for corner in np.ndindex(*(2,) * k):
            weight = np.prod(np.where(np.array(corner) == 1, f, 1.0 - f), axis=-1)
            index = np.minimum(base + np.array(corner), np.array(shape) - 1)
            chosen = flat[np.ravel_multi_index(tuple(np.moveaxis(index, -1, 0)), shape)]
            result += np.where(weight[..., None] > 0.0, weight[..., None] * chosen, 0.0)
    return result.reshape(*u.shape[:-1], *values.shape[k:])


@dataclass(frozen=True, eq=False)
class IsotropicGrid:
    """This project's isotropic table as the GPU samples it; nodes are the residual's texels."""

    table: IsotropicTable
    textures: Textures

    layout = "isotropic residual over (view, sqrt(alpha))"
    axes = ("view", "sqrt(alpha)")
    view_axis = 0
    circle_axis = None
    anisotropic = False
    clips = True
    decimals = None
    power = 1.0
    entries = None

    @classmethod
    def of(cls, table: IsotropicTable) -> IsotropicGrid:
        return cls(table, table.textures())

    @property
    def shape(self) -> tuple[int, ...]:
        return self.textures[0].shape[:2]

    def configuration(self, u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        alpha, c = alpha_and_cosine(np.maximum(u[..., 1], 1e-2), u[..., 0])
        # A view in the surface has no albedo; within 1e-7 of it all has its limit.
        c = np.maximum(c, 1e-7 * alpha)
        return alpha, alpha, np.stack([np.sqrt(1.0 - c * c), 0.0 * c, c], axis=-1)

    def at(self, u: FloatArray) -> Samples:
        return self.lookup(*self.configuration(u))

    def lookup(self, alpha_x: FloatArray, alpha_y: FloatArray, wo: FloatArray) -> Samples:
        return Samples(*sample_textures(self.textures, alpha_x, wo[..., 2]))

    def halved(self) -> IsotropicGrid:
        with np.errstate(over="ignore", under="ignore", invalid="ignore"):
            residual, albedo = (t.astype(np.float16).astype(np.float32) for t in self.textures)
        return replace(self, textures=(residual, albedo))

    def amplitude_misread(self) -> None:
        return None


def smallest_ratio_root() -> float:
    """Return the root of the smallest ratio of alphas on the anisotropic table's axis."""
    ax, ay, _ = node_views((2, 2, 2, 2))
    return float(np.sqrt(ay[0, 0, 0, 1] / ax[0, 0, 0, 1]))


@dataclass(frozen=True, eq=False)
class AnisotropicGrid:
    """This project's anisotropic table; nodes are the residual's."""

    table: AnisotropicTable

    layout = f"anisotropic residual over ({', '.join(AXES)})"
    axes = AXES
    view_axis = 2
    circle_axis = None
    anisotropic = True
    clips = True
    decimals = None
    power = 1.0
    entries = None

    @property
    def shape(self) -> tuple[int, ...]:
        return self.table.residual.shape[:4]

    def configuration(self, u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        azimuth, ratio, view, x = np.moveaxis(u, -1, 0)
        root = smallest_ratio_root()
        ax = np.maximum(x * x, ALPHA_MIN)
        ay = np.maximum(np.square(root + (1.0 - root) * ratio) * ax, ALPHA_MIN)
        d = np.stack([1.0 - azimuth, azimuth], axis=-1)
        d = d / np.linalg.norm(d, axis=-1, keepdims=True)
        along = np.hypot(ax * d[..., 0], ay * d[..., 1])
        p, r = view * view * (1.0 + along), along * np.square(1.0 - view)
        # A view in the surface has no albedo; within 1e-7 of it all has its limit.
        c = np.maximum(r / (p + r), 1e-7 * along)
        s = np.sqrt(1.0 - c * c)
        return ax, ay, np.concatenate([s[..., None] * d, c[..., None]], axis=-1)

    def at(self, u: FloatArray) -> Samples:
        return self.lookup(*self.configuration(u))

    def lookup(self, alpha_x: FloatArray, alpha_y: FloatArray, wo: FloatArray) -> Samples:
        A, B = self.table.albedo_terms_of_view(alpha_x, alpha_y, wo)
        return Samples(self.table.matrix_of_view(alpha_x, alpha_y, wo), A, B)

    def halved(self) -> AnisotropicGrid:
        return self  # it is stored in half floats

    def amplitude_misread(self) -> None:
        return None


def likeness(layout: Layout, matrix: FloatArray) -> float:
    """Return how far matrices (*shape, 3, 3) at a layout's nodes are from GGX; 0 is best.

    The median, over the nodes with a positive determinant, of the logarithm of the
    determinant over that of `ltc.table.closed_form_guess` (third columns of unit
    length), plus the mean angle between the lobes' axes [rad].
    """
    shape = matrix.shape[:-2]
    axes = [np.linspace(0.0, 1.0, n) for n in shape]
    u = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(shape))
    m = matrix.reshape(-1, 3, 3)
    keep = np.all(np.isfinite(m), axis=(1, 2)) & np.any(m[:, :, 2] != 0.0, axis=1)
    step = max(1, np.count_nonzero(keep) // 4000)
    u, m = u[keep][::step], m[keep][::step]
    if m.shape[0] == 0:
        return np.inf
    with np.errstate(all="ignore"):
        m = m / np.linalg.norm(m[..., 2], axis=-1)[:, None, None]
        guess = closed_form_guess(*layout.configuration(u))
        ratio = np.abs(np.linalg.det(m)) / np.linalg.det(guess)
        usable = ratio > 0.0
        if not np.any(usable):
            return np.inf
        spread = np.median(np.abs(np.log(ratio[usable])))
        angle = np.arccos(np.clip(np.sum(m[..., 2] * guess[..., 2], axis=-1), -1.0, 1.0))
    return float(spread + np.mean(angle))


def closest(layouts: Sequence[Layout], matrix: FloatArray) -> Layout:
    """Return the layout under which the matrices are most like GGX, the first if in doubt."""
    scores = [likeness(layout, matrix) for layout in layouts]
    best = int(np.argmin(scores))
    # Another reading must be clearly better than the documented one.
    return layouts[best] if scores[best] < 0.7 * scores[0] - 0.05 else layouts[0]


def read(paths: Sequence[str | Path], anyway: bool = False) -> Grid:
    """Return the table in one file, or in several that belong together.

    Parameters
    ----------
    paths : sequence of path
        One ``.npz`` of this project; ``ltc_1.dds`` and, where there is one,
        ``ltc_2.dds``; one ``.js``; one ``.inc`` or ``.h``; or ``.npy`` files:
        matrices, then amplitude, then Fresnel part.
    anyway : bool
        Return a broken table of this project too, for examination; published ones
        are not judged here.

    Raises
    ------
    OSError
        If a file cannot be read.
    ValueError
        If it holds something else: one sentence that names the file.
    """
    files = [Path(path) for path in paths]
    readers: dict[str, tuple[int, Callable[..., Grid]]] = {
        ".npz": (1, _read_npz),
        ".dds": (2, _read_dds),
        ".js": (1, _read_js),
        ".inc": (1, _read_inc),
        ".h": (1, _read_inc),
        ".npy": (3, _read_npy),
    }
    if not files:
        raise ValueError("no file given, expected a table")
    suffix = files[0].suffix.lower()
    for file in files:
        if file.suffix.lower() not in readers:
            raise ValueError(f"{file}: ends in {file.suffix!r}, expected {', '.join(readers)}")
        if file.suffix.lower() != suffix:
            raise ValueError(f"{file}: ends in {file.suffix!r}, expected {suffix!r} as the first")
    most, reader = readers[suffix]
    if len(files) > most:
        raise ValueError(f"{files[most]}: one file too many, a table has at most {most} {suffix}")
    if suffix == ".npz":
        return _read_npz(files[0], anyway)
    return reader(*files)


def _read_npz(file: Path, anyway: bool = False) -> Grid:
    data = file.read_bytes()
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as archive:
            text = archive["provenance"].astype(np.uint8).tobytes()
        kind = json.loads(text).get("format")
    except (ValueError, KeyError, OSError, EOFError, AttributeError, zipfile.BadZipFile):
        kind = FORMAT  # the loader below says what is wrong
    if kind == FORMAT:
        try:
            return IsotropicGrid.of(load_isotropic(file))
        except ValueError as refused:
            if not anyway:
                raise
            return IsotropicGrid.of(_anyway(file, "<f4", FORMAT, _UncheckedIsotropic, refused))
    if kind == ANISOTROPIC_FORMAT:
        try:
            return AnisotropicGrid(load_anisotropic(file))
        except ValueError as refused:
            if not anyway:
                raise
            return AnisotropicGrid(
                _anyway(file, "<f2", ANISOTROPIC_FORMAT, _UncheckedAnisotropic, refused)
            )
    raise ValueError(f"{file}: format is {kind!r}, expected {FORMAT!r} or {ANISOTROPIC_FORMAT!r}")


class _UncheckedIsotropic(IsotropicTable):
    def __post_init__(self) -> None: ...


class _UncheckedAnisotropic(AnisotropicTable):
    def __post_init__(self) -> None: ...


def _anyway(
    file: Path,
    dtype: str,
    file_format: str,
    make: Callable[..., Table],
    refused: ValueError,
) -> Table:
    """Return a table of this project that its own loader refused, for the doctor to name why.

    Shapes must be right and numbers finite: without these nothing can be looked up.
    """
    names = ("residual", "albedo", "fresnel")
    arrays, provenance = load_arrays(file, names, np.dtype(dtype), file_format, "a table")
    residual, albedo, fresnel = (arrays[name] for name in names)
    flat = file_format == FORMAT
    dimensions, channels, least = (2, 4, 4) if flat else (4, CHANNELS, 2)
    right = residual.ndim == dimensions + 1 and residual.shape[-1] == channels
    right &= albedo.ndim == dimensions and albedo.shape == fresnel.shape
    right = right and min(*residual.shape[:-1], *albedo.shape) >= least
    if flat and right:
        right = residual.shape[0] == residual.shape[1] and albedo.shape[0] == albedo.shape[1]
    if not right or not all(np.all(np.isfinite(array)) for array in arrays.values()):
        raise refused
    return make(residual, albedo, fresnel, provenance)


def _heitz_inverse(texels: NDArray[Any]) -> FloatArray:
    """Return (rows, columns, 3, 3) from the four stored entries of the inverse."""
    t = np.asarray(texels, dtype=np.float64)
    m = np.zeros((*t.shape[:-1], 3, 3))
    m[..., 0, 0], m[..., 2, 0], m[..., 0, 2], m[..., 2, 2] = np.moveaxis(t, -1, 0)
    m[..., 1, 1] = 1.0
    return m


def _heitz(first: NDArray[Any], second: NDArray[Any] | None, decimals: int | None) -> PublishedGrid:
    values = _heitz_inverse(first)
    layout = closest([heitz_layout(p) for p in POWERS], invert_where_regular(values))
    albedo = None if second is None else np.asarray(second[..., 0], dtype=np.float64)
    fresnel = None if second is None else np.asarray(second[..., 1], dtype=np.float64)
    if fresnel is not None and not np.any(fresnel):
        fresnel = None  # an early version left the channel empty
    return PublishedGrid(layout, values, True, albedo, fresnel, decimals)


def _read_dds(file: Path, other: Path | None = None) -> Grid:
    images: list[NDArray[Any]] = []
    for path, channels in ((file, (4,)), (other, (2, 4))):
        if path is None:
            break
        try:
            image = read_dds(path.read_bytes())
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from None
        if image.ndim != 3 or image.shape[-1] not in channels or min(image.shape[:2]) < 2:
            raise ValueError(
                f"{path}: an image of shape {image.shape}, expected a flat one with"
                f" {' or '.join(map(str, channels))} channels"
            )
        images.append(image)
    first, second = images[0], images[1] if other is not None else None
    if second is not None and second.shape[:2] != first.shape[:2]:
        raise ValueError(
            f"{other}: {second.shape[:2]} texels, expected {first.shape[:2]} as in {file}"
        )
    return _heitz(first, second, None)


_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|[-+]?(?:nan|inf)(?:inity)?"


def _numbers(file: Path, name: str, body: str) -> tuple[FloatArray, int | None]:
    """Return a text array's numbers, and their decimals if all have the same, fixed."""
    words = re.findall(_NUMBER, re.sub(r"//[^\n]*|/\*.*?\*/", "", body, flags=re.S), re.I)
    if not 0 < len(words) <= _LARGEST:
        raise ValueError(f"{file}: {name} has {len(words)} numbers, expected a table")
    fixed = {len(w.partition(".")[2]) if re.fullmatch(r"[-+]?\d+\.\d+", w) else -1 for w in words}
    decimals = fixed.pop() if len(fixed) == 1 else None
    return np.array([float(w) for w in words]), None if decimals == -1 else decimals


def _square(file: Path, name: str, values: FloatArray, channels: int) -> FloatArray:
    side = round((values.size / channels) ** 0.5)
    if side < 2 or side * side * channels != values.size:
        raise ValueError(
            f"{file}: {name} has {values.size} numbers, expected {channels} for every entry of"
            " a square table"
        )
    return values.reshape(side, side, channels)


def _read_js(file: Path) -> Grid:
    text = file.read_text(encoding="utf-8", errors="replace")
    arrays, fixed = {}, []
    for name in ("g_ltc_1", "g_ltc_2"):
        found = re.search(rf"\b{name}\s*=\s*\[(.*?)\]", text, re.S)
        if found is None:
            if name == "g_ltc_2":
                break
            raise ValueError(f"{file}: no array {name!r}, expected the table of Heitz et al.")
        values, decimals = _numbers(file, name, found[1])
        arrays[name] = _square(file, name, values, 4)
        fixed.append(decimals)
    first, second = arrays["g_ltc_1"], arrays.get("g_ltc_2")
    if second is not None and second.shape != first.shape:
        raise ValueError(f"{file}: g_ltc_2 has {second.size} numbers, g_ltc_1 {first.size}")
    return _heitz(first, second, fixed[0])


def _read_inc(file: Path) -> Grid:
    text = file.read_text(encoding="utf-8", errors="replace")
    bodies = {
        name: found[1]
        for name in ("tabM", "tabMagnitude", "tabAmplitude")
        if (found := re.search(rf"\b{name}\s*\[[^\]]*\]\s*=\s*\{{(.*?)\}}\s*;", text, re.S))
    }
    if "tabM" not in bodies:
        raise ValueError(f"{file}: no array 'tabM', expected the table of Heitz et al.")
    values, decimals = _numbers(file, "tabM", bodies.pop("tabM"))
    entries = _square(file, "tabM", values, 9)
    side = len(entries)
    matrix = np.swapaxes(entries.reshape(side, side, 3, 3), -1, -2)  # stored column by column
    albedo = None
    for name, body in bodies.items():
        albedo = _square(file, name, _numbers(file, name, body)[0], 1)[..., 0]
        if albedo.shape != (side, side):
            raise ValueError(f"{file}: {name} has {albedo.size} entries, tabM {side * side}")
    layout = closest([heitz_layout(p) for p in POWERS], matrix)
    return PublishedGrid(layout, matrix, False, albedo, None, decimals)


def _read_npy(file: Path, *others: Path) -> Grid:
    arrays = []
    for path in (file, *others):
        try:
            array = np.load(io.BytesIO(path.read_bytes()), allow_pickle=False)
        except (ValueError, EOFError) as error:
            raise ValueError(f"{path}: not an array of numbers ({error})") from None
        if not isinstance(array, np.ndarray) or array.dtype.kind != "f" or array.size > _LARGEST:
            raise ValueError(f"{path}: not an array of floats, expected a table")
        arrays.append(array.astype(np.float64))
    matrix, *rest = arrays
    shape = matrix.shape[:-2]
    if matrix.ndim not in (4, 6) or matrix.shape[-2:] != (3, 3) or min(shape) < 2:
        raise ValueError(
            f"{file}: shape {matrix.shape}, expected (alpha, lambda, theta, phi, 3, 3) or"
            " (alpha, theta, 3, 3)"
        )
    for path, array in zip(others, rest, strict=True):
        if array.shape != shape:
            raise ValueError(f"{path}: shape {array.shape}, expected {shape} as {file}")
    if len(shape) == 2:
        layouts = [kt_isotropic_layout(p) for p in POWERS]
    else:
        layouts = [
            kt_layout(p, ratio, circle)
            for p in POWERS
            for ratio in (True, False)
            for circle in (False, True)
        ]
    albedo, fresnel = (*rest, None, None)[:2]
    return PublishedGrid(closest(layouts, matrix), matrix, False, albedo, fresnel)
