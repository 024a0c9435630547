"""What happens around a fit: checkpoints, targets piece by piece, progress, provenance.

A fit is a list of pieces that depend on its settings alone. Everything computed
so far lies in a checkpoint beside the output, so that an interrupted fit goes on where
it stood and ends with the same bytes. Pieces run here or on any executor.
"""

from __future__ import annotations

import io
import json
import platform
import time
import zipfile
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from ltc.objective import FitState
from ltc.table import npz_bytes, write_atomically

FloatArray = NDArray[np.float64]
Report = Callable[[str], None]

CHUNK = 512
"""Targets per piece of work."""

SAVE_EVERY = 1.0
"""Seconds between checkpoints while targets are computed."""


class CheckpointError(ValueError):
    """A checkpoint cannot be continued; the message is one sentence for the user."""


@dataclass
class Work:
    """Everything a fit has computed so far; what a checkpoint holds.

    Attributes
    ----------
    path : Path
        The checkpoint.
    settings : dict
        What the fit depends on; a checkpoint with others is refused.
    arrays : dict
        Targets, perhaps incomplete.
    state : FitState, optional
        The last step.
    """

    path: Path
    settings: dict[str, Any]
    arrays: dict[str, NDArray[Any]] = field(default_factory=dict)
    state: FitState | None = None

    def save(self) -> None:
        """Write the checkpoint, atomically."""
        arrays: dict[str, NDArray[Any]] = {
            "settings": np.frombuffer(json.dumps(self.settings).encode(), dtype=np.uint8),
            **{f"target {name}": values for name, values in self.arrays.items()},
        }
        if self.state is not None:
            s = self.state
            arrays["residual"] = s.residual
            arrays["progress"] = np.array([s.damping, s.steps, s.loss, s.done])
        write_atomically(self.path, npz_bytes(arrays))

    @classmethod
    def load(cls, path: Path, settings: dict[str, Any]) -> Work:
        """Read a checkpoint of a fit with these settings.

        Raises
        ------
        CheckpointError
            If it is damaged or of a fit with other settings.
        """
        try:
            with np.load(io.BytesIO(path.read_bytes()), allow_pickle=False) as file:
                arrays = {name: file[name] for name in file.files}
            found = json.loads(arrays["settings"].tobytes())
            state = None
            if "progress" in arrays:
                damping, steps, loss, done = (float(p) for p in arrays["progress"])
                state = FitState(arrays["residual"], damping, int(steps), loss, bool(done))
        except (ValueError, KeyError, EOFError, OSError, zipfile.BadZipFile):
            raise CheckpointError(
                f"{path}: damaged, expected the checkpoint of a fit; --fresh discards it"
            ) from None
        if found != settings:
            raise CheckpointError(
                f"{path}: belongs to a fit with {_words(found)}, expected {_words(settings)};"
                " --fresh discards it"
            )
        targets = {
            name.removeprefix("target "): values
            for name, values in arrays.items()
            if name.startswith("target ")
        }
        return cls(path, found, targets, state)


def _words(settings: Any) -> str:
    if not isinstance(settings, dict):
        return "unknown settings"
    return ", ".join(f"{key} {value}" for key, value in settings.items())


def checkpoint_path(output: Path) -> Path:
    """Return where a fit of ``output`` keeps its checkpoint, beside it."""
    return output.with_name(output.name + ".checkpoint")


def begin(output: Path, settings: dict[str, Any], resume: bool | None, report: Report) -> Work:
    """Return the work of a new fit, or that of an interrupted one.

    Parameters
    ----------
    output : Path
        The file that the fit will write.
    settings : dict
        JSON values; lists, not tuples.
    resume : bool or None
        True: continue from the checkpoint, which must exist; False: discard it;
        None: continue if there is one.
    report : callable
        Takes lines of progress.

    Raises
    ------
    CheckpointError
        If a checkpoint is missing, damaged, or of a fit with other settings.
    """
    checkpoint = checkpoint_path(output)
    if resume and not checkpoint.exists():
        raise CheckpointError(f"{checkpoint}: no such checkpoint, so there is nothing to resume")
    if resume is not False and checkpoint.exists():
        work = Work.load(checkpoint, settings)
        report(f"continuing from {checkpoint}")
        return work
    return Work(checkpoint, settings)


def complete(
    work: Work,
    name: str,
    count: int,
    function: Callable[..., FloatArray],
    arguments: Callable[[slice], tuple[Any, ...]],
    report: Report,
    executor: Executor | None = None,
    chunk: int | None = None,
) -> None:
    """Complete the targets ``work.arrays[name]``, saving them now and then.

    Parameters
    ----------
    work : Work
        Grows by whole pieces.
    name : str
        Of the targets, for the report too.
    count : int
        How many there shall be.
    function, arguments : callable
        ``function(*arguments(part))`` returns the targets of ``part``, one each
        along the first axis. An executor must be able to send the function and what
        ``arguments`` returns.
    report : callable
        Takes lines of progress.
    executor : concurrent.futures.Executor, optional
        Computes the pieces; by default they are computed here.
    chunk : int, optional
        Targets per piece; by default CHUNK.
    """
    size = chunk or CHUNK
    first = len(work.arrays[name]) if name in work.arrays else 0
    start = done = first
    parts = [slice(i, min(i + size, count)) for i in range(first, count, size)]
    begin_time, saved = time.monotonic(), 0.0
    pieces = [work.arrays[name]] if first else []
    try:
        for piece in _results(function, [arguments(part) for part in parts], executor):
            pieces.append(piece)
            done += len(piece)
            now = time.monotonic() - begin_time
            if now - saved > SAVE_EVERY or done == count:
                saved = now
                work.arrays[name] = np.concatenate(pieces)
                work.save()
                left = now / (done - start) * (count - done)
                report(f"{name}: {done} of {count}, {left:.0f} s left")
    except KeyboardInterrupt:
        if pieces:
            work.arrays[name] = np.concatenate(pieces)
        work.save()
        raise


def _results(
    function: Callable[..., FloatArray],
    calls: list[tuple[Any, ...]],
    executor: Executor | None,
) -> Iterator[FloatArray]:
    """Yield ``function(*call)`` in order."""
    if executor is None:
        for call in calls:
            yield function(*call)
        return
    futures = deque(executor.submit(function, *call) for call in calls)
    try:
        while futures:
            yield futures[0].result()
            futures.popleft()
    finally:
        for future in futures:
            future.cancel()


def follow(work: Work, states: Iterator[FitState], most: int, report: Report) -> FitState:
    """Save and report every state of a descent; return the last one.

    One that was complete already yields none, and the checkpoint's is returned.
    """
    start = time.monotonic()
    for count, state in enumerate(states, 1):
        work.state = state
        work.save()
        pace = (time.monotonic() - start) / count
        report(
            f"fit: step {state.steps}, loss {state.loss:.6f},"
            f" at most {pace * (most - state.steps):.0f} s left, usually a third of that"
        )
    assert work.state is not None
    return work.state


def versions() -> dict[str, str]:
    """Return what a fit's bytes depend on besides its settings."""
    return {
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "python": platform.python_version(),
    }
