"""The page of ``ltc-viewer report``: one HTML file that loads nothing from elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

from app.cli.html_page import facts_table, html_page, sortable_table
from app.cli.log_plot import Point, log_plot
from app.plan_rows import format_bytes

Row = dict[str, Any]
"""One measured scene and technique: what a line of ``results.csv`` holds, by column."""

COLOURS = {
    "ltc": "#2f81f7",
    "ggx": "#e8590c",
    "adaptive": "#2f9e44",
    "adaptive-extrapolated": "#12a5a5",
    "uniform": "#ae4ad6",
}
"""By a technique's bare name; each at least 3:1 against white and against black."""

OTHER_COLOUR = "#868e96"

COLUMNS = (
    ("technique", "technique"),
    ("lighting [ms]", "lighting_ms"),
    ("wall [ms]", "wall_ms"),
    ("evaluations", "evaluations"),
    ("bytes", "bytes"),
    ("specular to GGX: mean", "specular_ggx_mean"),
    ("p95", "specular_ggx_p95"),
    ("max", "specular_ggx_max"),
    ("specular to own integral: mean", "specular_own_mean"),
    ("p95", "specular_own_p95"),
    ("max", "specular_own_max"),
    ("diffuse: mean", "diffuse_mean"),
    ("max", "diffuse_max"),
)
"""Heading and key of the tables' columns; ``results.csv`` has more."""


@dataclass(frozen=True)
class Pictures:
    """A crop of what a technique renders, and its difference, as ``data:`` addresses."""

    picture: str
    difference: str


def report_page(
    rows: Sequence[Row],
    pictures: dict[tuple[str, str], Pictures],
    machine: dict[str, str],
    settings: dict[str, Any],
    about_pictures: str,
) -> str:
    """Return the whole page.

    Parameters
    ----------
    rows : sequence of Row
        In the order in which they shall stand.
    pictures : dict of Pictures
        By scene and technique.
    machine, settings : dict
        Names and values for the tables at the top.
    about_pictures : str
        A sentence on what the differences show.
    """
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    clocks = sorted({row["timing"] for row in rows})
    body = [
        "<h1>Error against run time</h1>",
        "<p>What each technique costs, and how far its picture is from the truth: errors are the "
        "absolute differences at random pixels of radiance from the exact integral of GGX, in "
        "float64 along the very outlines, for lights of radiance 1 on a white material (F = 1, "
        "albedo 1). The error to a technique's <em>own integral</em>, that of the lobe which its "
        "table fits, leaves out what the fitted lobe itself errs. Where materials are anisotropic, "
        "errors are those of the isotropic lobe of the same area. Filled points are on the Pareto "
        "front: no other technique is both faster and more exact. Whiskers span the quartiles of "
        "the time.</p>",
        f"<p>Times are medians per pass by {escape(' and '.join(clocks))}"
        + (
            ", because this renderer's timer queries are not to be trusted: each pass ends with "
            "glFinish, so they contain what else the machine does."
            if "wall clock" in clocks
            else "."
        )
        + " A pixel's <em>evaluations</em> of the integral along the outlines depend on no "
        "machine, but one of another technique is other work. All numbers are in "
        "<code>results.csv</code> and <code>results.json</code>.</p>",
        facts_table({**machine, **{name: str(value) for name, value in settings.items()}}),
    ]
    if len(scenes) > 1:
        body += ["<h2>All scenes</h2>", '<div class="side">', _plot_all(rows), "</div>", _legend()]
    for scene in scenes:
        some = [row for row in rows if row["scene"] == scene]
        body.append(f"<h2>{escape(scene)}</h2>")
        body.append('<div class="side">')
        for lobe, meaning in (("ggx", "GGX"), ("own", "its own integral")):
            body.append(_figure(_plot(some, "lighting_ms", lobe), f"Against {meaning}, by time"))
        body.append(_figure(_plot(some, "evaluations", "ggx"), "Against GGX, by evaluations"))
        body += ["</div>", _legend(some), _table(some)]
        body.append(f"<h3>Pictures</h3><p>{escape(about_pictures)}</p>")
        body.append('<div class="side">')
        for row in some:
            seen = pictures[scene, row["technique"]]
            name = escape(row["technique"])
            body.append(
                f'<figure><div class="side" style="gap:2px"><img src="{seen.picture}" '
                f'alt="{name}"><img src="{seen.difference}" alt="difference of {name}"></div>'
                f"<figcaption>{name}, difference</figcaption></figure>"
            )
        body.append("</div>")
    return html_page("Error against run time", body)


def _colour(technique: str) -> str:
    return COLOURS.get(technique.partition(":")[0], OTHER_COLOUR)


def _points(rows: Sequence[Row], x: str, lobe: str, label: str, front: bool) -> list[Point]:
    points = []
    for row in rows:
        error, cost = row[f"specular_{lobe}_mean"], row.get(x)
        if error is None or cost is None:
            continue
        is_time = x.endswith("_ms")
        low, high = (row[f"{x[:-3]}_{q}_ms"] if is_time else cost for q in ("q1", "q3"))
        on_front = front and bool(row[f"on_front_{lobe}"])
        name = label.format(**row)
        points.append(Point(cost, error, name, _colour(row["technique"]), low, high, on_front))
    return points


AXES = {"lighting_ms": "lighting pass [ms]", "evaluations": "evaluations per pixel"}


def _plot(rows: Sequence[Row], x: str, lobe: str) -> str:
    # The front is that of times; evaluations of different techniques are not the same work.
    points = _points(rows, x, lobe, "{technique}", front=x == "lighting_ms")
    title = f"{rows[0]['scene']}: mean specular error by {AXES[x]}"
    return log_plot(points, title, AXES[x], "mean specular error")


def _plot_all(rows: Sequence[Row]) -> str:
    label = "{technique}, {scene}"
    points = _points(rows, "lighting_ms", "ggx", label, front=False)
    plot = log_plot(
        points, "all scenes", AXES["lighting_ms"], "mean specular error", labelled=False
    )
    return _figure(plot, "Every scene and technique, against GGX, by time")


def _figure(picture: str, caption: str) -> str:
    return f"<figure>{picture}<figcaption>{escape(caption)}</figcaption></figure>"


def _legend(rows: Sequence[Row] = ()) -> str:
    names = list(dict.fromkeys(row["technique"].partition(":")[0] for row in rows)) or [*COLOURS]
    keys = " &nbsp; ".join(
        f'<span style="color:{_colour(name)}">&#9679;</span> {escape(name)}' for name in names
    )
    return f"<p>{keys}</p>"


def _table(rows: Sequence[Row]) -> str:
    lines = []
    for row in rows:
        cells = "".join(_cell(key, row.get(key)) for _, key in COLUMNS)
        lines.append(
            f'<tr class="front">{cells}</tr>' if row["on_front_ggx"] else f"<tr>{cells}</tr>"
        )
    table = sortable_table([head for head, _ in COLUMNS], lines)
    return f"{table}<p>Click a heading to sort; bold techniques are on the front.</p>"


def _cell(key: str, value: Any) -> str:
    if value is None:
        return '<td data-value="Infinity">–</td>'
    if isinstance(value, str):
        return f"<td>{escape(value)}</td>"
    if key == "bytes":
        text = format_bytes(int(value))
    else:
        text = f"{value:.1e}" if key.startswith(("specular", "diffuse")) else f"{value:.3g}"
        if key.endswith("_ms") or key == "evaluations":
            text = f"{value:.3f}" if value < 10.0 else f"{value:.1f}"
    return f'<td data-value="{value!r}">{text}</td>'
