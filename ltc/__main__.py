"""Command line of the tables: ``python -m ltc``.

Exit codes: 0 success, 1 failure, 2 bad input (one sentence on stderr), 130
interrupted. Results go to stdout, everything else to stderr.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

from ltc import check_command
from ltc.fit import CONFIGURATIONS, SIZE, fit_isotropic
from ltc.fitting import checkpoint_path


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {message}\n")


def _parser() -> _Parser:
    parser = _Parser(
        prog="python -m ltc",
        description="Tables of linearly transformed cosines.",
        epilog="example: python -m ltc fit isotropic --output ltc_isotropic.npz",
    )
    commands = parser.add_subparsers(dest="command", metavar="COMMAND")
    fit = commands.add_parser("fit", help="fit a table to GGX", description="Fit a table to GGX.")
    tables = fit.add_subparsers(dest="table", metavar="TABLE", required=True)
    isotropic = tables.add_parser(
        "isotropic",
        help="equal alphas",
        description="Fit the isotropic table. Interrupted, the same command continues.",
        epilog="example: python -m ltc fit isotropic --output ltc_isotropic.npz --seed 7",
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )
    isotropic.add_argument(
        "--output", type=Path, default=Path("ltc_isotropic.npz"), help="file to write"
    )
    isotropic.add_argument("--size", type=int, default=SIZE, help="nodes an axis, 4 to 32")
    isotropic.add_argument("--seed", type=int, default=1, help="of all randomness")
    isotropic.add_argument(
        "--configurations", type=int, default=CONFIGURATIONS, help="rectangles to fit to"
    )
    again = isotropic.add_mutually_exclusive_group()
    again.add_argument(
        "--resume", action="store_true", help="insist on continuing an interrupted fit"
    )
    again.add_argument("--fresh", action="store_true", help="discard an interrupted fit")
    check_command.add_parser(commands)
    return parser


def _print_error(figures: dict[str, Any]) -> None:
    for name, values in figures.items():
        print(f"{name}: absolute error of the shading integral, light radiance 1")
        print("  " + "  ".join(f"{key} {values[key]:.5f}" for key in ("mean", "p95", "p99", "max")))
        for axis in ("theta", "alpha"):
            bins = "  ".join(f"{bounds}: {mean:.5f}" for bounds, mean in values[axis].items())
            print(f"  mean by {axis}  {bins}")


def _fit_isotropic(arguments: argparse.Namespace) -> int:
    output: Path = arguments.output
    if not output.parent.is_dir():
        raise ValueError(f"{output.parent}: no such folder, expected one to write {output.name} to")
    if output.is_dir():
        raise ValueError(f"{output}: is a folder, expected the name of a file to write")
    resume = True if arguments.resume else False if arguments.fresh else None

    def report(message: str) -> None:
        print(message, file=sys.stderr, flush=True)

    try:
        table = fit_isotropic(
            output, arguments.size, arguments.seed, arguments.configurations, resume, report
        )
    except KeyboardInterrupt:
        report(f"interrupted; the same command continues from {checkpoint_path(output)}")
        return 130
    _print_error(table.provenance["error"])
    print(f"{output}: {table.payload} bytes of tables")
    return 0


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code."""
    parser = _parser()
    parsed = parser.parse_args(arguments)
    if parsed.command is None:
        parser.print_help()
        return 0
    try:
        if parsed.command == "check":
            return check_command.run(parsed)
        return _fit_isotropic(parsed)
    except ValueError as error:
        print(f"python -m ltc: {error}", file=sys.stderr)
        return 2
    except OSError as error:
        print(f"python -m ltc: {error}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
