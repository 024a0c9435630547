"""What more curves cost: `curve_cost.csv` and ``docs/images/curves-cost.png``.

    .venv/bin/pip install "matplotlib>=3.9"
    .venv/bin/python -m docs.figures.curve_cost [--measure]

``--measure`` writes the figures anew (some minutes); without it they are only drawn. Times
are CPU seconds of all threads, so a machine with other work to do disturbs them little,
and only mean what they say where a software rasteriser draws.
"""

from __future__ import annotations

import csv
import sys
import time
from collections.abc import Callable
from pathlib import Path

import matplotlib.pyplot as plt
import moderngl
import numpy as np

from app.context import headless_context
from app.render.renderer import Renderer
from app.render.timers import is_software
from app.scene import Material, Outline, Plane, RenderSettings, Scene, Shot
from tests.gl.cost_scenes import (
    BEHIND,
    FAR,
    GLOSSY,
    NEAR,
    SHARP,
    evaluations,
    hearts,
    lit_floor,
    waves,
)

DATA = Path(__file__).with_suffix(".csv")
PICTURE = Path(__file__).parents[1] / "images" / "curves-cost.png"

COUNTS = (6, 12, 24, 48, 96, 192, 384, 768)
SIZE = (120, 80)
REPEATS = 5
BLACK = Material("floor", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))

Build = Callable[[int], Outline]
PLACES: dict[str, tuple[Build, Plane, Material]] = {
    "waves, near": (waves, NEAR, GLOSSY),
    "hearts, near": (hearts, NEAR, GLOSSY),
    "waves, far": (waves, FAR, GLOSSY),
    "waves, outside sharp lobes": (waves, BEHIND, SHARP),
}
TECHNIQUES = ("ltc", "adaptive", "uniform:18")
COLUMNS = ("scene", "technique", "curves", "mean evaluations", "most evaluations", "ms")

LINES = (
    ("waves, near", "uniform:18", "uniform:18", "#7f7f7f", "-"),
    ("waves, near", "adaptive", "adaptive", "#d95f02", "-"),
    ("waves, near", "ltc", "ltc", "#1b6ca8", "-"),
    ("hearts, near", "ltc", "ltc, hearts", "#1b6ca8", "--"),
    ("waves, far", "adaptive", "adaptive, far", "#d95f02", ":"),
    ("waves, outside sharp lobes", "adaptive", "adaptive, outside lobes", "#d95f02", "-."),
    ("waves, far", "ltc", "ltc, far", "#1b6ca8", ":"),
    ("waves, outside sharp lobes", "ltc", "ltc, outside lobes", "#1b6ca8", "-."),
)
"""Scene, technique, label, colour and style."""

Row = dict[str, str]


def measure() -> None:
    """Render all scenes and write the table."""
    context = headless_context()
    with context, DATA.open("w", newline="", encoding="utf-8") as stream:
        assert is_software(str(context.info["GL_RENDERER"])), "CPU seconds of a GPU mean nothing"
        renderer = Renderer(context)
        table = csv.writer(stream, lineterminator="\n")
        table.writerow(COLUMNS)
        for name, (outline, plane, material) in PLACES.items():
            for count in COUNTS:
                shape = outline(count)
                scene = lit_floor(shape, plane, material)
                idle = _milliseconds(context, renderer, lit_floor(shape, plane, BLACK), "ltc")
                for technique in TECHNIQUES:
                    cost = evaluations(renderer, scene, technique, SIZE)
                    shading = _milliseconds(context, renderer, scene, technique) - idle
                    mean, most = f"{cost.mean():.3f}", f"{cost.max():.0f}"
                    table.writerow((name, technique, count, mean, most, f"{shading:.2f}"))
                print(name, count)
        renderer.release()


def _milliseconds(
    context: moderngl.Context, renderer: Renderer, scene: Scene, technique: str
) -> float:
    """Return the median CPU time of a frame, all threads together."""
    shot = Shot(scene, RenderSettings(technique), *SIZE)
    times = []
    for _ in range(REPEATS + 1):
        start = time.process_time()
        renderer.render(shot)
        context.finish()
        times.append(1e3 * (time.process_time() - start))
    return float(np.median(times[1:]))  # the first compiles


def draw() -> None:
    """Draw the table."""
    with DATA.open(newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    figure, axes = plt.subplots(1, 2, figsize=(9.6, 4.2), layout="constrained", sharex=True)
    for axis, column, title in zip(
        axes,
        ("mean evaluations", "ms"),
        (
            "evaluations of the contour integral a pixel, mean",
            f"shading {SIZE[0]}×{SIZE[1]} pixels, CPU ms of two cores (llvmpipe)",
        ),
        strict=True,
    ):
        for scene, technique, label, colour, style in LINES:
            mine = [r for r in rows if (r["scene"], r["technique"]) == (scene, technique)]
            x = [int(row["curves"]) for row in mine]
            y = [float(row[column]) for row in mine]
            axis.loglog(x, y, style, color=colour, label=label, linewidth=1.6)
            if (scene, technique) == ("waves, near", "ltc") and column == "mean evaluations":
                most = [float(row["most evaluations"]) for row in mine]
                axis.fill_between(x, y, most, color=colour, alpha=0.15, linewidth=0)
                middle = (y[-2] * most[-2]) ** 0.5
                axis.text(x[-2], middle, "to the costliest", color=colour, ha="center", fontsize=8)
        axis.set_title(title, fontsize=9)
        axis.set_xlabel("curves of the light")
        axis.set_xticks(COUNTS, [str(count) for count in COUNTS])
        axis.minorticks_off()
        axis.grid(True, color="#e6e6e6", linewidth=0.6)
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside right center", frameon=False)
    figure.savefig(PICTURE, dpi=110)


if __name__ == "__main__":
    if "--measure" in sys.argv[1:]:
        measure()
    draw()
