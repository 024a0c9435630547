"""The report's plots: error against time, in each scene and in the mean of many."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from app.cli.drawing import Drawing, Shape
from app.cli.log_plot import Point, log_plot, pareto_front
from app.cli.report_parts import Row
from app.measure.entries import parse_entry

STYLES: Mapping[str, tuple[str, Shape]] = {
    "ltc": ("#2f81f7", "circle"),
    "ggx": ("#e8590c", "square"),
    "adaptive": ("#2f9e44", "triangle"),
    "adaptive-extrapolated": ("#12a5a5", "down"),
    "uniform": ("#ae4ad6", "diamond"),
    "reference": ("#868e96", "cross"),
    "representative-point": ("#e03177", "triangle"),
}
"""Colour and shape by a technique's bare name; each at least 3:1 against white and black."""

OTHER: tuple[str, Shape] = ("#868e96", "diamond")

TIME, EVALUATIONS = "lighting_ms", "evaluations"
AXES = {TIME: "lighting pass [ms]", EVALUATIONS: "evaluations per pixel"}
ERROR = "mean specular error"

SUMMARY = "all-scenes"
"""Name of the plot of means over all scenes, and its file."""


def style_of(technique: str) -> tuple[str, Shape]:
    """Return colour and shape of a technique's marks."""
    return STYLES.get(technique.partition(":")[0], OTHER)


def scene_plot(rows: Sequence[Row], x: str, lobe: str) -> Drawing | None:
    """Return the plot of one scene: ``x`` is `TIME` or `EVALUATIONS`, ``lobe`` ggx or own."""
    points = []
    for row in rows:
        error, cost = row[f"specular_{lobe}_mean"], row.get(x)
        if error is None or cost is None:
            continue
        low, high = (row[f"{x[:-3]}_{q}_ms"] if x == TIME else cost for q in ("q1", "q3"))
        # The front is that of times; evaluations of different techniques are not the same work.
        on_front = x == TIME and bool(row[f"on_front_{lobe}"])
        points.append(_point(row["technique"], cost, error, low, high, on_front))
    title = f"{rows[0]['scene']}: {ERROR} by {AXES[x]}"
    return log_plot(points, title, AXES[x], ERROR)


def _point(
    technique: str, cost: float, error: float, low: float, high: float, on_front: bool,
    low_y: float = 0.0, high_y: float = 0.0,
) -> Point:  # fmt: skip
    colour, shape = style_of(technique)
    series = technique.partition(":")[0]
    return Point(cost, error, technique, colour, low, high, on_front, shape, series, low_y, high_y)


def summary_rows(rows: Sequence[Row]) -> list[Row]:
    """Return one row a technique: geometric means over scenes that are the same for all.

    Those are the scenes that ``ltc`` was measured in; a technique that a scene leaves out because
    without curves it is ``ltc`` counts as ``ltc`` there, others that miss one are left out. Errors
    of 0 count as 1e-9, a hundredth of what float32 can tell.
    """
    by_scene: dict[str, dict[str, Row]] = {}
    for row in rows:
        if None not in (row.get(TIME), row["specular_ggx_mean"]):
            by_scene.setdefault(row["scene"], {})[row["technique"]] = row
    by_scene = {name: some for name, some in by_scene.items() if "ltc" in some}
    found = []
    names = {row["technique"] for row in rows}
    for technique in sorted(names, key=lambda name: parse_entry(name).place()):
        alike = technique.partition(":")[0] in (
            "ltc", "adaptive", "adaptive-extrapolated", "uniform",
        )  # fmt: skip
        some = [
            scene.get(technique, scene["ltc"] if alike else None) for scene in by_scene.values()
        ]
        whole = [row for row in some if row is not None]
        if not whole or len(whole) < len(some):
            continue
        times = [row[TIME] for row in whole]
        errors = [max(row["specular_ggx_mean"], 1e-9) for row in whole]
        found.append(
            {
                "technique": technique,
                "scenes": len(whole),
                TIME: _geometric_mean(times),
                "error": _geometric_mean(errors),
                "least": min(errors),
                "most": max(errors),
            }
        )
    best = pareto_front([(row[TIME], row["error"]) for row in found])
    return [{**row, "on_front": int(on)} for row, on in zip(found, best, strict=True)]


def _geometric_mean(values: Sequence[float]) -> float:
    return math.exp(sum(math.log(value) for value in values) / len(values))


def summary_plot(rows: Sequence[Row]) -> Drawing | None:
    """Return the plot of `summary_rows`."""
    points = [
        _point(row["technique"], row[TIME], row["error"], 0.0, 0.0, bool(row["on_front"]))
        for row in summary_rows(rows)
    ]
    return log_plot(points, f"all scenes: {ERROR} by {AXES[TIME]}", AXES[TIME], ERROR)


def named_plots(rows: Sequence[Row]) -> dict[str, Drawing]:
    """Return the plots that become files, by name without suffix."""
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    plots = {SUMMARY: summary_plot(rows)} if len(scenes) > 1 else {}
    for scene in scenes:
        plots[scene] = scene_plot([row for row in rows if row["scene"] == scene], TIME, "ggx")
    return {name: plot for name, plot in plots.items() if plot is not None}
