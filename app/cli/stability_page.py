"""The page and the Markdown of ``ltc-viewer stability``."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from html import escape
from typing import Any

from app.cli.html_page import facts_table, html_page, sortable_table
from app.render.techniques import TECHNIQUES, parse_technique
from app.stability.bounds import DEVIATIONS, EXCEPTIONS, QUANTITIES, UNBOUNDED, Bound, bound_of
from app.stability.cases import compared_techniques
from app.stability.sweeps import Sweep

Figures = Mapping[str, Any]
"""What a line of ``results.csv`` holds, by column, and its worst case's files."""

MARKS = {"holds": "", "exception": "*", "violated": "!", "not defined": "?"}
COLOURS = {"holds": "#2f9e4433", "exception": "#e8a00c55", "violated": "#e8300c77"}

INTRODUCTION = (
    "Each technique is evaluated on the GPU in float32 by the very functions of the lighting pass, "
    "and in float64 by its own definition in <code>ltc/</code>, at the same rounded inputs: a "
    "white material (F = 1, albedo 1), lights of radiance 1. What is beyond its bound and not a "
    "named exception is violated, and so is every value that is not finite, negative, above the "
    "light's radiance, light where none can be, or darkness where there must be light. Errors "
    "against exact GGX are those of the model itself and bounded by nothing here."
)

COLUMNS = (
    ("technique", "technique"),
    ("of", "quantity"),
    ("samples", "samples"),
    ("not finite", "non_finite"),
    ("impossible", "impossible"),
    ("false light", "false_light"),
    ("lost light", "lost_light"),
    ("error: median", "error_median"),
    ("95 %", "error_p95"),
    ("99 %", "error_p99"),
    ("largest", "error_max"),
    ("bound", "bound"),
    ("roundings used", "roundings"),
    ("jump", "jump"),
    ("to GGX: mean", "ggx_mean"),
    ("99 %", "ggx_p99"),
    ("largest", "ggx_max"),
    ("verdict", "verdict"),
)


def number(value: Any) -> str:
    """Return a figure as a person reads it: counts whole, errors with two digits."""
    if value is None:
        return "–"
    if isinstance(value, float):
        return f"{value:.0f}" if value == 0.0 else f"{value:.1e}".replace("e-0", "e-")
    return str(value)


def stability_page(
    rows: Sequence[Figures],
    sweeps: Sequence[Sweep],
    machine: Mapping[str, str],
    settings: Mapping[str, Any],
) -> str:
    """Return the whole page."""
    facts = {**machine, **{name: str(value) for name, value in settings.items()}}
    body = [
        "<h1>Stability</h1>",
        f"<p>{INTRODUCTION}</p>",
        facts_table(facts),
        "<h2>Largest errors</h2>",
        "<p>Specular, by technique and sweep. Green holds, orange is a named exception, red "
        "violates.</p>",
        _matrix(rows, sweeps),
    ]
    for sweep in sweeps:
        some = [row for row in rows if row["sweep"] == sweep.name]
        if not some:
            continue
        body.append(f"<h2>{escape(sweep.name)}</h2><p>{escape(sweep.about)}</p>")
        body.append(sortable_table([head for head, _ in COLUMNS], [_line(row) for row in some]))
        body += [_causes(some), _commands(some)]
    body += ["<h2>Bounds</h2>", _bounds_html()]
    return html_page("Stability", body)


def _cell(key: str, value: Any) -> str:
    if isinstance(value, str):
        return f"<td>{escape(value)}</td>"
    order = "Infinity" if value is None else repr(float(value))
    return f'<td data-value="{order}">{number(value)}</td>'


def _line(row: Figures) -> str:
    colour = COLOURS.get(row["verdict"], "none")
    cells = "".join(_cell(key, row.get(key)) for _, key in COLUMNS)
    return f'<tr style="background:{colour}">{cells}</tr>'


def _matrix(rows: Sequence[Figures], sweeps: Sequence[Sweep]) -> str:
    found = {(r["technique"], r["sweep"]): r for r in rows if r["quantity"] == "specular"}
    names = list(dict.fromkeys(row["technique"] for row in rows))
    columns = [sweep.name for sweep in sweeps]
    lines = []
    for name in names:
        cells = [f"<td>{escape(name)}</td>"]
        for column in columns:
            row = found.get((name, column))
            colour = COLOURS.get(row["verdict"], "none") if row else "none"
            value = row["error_max"] if row else None
            order = "Infinity" if value is None else repr(value)
            cells.append(
                f'<td data-value="{order}" style="background:{colour}">{number(value)}</td>'
            )
        lines.append(f"<tr>{''.join(cells)}</tr>")
    return sortable_table(["technique", *columns], lines)


def _causes(rows: Sequence[Figures]) -> str:
    causes = dict.fromkeys(row["cause"] for row in rows if row["cause"])
    return "".join(f"<p><b>Exception:</b> {escape(cause)}</p>" for cause in causes)


def _commands(rows: Sequence[Figures]) -> str:
    lines = []
    for row in rows:
        worst = row.get("worst")
        if worst and row["quantity"] == "specular":
            text = f"{row['technique']}: {worst['what']}, {worst['case']}"
            lines.append(
                f"<p>{escape(text)}<br><code>{escape(worst['probe'])}</code><br>"
                f"<code>{escape(worst['shot'])}</code></p>"
            )
    return f"<details><summary>The worst case of each</summary>{''.join(lines)}</details>"


Line = tuple[str, str, str, str, str, str, str]


def bound_lines() -> list[Line]:
    """Return the table of bounds: technique, light, quantity, largest, roundings, jump, reason."""
    held: dict[tuple[str, ...], dict[str, list[str]]] = {}
    for name in compared_techniques():
        choice = parse_technique(name)
        for curved in (False, True):
            for quantity in QUANTITIES:
                bound = bound_of(choice, curved, quantity)
                if bound is not None:
                    key = "curves" if curved else "polygons", *_numbers_of(bound)
                    held.setdefault(key, {}).setdefault(quantity, []).append(name)
    lines: list[Line] = []
    for (light, largest, roundings, jump, reason), names in held.items():
        # What holds of both lobes of the same techniques is one line.
        groups: dict[tuple[str, ...], list[str]] = {}
        for what, some in names.items():
            groups.setdefault(tuple(some), []).append(what)
        lines += [
            (", ".join(some), light, " and ".join(which), largest, roundings, jump, reason)
            for some, which in groups.items()
        ]
    return lines


def _numbers_of(bound: Bound) -> tuple[str, str, str, str]:
    return (
        f"{bound.largest:g}",
        f"{bound.roundings:g}",
        f"{bound.jump:g}",
        bound.reason,
    )


BOUND_HEADS = ("techniques", "light", "of", "error", "roundings", "jump", "because")


def _bounds_html() -> str:
    lines = [
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in line) + "</tr>"
        for line in bound_lines()
    ]
    return sortable_table(BOUND_HEADS, lines)


# --- Markdown -----------------------------------------------------------------------------

GENERATED = "ltc-viewer stability -o stability"

PREAMBLE = (
    "# Stability\n"
    "\n"
    "Every technique through the stiff and the extreme, float32 on the GPU against float64."
    f" `{GENERATED}` measures it on your machine and writes a page, every number, the worst "
    "cases as scenes and points to reproduce them with `ltc-viewer probe` and `shot`, and "
    "this text, `stability.md`; it exits with 1 if something is beyond its bound without a "
    "named exception. `--quick` takes half a minute, `--sweep`, `--technique` and "
    "`--points` say what and how finely. The property tests in "
    "[`tests/gl/test_stability.py`](../tests/gl/test_stability.py) draw from the same "
    "sweeps and hold the same bounds.\n"
    "\n"
    "## What must hold\n"
    "\n"
    "The lighting pass's own functions shade points of a white material (F = 1, albedo 1) "
    "under lights of radiance 1; the technique's definition in `ltc/` gets the same rounded"
    " inputs. Then\n"
    "\n"
    "- every value is finite, not negative, and no more than the light's radiance;\n"
    "- nothing is lit that certainly sees no light: behind a one-sided light or with all of"
    " it below the surface, by 10⁻⁶ of the distance (*false light*); and nothing is exactly"
    " dark that certainly sees one (*lost light*);\n"
    "- an error is at most its *bound*, what the technique's own rules of quadrature are "
    "documented to err by, and beyond that at most what a number of *roundings* do: the "
    "definition is evaluated again with everything that float32 knows (directions, view, "
    "alphas, control points of curves) moved at random by 2⁻²⁴ of its size, and an error "
    "may be so many times as large as the largest change of six. No float32 program can do "
    "better than a few of these, because its inputs are rounded themselves. At α = 10⁻⁴ one"
    " rounding is 6·10⁻⁴ of a lobe; where the light's plane holds the point, it decides "
    "whether the light is seen at all;\n"
    "- along a series of neighbouring points the error does not *jump*: a step may not "
    "differ from both steps beside it by more than the bound, however finely one looks. "
    "Jumps of `ggx` are measured against exact GGX, others against the exact integral of "
    "the lobe.\n"
    "\n"
    "Points on an outline itself have no integral; there values must be finite and at most "
    f"1.05. A technique that samples is held to {DEVIATIONS:g} standard errors.\n"
)


def static_markdown(sweeps: Sequence[Sweep]) -> str:
    """Return what the text says of sweeps, bounds and exceptions; no measured number."""
    parts = [PREAMBLE]
    parts.append("## The sweeps\n")
    parts.append(_markdown_table(("sweep", "what", "clouds", "series"), [
        (f"`{s.name}`", s.about, str(len(s.clouds)), str(len(s.series))) for s in sweeps
    ]))  # fmt: skip
    parts.append("\n## The bounds\n")
    parts.append(_markdown_table(BOUND_HEADS, bound_lines()))
    parts.append("\n## The exceptions\n")
    parts += [
        f"- **{', '.join(item.techniques)}** in `{item.sweep}`, "
        f"{'curves' if item.curved else 'polygons'}, {' and '.join(item.quantities)}: an error of "
        f"{item.bound.largest:g} or {item.bound.roundings:g} roundings, a jump of "
        f"{item.bound.jump:g}. {item.bound.reason}"
        for item in EXCEPTIONS
    ]
    parts += [f"- **{name}**: {cause}" for name, cause in UNBOUNDED.items()]
    return "\n".join(parts) + "\n"


def stability_markdown(
    rows: Sequence[Figures], sweeps: Sequence[Sweep], machine: Mapping[str, str],
    settings: Mapping[str, Any],
) -> str:  # fmt: skip
    """Return the text with its tables; ``docs/stability.md`` is one of these."""
    names = list(dict.fromkeys(row["technique"] for row in rows))
    shown = [sweep for sweep in sweeps if any(row["sweep"] == sweep.name for row in rows)]
    parts = [static_markdown(sweeps)]
    count = sum(row["samples"] for row in rows) // 2
    bad = {
        key: sum(row[key] for row in rows)
        for key in ("non_finite", "impossible", "false_light", "lost_light")
    }
    parts.append("## What was found\n")
    parts.append(
        f"{count:,} points and techniques; {bad['non_finite']} values not finite, "
        f"{bad['impossible']} impossible, {bad['false_light']} of false light, "
        f"{bad['lost_light']} of light lost; "
        f"{sum(row['verdict'] == 'violated' for row in rows)} rows violate a bound. Measured on "
        f"{machine['renderer']}, {settings['points']} points a sweep and {settings['steps']} a "
        f"series, seed {settings['seed']}. \\* marks a named exception, ! a violation, ? a "
        "technique that has no bound.\n"
    )
    for quantity in QUANTITIES:
        parts.append(f"### {quantity.capitalize()}: 99 % of errors below / largest\n")
        parts.append(_matrix_markdown(rows, names, shown, quantity, _errors))
    parts.append("### Roundings that the largest excess takes / largest jump, specular\n")
    parts.append(_matrix_markdown(rows, names, shown, "specular", _used))
    parts.append("### Against exact GGX, specular: mean / largest\n")
    parts.append("What the model itself errs; for information, nothing bounds it here.\n")
    parts.append(_matrix_markdown(rows, names, shown, "specular", _fit))
    return "\n".join(parts) + "\n"


def _errors(row: Figures) -> str:
    return f"{number(row['error_p99'])} / {number(row['error_max'])}"


def _used(row: Figures) -> str:
    used = row["roundings"]
    text = "–" if used is None else f"{used:.1f}" if used < 100.0 else "> 99"
    return f"{text} / {number(row['jump'])}"


def _fit(row: Figures) -> str:
    return f"{number(row['ggx_mean'])} / {number(row['ggx_max'])}"


def _matrix_markdown(
    rows: Sequence[Figures],
    names: Sequence[str],
    sweeps: Sequence[Sweep],
    quantity: str,
    show: Callable[[Figures], str],
) -> str:
    found = {(r["technique"], r["sweep"]): r for r in rows if r["quantity"] == quantity}
    lines = []
    for name in names:
        cells = []
        for sweep in sweeps:
            row = found.get((name, sweep.name))
            cells.append(show(row) + MARKS[row["verdict"]].replace("*", " \\*") if row else "–")
        lines.append((f"`{name}`", *cells))
    return _markdown_table(("", *(sweep.name for sweep in sweeps)), lines) + "\n"


def _markdown_table(heads: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    rows = [heads, ["---"] * len(heads), *lines]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in rows)


assert all(name in TECHNIQUES for item in EXCEPTIONS for name in item.techniques)
