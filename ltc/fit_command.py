"""``python -m ltc fit``: arguments, progress on stderr, figures on stdout."""

from __future__ import annotations

import argparse
import os
import signal
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from ltc import anisotropic_fit, fit
from ltc.anisotropic import AXES, AnisotropicTable
from ltc.anisotropic_fit import fit_anisotropic
from ltc.fit import fit_isotropic
from ltc.fitting import checkpoint_path
from ltc.sliced_wasserstein import SHAPE, PublishedTable, fit_published, published_files
from ltc.table import IsotropicTable

_Report = Callable[[str], None]
_Table = IsotropicTable | AnisotropicTable | PublishedTable
_Fit = Callable[[argparse.Namespace, _Report], _Table]


def _shape(text: str) -> tuple[int, ...]:
    try:
        return tuple(int(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"{text!r} is not a list of numbers like 4,4,8,8"
        ) from None


def _text(shape: tuple[int, ...]) -> str:
    return ",".join(str(n) for n in shape)


def add_parser(commands: Any) -> None:
    """Add the subcommand to argparse's."""
    parser = commands.add_parser(
        "fit", help="fit a table to GGX", description="Fit a table to GGX."
    )
    tables = parser.add_subparsers(dest="table", metavar="TABLE", required=True)
    for name, words, suffix in (
        ("isotropic", "equal alphas", ".npz"),
        ("anisotropic", "an alpha along each axis", ".npz"),
        ("published", "as KT et al. 2022 did, in their layout", ".npy"),
    ):
        table = tables.add_parser(
            name,
            help=words,
            description=f"Fit the {name} table: {words}. Interrupted, the same command continues.",
            epilog=f"example: python -m ltc fit {name} --output ltc_{name}{suffix} --seed 7",
            formatter_class=argparse.ArgumentDefaultsHelpFormatter,
        )
        table.add_argument(
            "--output", type=Path, default=Path(f"ltc_{name}{suffix}"), help="file to write"
        )
        if name == "isotropic":
            table.add_argument("--size", type=int, default=fit.SIZE, help="nodes an axis, 4 to 32")
        else:
            axes = ", ".join(AXES) if name == "anisotropic" else "alpha, lambda, theta, phi"
            shape = anisotropic_fit.SHAPE if name == "anisotropic" else SHAPE
            table.add_argument(
                "--shape",
                type=_shape,
                default=_text(shape),
                help=f"nodes along {axes}, 2 to 64 each",
            )
            table.add_argument(
                "--workers", type=int, default=min(os.cpu_count() or 1, 8), help="processes"
            )
        if name == "anisotropic":
            table.add_argument(
                "--albedo-shape",
                type=_shape,
                default=_text(anisotropic_fit.ALBEDO_SHAPE),
                help="the same of albedo and Fresnel term",
            )
        table.add_argument("--seed", type=int, default=1, help="of all randomness")
        if name != "published":
            table.add_argument(
                "--configurations", type=int, default=fit.CONFIGURATIONS, help="rectangles fitted"
            )
        again = table.add_mutually_exclusive_group()
        again.add_argument(
            "--resume", action="store_true", help="insist on continuing an interrupted fit"
        )
        again.add_argument("--fresh", action="store_true", help="discard an interrupted fit")


def _print_error(figures: dict[str, Any]) -> None:
    for name, values in figures.items():
        if name == "variation":
            print(
                "total variation between lobe and GGX"
                f"  mean {values['mean']:.4f}  max {values['max']:.4f}"
            )
            continue
        print(f"{name}: absolute error of the shading integral, light radiance 1")
        print("  " + "  ".join(f"{key} {values[key]:.5f}" for key in ("mean", "p95", "p99", "max")))
        for axis in ("theta", "alpha", "ratio"):
            if axis in values:
                bins = "  ".join(f"{bounds}: {mean:.5f}" for bounds, mean in values[axis].items())
                print(f"  mean by {axis}  {bins}")


def _isotropic(arguments: argparse.Namespace, report: _Report) -> IsotropicTable:
    return fit_isotropic(
        arguments.output,
        arguments.size,
        arguments.seed,
        arguments.configurations,
        _resume(arguments),
        report,
    )


def _anisotropic(arguments: argparse.Namespace, report: _Report) -> AnisotropicTable:
    with _workers(arguments.workers) as executor:
        return fit_anisotropic(
            arguments.output,
            arguments.shape,
            arguments.albedo_shape,
            arguments.seed,
            arguments.configurations,
            _resume(arguments),
            report,
            executor,
        )


def _published(arguments: argparse.Namespace, report: _Report) -> PublishedTable:
    with _workers(arguments.workers) as executor:
        return fit_published(
            arguments.output,
            arguments.shape,
            arguments.seed,
            resume=_resume(arguments),
            report=report,
            executor=executor,
        )


@contextmanager
def _workers(count: int) -> Iterator[ProcessPoolExecutor | None]:
    """Yield so many processes, or None for one."""
    if count < 1:
        raise ValueError(f"workers is {count}, expected 1 or more")
    if count == 1:
        yield None
        return
    # Ctrl-C reaches the workers too; only this process shall answer it.
    executor = ProcessPoolExecutor(count, initializer=_ignore_interrupts)
    try:
        yield executor
    finally:
        executor.shutdown(cancel_futures=True)


def _ignore_interrupts() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _resume(arguments: argparse.Namespace) -> bool | None:
    return True if arguments.resume else False if arguments.fresh else None


_FITS: dict[str, _Fit] = {
    "isotropic": _isotropic,
    "anisotropic": _anisotropic,
    "published": _published,
}


def run(arguments: argparse.Namespace) -> int:
    """Run the subcommand; return 0, or 130 if interrupted.

    Raises
    ------
    ValueError, OSError
        If a file or an argument is bad.
    """
    output: Path = arguments.output
    if not output.parent.is_dir():
        raise ValueError(f"{output.parent}: no such folder, expected one to write {output.name} to")
    if output.is_dir():
        raise ValueError(f"{output}: is a folder, expected the name of a file to write")

    def report(message: str) -> None:
        print(message, file=sys.stderr, flush=True)

    try:
        table = _FITS[arguments.table](arguments, report)
    except KeyboardInterrupt:
        report(f"interrupted; the same command continues from {checkpoint_path(output)}")
        return 130
    if isinstance(table, PublishedTable):
        losses = table.losses
        print(
            "sliced Wasserstein distance"
            f"  mean {losses.mean():.5f}  median {np.median(losses):.5f}  max {losses.max():.5f}"
        )
        print(" ".join(str(path) for path in published_files(output)))
        return 0
    _print_error(table.provenance["error"])
    print(f"{output}: {table.payload} bytes of tables")
    return 0
