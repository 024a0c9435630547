"""How long passes take: GPU timer queries, or the wall clock where those cannot be trusted."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

import moderngl


class PassTimers:
    """Times named passes. ``source`` says what the figures are.

    With ``"timer queries"`` nothing waits until `milliseconds` is asked. With
    ``"wall clock"`` every pass ends with a glFinish, so the figure contains
    the driver's overhead and nothing overlaps.
    """

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._queries: dict[str, moderngl.Query] = {}
        self._pending: set[str] = set()
        self._milliseconds: dict[str, float] = {}
        self.source = "timer queries"

    @contextmanager
    def measure(self, name: str) -> Iterator[None]:
        """Time what is drawn inside."""
        if self.source == "wall clock":
            self._ctx.finish()
            start = time.perf_counter()
            yield
            self._ctx.finish()
            self._milliseconds[name] = 1e3 * (time.perf_counter() - start)
            return
        if name not in self._queries:
            self._queries[name] = self._ctx.query(time=True)
        with self._queries[name]:
            yield
        self._pending.add(name)

    def milliseconds(self) -> dict[str, float]:
        """Return the last figure of each pass [ms]; waits for the GPU."""
        for name in self._pending:
            self._milliseconds[name] = self._queries[name].elapsed * 1e-6
        self._pending.clear()
        return dict(self._milliseconds)

    def use_wall_clock(self) -> None:
        """Stop trusting timer queries."""
        self.source = "wall clock"
        self._pending.clear()
        self._milliseconds.clear()

    def forget(self, name: str) -> None:
        """Drop the figure of a pass that no longer runs."""
        self._pending.discard(name)
        self._milliseconds.pop(name, None)

    def release(self) -> None:
        """Drop the queries; moderngl deletes them with their context."""
        self._queries.clear()
        self._pending.clear()
