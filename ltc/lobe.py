"""GGX's lobe beside the transformed cosine that stands for it, for one material and view.

What is compared, over directions w above the surface [1/sr]
    GGX   g(w) = f(wo, w) w_z with F = 1 (`ltc.brdf.evaluate`); its integral is the exact
          directional albedo.
    LTC   l(w) = A D(w) / (1 - leak): what the technique ``ltc`` integrates over a light, with
          the table's A and M (`ltc.polygon.ltc_specular`); its integral is A.

    Equal alphas are looked up in the isotropic table as the GPU samples it, others in the
    anisotropic one. The frame is the tangent frame in either case.

The disk
    Lambert's azimuthal equal-area projection of the hemisphere, seen from above: x to the
    right, y up, radius sqrt(1 - w_z), so that the horizon is the unit circle. Equal areas
    are equal solid angles, 2 sr for an area of 1: what looks like much of the disk is much of
    the light of a white sky.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ltc import brdf, transform
from ltc.anisotropic import AnisotropicTable, load_anisotropic, view_direction
from ltc.table import ALPHA_MIN, Textures, load_isotropic, sample_textures

FloatArray = NDArray[np.float64]

THETA_MAX = np.radians(89.99)
"""Largest angle between view and normal [rad]: GGX has no lobe at the horizon itself."""

STRATA = 48
"""Rows and columns of the grid of samples of each lobe that its figures are computed from."""

MARGIN = 1.3
"""Side of a `Window` over that of the square around all but few of both lobes' samples."""

_FEW = 0.02  # share of samples that may lie off each side of that square


@dataclass(frozen=True, slots=True)
class Case:
    """A material and a view.

    Attributes
    ----------
    alpha_x, alpha_y : float
        GGX parameters along tangent and bitangent, in [ALPHA_MIN, 1].
    theta : float
        Angle between view and normal [rad], in [0, THETA_MAX].
    phi : float
        Azimuth of the view from the tangent [rad].

    Raises
    ------
    ValueError
        Naming the number that is out of range.
    """

    alpha_x: float
    alpha_y: float
    theta: float
    phi: float = 0.0

    def __post_init__(self) -> None:
        for name, value, low, high in (
            ("alpha_x", self.alpha_x, ALPHA_MIN, 1.0),
            ("alpha_y", self.alpha_y, ALPHA_MIN, 1.0),
            ("theta", self.theta, 0.0, THETA_MAX),
            ("phi", self.phi, -1e3, 1e3),
        ):
            if not low <= value <= high:
                raise ValueError(f"{name} is {value:g}, expected {low:g} to {high:g}")

    @property
    def is_anisotropic(self) -> bool:
        """Whether the alphas differ."""
        return self.alpha_x != self.alpha_y

    @property
    def wo(self) -> FloatArray:
        """Unit direction to the viewer, (3,)."""
        return view_direction(np.cos(self.theta), self.phi)

    @property
    def mirror(self) -> FloatArray:
        """The view mirrored about the normal, (3,)."""
        return np.asarray(self.wo * np.array([-1.0, -1.0, 1.0]))


@dataclass(frozen=True, slots=True)
class Window:
    """A square of the disk: its centre, and by how much it is smaller than the whole."""

    x: float = 0.0
    y: float = 0.0
    zoom: int = 1

    @property
    def half(self) -> float:
        """Half the side."""
        return 1.0 / self.zoom


WHOLE = Window()
"""All of the disk."""


@dataclass(frozen=True, slots=True, eq=False)
class LobePair:
    """Both lobes of a case, and how much they differ.

    Attributes
    ----------
    case : Case
    table : str
        The file that the transform is looked up in, without its folder.
    M : (3, 3) float64
        ``shading_from_cosine`` in the tangent frame, third column of unit length.
    albedo, exact_albedo : float
        Directional albedo for F = 1 by the table, and exact.
    leak : float
        Share of the transformed cosine below the surface.
    variation : float
        Total variation between the two, each normalised above the surface: 0 for equal lobes,
        1 for lobes that share nothing; to .003 (see `lobe_pair`).
    peak : float
        Largest value of either lobe at their samples [1/sr].
    window : Window
        What of the disk to look at to see both lobes.
    """

    case: Case
    table: str
    M: FloatArray
    albedo: float
    exact_albedo: float
    leak: float
    variation: float
    peak: float
    window: Window

    def ggx(self, w: ArrayLike) -> FloatArray:
        """Return GGX in unit directions w (..., 3), zero below the surface [1/sr]."""
        return brdf.evaluate(self.case.wo, w, self.case.alpha_x, self.case.alpha_y)

    def ltc(self, w: ArrayLike) -> FloatArray:
        """Return the transformed cosine in unit directions w (..., 3), likewise [1/sr]."""
        return _transformed(np.asarray(w), self.M, self.albedo / (1.0 - self.leak))


def lobe_pair(
    case: Case, isotropic: Textures | None = None, anisotropic: AnisotropicTable | None = None
) -> LobePair:
    """Return both lobes of a case.

    Parameters
    ----------
    case : Case
    isotropic, anisotropic : optional
        The tables' textures and table; by default those shipped with the program.

    Raises
    ------
    FileNotFoundError, ValueError
        If a shipped table is missing or damaged.

    Notes
    -----
    The figures come from a regular grid of samples of each lobe, weighed against the density
    of both (Veach and Guibas 1995, the balance heuristic): however narrow a lobe is, that is
    where its share of the difference lies. Against 150 times the samples the total
    variation errs by .0004 in the mean and .003 at most (120 cases, alphas from .001).
    """
    wo, ax, ay = case.wo, case.alpha_x, case.alpha_y
    cosine = float(wo[2])
    if case.is_anisotropic:
        table = anisotropic or _shipped_anisotropic()
        M = table.matrix_of_view(ax, ay, wo)
        A = float(table.albedo_terms_of_view(ax, ay, wo)[0])
    else:
        M, albedo, _ = sample_textures(isotropic or _shipped_isotropic(), ax, cosine)
        M, A = about_normal(case.phi) @ M, float(albedo)
    leak = float(transform.leak(M))
    exact = float(brdf.directional_albedo(wo, ax, ay)[0])

    u = (np.arange(STRATA) + 0.5) / STRATA
    grid = np.stack(np.meshgrid(u, u, indexing="ij"), axis=-1).reshape(-1, 2)
    normals = brdf.sample_visible_normals(wo, grid, ax, ay)
    w = np.concatenate([brdf.reflect(wo, normals), transform.sample(grid, M)])
    w = w[w[:, 2] > 0.0]
    g, q = brdf.evaluate(wo, w, ax, ay), _transformed(w, M, 1.0)
    density = brdf.pdf(wo, w, ax, ay) + q
    difference = np.abs(g / exact - q / (1.0 - leak))
    variation = 0.5 * float(np.sum(difference / density)) / len(grid)
    return LobePair(
        case,
        "ltc_anisotropic.npz" if case.is_anisotropic else "ltc_isotropic.npz",
        M,
        A,
        exact,
        leak,
        variation,
        max(float(np.max(g)), float(np.max(q)) * A / (1.0 - leak)),
        _window(disk_from_direction(w)),
    )


def about_normal(phi: float) -> FloatArray:
    """Return the matrix that turns directions about +z by phi [rad], (3, 3)."""
    c, s = np.cos(phi), np.sin(phi)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def disk_from_direction(w: ArrayLike) -> FloatArray:
    """Return the places in the disk, (..., 2), of unit directions w (..., 3), w_z >= 0.

    sqrt(1 - z) times the azimuth's direction, written xy / sqrt(1 + z), which loses
    nothing near the normal.
    """
    w = np.asarray(w, dtype=np.float64)
    return np.asarray(w[..., :2] / np.sqrt(1.0 + w[..., 2:]))


def direction_from_disk(p: ArrayLike) -> FloatArray:
    """Return the unit directions (..., 3) at places p (..., 2) of the unit disk."""
    p = np.asarray(p, dtype=np.float64)
    r2 = np.sum(p * p, axis=-1, keepdims=True)
    return np.concatenate([p * np.sqrt(np.maximum(2.0 - r2, 0.0)), 1.0 - r2], axis=-1)


def pixel_directions(size: int, window: Window = WHOLE) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return the directions of a square picture's pixels, and which are above the surface.

    Parameters
    ----------
    size : int
        Pixels on each side.
    window : Window
        What of the disk the picture shows.

    Returns
    -------
    directions : (n, 3) float64
        Of the pixels' centres, those of True pixels only, row by row.
    inside : (size, size) bool
        Row 0 at the top.
    """
    step = (2.0 * np.arange(size) + 1.0) / size - 1.0
    x, y = np.meshgrid(window.x + window.half * step, window.y - window.half * step)
    inside = x * x + y * y < 1.0
    return direction_from_disk(np.stack([x[inside], y[inside]], axis=-1)), inside


def pictures(pair: LobePair, size: int, window: Window = WHOLE) -> tuple[FloatArray, FloatArray]:
    """Return GGX and LTC at the pixels of a square picture, (size, size) each [1/sr].

    NaN outside the disk; arguments as for `pixel_directions`.
    """
    w, inside = pixel_directions(size, window)
    ggx, ltc = np.full((2, size, size), np.nan)
    ggx[inside], ltc[inside] = pair.ggx(w), pair.ltc(w)
    return ggx, ltc


def _transformed(w: FloatArray, M: FloatArray, gain: float) -> FloatArray:
    """Return gain times the transformed cosine, zero below the surface."""
    return np.where(w[..., 2] > 0.0, gain * transform.evaluate(w, M), 0.0)


def _window(p: FloatArray) -> Window:
    """Return the window around all but few of the places p (n, 2); its zoom is a power of 2."""
    low, high = np.quantile(p, (_FEW, 1.0 - _FEW), axis=0)
    extent = 0.5 * MARGIN * float(np.max(high - low))
    zoom = 2 ** int(np.clip(np.floor(-np.log2(max(extent, 1e-9))), 0.0, 16.0))
    reach = 1.0 - 1.0 / zoom
    x, y = np.clip(0.5 * (low + high), -reach, reach).tolist()
    return Window(x, y, zoom)


@lru_cache(maxsize=1)
def _shipped_isotropic() -> Textures:
    return load_isotropic().textures()


@lru_cache(maxsize=1)
def _shipped_anisotropic() -> AnisotropicTable:
    return load_anisotropic()
