"""How long passes take: GPU timer queries, or the wall clock where those cannot be trusted."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Literal, TypeAlias

import moderngl

Clock: TypeAlias = Literal["wall clock", "processor time"]


class PassTimers:
    """Times named passes. ``source`` says what the figures are.

    With ``"timer queries"`` nothing waits until `milliseconds` is asked; each pass
    has two queries in turn, so that the one before last can be read while the GPU
    works on the last. With ``"wall clock"`` every pass ends with a glFinish, so
    the figure contains the driver's overhead and nothing overlaps. With ``"processor time"``
    it is what this process took then, of all processors together: what a software rasteriser
    works, whatever else the machine does meanwhile.
    """

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._queries: dict[str, tuple[moderngl.Query, moderngl.Query]] = {}
        self._unread: dict[str, list[moderngl.Query]] = {}
        self._milliseconds: dict[str, float] = {}
        self.source: Literal["timer queries"] | Clock = "timer queries"

    @contextmanager
    def measure(self, name: str) -> Iterator[None]:
        """Time what is drawn inside."""
        if self.source != "timer queries":
            clock = time.perf_counter if self.source == "wall clock" else time.process_time
            self._ctx.finish()
            start = clock()
            yield
            self._ctx.finish()
            self._milliseconds[name] = 1e3 * (clock() - start)
            return
        if name not in self._queries:
            self._queries[name] = (self._ctx.query(time=True), self._ctx.query(time=True))
        query, other = self._queries[name]
        self._queries[name] = (other, query)
        with query:
            yield
        self._unread[name] = [*self._unread.get(name, []), query][-2:]

    def milliseconds(self, *, wait: bool = True) -> dict[str, float]:
        """Return the last figure of each pass [ms].

        Without ``wait`` that is the one before last where the last may still be
        in the making, and passes that ran only once are missing.
        """
        for name, unread in self._unread.items():
            if unread and (wait or len(unread) > 1):
                query = unread[-1] if wait else unread[0]
                self._milliseconds[name] = query.elapsed * 1e-6
                self._unread[name] = [] if wait else unread[1:]
        return dict(self._milliseconds)

    def use_clock(self, source: Clock) -> None:
        """Stop trusting timer queries."""
        self.source = source
        self._unread.clear()
        self._milliseconds.clear()

    def forget(self, name: str) -> None:
        """Drop the figure of a pass that no longer runs."""
        self._unread.pop(name, None)
        self._milliseconds.pop(name, None)

    def release(self) -> None:
        """Drop the queries; moderngl deletes them with their context."""
        self._queries.clear()
        self._unread.clear()


def is_software(renderer_name: str) -> bool:
    """Tell Mesa's software rasterisers, whose timer queries say little, by their name."""
    return any(word in renderer_name.lower() for word in ("llvmpipe", "softpipe", "swrast"))
