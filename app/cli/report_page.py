"""The page of ``ltc-viewer report``: one HTML file that loads nothing from elsewhere."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from app.cli.drawing import Drawing, Mark, svg_element
from app.cli.html_page import facts_table, html_page, sortable_table
from app.cli.report_parts import Row
from app.cli.report_pictures import FULL_COLOUR, OTHER, STANDARD, Pictures
from app.cli.report_plots import (
    EVALUATIONS,
    STYLES,
    TIME,
    kind_of,
    scene_plot,
    summary_plot,
    summary_rows,
)
from app.plan_rows import format_bytes

COLUMNS = (
    ("technique", "technique"),
    ("lighting [ms]", "lighting_ms"),
    ("wall [ms]", "wall_ms"),
    ("evaluations", "evaluations"),
    ("tables", "table_bytes"),
    ("bytes in all", "bytes"),
    ("specular to GGX: mean", "specular_ggx_mean"),
    ("p95", "specular_ggx_p95"),
    ("max", "specular_ggx_max"),
    ("specular to own integral: mean", "specular_own_mean"),
    ("p95", "specular_own_p95"),
    ("max", "specular_own_max"),
    ("diffuse: mean", "diffuse_mean"),
    ("max", "diffuse_max"),
    ("picture", "picture_share"),
)
"""Heading and key of the tables' columns; ``results.csv`` has more."""

ABOUT = (
    "<p>What each technique costs, and how far its picture is from the truth: errors are the "
    "absolute differences at random pixels of radiance from the exact integral of GGX, in float64 "
    "along the very outlines, for lights of radiance 1 on a white material (F = 1, albedo 1). The "
    "error to a technique's <em>own integral</em>, that of the lobe which its table fits, leaves "
    "out what the fitted lobe itself errs. <em>Picture</em> is the mean difference of the "
    f"scene's own picture from {STANDARD}, over its mean. Filled points are on the Pareto front: "
    "no other technique is both faster and more exact. Whiskers span the quartiles of the "
    "time.</p>"
)

ABOUT_PICTURES = (
    f"Where {OTHER} differs most from {STANDARD}: left the picture, right its difference from "
    f"{STANDARD}, which itself is within a few 1e-4 of GGX unless lights have pictures; orange is "
    f"too bright, blue too dark, in full colour at {FULL_COLOUR:.0%} of the crop's median radiance."
)


def report_page(
    rows: Sequence[Row],
    pictures: Mapping[tuple[str, str], Pictures],
    machine: Mapping[str, str],
    settings: Mapping[str, Any],
) -> str:
    """Return the whole page.

    Parameters
    ----------
    rows : sequence of Row
        In the order in which they shall stand.
    pictures : mapping of Pictures
        By scene and technique.
    machine, settings : mapping
        Names and values for the tables at the top.
    """
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    facts = {**machine, **{name: str(value) for name, value in settings.items()}}
    body = ["<h1>Error against run time</h1>", ABOUT, _about_times(rows), facts_table(facts)]
    if len(scenes) > 1:
        body += _summary(rows)
        links = ", ".join(f"<b>{escape(scene)}</b>" for scene in scenes)
        body.append(f"<p>Below, scene by scene: {links}.</p>")
    for scene in scenes:
        body += _scene(scene, [row for row in rows if row["scene"] == scene], pictures)
    return html_page("Error against run time", body)


def _about_times(rows: Sequence[Row]) -> str:
    clocks = sorted({row["timing"] for row in rows})
    text = f"<p>Times are medians per pass by {escape(' and '.join(clocks))}"
    if "wall clock" in clocks:
        text += (
            ", because this renderer's timer queries are not to be trusted: each pass ends with "
            "glFinish, so they contain what else the machine does"
        )
    if "processor time" in clocks:
        text += (
            ", what this process took of all processors together, because this renderer's timer "
            "queries are not to be trusted and the machine did other things too"
        )
    if any("llvmpipe" in row["renderer"] for row in rows):
        text += (
            ". <b>This is a software rasteriser: its times are those of a processor, not of a "
            "GPU</b>"
        )
    return text + (
        ". Of a technique that samples they are those of all its samples: <code>reference:64</code>"
        " is 64 samples a pixel, and its error is their noise. A pixel's <em>evaluations</em> of "
        "the integral along the outlines depend on no machine, but one of another technique is "
        f"other work. {_about_truth(rows)} All numbers are in <code>results.csv</code> and "
        "<code>results.json</code>.</p>"
    )


def _about_truth(rows: Sequence[Row]) -> str:
    """Return how exact the truths are themselves."""
    exact, sampled = (
        [row["truth_uncertainty"] for row in rows if row["truth"] == kind]
        for kind in ("exact", "reference")
    )
    text = ""
    if exact:
        text += (
            "The exact integrals differ from finer ones, at every eighth of their points, by "
            f"{max(exact):.0e} at most; no error below that means anything."
        )
    if sampled:
        text += (
            " Lights with pictures have no exact integral here: there the truth is what "
            f"<code>reference</code> converges to, with a standard error of {max(sampled):.0e} "
            "at most."
        )
    return text


def _summary(rows: Sequence[Row]) -> list[str]:
    found = summary_rows(rows)
    if not found:
        return []
    heads = ("technique", "lighting [ms]", "error to GGX", "least of a scene", "most of a scene")
    lines = []
    for row in found:
        cells = "".join(
            f'<td data-value="{row[key]!r}">{form(row[key])}</td>'
            for key, form in (
                (TIME, _milliseconds), ("error", _small), ("least", _small), ("most", _small),
            )
        )  # fmt: skip
        front = ' class="front"' if row["on_front"] else ""
        lines.append(f"<tr{front}><td>{escape(row['technique'])}</td>{cells}</tr>")
    return [
        "<h2>All scenes</h2>",
        f"<p>Geometric means over the {found[0]['scenes']} scenes that every technique was "
        "measured in; what is the same as ltc where nothing is curved counts as that there.</p>",
        '<div class="side">',
        _figure(summary_plot(rows), "Mean error to GGX by time of the lighting pass"),
        "</div>",
        _legend([row["technique"] for row in found]),
        sortable_table(heads, lines),
    ]


def _scene(
    scene: str, rows: Sequence[Row], pictures: Mapping[tuple[str, str], Pictures]
) -> list[str]:
    body = [f"<h2>{escape(scene)}</h2>", '<div class="side">']
    for lobe, meaning in (("ggx", "GGX"), ("own", "its own integral")):
        body.append(_figure(scene_plot(rows, TIME, lobe), f"Against {meaning}, by time"))
    body.append(_figure(scene_plot(rows, EVALUATIONS, "ggx"), "Against GGX, by evaluations"))
    body += ["</div>", _legend([row["technique"] for row in rows]), _table(rows)]
    body.append(f"<h3>Pictures</h3><p>{escape(ABOUT_PICTURES)}</p>")
    body.append('<div class="side">')
    for row in rows:
        seen = pictures[scene, row["technique"]]
        name = escape(row["technique"])
        body.append(
            f'<figure><div class="side" style="gap:2px"><img src="{seen.picture}" '
            f'alt="{name}"><img src="{seen.difference}" alt="difference of {name}"></div>'
            f"<figcaption>{name}, difference</figcaption></figure>"
        )
    return [*body, "</div>"]


def _figure(plot: Drawing | None, caption: str) -> str:
    picture = "<p>There is nothing to show.</p>" if plot is None else svg_element(plot)
    return f"<figure>{picture}<figcaption>{escape(caption)}</figcaption></figure>"


def _legend(techniques: Sequence[str]) -> str:
    found = {kind_of(technique) for technique in techniques}
    keys = []
    for name, (colour, shape) in STYLES.items():
        if name not in found:
            continue
        key = svg_element(Drawing(12, 12, name, [Mark(6, 6, shape, colour, True, 4.0)]))
        keys.append(f"{key} {escape(name)}")
    return f"<p>{' &nbsp; '.join(keys)}</p>"


def _table(rows: Sequence[Row]) -> str:
    lines = []
    for row in rows:
        cells = "".join(_cell(key, row.get(key)) for _, key in COLUMNS)
        lines.append(
            f'<tr class="front">{cells}</tr>' if row["on_front_ggx"] else f"<tr>{cells}</tr>"
        )
    table = sortable_table([head for head, _ in COLUMNS], lines)
    return f"{table}<p>Click a heading to sort; bold techniques are on the front.</p>"


def _milliseconds(value: float) -> str:
    return f"{value:.3f}" if value < 10.0 else f"{value:.1f}"


def _small(value: float) -> str:
    return f"{value:.1e}"


def _cell(key: str, value: Any) -> str:
    if value is None:
        return '<td data-value="Infinity">–</td>'
    if isinstance(value, str):
        return f"<td>{escape(value)}</td>"
    if key.endswith("bytes"):
        text = format_bytes(int(value))
    elif key == "picture_share":
        text = f"{value:.3%}"
    elif key.startswith(("specular", "diffuse")):
        text = _small(value)
    else:
        text = _milliseconds(value)
    return f'<td data-value="{value!r}">{text}</td>'
