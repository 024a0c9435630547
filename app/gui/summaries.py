"""What is computed of two pictures aside from the frames, and how panels show it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.gui.breakdowns import BreakdownWork, refusal
from app.gui.live_picture import LivePicture
from app.panels.compare import NumberRow
from app.panels.parts import PartRow, Parts
from app.render.comparison import Pictures, earlier_samples, estimated_error
from app.render.difference import (
    DIFFERENCE_VIEWS,
    DifferenceView,
    Measure,
    Numbers,
    robust_high,
)
from app.render.flip import FloatArray
from app.render.renderer import Renderer
from app.render.techniques import find_technique
from app.scene import Shot

Radiance: TypeAlias = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Source:
    """What numbers were computed of; the shots are compared by identity."""

    shots: tuple[Shot, Shot]
    samples: tuple[int, int]
    measure: Measure
    flips: bool

    def covers(self, other: Source) -> bool:
        """Tell whether nothing else would be computed of ``other``."""
        return (
            all(a is b for a, b in zip(self.shots, other.shots, strict=True))
            and (self.samples, self.measure) == (other.samples, other.measure)
            and (self.flips or not other.flips)
        )


@dataclass(frozen=True, eq=False)
class Summary:
    """What was computed of two pictures."""

    source: Source
    numbers: Numbers
    highs: dict[DifferenceView, float]
    flip: FloatArray | None

    @classmethod
    def of(cls, source: Source, pictures: Pictures) -> Summary:
        numbers = pictures.numbers(source.measure)
        highs = {
            view: robust_high(view, pictures.a, pictures.b, source.measure, numbers.floor)
            for view in DIFFERENCE_VIEWS
        }
        return cls(source, numbers, highs, pictures.flip() if source.flips else None)


class EarlierMeans:
    """What was copied last of pictures that are random estimates, to tell how noisy they are."""

    def __init__(self) -> None:
        self._kept: list[tuple[Shot, int, Radiance] | None] = [None, None]

    def watch(self, side: int, picture: LivePicture, renderer: Renderer) -> None:
        """Keep the mean of half the samples of a random estimate, 0 for A's and 1 for B's."""
        shot, (done, wanted) = picture.shot, picture.samples
        if shot is None or not shot.settings.positions or picture.has_failed:
            return
        before = self._kept[side]
        is_new = before is None or before[1] != done or not _show_the_same(before[0], shot)
        if is_new and done == earlier_samples(wanted, shot.settings.positions):
            self._kept[side] = (shot, done, renderer.radiance())
            renderer.ctx.screen.use()

    def noise(
        self, source: Source, names: tuple[str, str], means: tuple[Radiance, Radiance]
    ) -> tuple[Radiance | None, Radiance | None]:
        """Return the standard errors of A's and B's pixels, where known, and keep the means."""
        found: list[Radiance | None] = [None, None]
        kept = zip(self._kept, source.shots, source.samples, means, strict=True)
        for side, (before, shot, samples, mean) in enumerate(list(kept)):
            positions = shot.settings.positions
            if not (find_technique(names[side]).is_sampled and positions):
                self._kept[side] = None
                continue
            if before is not None and _show_the_same(before[0], shot) and before[1] < samples:
                found[side] = estimated_error(mean, samples, before[2], before[1])
            # Both means must be of the same positions.
            if samples % positions == 0:
                self._kept[side] = (shot, samples, mean)
        return found[0], found[1]


def _show_the_same(a: Shot, b: Shot) -> bool:
    sizes = (a.width, a.height), (b.width, b.height)
    return a.scene is b.scene and a.settings == b.settings and sizes[0] == sizes[1]


SHORT = {
    "95 % below": "p95", "99 % below": "p99", "largest": "max", "A brighter by": "bias",
    "A's own noise": "noise of A", "B's own noise": "noise of B",
    "RMSE beyond it, at least": "beyond it",
}  # fmt: skip
"""Names of numbers that a narrow panel has room for."""


def number_rows(summary: Summary) -> tuple[NumberRow, ...]:
    """Return the numbers as the panel's table shows them."""
    numbers = summary.numbers
    rows = []
    for name, value, *shares in numbers.rows():
        texts = ("" if share is None else f"{100.0 * share:.3g} %" for share in shares)
        rows.append(NumberRow(SHORT.get(name, name), f"{value:.3g}", *texts))
    rows.append(NumberRow("mean of B", f"{numbers.mean_b:.3g}"))
    if summary.flip is not None:
        rows.append(NumberRow("mean FLIP", f"{float(summary.flip.mean()):.3g}"))
    if numbers.bad:
        rows.append(NumberRow("not finite", f"{numbers.bad} pixels"))
    return tuple(rows)


def view_parts(work: BreakdownWork, picture: LivePicture) -> Parts:
    """Return what a panel shows of the parts of a picture's error at random pixels."""
    rows: tuple[PartRow, ...] = ()
    about, found = work.problem, work.result
    if found is not None:
        rows = tuple(
            PartRow(name, tuple(f"{value:.2g}" for value in (mean, most, bias)))
            for name, mean, _, most, bias in found.rows()
        )
        about = f"{found.technique} at {len(found.exact)} random pixels' points: luminance"
    return Parts(
        about, ("mean", "max", "bias"), rows, work.is_of(picture), work.progress,
        refusal(picture),
    )  # fmt: skip
