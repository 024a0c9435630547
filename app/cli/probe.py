"""``ltc-viewer probe``: shade given points on the GPU, for measurements."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from numpy.typing import NDArray

from app.cli.common import (
    SceneArgument,
    Steps,
    TechniqueOption,
    headless_renderer,
    messages,
    named_scene,
    whole_number,
)
from app.errors import InputError, nearest, os_reason, require_file
from app.files import check_output, replace_file
from app.json_reader import LARGEST_NUMBER
from app.render.techniques import AUTOMATIC, find_technique, suited_technique
from app.scene import ALPHA_MIN, MAX_SAMPLES, RenderSettings

FloatArray = NDArray[np.float64]

COLUMNS = {"position": 3, "normal": 3, "tangent": 3, "view": 3, "alpha": 2}
"""The arrays of a point file and their second dimension."""

UNIT_TOLERANCE = 1e-3
"""Directions whose length is off by less are normalised, others refused."""

BATCH = 2**20
"""Points that go to the GPU at once."""


def probe(
    scene: SceneArgument,
    points: Annotated[
        str, typer.Argument(metavar="POINTS.npz", help="The points to shade.", show_default=False)
    ],
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="OUT.npz", help="File of results to write.")
    ],
    technique: TechniqueOption = AUTOMATIC,
    samples: Annotated[
        int,
        typer.Option(
            "--samples",
            metavar="N",
            help="Estimates to average at each point, with technique reference.",
            parser=whole_number("--samples", 1, MAX_SAMPLES),
        ),
    ] = 64,
) -> None:
    """Shade given points on the GPU with the functions of the lighting pass.

    POINTS.npz holds position, normal, tangent and view, each (n, 3), and alpha
    (n, 2): metres in world space; view is the unit vector to the eye. OUT.npz gets
    specular and diffuse, (n, 3) float32 radiance of a white material (F = 1,
    albedo 1) summed over the scene's lights, and the name of the technique.
    Directions off unit length by up to 0.001 are normalised, others are
    errors; the tangent is made perpendicular to the normal. A view from below
    the surface is shaded as the lighting pass shades one: as if at grazing.

    \b
    Example:
      ltc-viewer probe scene.json points.npz -o radiance.npz
    """
    suited_technique(technique, anisotropic=False)
    check_output(output, "an array file", (".npz",))
    arrays = read_points(Path(points))
    wanted = named_scene(scene)
    count = len(arrays["position"])
    anisotropic = int(np.count_nonzero(arrays["alpha"][:, 0] != arrays["alpha"][:, 1]))
    technique = suited_technique(technique, anisotropic > 0)
    settings = RenderSettings(technique, samples)
    if anisotropic and not find_technique(technique).anisotropic:
        messages().print(
            f"{anisotropic} of {count} points are anisotropic: technique {technique} shades them "
            "with alpha = sqrt(alpha_x alpha_y)."
        )
    specular = np.zeros((count, 3), dtype=np.float32)
    diffuse = np.zeros((count, 3), dtype=np.float32)
    with headless_renderer() as (_, renderer), Steps("shading points", count) as steps:
        for start in range(0, count, BATCH):
            part = slice(start, start + BATCH)
            found = renderer.probe(
                wanted,
                settings,
                anisotropic=anisotropic > 0,
                **{name: array[part] for name, array in arrays.items()},
            )
            specular[part], diffuse[part] = found["specular"], found["diffuse"]
            steps.done(min(start + BATCH, count))
    buffer = io.BytesIO()
    np.savez(buffer, specular=specular, diffuse=diffuse, technique=np.array(technique))
    replace_file(output, buffer.getvalue(), "an array file")
    typer.echo(output)


def read_points(path: Path) -> dict[str, FloatArray]:
    """Read and check a point file.

    Returns
    -------
    dict
        The arrays of `COLUMNS` as float64; ``normal``, ``tangent`` and ``view``
        unit to rounding, ``tangent`` perpendicular to ``normal``.

    Raises
    ------
    InputError
        Naming the file, the array and the row.
    """
    require_file(path, "a point file (.npz)")
    arrays = {name: _array(path, name, raw) for name, raw in _raw_arrays(path).items()}
    count = len(arrays["position"])
    for name, array in arrays.items():
        if len(array) != count:
            raise InputError(
                f"{path}: {name} has {len(array)} rows, expected {count} as in position"
            )
    for name in ("normal", "tangent", "view"):
        arrays[name] = _unit(path, name, arrays[name])
    arrays["tangent"] = _perpendicular(path, arrays["tangent"], arrays["normal"])
    _require(
        path,
        "alpha",
        arrays["alpha"],
        np.all((arrays["alpha"] >= ALPHA_MIN) & (arrays["alpha"] <= 1.0), axis=1),
        f"expected values between {ALPHA_MIN:g} and 1",
    )
    return arrays


def _raw_arrays(path: Path) -> dict[str, NDArray[np.generic]]:
    try:
        with path.open("rb") as file:
            loaded = np.load(file, allow_pickle=False)
            if not isinstance(loaded, np.lib.npyio.NpzFile):
                raise InputError(f"{path}: found a single array, expected an .npz of several")
            for name in COLUMNS:
                if name not in loaded.files:
                    guess = nearest(name, loaded.files)
                    meant = f" (did you mean it by '{guess}'?)" if guess else ""
                    raise InputError(
                        f"{path}: found the arrays {', '.join(loaded.files) or 'none'}, "
                        f"expected one named {name}{meant}"
                    )
            return {name: loaded[name] for name in COLUMNS}
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({os_reason(error)}), expected .npz") from error
    except (ValueError, EOFError, KeyError, zipfile.BadZipFile, MemoryError) as error:
        raise InputError(
            f"{path}: the file is damaged or no .npz, expected arrays written by numpy.savez"
        ) from error


def _array(path: Path, name: str, raw: NDArray[np.generic]) -> FloatArray:
    columns = COLUMNS[name]
    if raw.ndim != 2 or raw.shape[1] != columns:
        raise InputError(f"{path}: {name} has shape {raw.shape}, expected (n, {columns})")
    if raw.dtype.kind not in "fiu":
        raise InputError(f"{path}: {name} has type {raw.dtype}, expected real numbers")
    array = raw.astype(np.float64)
    finite = np.asarray(np.isfinite(array).all(axis=1))
    _require(path, name, array, finite, "expected finite numbers")
    within = np.asarray((np.abs(array) <= LARGEST_NUMBER).all(axis=1))
    _require(path, name, array, within, f"expected at most {LARGEST_NUMBER:g}")
    return array


def _require(
    path: Path, name: str, array: FloatArray, good: NDArray[np.bool_], expected: str
) -> None:
    """Name the first row of ``array`` that is not ``good``."""
    if not good.all():
        row = int(np.flatnonzero(~good)[0])
        found = ", ".join(f"{x:g}" for x in array[row])
        raise InputError(f"{path}: {name}[{row}] is ({found}), {expected}")


def _unit(path: Path, name: str, array: FloatArray) -> FloatArray:
    length = np.linalg.norm(array, axis=1)
    _require(
        path, name, array, np.abs(length - 1.0) <= UNIT_TOLERANCE, "expected vectors of length 1"
    )
    return np.asarray(array / length[:, None], dtype=np.float64)


def _perpendicular(path: Path, tangent: FloatArray, normal: FloatArray) -> FloatArray:
    rejected = tangent - normal * np.sum(normal * tangent, axis=1, keepdims=True)
    length = np.linalg.norm(rejected, axis=1)
    _require(
        path,
        "tangent",
        tangent,
        length > UNIT_TOLERANCE,
        "which is parallel to the normal, expected another direction",
    )
    return np.asarray(rejected / length[:, None], dtype=np.float64)
