"""Tables for other programs: ``python -m ltc export TABLE -o FILE``.

The ending of the file's name chooses what is written:

=============  ====================================================================
``.dds``       a DDS file for each texture, extended header, floats of 16 or 32 bits
``.ktx2``      a KTX2 file for each texture
``.exr``       an EXR picture for each texture, slices of a volume one below the other
``.npz``       all textures, and what they are, as text
``.h``         C arrays of float
``.js``        an ECMAScript module with Float32Array
``.glsl``      code that samples the textures; also ``.hlsl`` and ``.wgsl``
=============  ====================================================================

Where a file holds one texture, its name is put before the ending:
``ggx.dds`` becomes ``ggx.residual.dds`` and ``ggx.albedo.dds``.

Numbers in text are the shortest that read back as the same float. Six
decimals, as one published table was written with, leave nothing of a
column of 5e-8 and make matrices singular.
"""

from __future__ import annotations

import argparse
import re
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ltc import formats
from ltc.containers import Image, dds_bytes, ktx2_bytes
from ltc.formats import AnisotropicGrid, Grid, IsotropicGrid, PublishedGrid
from ltc.snippets import LANGUAGES, anisotropic_snippet, isotropic_snippet
from ltc.table import npz_bytes, write_atomically

ENDINGS = (".dds", ".ktx2", ".exr", ".npz", ".h", ".js", *(f".{name}" for name in LANGUAGES))
_BINARY = (".dds", ".ktx2", ".exr", ".npz")


def textures(grid: Grid) -> dict[str, Image]:
    """Return what a GPU samples of a table, by name.

    Returns
    -------
    dict of str to array
        This project's isotropic table: ``residual``, ``albedo``; its anisotropic one:
        ``residual_1``, ``residual_2``, ``albedo``. Layouts of Heitz et al.:
        ``ltc_1`` as published and ``ltc_2`` with A and B. Of KT et al.:
        ``matrix_1`` to ``matrix_3``, volumes of depth alpha and lambda, height theta,
        width phi, with the matrix row by row, then A, B and 0.

    Raises
    ------
    ValueError
        If the table lacks a part or has numbers that are not finite.
    """
    if isinstance(grid, IsotropicGrid):
        residual, albedo = grid.textures
        return {"residual": residual, "albedo": albedo}
    if isinstance(grid, AnisotropicGrid):
        first, second, pair = grid.table.textures()
        return {"residual_1": first, "residual_2": second, "albedo": pair}
    if not isinstance(grid, PublishedGrid):
        raise ValueError(f"no textures are known for a table of layout {grid.layout!r}")
    A = np.zeros(grid.shape) if grid.albedo is None else grid.albedo
    B = np.zeros(grid.shape) if grid.fresnel is None else grid.fresnel
    found: dict[str, NDArray[np.float64]] = {}
    if grid.anisotropic:
        flat = grid.values.reshape(-1, *grid.shape[2:], 9)
        parts = [flat, *(x.reshape(flat.shape[:-1])[..., None] for x in (A, B, 0.0 * A))]
        whole = np.concatenate(parts, axis=-1)
        found = {f"matrix_{i + 1}": whole[..., 4 * i : 4 * i + 4] for i in range(3)}
    else:
        inverse = grid.values if grid.inverse else formats.invert_where_regular(grid.values)
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = inverse / inverse[..., 1:2, 1:2]
        entries = ((0, 0), (2, 0), (0, 2), (2, 2))
        found["ltc_1"] = np.stack([inverse[..., i, j] for i, j in entries], axis=-1)
        found["ltc_2"] = np.stack([A, B], axis=-1)
    result = {}
    for name, values in found.items():
        if not np.all(np.isfinite(values)):
            place = [int(i) for i in np.argwhere(~np.isfinite(values))[0][:-1]]
            raise ValueError(f"entry {place} of {name} is no number or has no inverse")
        with np.errstate(under="ignore"):
            result[name] = values.astype(np.float32)
    return result


def halves(images: Mapping[str, Image]) -> dict[str, Image]:
    """Return textures as half floats.

    Raises
    ------
    ValueError
        If a number is too large for one, or a texel of matrices would become all zero.
    """
    result = {}
    for name, image in images.items():
        with np.errstate(over="ignore", under="ignore"):
            half = image.astype(np.float16)
        if not np.all(np.isfinite(half)):
            raise ValueError(f"{name} goes up to {np.max(np.abs(image)):.4g}, halves to 65504")
        lost = np.any(image != 0.0, axis=-1) & np.all(half == 0.0, axis=-1)
        if np.any(lost):
            place = [int(i) for i in np.argwhere(lost)[0]]
            raise ValueError(f"texel {place} of {name} is too small for half floats")
        result[name] = half
    return result


def notes(grid: Grid, images: Mapping[str, Image]) -> list[str]:
    """Return what the textures are, as lines of text."""
    lines = [f"Linearly transformed cosines of GGX: {grid.layout}."]
    if isinstance(grid, IsotropicGrid):
        lines += [
            "Column: x = sqrt(alpha), alpha the GGX parameter, 1e-4 or more.",
            "Row: y = p / (p + r), p = sqrt(alpha (1 - c)), r = sqrt(c (1 + alpha)),",
            "c the cosine between view and normal.",
            "residual: X00, X02 / s, X11, X20 / s of M = M0 (I + X), s = sqrt(1 - c c).",
            "albedo: A, and u with B = A (1 - q u)^5, q = sqrt(alpha^2 s^2 + c^2).",
        ]
    elif isinstance(grid, AnisotropicGrid):
        n, m = grid.table.residual.shape, grid.table.albedo.shape
        lines += [
            "Axes, a of the larger alpha: azimuth |v_b| / (|v_a| + |v_b|); ratio (sqrt(alpha_b /",
            f"alpha_a) - w) / (1 - w), w = {formats.smallest_ratio_root()}, at least 0; view",
            "p / (p + r), p = sqrt(e (1 - c)), r = sqrt(c (1 + e)), c = v_z,",
            "e = |(alpha_x v_x, alpha_y v_y)| / |(v_x, v_y)|; sqrt(alpha_a).",
            "residual_1, residual_2: p, d, r, e_a and e_b, g_a, g_b, 0 of M = M0 (I + X);",
            f"nodes {n[0]} {n[1]} {n[2]} {n[3]}; depth: slabs of one azimuth, ratios within.",
            f"albedo: A, u with B = A (1 - q u)^5; nodes {m[0]} {m[1]} {m[2]} {m[3]}.",
        ]
    elif grid.anisotropic:
        lines += [
            f"Axes: {', '.join(grid.axes)}, {' '.join(map(str, grid.shape))} nodes.",
            "matrix_1 to matrix_3: M row by row, A, B, 0.",
        ]
    else:
        lines += [
            f"Axes: {', '.join(grid.axes)}.",
            "ltc_1: 00, 20, 02, 22 (row, column) of M^-1 over its middle entry. ltc_2: A, B.",
        ]
    if isinstance(grid, PublishedGrid):
        missing = [n for n, x in (("A", grid.albedo), ("B", grid.fresnel)) if x is None]
        lines += [f"The table has no {name}: zeros." for name in missing]
    lines.append("Nodes are texel centres, ends included: coordinate t is texel t (n - 1).")
    for name, image in images.items():
        size = " x ".join(str(n) for n in image.shape[-2::-1])
        lines.append(f"{name}: {size} texels (width first), {image.shape[-1]} channels.")
    return lines


def files(grid: Grid, output: Path, half: bool = False) -> dict[Path, bytes]:
    """Return the files that an export consists of, and their contents.

    Parameters
    ----------
    grid : Grid
        From `ltc.formats.read`.
    output : Path
        Its ending, one of `ENDINGS`, chooses the format.
    half : bool
        Write half floats (binary formats only).

    Raises
    ------
    ValueError
        If the ending is unknown, the table does not fit the format, or EXR is asked
        for without OpenEXR.
    """
    ending = output.suffix.lower()
    if ending not in ENDINGS:
        raise ValueError(f"{output}: ends in {output.suffix!r}, expected {', '.join(ENDINGS)}")
    if ending[1:] in LANGUAGES:
        return {output: snippet(grid, ending[1:]).encode()}
    images = textures(grid)
    told = notes(grid, images)
    if half and ending not in _BINARY:
        raise ValueError(f"half floats are for {', '.join(_BINARY)}; text has all digits")
    if half:
        images = halves(images)
    if ending == ".npz":
        arrays: dict[str, NDArray[Any]] = dict(images)
        arrays["notes"] = np.frombuffer("\n".join(told).encode(), dtype=np.uint8)
        return {output: npz_bytes(arrays)}
    if ending == ".h":
        return {output: c_header(images, told, output.stem).encode()}
    if ending == ".js":
        return {output: javascript(images, told).encode()}
    result = {}
    for name, image in images.items():
        path = output.with_name(f"{output.stem}.{name}{output.suffix}")
        if ending == ".dds":
            result[path] = dds_bytes(image)
        elif ending == ".ktx2":
            result[path] = ktx2_bytes(image, {"ltc.notes": "\n".join(told)})
        else:
            result[path] = exr_bytes(image, told)
    return result


def snippet(grid: Grid, language: str) -> str:
    """Return code that samples a table's textures, see `ltc.snippets`.

    Raises
    ------
    ValueError
        If the table is none of this project.
    """
    if isinstance(grid, IsotropicGrid):
        residual, albedo = grid.textures
        return isotropic_snippet(language, residual.shape[0], albedo.shape[0])
    if isinstance(grid, AnisotropicGrid):
        return anisotropic_snippet(
            language, grid.shape, grid.table.albedo.shape, formats.smallest_ratio_root()
        )
    raise ValueError(
        f"shader code is written for this project's tables, not for the layout of {grid.layout}"
    )


def _rows(image: Image, suffix: str = "") -> list[str]:
    """Return one line of numbers, the shortest that read back exactly, per row of texels."""
    # Of float16 too: as float32 they are exact.
    flat = image.astype(np.float32).reshape(-1, image.shape[-2] * image.shape[-1])
    return [", ".join(str(number) + suffix for number in row) + "," for row in flat]


def c_header(images: Mapping[str, Image], told: list[str], name: str) -> str:
    """Return a C header with arrays ``ltc_NAME[...][channels]`` and their sizes."""
    guard = re.sub(r"\W", "_", f"LTC_{name}_H").upper()
    lines = [*(f"// {line}" for line in told), f"#ifndef {guard}", f"#define {guard}", ""]
    for key, image in images.items():
        sides = ("DEPTH", "HEIGHT", "WIDTH", "CHANNELS")[-image.ndim :]
        macros = [f"LTC_{key.upper()}_{side}" for side in sides]
        lines += [f"#define {m} {n}" for m, n in zip(macros, image.shape, strict=True)]
        lines.append(f"static const float ltc_{key}[{' * '.join(macros)}] = {{")
        lines += [*_rows(image, "f"), "};", ""]
    return "\n".join([*lines, "#endif", ""])


def javascript(images: Mapping[str, Image], told: list[str]) -> str:
    """Return a module that exports, for each texture, its size and a Float32Array."""
    lines = [f"// {line}" for line in told]
    for key, image in images.items():
        sides = ("depth", "height", "width", "channels")[-image.ndim :]
        sizes = ", ".join(f"{s}: {n}" for s, n in zip(sides, image.shape, strict=True))
        lines += [f"export const {key} = {{ {sizes}, data: new Float32Array(["]
        lines += [*_rows(image), "]) };"]
    return "\n".join([*lines, ""])


def exr_bytes(image: Image, told: list[str]) -> bytes:
    """Return an EXR picture, uncompressed; a volume's slices lie one below the other.

    Raises
    ------
    ValueError
        If OpenEXR is not installed.
    """
    try:
        import OpenEXR
    except ImportError:
        raise ValueError("EXR needs OpenEXR: pip install openexr") from None
    flat = image.reshape(-1, *image.shape[-2:])
    channels = {
        letter: np.ascontiguousarray(flat[..., i])
        for i, letter in enumerate("RGBA"[: flat.shape[-1]])
    }
    header = {
        "compression": OpenEXR.NO_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        "comments": "\n".join(told),
    }
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "texture.exr"
        with OpenEXR.File(header, channels) as file:
            file.write(str(path))
        return path.read_bytes()


def add_parser(commands: Any) -> None:
    """Add the subcommand to argparse's."""
    parser = commands.add_parser(
        "export",
        help="write a table for other programs",
        description="Write a table's textures, or shader code that samples them."
        f" The ending of FILE chooses the format: {' '.join(ENDINGS)}.",
        epilog="example: python -m ltc export ltc_isotropic.npz -o ggx.ktx2",
    )
    parser.add_argument(
        "files", type=Path, nargs="+", metavar="TABLE", help="as for python -m ltc check"
    )
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        required=True,
        metavar="FILE",
        help="file to write; formats of one texture a file put its name before the ending",
    )
    parser.add_argument("--half", action="store_true", help="half floats, in binary formats")


def run(arguments: argparse.Namespace) -> int:
    """Run the subcommand: write the files and print their names.

    Raises
    ------
    ValueError, OSError
        If a file or an argument is bad.
    """
    output: Path = arguments.output
    for file in arguments.files:
        if not file.is_file():
            raise ValueError(f"{file}: no such file, expected a table")
    if not output.parent.is_dir():
        raise ValueError(f"{output.parent}: no such folder, expected one to write {output.name} to")
    made = files(formats.read(arguments.files), output, arguments.half)
    for path, data in made.items():
        if path.is_dir():
            raise ValueError(f"{path}: is a folder, expected the name of a file to write")
        if any(path.exists() and path.samefile(file) for file in arguments.files):
            raise ValueError(f"{path}: is the table itself, expected another name")
        write_atomically(path, data)
        print(path)
    if output.suffix.lower()[1:] in LANGUAGES:
        print("its textures: the same command with .dds, .ktx2 or .exr", file=sys.stderr)
    return 0
