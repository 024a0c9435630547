"""What leaving out saves: `leaving_out.csv`, `culling.csv` and ``docs/images/leaving-out.png``.

    .venv/bin/pip install "matplotlib>=3.9"
    .venv/bin/python -m docs.figures.leaving_out [--measure]

``--measure`` writes the figures anew (some minutes); without it they are only drawn, and
printed as the tables of ``docs/leaving-out.md``. Times are CPU seconds of all threads, so a
machine with other work to do disturbs them little, and only mean what they say where a
software rasteriser draws.
"""

from __future__ import annotations

import csv
import sys
import time
from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import moderngl
import numpy as np
from numpy.typing import NDArray

from app.context import headless_context
from app.plan_rows import format_bytes, share_text
from app.render.pack import light_bounds, light_geometry
from app.render.plan import Plan
from app.render.renderer import Renderer
from app.render.timers import is_software
from app.render.truth import shading_frames
from app.scene import RenderSettings, Scene, Shot
from app.scene_io import demo_scenes, load_scene
from ltc import transform
from ltc.bounds import form_factor_bound
from ltc.resources import resource_path
from ltc.table import load_isotropic

EVERYTHING = Path(__file__).with_suffix(".csv")
CULLING = Path(__file__).with_name("culling.csv")
PICTURE = Path(__file__).parents[1] / "images" / "leaving-out.png"
BENCH = resource_path("assets", "scenes", "bench")

SIZE = (240, 136)
REPEATS = 7
"""Frames, of which the least time counts: what else a machine does only ever adds to it."""
SHARES = (1 / 4096, 1 / 1024, 1 / 256)
TILES = (1, 8, 16)
CULLED = (
    ("05-many-lights", "ltc"),
    ("05-many-lights", "ggx"),
    ("lights-32", "ltc"),
    ("lights-08", "ltc"),
    ("06-grazing", "ltc"),
    ("01-still-life", "ltc"),
    ("13-word", "ltc"),
)

Row = dict[str, str]
FloatArray = NDArray[np.float64]


def scene_of(name: str) -> Scene:
    """Return a demo scene, or one of those to measure with."""
    return load_scene(demo_scenes().get(name) or BENCH / f"{name}.json")


def measure() -> None:
    """Render all scenes and write both tables."""
    context = headless_context()
    with context:
        assert is_software(str(context.info["GL_RENDERER"])), "CPU seconds of a GPU mean nothing"
        needed, full = Renderer(context), Renderer(context, everything=True)
        rows = [_with_and_without(context, needed, full, name) for name in demo_scenes()]
        _write(EVERYTHING, rows)
        _write(CULLING, [row for name, technique in CULLED
                         for row in _culled(context, needed, name, technique)])  # fmt: skip
        needed.release()
        full.release()


def _write(path: Path, rows: list[Row]) -> None:
    with path.open("w", newline="", encoding="utf-8") as stream:
        table = csv.DictWriter(stream, list(rows[0]), lineterminator="\n")
        table.writeheader()
        table.writerows(rows)


def _with_and_without(
    context: moderngl.Context, needed: Renderer, full: Renderer, name: str
) -> Row:
    shot = Shot(scene_of(name), RenderSettings(), *SIZE)
    times = _milliseconds(context, [(needed, shot), (full, shot)])
    pictures = [renderer.radiance().astype(np.float64) for renderer in (needed, full)]
    row = {"scene": name}
    for label, renderer, ms in (("needed", needed, times[0]), ("everything", full, times[1])):
        plan = renderer.plan(shot)
        row |= {
            f"{label} lines": str(plan.lines),
            f"{label} characters": str(_characters(plan)),
            f"{label} attachments": str(sum(part.bytes for part in plan.attachments)),
            f"{label} bytes": str(plan.bytes),
            f"{label} ms": f"{ms:.2f}",
        }
    difference = np.abs(pictures[0] - pictures[1]).max() / pictures[0].max()
    print(name, times, difference)
    return row | {"difference": f"{difference:.1e}"}


def _characters(plan: Plan) -> int:
    return sum(program.characters for program in plan.programs)


def _milliseconds(context: moderngl.Context, jobs: list[tuple[Renderer, Shot]]) -> list[float]:
    """Return the least CPU times of a frame, all threads together; the jobs take turns."""
    times: list[list[float]] = [[] for _ in jobs]
    for _ in range(REPEATS + 1):
        for mine, (renderer, shot) in zip(times, jobs, strict=True):
            start = time.process_time()
            renderer.render(shot)
            context.finish()
            mine.append(1e3 * (time.process_time() - start))
    return [min(mine[1:]) for mine in times]  # the first compiles


def _culled(context: moderngl.Context, renderer: Renderer, name: str, technique: str) -> list[Row]:
    scene = scene_of(name)
    white = 2.0**-scene.display.exposure
    shots = [Shot(scene, RenderSettings(technique, cull=share), *SIZE) for share in (0.0, *SHARES)]
    times = [_milliseconds(context, [(renderer, shot)])[0] for shot in shots]
    rows = []
    for shot, ms in zip(shots, times, strict=True):
        share = shot.settings.cull
        renderer.render(shots[0])
        whole = renderer.radiance().astype(np.float64)
        renderer.render(shot)
        error = np.abs(renderer.radiance() - whole).max() / white
        renderer.render(replace(shot, settings=replace(shot.settings, view="cost")))
        evaluations = renderer.radiance()[..., 0].mean(dtype=np.float64)
        row = {
            "scene": name,
            "technique": technique,
            "share": repr(share),
            "ms": f"{ms:.2f}",
            "evaluations": f"{evaluations:.1f}",
            "error": f"{error:.1e}",
        }
        tiled = technique == "ltc" and share and name in ("lights-32", "lights-08")
        skipped = _skipped_by_tiles(renderer, scene, share) if tiled else [np.nan] * len(TILES)
        for tile, found in zip(TILES, skipped, strict=True):
            row[f"skipped by {tile}"] = "" if np.isnan(found) else f"{found:.3f}"
        print(row)
        rows.append(row)
    return rows


def _skipped_by_tiles(renderer: Renderer, scene: Scene, share: float) -> list[float]:
    """Return which part of all lobes is skipped if whole tiles decide, by the tile's side.

    A tile skips what each of its pixels would skip with an equal part of the share: no bound
    of a whole tile can skip more. Pixels must all show surfaces.
    """
    renderer.render(Shot(scene, RenderSettings("ltc"), *SIZE))
    seen = renderer.surfaces()
    width, height = SIZE
    assert len(seen.index) == width * height
    frames = shading_frames(seen.normal, seen.view)
    cosine = np.sum(seen.normal * seen.view, axis=1)
    materials = scene.object_materials()
    alpha = np.array([m.alpha[0] for m in materials])[seen.index]
    f0 = np.array([max(m.f0) for m in materials])[seen.index]
    diffuse = np.array([max(m.diffuse) for m in materials])[seen.index]
    table = load_isotropic()
    one, fresnel = table.albedo_terms(alpha, cosine)
    reflectance = f0 * (one - fresnel) + fresnel
    inverse = transform.invert(table.matrix(alpha, cosine))
    each = share * 2.0**-scene.display.exposure / len(scene.lights)
    skips = []
    for light in scene.lights:
        geometry = light_geometry(light)
        low, high = light_bounds(light).astype(np.float64).reshape(2, 2)
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        to_middle = geometry.origin + middle[0] * geometry.u + middle[1] * geometry.v
        vectors = (to_middle - seen.position, half[0] * geometry.u, half[1] * geometry.v)
        local = [np.einsum("nij,...j->ni", frames, vector) if vector.ndim == 1
                 else np.einsum("nij,nj->ni", frames, vector) for vector in vectors]  # fmt: skip
        lobe = [np.einsum("nij,nj->ni", inverse, vector) for vector in local]
        radiance = max(light.radiance)
        skips.append(radiance * reflectance * form_factor_bound(*lobe) < each)
        skips.append(radiance * diffuse * form_factor_bound(*local) < each)
    return [float(np.mean([_by_tiles(skip, tile) for skip in skips])) for tile in TILES]


def _by_tiles(skip: NDArray[np.bool_], tile: int) -> float:
    width, height = SIZE
    pixels = skip.reshape(height, width)[: height // tile * tile, : width // tile * tile]
    blocks = pixels.reshape(height // tile, tile, width // tile, tile)
    return float(blocks.all(axis=(1, 3)).mean())


def _read(path: Path) -> list[Row]:
    with path.open(newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def tables() -> str:
    """Return the tables of the page."""
    lines = ["| scene | lines | attachments | all memory | frame, CPU ms | pictures differ by |",
             "|---|---|---|---|---|---|"]  # fmt: skip
    for row in _read(EVERYTHING):
        cells = [row["scene"]]
        for what in ("lines", "attachments", "bytes", "ms"):
            pair = [float(row[f"{which} {what}"]) for which in ("needed", "everything")]
            form = {"lines": "{:.0f}", "ms": "{:.0f}"}.get(what)
            texts = [form.format(x) if form else format_bytes(int(x)) for x in pair]
            cells.append(f"{texts[0]} / {texts[1]}")
        difference = float(row["difference"])
        cells.append(row["difference"] if difference else "0")
        lines.append(f"| {' | '.join(cells)} |")
    lines += ["", "| scene | technique | allowed | evaluations | frame, CPU ms | largest error |",
              "|---|---|---|---|---|---|"]  # fmt: skip
    for row in _read(CULLING):
        share = float(row["share"])
        error = f"{float(row['error']) / share:.2f} of it" if share else "-"
        cells = [
            row["scene"], row["technique"], share_text(share) if share else "nothing",
            row["evaluations"], f"{float(row['ms']):.0f}", error,
        ]  # fmt: skip
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def draw() -> None:
    """Draw both tables."""
    plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    figure, (left, right) = plt.subplots(
        1, 2, figsize=(9.6, 4.4), layout="constrained", gridspec_kw={"width_ratios": (1.25, 1)}
    )
    rows = _read(EVERYTHING)
    place = np.arange(len(rows))[::-1]
    for offset, what, label, colour in (
        (0.27, "lines", "lines of shaders", "#7f7f7f"),
        (0.0, "bytes", "memory", "#1b6ca8"),
        (-0.27, "ms", "time", "#d95f02"),
    ):
        part = [float(row[f"needed {what}"]) / float(row[f"everything {what}"]) for row in rows]
        left.barh(place + offset, part, 0.25, color=colour, label=label)
    left.axvline(1.0, color="black", linewidth=0.8)
    left.set_yticks(place, [row["scene"] for row in rows])
    left.set_title("what the scene needs, as a part of everything", fontsize=9)
    left.legend(frameon=False, fontsize=8, ncols=3, loc="lower center", bbox_to_anchor=(0.4, -0.17))
    names = list(dict.fromkeys((row["scene"], row["technique"]) for row in _read(CULLING)))
    colours = plt.get_cmap("viridis")(np.linspace(0.0, 0.9, len(names)))
    for (scene, technique), colour in zip(names, colours, strict=True):
        mine = [r for r in _read(CULLING) if (r["scene"], r["technique"]) == (scene, technique)]
        x = range(len(mine))
        y = [float(row["ms"]) / float(mine[0]["ms"]) for row in mine]
        style = "--" if technique == "ggx" else "-"
        right.plot(x, y, style, color=colour, marker="o", markersize=3,
                   label=f"{scene}, {technique}")  # fmt: skip
    right.set_xticks(range(len(SHARES) + 1), ["nothing", *map(share_text, SHARES)])
    right.set_xlabel("skipped at most, of display white")
    right.set_ylim(0.0, 1.1)
    right.grid(True, color="#e6e6e6", linewidth=0.6)
    right.set_title("time of a frame where faint lights are skipped", fontsize=9)
    right.legend(frameon=False, fontsize=8)
    figure.savefig(PICTURE, dpi=110)


if __name__ == "__main__":
    if "--measure" in sys.argv[1:]:
        measure()
    draw()
    print(tables())
