"""``python -m ltc textures``: the error of fetched pictures, as a table on stdout."""

from __future__ import annotations

import argparse
import itertools
from typing import Any

from rich.console import Console
from rich.table import Table

from ltc.textured_check import ALPHA_BOUNDS, KINDS, METHODS, OUTLINES, Measured, measure

DESCRIPTION = (
    "Measure how far the fetched mean of a light's picture is from its exact integral: the fetch of"
    " Heitz et al. 2016 and this project's with 1, 3, 5 and 9 taps, over random lights and"
    " pictures. Mean / 95th percentile of the shading integral's absolute error x 1000, pictures"
    " from 0 to 1."
)


def add_parser(commands: Any) -> None:
    """Add the subcommand to argparse's."""
    parser = commands.add_parser(
        "textures",
        help="measure lights with pictures against exact integrals",
        description=DESCRIPTION,
        epilog="example: python -m ltc textures --lobe diffuse --configurations 1000",
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )
    parser.add_argument("--configurations", type=int, default=500, help="lights and views")
    parser.add_argument("--size", type=int, default=64, help="texels on a side")
    parser.add_argument("--pictures", type=int, default=3, help="of each kind")
    parser.add_argument(
        "--lobe",
        choices=("ltc", "diffuse", "ggx"),
        default="ltc",
        help="ltc and diffuse: the fetch alone; ggx: the technique ltc against GGX",
    )
    parser.add_argument(
        "--outline", choices=tuple(OUTLINES), default="rectangle", help="of the lights"
    )
    parser.add_argument("--half", action="store_true", help="store half floats, as GPUs do")
    parser.add_argument("--seed", type=int, default=1, help="of all randomness")


def run(arguments: argparse.Namespace) -> int:
    """Run the subcommand; return 0.

    Raises
    ------
    ValueError
        If an argument is bad.
    """
    show(
        measure(
            arguments.configurations,
            arguments.seed,
            arguments.size,
            arguments.pictures,
            arguments.lobe,
            arguments.half,
            arguments.outline,
        )
    )
    return 0


def show(measured: Measured) -> None:
    """Print errors on stdout, by kind of picture and by alpha."""
    console = Console(highlight=False)
    if not console.is_terminal:
        console = Console(highlight=False, width=120)
    ranges = list(itertools.pairwise(ALPHA_BOUNDS))
    for title, columns in (
        ("by picture", [(kind, {"kind": kind}) for kind in KINDS]),
        ("by alpha", [(f"{a:g}-{b:g}", {"low": a, "high": b + (b == 1.0)}) for a, b in ranges]),
    ):
        table = Table(title=title, title_justify="left", box=None, pad_edge=False)
        table.add_column("")
        for name, _ in [*columns, ("all", {})]:
            table.add_column(name, justify="right")
        table.add_column("of paper", justify="right")
        paper = measured.figures("paper")[0]
        for method in METHODS:
            cells = []
            for _, where in [*columns, ("all", {})]:
                mean, p95 = measured.figures(method, **where)
                cells.append(f"{1e3 * mean:.2f} / {1e3 * p95:.1f}")
            cells.append(f"{measured.figures(method)[0] / paper:.3f}")
            table.add_row(method, *cells)
        console.print(table)
    console.print(f"exact integrals: error estimated at most {measured.exact_error:.1e}")
