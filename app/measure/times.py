"""How long the passes of a shot take."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from app.scene import Shot

if TYPE_CHECKING:
    import moderngl

    from app.render.renderer import Renderer


@dataclass(frozen=True)
class Quartiles:
    """Of one pass's times [ms]."""

    median: float
    q1: float
    q3: float
    repeats: int

    @classmethod
    def of(cls, times: list[float]) -> Quartiles:
        """Return the quartiles of one or more times."""
        q1, median, q3 = np.quantile(times, (0.25, 0.5, 0.75))
        return cls(float(median), float(q1), float(q3), len(times))

    def times(self, factor: float) -> Quartiles:
        """Return them of something that takes so many times as long."""
        return Quartiles(factor * self.median, factor * self.q1, factor * self.q3, self.repeats)


def measure_passes(
    ctx: moderngl.Context,
    renderer: Renderer,
    shot: Shot,
    warm_up: int,
    repeats: int,
    on_frame: Callable[[], None] | None = None,
) -> tuple[dict[str, Quartiles], Quartiles]:
    """Render a shot ``warm_up`` and then ``repeats`` times.

    Returns
    -------
    passes : dict of Quartiles
        Times [ms] of a sample by name: what they are ``renderer.timing_source`` says.
    wall : Quartiles
        Of the whole frame, all samples, with a glFinish [ms].
    """
    return measure_in_turn(ctx, [renderer], shot, warm_up, repeats, on_frame)[0]


def measure_in_turn(
    ctx: moderngl.Context,
    renderers: Sequence[Renderer],
    shot: Shot,
    warm_up: int,
    repeats: int,
    on_frame: Callable[[], None] | None = None,
    new_pictures: bool = False,
) -> list[tuple[dict[str, Quartiles], Quartiles]]:
    """Render a shot with several renderers, a frame each in turn.

    What else the machine does then disturbs all alike. With ``new_pictures`` those of
    lights are filtered in every frame, as those that play are. Returns for each what
    `measure_passes` does.
    """
    times: list[dict[str, list[float]]] = [{} for _ in renderers]
    wall: list[list[float]] = [[] for _ in renderers]
    for index in range((warm_up + repeats) * len(renderers)):
        which = index % len(renderers)
        renderer = renderers[which]
        if new_pictures:
            renderer.forget_pictures()
        ctx.finish()
        start = time.perf_counter()
        renderer.render(shot)
        _ = renderer.texture  # draws the display pass
        ctx.finish()
        elapsed = 1e3 * (time.perf_counter() - start)
        figures = renderer.timings()
        if renderer.timing_source != "timer queries":
            figures.pop("cpu", None)  # it would contain the passes
        if index >= warm_up * len(renderers):
            wall[which].append(elapsed)
            for key, value in figures.items():
                times[which].setdefault(key, []).append(value)
        if on_frame is not None:
            on_frame()
    return [
        ({key: Quartiles.of(values) for key, values in passes.items()}, Quartiles.of(frames))
        for passes, frames in zip(times, wall, strict=True)
    ]
