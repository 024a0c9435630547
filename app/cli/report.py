"""``ltc-viewer report``: error against run time, as one page, and every number beside it."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from app.cli.common import SizeOption, image_size, list_techniques, whole_number
from app.cli.report_run import run_report
from app.errors import InputError, expected_one_of, quote
from app.render.timers import Clock

MAX_REPEATS = 100_000
MAX_POINTS = 100_000
MAX_WORKERS = 1024

CLOCKS: dict[str, Clock] = {"wall": "wall clock", "processor": "processor time"}


def report(
    output: Annotated[
        Path,
        typer.Option("--output", "-o", metavar="DIR", help="Folder for the page and its numbers."),
    ],
    scenes: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[SCENES]...",
            help="Scene files, or names of demo scenes.",
            show_default="all demo scenes",
        ),
    ] = None,
    techniques: Annotated[
        list[str],
        typer.Option(
            "--technique",
            metavar="NAME[:N]",
            help="How to shade; repeat for several, 'help' lists them. Of a technique that "
            "samples N is the samples of a pixel, reference:64.",
            callback=list_techniques,
            is_eager=True,
        ),
    ] = [],  # noqa: B006 (typer copies it)
    size: SizeOption = "640x360",
    points: Annotated[
        int,
        typer.Option(
            "--points",
            metavar="N",
            help="Random pixels a scene that are compared with the exact integral.",
            parser=whole_number("--points", 1, MAX_POINTS),
        ),
    ] = 500,
    repeats: Annotated[
        int,
        typer.Option(
            "--repeats",
            metavar="N",
            help="Measured frames a technique.",
            parser=whole_number("--repeats", 1, MAX_REPEATS),
        ),
    ] = 10,
    workers: Annotated[
        int,
        typer.Option(
            "--workers",
            metavar="N",
            help="Processes that integrate exactly; what is timed runs alone.",
            parser=whole_number("--workers", 1, MAX_WORKERS),
            show_default="one a processor, up to 8",
        ),
    ] = min(os.cpu_count() or 1, 8),
    clock: Annotated[
        str,
        typer.Option(
            "--clock",
            metavar="NAME",
            help="Where timer queries are not to be trusted: 'wall', or 'processor', the time of "
            "this process alone, on machines that do other things too.",
        ),
    ] = "wall",
    again: Annotated[
        bool, typer.Option("--again", help="Measure anew what an earlier run left in DIR.")
    ] = False,
) -> None:
    """Compare techniques: how far they are from the truth, and what they cost.

    Writes index.html, one page with plots, tables and pictures that loads nothing
    from elsewhere, all numbers as results.csv and results.json, and the plots as
    PNG and SVG. Every technique that makes a difference in a scene is measured
    unless --technique names some.

    A run that was interrupted goes on where it stopped: what is in DIR/parts is
    measured again only if size, points, repeats, scene file, shaders, tables,
    graphics device or version of the program are others. --again measures
    everything anew, which changed meshes or an idler machine call for.

    \b
    Examples:
      ltc-viewer report -o report
      ltc-viewer report 02-quad 11-curvy -o report --size 320x180 --points 200
      ltc-viewer report 02-quad -o report --technique ltc --technique reference:64
    """
    if clock not in CLOCKS:
        raise InputError(f"--clock is {quote(clock)}, {expected_one_of(clock, CLOCKS)}")
    with _pool(workers) as executor:
        page = run_report(
            scenes or [], output, techniques=techniques, size=image_size(size), points=points,
            repeats=repeats, clock=CLOCKS[clock], again=again, executor=executor,
        )  # fmt: skip
    typer.echo(page)


@contextmanager
def _pool(workers: int) -> Iterator[Executor | None]:
    """Open a pool of processes; none for one worker, which is this process."""
    if workers == 1:
        yield None
        return
    # Forked ones would share this process's OpenGL; Ctrl-C is for this process to answer.
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(workers, context, signal.signal, (signal.SIGINT, signal.SIG_IGN))
    try:
        yield pool
    finally:
        pool.shutdown(cancel_futures=True)
