"""What commands share that write a folder: a page, CSV and JSON of numbers about this machine."""

from __future__ import annotations

import csv
import io
import os
import platform
import time
from collections.abc import Mapping, Sequence
from importlib import metadata
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

from app.cli.common import Steps, messages
from app.errors import InputError

if TYPE_CHECKING:
    import moderngl

TELL_EVERY = 10.0
"""Seconds between lines of progress where stderr is no terminal."""


def check_folder(path: Path, kind: str) -> None:
    """Raise `InputError` unless the folder of ``kind``, "the report" say, can be written."""
    if path.exists() and not path.is_dir():
        raise InputError(f"{path}: this is a file, expected a folder for {kind}")
    parent = path if path.exists() else path.parent
    if not parent.is_dir():
        raise InputError(f"{path}: the folder {parent} does not exist, expected one that does")
    if not os.access(parent, os.W_OK):
        raise InputError(f"{path}: permission denied, expected a writable place for {kind}")


def csv_text(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return rows of the same columns as CSV; a number is written as in JSON, none as nothing."""
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def machine_facts(ctx: moderngl.Context) -> dict[str, str]:
    """Return what figures depend on, besides the input, by name."""
    versions = {f"{name} version": version(name) for name in ("ltc-viewer", "numpy", "scipy")}
    return {
        "renderer": str(ctx.info["GL_RENDERER"]),
        "gl_version": str(ctx.info["GL_VERSION"]),
        "platform": platform.platform(),
        "processors": str(os.cpu_count()),
        "python": platform.python_version(),
        **versions,
    }


def version(package: str) -> str:
    """Return a package's version, or that there is none."""
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "not installed"


class TimedSteps:
    """Progress with the time that remains: a bar, or a line now and then without a terminal."""

    def __init__(self, doing: str, done: str, total: int) -> None:
        self._steps = Steps(doing, total)
        self._done = done
        self._total = total
        self._start = self._told = time.monotonic()

    def __enter__(self) -> TimedSteps:
        self._steps.__enter__()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._steps.__exit__(kind, error, trace)

    def done(self, count: int) -> None:
        """Say how many of the steps are done."""
        self._steps.done(count)
        now = time.monotonic()
        if not messages().is_terminal and now - self._told > TELL_EVERY:
            self._told = now
            left = (now - self._start) / count * (self._total - count)
            span = f"{left:.0f} s" if left < 100.0 else f"{left / 60.0:.0f} min"
            messages().print(f"{count} of {self._total} {self._done}, about {span} left")
