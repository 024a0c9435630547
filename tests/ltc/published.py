"""Tables in published layouts, sound ones, to be broken by tests.

The lobes are the closed form's, tilted where they would reach below the surface;
amplitudes are exact.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ltc import brdf
from ltc.containers import dds_bytes
from ltc.formats import Layout, heitz_layout, kt_layout
from ltc.table import closed_form_guess

FloatArray = NDArray[np.float64]


class Table(NamedTuple):
    """M (*shape, 3, 3), A and B (*shape) at the nodes of a layout."""

    matrix: FloatArray
    albedo: FloatArray
    fresnel: FloatArray

    def copy(self) -> Table:
        return Table(*(a.copy() for a in self))


def grid(shape: tuple[int, ...]) -> FloatArray:
    axes = [np.linspace(0.0, 1.0, n) for n in shape]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)


def lobes(layout: Layout, shape: tuple[int, ...], widen: float = 1.0) -> FloatArray:
    """Return GGX's closed form with little mass below the surface."""
    M = closed_form_guess(*layout.configuration(grid(shape)))
    M[..., :2] *= widen
    row = M[..., 2, :2]
    tilt = np.sqrt(np.sum(row * row, axis=-1))
    limit = 0.35 * M[..., 2, 2]  # leaves (1 - 1/sqrt(1 + .35^2)) / 2 = 2.8 % below
    M[..., 2, :2] *= np.minimum(1.0, limit / np.maximum(tilt, 1e-300))[..., None]
    return M


@cache
def _sound(layout: str, shape: tuple[int, ...]) -> Table:
    made = {"heitz": heitz_layout(), "kt": kt_layout(), "circle": kt_layout(circle=True)}[layout]
    ax, ay, wo = made.configuration(grid(shape))
    return Table(lobes(made, shape), *brdf.directional_albedo(wo, ax, ay, step=0.25))


def sound(layout: str, shape: tuple[int, ...]) -> Table:
    """Return a table without faults: layout "heitz", "kt" or "circle"."""
    return _sound(layout, shape).copy()


def heitz_images(table: Table) -> tuple[FloatArray, FloatArray]:
    """Return the two images of Heitz et al."""
    inverse = np.linalg.inv(table.matrix)
    inverse = inverse / inverse[..., 1:2, 1:2]
    first = np.stack([inverse[..., i, j] for i, j in ((0, 0), (2, 0), (0, 2), (2, 2))], axis=-1)
    zero = np.zeros_like(table.albedo)
    return first, np.stack([table.albedo, table.fresnel, zero, zero], axis=-1)


def write_dds(folder: Path, table: Table) -> list[Path]:
    paths = [folder / "ltc_1.dds", folder / "ltc_2.dds"]
    for path, image in zip(paths, heitz_images(table), strict=True):
        path.write_bytes(dds_bytes(image.astype(np.float32)))
    return paths


def write_js(folder: Path, table: Table) -> list[Path]:
    lines = []
    for i, image in enumerate(heitz_images(table), 1):
        lines.append(f"var g_ltc_{i} = [")
        lines += [", ".join(f"{x:.6g}" for x in texel) + ", " for texel in image.reshape(-1, 4)]
        lines.append("];")
    (folder / "ltc.js").write_text("\n".join(lines))
    return [folder / "ltc.js"]


def write_inc(folder: Path, table: Table, number: str = ".9g") -> list[Path]:
    """As Heitz et al. do with ``number`` ".6f"."""
    size = len(table.matrix)
    lines = [f"static const int size = {size};", ""]
    inverse = np.linalg.inv(table.matrix)
    for name, m in (("tabM", table.matrix), ("tabMinv", inverse)):
        lines.append(f"static const mat33 {name}[size*size] = {{")
        columns = np.swapaxes(m, -1, -2).reshape(-1, 9)
        lines += ["{" + ", ".join(f"{x:{number}}" for x in entry) + "}, " for entry in columns]
        lines += ["};", ""]
    lines.append("static const float tabMagnitude[size*size] = {")
    lines += [f"{x:{number}}f, " for x in table.albedo.ravel()]
    lines.append("};")
    (folder / "ltc.inc").write_text("\n".join(lines))
    return [folder / "ltc.inc"]


def write_npy(folder: Path, table: Table, fresnel: bool = True) -> list[Path]:
    M = table.matrix.copy()
    usable = np.all(np.isfinite(M), axis=(-2, -1)) & np.any(M[..., 2] != 0.0, axis=-1)
    M[usable] /= np.linalg.norm(M[usable][..., 2:], axis=-2, keepdims=True)
    arrays = {"matrix": M, "amplitude": table.albedo}
    if fresnel:
        arrays["fresnel"] = table.fresnel
    paths = []
    for name, values in arrays.items():
        paths.append(folder / f"{name}.npy")
        with np.errstate(under="ignore"):
            np.save(paths[-1], values.astype(np.float32))
    return paths
