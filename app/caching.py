"""A cache that is bounded by bytes, not by entries."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

Value = TypeVar("Value")


class ByteCache(Generic[Value]):
    """Results of a pure function, the least recently used dropped beyond a number of bytes.

    A thousand small lights stay; of one huge outline that is dragged about, only
    the last few shapes do.

    Parameters
    ----------
    make : callable
        The function; its arguments are hashable.
    size : callable
        Bytes of a result.
    limit : int
        Bytes to keep. The newest result is kept whatever its size.
    """

    def __init__(
        self, make: Callable[..., Value], size: Callable[[Value], int], limit: int
    ) -> None:
        self._make = make
        self._size = size
        self._limit = limit
        self._held: dict[tuple[Hashable, ...], Value] = {}
        self.bytes = 0

    def __call__(self, *arguments: Hashable) -> Value:
        """Return ``make(*arguments)``, made now or before."""
        if arguments in self._held:
            value = self._held.pop(arguments)
        else:
            value = self._make(*arguments)
            self.bytes += self._size(value)
        self._held[arguments] = value
        while self.bytes > self._limit and len(self._held) > 1:
            self.bytes -= self._size(self._held.pop(next(iter(self._held))))
        return value

    def __len__(self) -> int:
        return len(self._held)
