"""Command line of the library: tables and measurements, ``python -m ltc``.

Exit codes: 0 success, 1 failure, 2 bad input (one sentence on stderr), 130
interrupted. Results go to stdout, everything else to stderr.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from typing import NoReturn

from ltc import check_command, export, fit_command, textures_command


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
    fit_command.add_parser(commands)
    check_command.add_parser(commands)
    export.add_parser(commands)
    textures_command.add_parser(commands)
    return parser


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
        if parsed.command == "export":
            return export.run(parsed)
        if parsed.command == "textures":
            return textures_command.run(parsed)
        return fit_command.run(parsed)
    except ValueError as error:
        print(f"python -m ltc: {error}", file=sys.stderr)
        return 2
    except OSError as error:
        print(f"python -m ltc: {error}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
