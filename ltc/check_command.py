"""``python -m ltc check``: arguments, and the report as a table on stdout."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from ltc import check_plots, formats
from ltc.check import Report, check

DESCRIPTION = (
    "Examine a table of transforms: determinants, neighbours, mass below the horizon, amplitude,"
    " seams, half floats and the error of the shading integral. Exit code 1 if it is broken."
)


def add_parser(commands: Any) -> None:
    """Add the subcommand to argparse's."""
    parser = commands.add_parser(
        "check",
        help="examine a table, this project's or a published one",
        description=DESCRIPTION,
        epilog="example: python -m ltc check ltc_1.dds ltc_2.dds --plots plots",
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )
    parser.add_argument(
        "files",
        type=Path,
        nargs="+",
        metavar="TABLE",
        help=".npz of this project; .dds (both), .js or .inc of Heitz et al.;"
        " .npy of KT et al.: matrices, then amplitude, then Fresnel part",
    )
    parser.add_argument("--plots", type=Path, metavar="DIR", help="write pictures there")
    parser.add_argument("--seed", type=int, default=1, help="of all randomness")
    parser.add_argument("--rectangles", type=int, default=2000, help="shading integrals to compare")


def run(arguments: argparse.Namespace) -> int:
    """Run the subcommand; return 0 for a sound table and 1 for a broken one.

    Raises
    ------
    ValueError, OSError
        If a file or an argument is bad.
    """
    plots: Path | None = arguments.plots
    if plots is not None and not check_plots.available():
        raise ValueError("--plots needs matplotlib: pip install 'ltc-viewer[plots]'")
    if plots is not None and plots.exists() and not plots.is_dir():
        raise ValueError(f"{plots}: is a file, expected a folder for pictures")
    if arguments.seed < 0:
        raise ValueError(f"seed is {arguments.seed}, expected 0 or more")
    for file in arguments.files:
        if not file.is_file():
            raise ValueError(f"{file}: no such file, expected a table")
    report = check(formats.read(arguments.files, True), arguments.seed, arguments.rectangles)
    show(report, str(arguments.files[0]))
    if plots is not None:
        for path in check_plots.write_plots(report, plots):
            print(path, file=sys.stderr)
    return 1 if report.faults else 0


def show(report: Report, name: str) -> None:
    """Print a report on stdout."""
    console = Console(highlight=False)
    if not console.is_terminal:
        console = Console(highlight=False, width=120)  # files and pipes have no width of their own
    console.print(f"{name}: {report.layout}", markup=False)
    table = Table(box=None, pad_edge=False)
    for column in ("", "check", "found", "remarks"):
        table.add_column(column, overflow="fold")
    for finding in report.findings:
        if finding.fault is not None:
            mark, note = "[bold red]FAULT[/]", f"{finding.fault}: {finding.note}"
        else:
            mark, note = ("[yellow]note[/]" if finding.warning else "[green]ok[/]"), finding.note
        note = note.removesuffix(": ").replace("[", "\\[")
        table.add_row(mark, finding.what, finding.figure, note)
    console.print(table)
    for axis in ("theta", "alpha", "lambda"):
        if axis in report.figures:
            bins = "  ".join(f"{k}: {v:.4f}" for k, v in report.figures[axis].items())
            console.print(f"mean error by {axis}  {bins}", markup=False)
    worst = Table(title="largest errors", title_justify="left", box=None, pad_edge=False)
    for column in ("alpha_x", "alpha_y", "theta", "phi", "got", "exact"):
        worst.add_column(column, justify="right")
    for case in report.worst:
        worst.add_row(
            f"{case.alpha_x:.4f}",
            f"{case.alpha_y:.4f}",
            f"{case.theta:.2f}",
            f"{case.phi:.2f}",
            f"{case.got:.4f}",
            f"{case.exact:.4f}",
        )
    console.print(worst)
    faults = ", ".join(dict.fromkeys(str(fault) for fault in report.faults))
    console.print(f"broken: {faults}" if faults else "sound", markup=False)
