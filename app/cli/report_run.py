"""Makes a report: every scene and technique measured once, then the page and its files.

First the truths, which any executor can share out, then everything that needs the GPU, in this
process and one after the other: while something is timed nothing else runs.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from app.cli.common import headless_renderer, messages, named_scene, scene_path
from app.cli.drawing import png_file, svg_file
from app.cli.folder import TimedSteps, check_folder, csv_text, machine_facts, version
from app.cli.report_page import report_page
from app.cli.report_parts import (
    Part,
    Row,
    part_path,
    read_part,
    read_truth,
    write_part,
    write_truth,
)
from app.cli.report_pictures import Comparison
from app.cli.report_plots import named_plots
from app.errors import InputError
from app.files import replace_file
from app.measure.entries import Entry, entries_of, parse_entry
from app.measure.errors import (
    Errors,
    SurfacePoints,
    Truth,
    choose_points,
    exact_truth,
    has_exact_truth,
    lit_evenly,
    mean_evaluations,
    own_lobe,
    probe_errors,
    sampled_truth,
)
from app.measure.front import pareto_front
from app.measure.times import measure_passes
from app.render.needs import needs_of
from app.render.tables import table_textures
from app.render.techniques import AUTOMATIC
from app.render.timers import Clock, is_software
from app.render.truth import Lobe
from app.scene import RenderSettings, Scene, Shot
from app.scene_io import demo_scenes

if TYPE_CHECKING:
    import moderngl

    from app.render.renderer import Renderer

WARM_UP = 2
"""Frames before those measured: the first compiles, and fills caches."""

TIMED_SAMPLES = 4
"""Most samples of a pixel that are timed: each takes as long as any other."""

TRUTH_SAMPLES = 16384
"""Of ``reference`` at a point, where there is no exact integral."""

KIND = "a report"


@dataclass(frozen=True)
class Target:
    """A scene by its name in the report, and what of it is compared."""

    name: str
    scene: Scene
    digest: str
    entries: tuple[Entry, ...]


Truths = dict[Lobe, Truth]


def run_report(
    scenes: Sequence[str],
    output: Path,
    *,
    techniques: Sequence[str] = (),
    size: tuple[int, int] = (640, 360),
    points: int = 500,
    repeats: int = 10,
    clock: Clock = "wall clock",
    again: bool = False,
    executor: Executor | None = None,
) -> Path:
    """Measure and write a report; return its page.

    Parameters
    ----------
    scenes : sequence of str
        Scene files or names of demo scenes; none for all of those.
    output : Path
        The folder, made if its parent is there.
    techniques : sequence of str
        As `app.measure.entries.parse_entry` reads them; none for all that make a difference.
    size : (width, height)
        Of the pictures that are timed [pixels].
    points : int
        Random pixels a scene that are compared with the exact integral.
    repeats : int
        Measured frames a technique.
    clock : {"wall clock", "processor time"}
        What times are by where the renderer's timer queries are not to be trusted.
    again : bool
        Whether to measure anew what an earlier run left in ``output``.
    executor : concurrent.futures.Executor, optional
        Computes the exact integrals; its workers need this program, and neither a display nor
        OpenGL. Without one they are computed in this process.

    Raises
    ------
    InputError
        If a scene, a technique or the folder is wrong.
    app.cli.common.FailureError
        If there is no OpenGL.
    """
    for text in techniques:
        if text != AUTOMATIC:
            parse_entry(text)
    targets = _targets(scenes or list(demo_scenes()), techniques)
    check_folder(output, "the report")
    with headless_renderer() as (ctx, renderer):
        if is_software(str(ctx.info["GL_RENDERER"])):
            renderer.use_clock(clock)
        run = _Run(ctx, renderer, output / "parts", size, points, repeats, again)
        truths = run.truths(targets, executor)
        measured = run.measure(targets, truths)
        machine = machine_facts(ctx)
    rows = _marked([part[0] for part in measured.values()])
    settings = {
        "size": f"{size[0]}x{size[1]}", "points": points, "repeats": repeats, "warm_up": WARM_UP,
    }  # fmt: skip
    pictures = {key: part[1] for key, part in measured.items()}
    figures = {"machine": machine, "settings": settings, "rows": rows}
    texts = {
        "results.json": json.dumps(figures, indent=2, allow_nan=False) + "\n",
        "results.csv": csv_text(rows),
        "index.html": report_page(rows, pictures, machine, settings),
    }
    for name, plot in named_plots(rows).items():
        replace_file(output / f"{name}.png", png_file(plot), KIND)
        texts[f"{name}.svg"] = svg_file(plot)
    for name, text in texts.items():
        replace_file(output / name, text.encode("utf-8"), KIND)
    return output / "index.html"


def _targets(names: Sequence[str], techniques: Sequence[str]) -> list[Target]:
    """Return scenes by the name that they have in the report, with digests of their files."""
    found: dict[str, Target] = {}
    for name in names:
        path = scene_path(name)
        scene = named_scene(name)
        if path.stem in found:
            raise InputError(
                f"{path}: another scene of this report is named '{path.stem}' too, expected names "
                "that differ"
            )
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
        found[path.stem] = Target(path.stem, scene, digest, entries_of(scene, techniques))
    return list(found.values())


class _Run:
    """One run: what it measures with, and what earlier ones left."""

    def __init__(
        self,
        ctx: moderngl.Context,
        renderer: Renderer,
        parts: Path,
        size: tuple[int, int],
        points: int,
        repeats: int,
        again: bool,
    ) -> None:
        self._ctx, self._renderer = ctx, renderer
        self._parts, self._size = parts, size
        self._points, self._repeats, self._again = points, repeats, again
        self._device = str(ctx.info["GL_RENDERER"])
        self._chosen: dict[str, SurfacePoints] = {}
        parts.mkdir(parents=True, exist_ok=True)

    def _origin(self, target: Target) -> dict[str, Any]:
        """Return what the points of a scene, and so their truths, depend on."""
        return {
            "renderer": self._device,
            "program": version("ltc-viewer"),
            "size": [*self._size],
            "points": self._points,
            "scene": target.digest,
        }

    def _entry_origin(self, target: Target, entry: Entry) -> dict[str, Any]:
        """Return what an entry's figures depend on: its shaders and tables too."""
        needs = needs_of(target.scene, entry.samples, self._renderer.limits, entry.technique)
        digest = hashlib.sha256()
        for spec in needs.programs:
            for source in spec.sources(self._renderer.programs.roots):
                digest.update(source.text.encode())
        if needs.lighting.reads_tables:
            for texels in table_textures(
                needs.lighting.anisotropic, needs.lighting.residual_size
            ).values():
                digest.update(texels.tobytes())
        drawn, clock = digest.hexdigest(), self._renderer.timing_source
        return {
            **self._origin(target),
            "repeats": self._repeats,
            "timing": clock,
            "drawn_with": drawn,
        }

    def _known(self, target: Target, entry: Entry) -> Part | None:
        path = part_path(self._parts, target.name, str(entry), ".json")
        return None if self._again else read_part(path, self._entry_origin(target, entry))

    def truths(self, targets: Sequence[Target], executor: Executor | None) -> dict[str, Truths]:
        """Return the truths of each scene that has something to measure, by its name."""
        wanted: list[tuple[Target, Lobe]] = []
        found: dict[str, Truths] = {target.name: {} for target in targets}
        for target in targets:
            missing = [e for e in target.entries if self._known(target, e) is None]
            lobes = {"ggx"} if missing else set()
            if has_exact_truth(target.scene):
                lobes |= {_own(entry) or "ggx" for entry in missing}
            for lobe in sorted(lobes):
                path = part_path(self._parts, target.name, f"truth-{lobe}", ".npz")
                known = None if self._again else read_truth(path, self._origin(target))
                if known is None:
                    wanted.append((target, lobe))
                else:
                    self._chosen[target.name], found[target.name][lobe] = known
        for target in dict.fromkeys(target for target, _ in wanted):
            self._choose(target)
        total = sum(len(self._chosen[target.name]) for target, _ in wanted)
        with TimedSteps("integrating exactly", "points integrated exactly", total) as steps:
            done = 0

            def more(count: int) -> None:
                nonlocal done
                done += count
                steps.done(done)

            for target, lobe in wanted:
                points, scene = self._chosen[target.name], lit_evenly(target.scene)
                if has_exact_truth(scene):
                    truth = exact_truth(scene, points, lobe, executor, more)
                else:
                    truth = sampled_truth(self._renderer, scene, points, TRUTH_SAMPLES)
                    more(len(points))
                path = part_path(self._parts, target.name, f"truth-{lobe}", ".npz")
                write_truth(path, self._origin(target), points, truth)
                found[target.name][lobe] = truth
        return found

    def _choose(self, target: Target) -> None:
        """Choose a scene's points, unless a truth of them is known."""
        if target.name not in self._chosen:
            self._renderer.render(Shot(target.scene, RenderSettings("ggx"), *self._size))
            self._chosen[target.name] = choose_points(
                self._renderer, lit_evenly(target.scene), self._points
            )

    def measure(
        self, targets: Sequence[Target], truths: Mapping[str, Truths]
    ) -> dict[tuple[str, str], Part]:
        """Return all parts by scene and technique, in order; write those that were missing."""
        parts: dict[tuple[str, str], Part | None] = {
            (target.name, str(entry)): self._known(target, entry)
            for target in targets
            for entry in target.entries
        }
        missing = sum(part is None for part in parts.values())
        if missing < len(parts):
            messages().print(f"{len(parts) - missing} of {len(parts)} parts are there already.")
        with TimedSteps("measuring", "measured", missing) as steps:
            done = 0
            for target in targets:
                some = [e for e in target.entries if parts[target.name, str(e)] is None]
                if not some:
                    continue
                comparison = Comparison(self._renderer, target.scene, self._size)
                for entry in some:
                    key = target.name, str(entry)
                    figures = self._figures(target, entry, truths[target.name])
                    pictures, figures["picture_share"] = comparison.of(self._renderer, entry)
                    path = part_path(self._parts, *key, ".json")
                    parts[key] = write_part(
                        path, self._entry_origin(target, entry), figures, pictures
                    )
                    done += 1
                    steps.done(done)
        return {key: part for key, part in parts.items() if part is not None}

    def _figures(self, target: Target, entry: Entry, truths: Truths) -> Row:
        renderer = self._renderer
        samples = min(entry.samples, TIMED_SAMPLES)
        shot = Shot(target.scene, entry.settings(samples), *self._size)
        passes, wall = measure_passes(self._ctx, renderer, shot, WARM_UP, self._repeats)
        plan = renderer.plan(shot)
        figures: Row = {
            "scene": target.name,
            "technique": str(entry),
            "samples": entry.samples,
            "renderer": self._device,
            "timing": renderer.timing_source,
            "width": shot.width,
            "height": shot.height,
            "bytes": plan.bytes,
            "table_bytes": sum(part.bytes for part in plan.tables),
            "buffer_bytes": sum(part.bytes for part in plan.buffers),
            "attachment_bytes": sum(part.bytes for part in plan.attachments),
            "repeats": wall.repeats,
        }
        for name, times in {**passes, "wall": wall}.items():
            # The picture is displayed once, however many samples it has.
            factor = {"display": 1.0, "wall": entry.samples / samples}.get(name, entry.samples)
            scaled = times.times(factor)
            figures[f"{name}_ms"] = scaled.median
            figures[f"{name}_q1_ms"], figures[f"{name}_q3_ms"] = scaled.q1, scaled.q3
        scene, points = lit_evenly(target.scene), self._chosen[target.name]
        own = _own(entry)
        to_ggx = probe_errors(renderer, scene, entry, points, truths["ggx"])
        truth = truths.get(own) if own else None
        to_own = probe_errors(renderer, scene, entry, points, truth) if truth else {}
        figures["points"] = len(points)
        figures["truth"] = "reference" if truths["ggx"].sampled else "exact"
        figures["truth_uncertainty"] = truths["ggx"].uncertainty
        # Lambert is the same for both.
        for name, errors in (
            ("specular_ggx", to_ggx.get("specular")),
            ("specular_own", to_own.get("specular")),
            ("diffuse", to_ggx.get("diffuse")),
        ):
            figures |= _error_figures(name, errors)
        whole = Shot(target.scene, entry.settings(), *self._size)
        figures["evaluations"] = mean_evaluations(renderer, whole)
        return figures


def _own(entry: Entry) -> Lobe | None:
    """Return the lobe of `own_lobe`, but of variants none: tests hold them to theirs."""
    return None if entry.variant else own_lobe(entry)


def _error_figures(name: str, errors: Errors | None) -> Row:
    return {
        f"{name}_{what}": getattr(errors, what) if errors else None
        for what in ("mean", "p95", "max")
    }


def _marked(found: Sequence[Row]) -> list[Row]:
    """Return all figures with the same columns, and who is on the fronts of its scene."""
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
