"""``ltc-viewer bench``: how long the passes take, by scene and technique, and how much they err.

Errors are those of the integration alone: at random pixels' surface points every technique
is compared with the limit that it approximates, its lobe integrated in float64 along the
very curves (`app.render.truth`): the fitted lobe of ``ltc`` for all but ``ggx``, whose
lobe is GGX.
"""

from __future__ import annotations

import json
import platform
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from app.cli.common import (
    CullOption,
    EverythingOption,
    SizeOption,
    Steps,
    TechniquesOption,
    headless_renderer,
    image_size,
    messages,
    named_scene,
    results,
    whole_number,
)
from app.errors import InputError
from app.files import check_output, replace_file
from app.measure.entries import Entry
from app.measure.errors import Errors, Exact, mean_evaluations
from app.measure.times import Quartiles, measure_in_turn
from app.plan_rows import format_bytes, share_text
from app.render.techniques import AUTOMATIC, suited_technique, technique_of
from app.render.timers import is_software
from app.scene import ALPHA_MIN, Material, RenderSettings, Scene, Shot

if TYPE_CHECKING:
    from app.render.renderer import Renderer

BASELINE = "no shading"
"""The row whose materials reflect nothing: what the passes cost without the integrals."""

MAX_REPEATS = 100_000
MAX_POINTS = 100_000
WIDEST = 320
"""Characters of a table that goes to a file: all columns with errors, unfolded."""


@dataclass(frozen=True)
class Row:
    """One measured shot: ``passes`` by name, and ``wall``, the whole frame with a glFinish.

    ``alpha`` is what all materials were given, None where they keep their own; ``errors``
    are those of specular and diffuse radiance, empty where none were asked for; so are
    ``evaluations`` of the contour integral, their mean over pixels that show surfaces.
    ``cull`` is the share of display white that skipped lights may add up to; ``everything``
    says that nothing was left out, ``bytes`` what was allocated.
    """

    scene: str
    technique: str
    alpha: float | None
    passes: dict[str, Quartiles]
    wall: Quartiles
    errors: dict[str, Errors]
    evaluations: float | None
    cull: float
    everything: bool
    bytes: int


@dataclass(frozen=True)
class Job:
    """A shot to measure, and how its row is labelled."""

    scene: str
    technique: str
    alpha: float | None
    shot: Shot


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
    alphas: Annotated[
        list[float],
        typer.Option(
            "--alpha",
            metavar="A",
            help="Give all materials this GGX alpha; repeat for several.",
            show_default="their own",
        ),
    ] = [],  # noqa: B006 (typer copies it)
    points: Annotated[
        int,
        typer.Option(
            "--error",
            metavar="N",
            help="Compare N random pixels with the exact integral.",
            parser=whole_number("--error", 0, MAX_POINTS),
            show_default=False,
        ),
    ] = 0,
    cull: CullOption = 0.0,
    everything: EverythingOption = False,
    json_file: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help="Write the figures as JSON too.")
    ] = None,
) -> None:
    """Measure the time of each pass: median and quartiles over repeated frames.

    GPU times come from timer queries. Where those are not to be trusted
    (software rasterisers) every pass is timed by the wall clock instead, and the
    table says so. The row "no shading" shows the scene with materials that
    reflect nothing: what remains when the integrals are left out. Pictures of lights are
    filtered in every frame, as those that play are: the pass "pictures".

    --error adds how far each technique is from the integral that it approximates:
    mean, 95th percentile and largest error of specular and diffuse radiance, of
    lights with radiance 1 on a white material; and how often a pixel evaluates the
    integral along the outlines, which no other program on the machine can disturb.

    --cull measures each technique a second time, skipping lights too faint to see.

    --everything measures each row a second time, frame by frame in turn, with one
    program for all scenes and nothing left out: what the scene spares.

    \b
    Examples:
      ltc-viewer bench quad.json star.json --technique ltc --size 1920x1080 --json times.json
      ltc-viewer bench disk.json --technique ltc --technique uniform:30 --alpha 0.01 --error 2000
    """
    width, height = image_size(size)
    for technique in techniques:
        suited_technique(technique, anisotropic=False)
    for alpha in alphas:
        if not ALPHA_MIN <= alpha <= 1.0:
            raise InputError(f"--alpha is {alpha:g}, expected a number between {ALPHA_MIN:g} and 1")
    if json_file is not None:
        check_output(json_file, "a table of figures", (".json",))
    loaded = [(name, named_scene(name)) for name in scenes]
    jobs = list(_jobs(loaded, techniques, alphas, cull, width, height))
    with headless_renderer() as (ctx, renderer), ExitStack() as stack:
        device = str(ctx.info["GL_RENDERER"])
        if is_software(device):
            renderer.use_clock("wall clock")
        rows = []
        exact = Exact(renderer, points)
        renderers = [renderer, *([stack.enter_context(_full(renderer))] if everything else [])]
        with Steps("measuring", len(jobs) * (warm_up + repeats) * len(renderers)) as steps:

            def one_more() -> None:
                steps.done(steps.count + 1)

            for job in jobs:
                measured = measure_in_turn(
                    ctx, renderers, job.shot, warm_up, repeats, one_more, new_pictures=True
                )
                for one, (passes, wall) in zip(renderers, measured, strict=True):
                    errors, evaluations, held = {}, None, sum(one.allocated().values())
                    share = job.shot.settings.cull
                    counts = (points or cull) and job.technique != BASELINE
                    # Points to be probed are shaded by all lights.
                    if points and counts and not one.everything and not share:
                        errors = exact.errors(job.shot, Entry(job.shot.settings.technique))
                    if counts and not one.everything:
                        evaluations = mean_evaluations(one, job.shot)
                    rows.append(
                        Row(
                            job.scene, job.technique, job.alpha, passes, wall, errors,
                            evaluations, share, one.everything, held,
                        )
                    )  # fmt: skip
        source = renderer.timing_source
        version = str(ctx.info["GL_VERSION"])
    console = results()
    if not console.is_terminal:
        console.width = WIDEST
    console.print(_table(rows, f"{device}, {width}x{height}, by {source}"))
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


@contextmanager
def _full(like: Renderer) -> Iterator[Renderer]:
    """Make a renderer that leaves nothing out, and measures time as ``like`` does."""
    renderer = type(like)(like.ctx, everything=True)
    if like.timing_source == "wall clock":
        renderer.use_clock("wall clock")
    try:
        yield renderer
    finally:
        renderer.release()


def _jobs(
    scenes: list[tuple[str, Scene]],
    techniques: list[str],
    alphas: list[float],
    cull: float,
    width: int,
    height: int,
) -> Iterator[Job]:
    """Yield each scene's baseline, then for each alpha its techniques, without and with culling."""
    for name, scene in scenes:
        black = _with_materials(scene, diffuse=(0.0, 0.0, 0.0), f0=(0.0, 0.0, 0.0))
        first = RenderSettings(technique=techniques[0])
        yield Job(name, BASELINE, None, Shot(black, first, width, height))
        choices: list[float | None] = [*alphas] if alphas else [None]
        for alpha in choices:
            glossy = scene if alpha is None else _with_materials(scene, alpha=(alpha, alpha))
            for technique in techniques:
                own = technique_of(glossy, technique)
                label = own if technique == AUTOMATIC else technique
                for share in (0.0, cull) if cull else (0.0,):
                    settings = RenderSettings(technique=own, cull=share)
                    yield Job(name, label, alpha, Shot(glossy, settings, width, height))


def _with_materials(scene: Scene, **changes: Any) -> Scene:
    materials: tuple[Material, ...] = tuple(replace(m, **changes) for m in scene.materials)
    return replace(scene, materials=materials)


def _table(rows: list[Row], title: str) -> Table:
    table = Table(title=f"Milliseconds per frame: median (quartiles). {title}")
    table.add_column("scene", no_wrap=True)
    table.add_column("technique", no_wrap=True)
    has_alpha = any(row.alpha is not None for row in rows)
    if has_alpha:
        table.add_column("alpha", justify="right")
    names = list(dict.fromkeys(name for row in rows for name in row.passes))
    for name in (*names, "wall"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("repeats", justify="right")
    has_memory = any(row.everything for row in rows)
    if has_memory:
        table.add_column("memory", justify="right", no_wrap=True)
    lobes = list(dict.fromkeys(lobe for row in rows for lobe in row.errors))
    for lobe in lobes:
        table.add_column(f"{lobe} error: mean, p95, max", justify="right", no_wrap=True)
    has_counts = any(row.evaluations is not None for row in rows)
    if has_counts:
        table.add_column("evaluations", justify="right", no_wrap=True)
    for row in rows:
        count = "-" if row.evaluations is None else f"{row.evaluations:.1f}"
        table.add_row(
            Path(row.scene).stem,
            _label(row),
            *(["-" if row.alpha is None else f"{row.alpha:g}"] if has_alpha else []),
            *(_cell(row.passes.get(name)) for name in names),
            _cell(row.wall),
            str(row.wall.repeats),
            *([format_bytes(row.bytes)] if has_memory else []),
            *(_error_cell(row.errors.get(lobe)) for lobe in lobes),
            *([count] if has_counts else []),
        )
    return table


def _label(row: Row) -> str:
    """Return what the technique's column says."""
    culls = [f"cull {share_text(row.cull)}"] if row.cull else []
    return ", ".join([row.technique, *culls, *(["everything"] if row.everything else [])])


def _cell(figures: Quartiles | None) -> str:
    if figures is None:
        return "-"
    return f"{figures.median:.3f} ({figures.q1:.3f} to {figures.q3:.3f})"


def _error_cell(errors: Errors | None) -> str:
    if errors is None:
        return "-"
    return f"{errors.mean:.1e}, {errors.p95:.1e}, {errors.max:.1e}"
