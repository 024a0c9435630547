"""The report's plots: error against time, in each scene and in the mean of many."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from app.cli.drawing import Drawing, Shape
from app.cli.log_plot import Point, log_plot
from app.cli.report_parts import Row
from app.measure.entries import Entry, parse_entry
from app.measure.front import pareto_front
from app.render.techniques import VARIANTS

STYLES: Mapping[str, tuple[str, Shape]] = {
    "ltc": ("#2f81f7", "circle"),
    "ltc, other tables": ("#7a73e8", "diamond"),
    "ltc, cut otherwise": ("#b8860b", "down"),
    "ltc, other looks at pictures": ("#0b8f6f", "triangle"),
    "ggx": ("#e8590c", "square"),
    "adaptive": ("#2f9e44", "triangle"),
    "adaptive-extrapolated": ("#12a5a5", "down"),
    "uniform": ("#ae4ad6", "diamond"),
    "reference": ("#868e96", "cross"),
    "ltc+residual": ("#5c940d", "cross"),
    "representative-point": ("#e03177", "triangle"),
}
"""Colour and shape by kind, see `kind_of`; each at least 3:1 against white and against black."""

OTHER: tuple[str, Shape] = ("#868e96", "square")

TIME, EVALUATIONS = "lighting_ms", "evaluations"
AXES = {TIME: "lighting pass [ms]", EVALUATIONS: "evaluations per pixel"}
ERROR = "mean specular error"

SUMMARY = "all-scenes"
"""Name of the plot of means over all scenes, and its file."""


def kind_of(technique: str) -> str:
    """Return what kind of entry one is: its bare name, or what a variant changes."""
    entry = parse_entry(technique)
    if not entry.variant:
        return entry.name
    changes = VARIANTS[entry.variant]
    if changes.is_of_pictures:
        return "ltc, other looks at pictures"
    return "ltc, other tables" if changes.residual is not None else "ltc, cut otherwise"


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
    technique: str, cost: float, error: float, low: float, high: float, on_front: bool
) -> Point:
    kind = kind_of(technique)
    colour, shape = STYLES.get(kind, OTHER)
    series = "" if kind == "ltc, cut otherwise" else kind
    return Point(cost, error, technique, colour, low, high, on_front, shape, series)


def summary_rows(rows: Sequence[Row]) -> list[Row]:
    """Return one row a technique: geometric means over the scenes that every one was measured in.

    What a scene leaves out because without curves it is ``ltc`` counts as ``ltc`` there. Errors of
    0 count as 1e-9, a hundredth of what float32 can tell.
    """
    by_scene: dict[str, dict[str, Row]] = {}
    for row in rows:
        if None not in (row.get(TIME), row["specular_ggx_mean"]):
            by_scene.setdefault(row["scene"], {})[row["technique"]] = row
    entries = sorted(
        (parse_entry(name) for name in {r["technique"] for r in rows}), key=Entry.place
    )
    for scene in by_scene.values():
        for entry in entries:
            if "ltc" in scene and entry.looks_up and not entry.variant:
                scene.setdefault(str(entry), scene["ltc"])
    names = [str(entry) for entry in entries]
    shared = [scene for scene in by_scene.values() if set(names) <= set(scene)]
    found = []
    for technique in names if shared else ():
        times = [scene[technique][TIME] for scene in shared]
        errors = [max(scene[technique]["specular_ggx_mean"], 1e-9) for scene in shared]
        found.append(
            {
                "technique": technique,
                "scenes": len(shared),
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
