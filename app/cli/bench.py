"""``ltc-viewer bench``: how long the passes take, by scene and technique."""

from __future__ import annotations

import json
import platform
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer
from rich.table import Table

from app.cli.common import (
    SizeOption,
    Steps,
    TechniquesOption,
    headless_renderer,
    image_size,
    is_software,
    messages,
    named_scene,
    results,
    whole_number,
)
from app.files import check_output, replace_file
from app.render.techniques import AUTOMATIC, suited_technique, technique_of
from app.scene import RenderSettings, Scene, Shot

if TYPE_CHECKING:
    import moderngl

    from app.render.renderer import Renderer

BASELINE = "no shading"
"""The row whose materials reflect nothing: what the passes cost without the integrals."""

MAX_REPEATS = 100_000


@dataclass(frozen=True)
class Quartiles:
    """Of one pass's times [ms]."""

    median: float
    q1: float
    q3: float
    repeats: int

    @classmethod
    def of(cls, times: list[float]) -> Quartiles:
        q1, median, q3 = np.quantile(times, (0.25, 0.5, 0.75))
        return cls(float(median), float(q1), float(q3), len(times))


@dataclass(frozen=True)
class Row:
    """One measured shot: ``passes`` by name, and ``wall``, the whole frame with a glFinish."""

    scene: str
    technique: str
    passes: dict[str, Quartiles]
    wall: Quartiles


def bench(
    scenes: Annotated[
        list[str],
        typer.Argument(metavar="SCENE...", help="Scene files, or names of demo scenes."),
    ],
    techniques: TechniquesOption = [AUTOMATIC],  # noqa: B006 (typer copies it)
    size: SizeOption = "1920x1080",
    repeats: Annotated[
        int,
        typer.Option(
            "--repeats",
            metavar="N",
            help="Measured frames per row.",
            parser=whole_number("--repeats", 1, MAX_REPEATS),
        ),
    ] = 30,
    warm_up: Annotated[
        int,
        typer.Option(
            "--warm-up",
            metavar="N",
            help="Frames before measuring.",
            parser=whole_number("--warm-up", 0, MAX_REPEATS),
        ),
    ] = 5,
    json_file: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help="Write the figures as JSON too.")
    ] = None,
) -> None:
    """Measure the time of each pass: median and quartiles over repeated frames.

    GPU times come from timer queries. Where those are not to be trusted
    (software rasterisers) every pass is timed by the wall clock instead, and the
    table says so. The row "no shading" shows the scene with materials that
    reflect nothing: what remains when the integrals are left out.

    \b
    Example:
      ltc-viewer bench quad.json star.json --technique ltc --size 1920x1080 --json times.json
    """
    width, height = image_size(size)
    for technique in techniques:
        suited_technique(technique, anisotropic=False)
    if json_file is not None:
        check_output(json_file, "a table of figures", (".json",))
    loaded = [(name, named_scene(name)) for name in scenes]
    shots = list(_shots(loaded, techniques, width, height))
    with headless_renderer() as (ctx, renderer):
        device = str(ctx.info["GL_RENDERER"])
        if is_software(device):
            renderer.use_wall_clock()
        rows = []
        with Steps("measuring", len(shots) * (warm_up + repeats)) as steps:
            for name, technique, shot in shots:
                rows.append(_measure(ctx, renderer, name, technique, shot, warm_up, repeats, steps))
        source = renderer.timing_source
        version = str(ctx.info["GL_VERSION"])
    results().print(_table(rows, f"{device}, {width}x{height}, by {source}"))
    if source == "wall clock":
        messages().print(
            "Times are by the wall clock, each pass ending with glFinish: this renderer's timer "
            "queries are not to be trusted."
        )
    if json_file is not None:
        figures: dict[str, Any] = {
            "renderer": device,
            "gl_version": version,
            "timing": source,
            "platform": platform.platform(),
            "python": platform.python_version(),
            "size": [width, height],
            "warm_up": warm_up,
            "unit": "ms",
            "rows": [asdict(row) for row in rows],
        }
        text = json.dumps(figures, indent=2) + "\n"
        replace_file(json_file, text.encode("utf-8"), "a table of figures")


def _shots(
    scenes: list[tuple[str, Scene]], techniques: list[str], width: int, height: int
) -> Iterator[tuple[str, str, Shot]]:
    """Yield each scene's baseline, then its techniques."""
    for name, scene in scenes:
        black = tuple(
            replace(material, diffuse=(0.0, 0.0, 0.0), f0=(0.0, 0.0, 0.0))
            for material in scene.materials
        )
        first = RenderSettings(technique=techniques[0])
        yield name, BASELINE, Shot(replace(scene, materials=black), first, width, height)
        for technique in techniques:
            own = technique_of(scene, technique)
            yield name, own, Shot(scene, RenderSettings(technique=own), width, height)


def _measure(
    ctx: moderngl.Context,
    renderer: Renderer,
    name: str,
    technique: str,
    shot: Shot,
    warm_up: int,
    repeats: int,
    steps: Steps,
) -> Row:
    before = steps.count
    times: dict[str, list[float]] = {}
    wall: list[float] = []
    for index in range(warm_up + repeats):
        ctx.finish()
        start = time.perf_counter()
        renderer.render(shot)
        _ = renderer.texture  # draws the display pass
        ctx.finish()
        elapsed = 1e3 * (time.perf_counter() - start)
        figures = renderer.timings()
        if renderer.timing_source == "wall clock":
            figures.pop("cpu", None)  # it would contain the passes
        if index >= warm_up:
            wall.append(elapsed)
            for key, value in figures.items():
                times.setdefault(key, []).append(value)
        steps.done(before + index + 1)
    passes = {key: Quartiles.of(values) for key, values in times.items()}
    return Row(name, technique, passes, Quartiles.of(wall))


def _table(rows: list[Row], title: str) -> Table:
    table = Table(title=f"Milliseconds per frame: median (quartiles). {title}")
    table.add_column("scene")
    table.add_column("technique")
    names = list(dict.fromkeys(name for row in rows for name in row.passes))
    for name in (*names, "wall"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("repeats", justify="right")
    for row in rows:
        cells = [_cell(row.passes.get(name)) for name in names]
        table.add_row(
            Path(row.scene).stem,
            row.technique,
            *cells,
            _cell(row.wall),
            str(row.wall.repeats),
        )
    return table


def _cell(figures: Quartiles | None) -> str:
    if figures is None:
        return "-"
    return f"{figures.median:.3f} ({figures.q1:.3f} to {figures.q3:.3f})"
