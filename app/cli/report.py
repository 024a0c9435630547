"""``ltc-viewer report``: error against run time, as one page, and every number beside it.

Each scene and technique is measured on its own and its figures are written to a file in
``parts`` at once, so that a report which was interrupted goes on where it stopped. A part says
what it was measured with; where that is not what is asked for now, it is measured again.
"""

from __future__ import annotations

import base64
import hashlib
import io
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer
from numpy.typing import NDArray

from app.cli.common import (
    SizeOption,
    TechniquesOption,
    headless_renderer,
    image_size,
    is_software,
    messages,
    named_scene,
    scene_path,
    whole_number,
)
from app.cli.folder import TimedSteps, check_folder, csv_text, machine_facts, version
from app.cli.log_plot import pareto_front
from app.cli.measure import Exact, mean_evaluations, measure_passes
from app.cli.report_page import Pictures, Row, report_page
from app.errors import InputError
from app.files import replace_file
from app.render.techniques import AUTOMATIC, find_technique, parse_technique, suited_technique
from app.scene import BezierContour, RenderSettings, Scene, Shot
from app.scene_io import demo_scenes

if TYPE_CHECKING:
    import moderngl

    from app.render.renderer import Renderer

PART_FORMAT = "ltc-report-part/1"
WARM_UP = 2
"""Frames before those measured: the first compiles, and fills caches."""

MAX_REPEATS = 100_000
MAX_POINTS = 100_000

COMPARED = (
    "ltc", "ltc:2", "ltc:3", "ltc:5", "ltc:6", "ggx:1", "ggx:2", "ggx:3", "ggx:4",
    "adaptive", "adaptive-extrapolated", "uniform:6", "uniform:18", "uniform:30", "uniform:96",
)  # fmt: skip
POLYGONS = ("ltc", "ggx:1", "ggx:2", "ggx:3", "ggx:4")
"""What is compared where no outline has curves: all else does the same there as ``ltc``."""

STANDARD = "ggx:4"
"""What pictures are compared with: within a few 1e-4 of GGX on average (docs/ggx.md), and made
in seconds, where the exact integral of every pixel would take hours."""

CROP = (160, 112)
"""Largest width and height of the pictures on the page [pixels]."""

FULL_COLOUR = 0.1
"""The difference that has the full colour, as a share of the crop's median radiance, black
left out. The median, because a light in the crop would be all that a mean or maximum shows."""

TOO_BRIGHT, TOO_DARK = (255, 140, 0), (60, 140, 255)
"""Colours that remain apart with any colour vision; no difference is black."""

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Job:
    """One scene and technique to measure; ``origin`` is what its part must have been made with."""

    name: str
    technique: str
    scene: Scene
    part: Path
    origin: dict[str, Any]


def report(
    output: Annotated[
        Path,
        typer.Option("--output", "-o", metavar="DIR", help="Folder for the page and its numbers."),
    ],
    scenes: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[SCENES]...",
            help="Scene files, or names of demo scenes.",
            show_default="all demo scenes",
        ),
    ] = None,
    techniques: TechniquesOption = [],  # noqa: B006 (typer copies it)
    size: SizeOption = "640x360",
    points: Annotated[
        int,
        typer.Option(
            "--points",
            metavar="N",
            help="Random pixels a scene that are compared with the exact integral.",
            parser=whole_number("--points", 1, MAX_POINTS),
        ),
    ] = 500,
    repeats: Annotated[
        int,
        typer.Option(
            "--repeats",
            metavar="N",
            help="Measured frames a technique.",
            parser=whole_number("--repeats", 1, MAX_REPEATS),
        ),
    ] = 10,
    again: Annotated[
        bool, typer.Option("--again", help="Measure anew what an earlier run left in DIR.")
    ] = False,
) -> None:
    """Compare techniques: how far they are from the truth, and what they cost.

    Writes index.html, one page with plots, tables and pictures that loads nothing
    from elsewhere, and all numbers as results.csv and results.json. Every technique
    that makes a difference in a scene is measured unless --technique names some.

    A run that was interrupted goes on where it stopped: what is in DIR/parts is
    measured again only if size, points, repeats, scene file, graphics device or
    version of the program are others. --again measures everything anew, which
    changed shaders, tables or meshes call for.

    \b
    Examples:
      ltc-viewer report -o report
      ltc-viewer report 02-quad 11-curvy -o report --size 320x180 --points 200
    """
    width, height = image_size(size)
    for technique in techniques:
        suited_technique(technique, anisotropic=False)
    loaded = _load(scenes or list(demo_scenes()))
    check_folder(output, "the report")
    measured: dict[Path, dict[str, Any]] = {}
    with headless_renderer() as (ctx, renderer):
        device = str(ctx.info["GL_RENDERER"])
        if is_software(device):
            renderer.use_wall_clock()
        origin = {
            "renderer": device,
            "program": version("ltc-viewer"),
            "size": [width, height],
            "points": points,
            "repeats": repeats,
        }
        jobs = [
            Job(
                name, technique, scene, output / "parts" / _part_name(name, technique),
                {**origin, "scene": digest},
            )
            for name, (scene, digest) in loaded.items()
            for technique in _techniques_of(scene, techniques)
        ]  # fmt: skip
        if not jobs:
            raise InputError(
                f"--technique is {', '.join(techniques)}, which shades no anisotropic surfaces, "
                "and all scenes have some; expected 'ggx' among them"
            )
        (output / "parts").mkdir(parents=True, exist_ok=True)
        if not again:
            measured = {job.part: part for job in jobs if (part := _read_part(job)) is not None}
        missing = [job for job in jobs if job.part not in measured]
        if len(missing) < len(jobs):
            messages().print(f"{len(jobs) - len(missing)} of {len(jobs)} parts are there already.")
        machine = machine_facts(ctx)
        _measure_all(ctx, renderer, missing, measured)
    rows = _rows(jobs, measured)
    settings = {
        "size": f"{width}x{height}", "points": points, "repeats": repeats, "warm_up": WARM_UP,
    }  # fmt: skip
    figures = {"machine": machine, "settings": settings, "rows": rows}
    page = report_page(
        rows,
        {
            (job.name, job.technique): Pictures(part["picture"], part["difference"])
            for job in jobs
            for part in [measured[job.part]]
        },
        machine,
        settings,
        f"Where ltc (or ggx:1 where surfaces are anisotropic) differs most from {STANDARD}: left "
        f"the picture, right its difference from {STANDARD}, which itself is within a few 1e-4 of "
        "GGX; orange is too bright, blue too dark, in full colour at "
        f"{FULL_COLOUR:.0%} of the crop's median radiance.",
    )
    for name, text in (
        ("results.json", json.dumps(figures, indent=2, allow_nan=False) + "\n"),
        ("results.csv", csv_text(rows)),
        ("index.html", page),
    ):
        replace_file(output / name, text.encode("utf-8"), "a report")
    typer.echo(output / "index.html")


def _load(names: Sequence[str]) -> dict[str, tuple[Scene, str]]:
    """Return scenes by the name that they have in the report, and digests of their files."""
    found: dict[str, tuple[Scene, str]] = {}
    for name in names:
        path = scene_path(name)
        scene = named_scene(name)
        if path.stem in found:
            raise InputError(
                f"{path}: another scene of this report is named '{path.stem}' too, expected names "
                "that differ"
            )
        found[path.stem] = scene, hashlib.sha256(path.read_bytes()).hexdigest()
    return found


def _techniques_of(scene: Scene, wanted: Sequence[str]) -> list[str]:
    """Return the techniques to compare in a scene: those wanted that can shade it, or all."""
    used = scene.object_materials()
    anisotropic = any(m.is_anisotropic and any(m.f0) for m in used)
    contours = (c for light in scene.lights for c in light.outline.contours)
    curved = any(isinstance(contour, BezierContour) for contour in contours)
    names = wanted or (COMPARED if curved else POLYGONS)
    resolved = [suited_technique(n, anisotropic) if n == AUTOMATIC else n for n in names]
    able = [n for n in resolved if find_technique(n).anisotropic or not anisotropic]
    # "ltc:4" is "ltc": the same is not measured twice.
    return list({str(parse_technique(n)): n for n in reversed(able)}.values())[::-1]


def _part_name(scene: str, technique: str) -> str:
    return f"{scene}--{technique.replace(':', '-')}.json"


def _read_part(job: Job) -> dict[str, Any] | None:
    """Return what an earlier run measured, or None if there is nothing that can be used."""
    try:
        part = json.loads(job.part.read_text(encoding="utf-8"))
        usable = part["format"] == PART_FORMAT and part["origin"] == job.origin
        usable = usable and {"figures", "picture", "difference"} <= set(part)
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return part if usable else None


def _measure_all(
    ctx: moderngl.Context,
    renderer: Renderer,
    jobs: Sequence[Job],
    measured: dict[Path, dict[str, Any]],
) -> None:
    """Measure jobs, write a part for each, and add it to ``measured``."""
    with TimedSteps("measuring", "measured", len(jobs)) as steps:
        comparison: _Comparison | None = None
        for index, job in enumerate(jobs, start=1):
            if comparison is None or comparison.scene is not job.scene:
                comparison = _Comparison(renderer, job)
            part = {
                "format": PART_FORMAT,
                "origin": job.origin,
                **_measure(ctx, renderer, job, comparison),
            }
            text = json.dumps(part, indent=1, allow_nan=False) + "\n"
            replace_file(job.part, text.encode("utf-8"), "a part of a report")
            # As read again, so that a resumed report has the very same figures.
            measured[job.part] = json.loads(text)
            steps.done(index)


class _Comparison:
    """What all techniques of a scene are compared with: exact integrals, and a picture."""

    def __init__(self, renderer: Renderer, job: Job) -> None:
        self.scene = job.scene
        width, height = job.origin["size"]
        self.exact = Exact(renderer, job.origin["points"])
        self._radiance = _radiance(renderer, _shot(job, STANDARD))
        able = _techniques_of(job.scene, ["ltc"])
        other = _radiance(renderer, _shot(job, able[0] if able else "ggx:1"))
        self._crop = _worst_place(np.abs(other - self._radiance).sum(axis=-1), (width, height))

    def pictures(self, renderer: Renderer) -> dict[str, str]:
        """Return crops of the picture that was rendered last, and of its difference."""
        rows, columns = self._crop
        colours = renderer.display()[rows, columns]
        seen = renderer.radiance().astype(np.float64)[rows, columns]
        wanted = self._radiance[rows, columns]
        difference = (seen - wanted).mean(axis=-1)
        shining = wanted[wanted.max(axis=-1) > 0.0].mean(axis=-1)
        full = FULL_COLOUR * float(np.median(shining)) if shining.size else 0.0
        share = np.clip(difference / full, -1.0, 1.0)[..., None] if full > 0.0 else 0.0
        bright, dark = np.maximum(share, 0.0), np.maximum(np.negative(share), 0.0)
        image = bright * np.array(TOO_BRIGHT) + dark * np.array(TOO_DARK) + np.zeros(wanted.shape)
        return {
            "picture": _data_address(colours, "JPEG", quality=88),
            "difference": _data_address(np.rint(image).astype(np.uint8), "PNG", optimize=True),
        }


def _shot(job: Job, technique: str) -> Shot:
    width, height = job.origin["size"]
    settings = RenderSettings(technique=str(parse_technique(technique)))
    return Shot(job.scene, settings, width, height)


def _radiance(renderer: Renderer, shot: Shot) -> FloatArray:
    renderer.render(shot)
    return renderer.radiance().astype(np.float64)


def _worst_place(difference: FloatArray, size: tuple[int, int]) -> tuple[slice, slice]:
    """Return the rows and columns of the crop in which the differences' sum is largest."""
    from scipy.ndimage import uniform_filter

    width, height = min(CROP[0], size[0]), min(CROP[1], size[1])
    sums = uniform_filter(difference, (height, width), mode="constant")
    row, column = np.unravel_index(int(np.argmax(sums)), sums.shape)
    top = int(np.clip(row - height // 2, 0, size[1] - height))
    left = int(np.clip(column - width // 2, 0, size[0] - width))
    return slice(top, top + height), slice(left, left + width)


def _data_address(colours: NDArray[np.uint8], form: str, **options: Any) -> str:
    from PIL import Image

    image = Image.fromarray(np.ascontiguousarray(colours))
    if form == "PNG":
        image = image.quantize(64)  # a third of the bytes, and no difference to be seen
    buffer = io.BytesIO()
    image.save(buffer, form, **options)
    text = base64.b64encode(buffer.getvalue()).decode("ascii")
    return f"data:image/{form.lower()};base64,{text}"


def _measure(
    ctx: moderngl.Context, renderer: Renderer, job: Job, comparison: _Comparison
) -> dict[str, Any]:
    shot = _shot(job, job.technique)
    passes, wall = measure_passes(ctx, renderer, shot, WARM_UP, job.origin["repeats"])
    pictures = comparison.pictures(renderer)
    figures: Row = {
        "scene": job.name,
        "technique": job.technique,
        "renderer": job.origin["renderer"],
        "timing": renderer.timing_source,
        "width": shot.width,
        "height": shot.height,
        "bytes": sum(renderer.allocated().values()),
        "repeats": wall.repeats,
    }
    for name, times in {**passes, "wall": wall}.items():
        figures[f"{name}_ms"] = times.median
        figures[f"{name}_q1_ms"], figures[f"{name}_q3_ms"] = times.q1, times.q3
    to_ggx = comparison.exact.errors(shot, "ggx")
    to_own = comparison.exact.errors(shot)
    some = to_ggx.get("specular")
    figures["points"] = some.points if some else 0
    # Lambert is the same for both.
    for name, errors in (
        ("specular_ggx", some),
        ("specular_own", to_own.get("specular")),
        ("diffuse", to_ggx.get("diffuse")),
    ):
        for what in ("mean", "p95", "max"):
            figures[f"{name}_{what}"] = getattr(errors, what) if errors else None
    figures["evaluations"] = mean_evaluations(renderer, shot)
    return {"figures": figures, **pictures}


def _rows(jobs: Sequence[Job], measured: dict[Path, dict[str, Any]]) -> list[Row]:
    """Return all figures with the same columns, and who is on the fronts of its scene."""
    found = [measured[job.part]["figures"] for job in jobs]
    columns = list(dict.fromkeys(key for row in found for key in row))
    rows: list[Row] = [{key: row.get(key) for key in columns} for row in found]
    for lobe in ("ggx", "own"):
        for name in dict.fromkeys(row["scene"] for row in rows):
            some = [row for row in rows if row["scene"] == name]
            able = [
                r for r in some if None not in (r.get("lighting_ms"), r[f"specular_{lobe}_mean"])
            ]
            best = pareto_front([(r["lighting_ms"], r[f"specular_{lobe}_mean"]) for r in able])
            on_front = {id(r) for r, on in zip(able, best, strict=True) if on}
            for row in some:
                row[f"on_front_{lobe}"] = int(id(row) in on_front)
    return rows
