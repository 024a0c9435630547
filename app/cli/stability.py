"""``ltc-viewer stability``: every technique through the extreme, float32 against float64.

`app.stability` says what is swept and what must hold; this writes what was found: a table, a page,
every number, and the worst case of each technique in each sweep as files to reproduce it.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.table import Table

from app.cli.common import TechniquesOption, headless_renderer, messages, results, whole_number
from app.cli.folder import TimedSteps, check_folder, csv_text, machine_facts
from app.cli.stability_cases import CaseFiles, write_case
from app.cli.stability_page import Figures, number, stability_markdown, stability_page
from app.errors import InputError, expected_one_of
from app.files import replace_file
from app.render.techniques import AUTOMATIC, TECHNIQUES, parse_technique
from app.stability.bounds import bound_of
from app.stability.cases import Sampling, compared_techniques
from app.stability.measure import Row, measure
from app.stability.sweeps import make_sweeps

MAX_POINTS = 1_000_000
MAX_SEED = 2**31 - 1
QUICK = Sampling(points=60, steps=16, compared=10, samples=128)
"""With ``--quick``: half a minute on two cores."""

SHOWN = 12
"""Commands printed at most; all are in the page."""


def stability(
    output: Annotated[
        Path,
        typer.Option("--output", "-o", metavar="DIR", help="Folder for the page and its numbers."),
    ],
    techniques: TechniquesOption = [],  # noqa: B006 (typer copies it)
    sweeps: Annotated[
        list[str] | None,
        typer.Option("--sweep", metavar="NAME", help="What to sweep; repeat for several."),
    ] = None,
    points: Annotated[
        int | None,
        typer.Option(
            "--points",
            metavar="N",
            help="Points a sweep; a series has fewer.",
            parser=whole_number("--points", 1, MAX_POINTS),
            show_default="800",
        ),
    ] = None,
    seed: Annotated[
        int,
        typer.Option(
            "--seed",
            metavar="S",
            help="Of random lights and points.",
            parser=whole_number("--seed", 0, MAX_SEED),
        ),
    ] = 0,
    quick: Annotated[
        bool, typer.Option("--quick", help="Few points, and each technique in its usual setting.")
    ] = False,
) -> None:
    """Hold every technique against float64 through the stiff and the extreme.

    Roughness to 0.0001, views to 89.9 degrees, lights of 0.00001 to 100,000 times
    their distance, needles, horizons, crossing outlines, cusps, seams, points on
    and beside an outline. Writes index.html, stability.md, all numbers as
    results.csv and results.json, and for each technique and sweep the worst case
    as a scene and points in DIR/cases, with the commands that reproduce it.

    Exits with 1 if a documented bound is violated without a named exception.

    \b
    Examples:
      ltc-viewer stability -o stability --quick
      ltc-viewer stability -o stability --sweep horizon --technique ltc --technique ggx:4
    """
    wanted = list(dict.fromkeys(_canonical(name) for name in techniques))
    everything = make_sweeps(seed)
    for name in sweeps or ():
        if name not in everything:
            raise InputError(f"--sweep '{name}' is unknown, {expected_one_of(name, everything)}")
    chosen = [everything[name] for name in dict.fromkeys(sweeps or everything)]
    check_folder(output, "the report")
    base = QUICK if quick else Sampling()
    count = points or base.points
    steps = base.steps if points is None else max(16, min(base.steps, count))
    sampling = Sampling(count, steps, base.compared, base.samples, seed)
    names = wanted or (list(TECHNIQUES) if quick else compared_techniques())
    (output / "cases").mkdir(parents=True, exist_ok=True)
    with headless_renderer() as (ctx, renderer):
        machine = machine_facts(ctx)
        # All lights in textures: in uniform blocks every size of outline would be a program.
        renderer.limits = replace(renderer.limits, uniform_block_bytes=0)
        with np.errstate(all="raise", under="ignore"):
            steps_total = sum(len(s.clouds) + len(s.series) for s in chosen)
            with TimedSteps("sweeping", "cases done", steps_total) as progress:
                found: dict[tuple[str, str], tuple[Row, Row]] = {}
                for done, _, rows in measure(renderer, chosen, names, sampling):
                    found = rows
                    progress.done(done)
    files = {
        key: write_case(output, key[1], max(worst, key=lambda w: w.measure), sampling.samples)
        for key, pair in found.items()
        if (worst := [row.worst for row in pair if row.worst is not None])
    }
    figures = [_figures(row, files.get(key)) for key, pair in found.items() for row in pair]
    settings = {
        "points": sampling.points, "steps": sampling.steps, "samples": sampling.samples,
        "seed": seed,
    }  # fmt: skip
    if not figures:
        raise InputError(
            f"--technique is {', '.join(names)}, which shades no case of these sweeps, expected "
            "another or --sweep with others"
        )
    flat = [{k: v for k, v in row.items() if k != "worst"} for row in figures]
    document = {"machine": machine, "settings": settings, "rows": figures}
    for name, text in (
        ("results.json", json.dumps(document, indent=1, allow_nan=False) + "\n"),
        ("results.csv", csv_text(flat)),
        ("stability.md", stability_markdown(figures, chosen, machine, settings)),
        ("index.html", stability_page(figures, chosen, machine, settings)),
    ):
        replace_file(output / name, text.encode("utf-8"), "a report")
    _print(figures)
    typer.echo(output / "index.html")
    if any(row["verdict"] == "violated" for row in figures):
        raise typer.Exit(1)


def _canonical(name: str) -> str:
    if name == AUTOMATIC:
        raise InputError(
            f"--technique is '{AUTOMATIC}', which depends on a scene, expected one of "
            f"{', '.join(TECHNIQUES)}"
        )
    return str(parse_technique(name))


def _figures(row: Row, files: CaseFiles | None) -> dict[str, Any]:
    figures: dict[str, Any] = row.figures()
    choice = parse_technique(row.technique)
    bounds = [bound_of(choice, curved, row.quantity) for curved in (False, True)]
    figures["bound"] = None if None in bounds else max(b.largest for b in bounds if b is not None)
    # JSON knows no infinity: no rounding explains such an error.
    for key in ("error_median", "error_p95", "error_p99", "error_max", "roundings"):
        if figures[key] is not None and not np.isfinite(figures[key]):
            figures[key] = 1e30
    figures["worst"] = files.figures() if files else None
    return figures


def _print(figures: Sequence[Figures]) -> None:
    """Print a line for each technique, then what is not as it must be, with commands."""
    table = Table("technique", "sweeps", "samples", "not finite", "impossible", "false light",
                  "lost light", "error 99 %", "largest", "in", "jump", "to GGX", "verdict",
                  box=None, pad_edge=False, header_style="bold")  # fmt: skip
    for name in dict.fromkeys(row["technique"] for row in figures):
        some = [row for row in figures if row["technique"] == name]
        specular = [row for row in some if row["quantity"] == "specular"]
        measured = [row for row in specular if row["error_max"] is not None]
        worst = max(measured, key=lambda row: row["error_max"], default=None)
        verdicts = {row["verdict"] for row in some}
        order = ("violated", "exception", "not defined", "holds")
        table.add_row(
            name,
            str(len(specular)),
            str(sum(row["samples"] for row in specular)),
            *(
                str(sum(row[key] for row in some))
                for key in ("non_finite", "impossible", "false_light", "lost_light")
            ),
            number(max((row["error_p99"] for row in measured), default=None)),
            number(worst["error_max"] if worst else None),
            worst["sweep"] if worst else "–",
            number(max((row["jump"] for row in measured), default=None)),
            number(max((row["ggx_mean"] or 0.0 for row in specular), default=None)),
            next(verdict for verdict in order if verdict in verdicts),
        )
    console = results()
    console.print(table)
    shown = 0
    for verdict in ("violated", "exception"):
        for row in figures:
            if row["verdict"] != verdict:
                continue
            shown += 1
            if shown > SHOWN:
                continue
            cause = f": {row['cause']}" if row["cause"] else ""
            line = f"{verdict} {row['technique']}, {row['sweep']}, {row['quantity']}{cause}"
            console.print(line, markup=False, soft_wrap=True)
            if row["worst"]:
                console.print(f"  {row['worst']['probe']}", markup=False, soft_wrap=True)
                console.print(f"  {row['worst']['shot']}", markup=False, soft_wrap=True)
    if shown > SHOWN:
        messages().print(f"{shown - SHOWN} more are in the page.")
