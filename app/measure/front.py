"""Which of many are worth their price."""

from __future__ import annotations

from collections.abc import Sequence


def pareto_front(pairs: Sequence[tuple[float, float]]) -> list[bool]:
    """Tell which pairs no other beats in one number without losing in the other.

    Equal pairs are on the front together.
    """
    return [
        not any(other[0] <= pair[0] and other[1] <= pair[1] and other != pair for other in pairs)
        for pair in pairs
    ]
