"""What is computed of two pictures aside from the frames, and how panels show it."""

from __future__ import annotations

from dataclasses import dataclass

from app.gui.breakdowns import BreakdownWork, refusal
from app.gui.live_picture import LivePicture
from app.panels.compare import NumberRow
from app.panels.parts import PartRow, Parts
from app.render.comparison import Pictures
from app.render.difference import (
    DIFFERENCE_VIEWS,
    DifferenceView,
    Measure,
    Numbers,
    robust_high,
)
from app.render.flip import FloatArray
from app.scene import Shot


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


SHORT = {"95 % below": "p95", "99 % below": "p99", "largest": "max", "A brighter by": "bias"}
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
            PartRow(name, (f"{mean:.2g}", f"{p95:.2g}", f"{most:.2g}", f"{bias:+.2g}"))
            for name, mean, p95, most, bias in found.rows()
        )
        about = f"{found.technique} at {len(found.exact)} random pixels' points: luminance"
    return Parts(
        about, ("mean", "p95", "max", "bias"), rows, work.is_of(picture), work.progress,
        refusal(picture),
    )  # fmt: skip
