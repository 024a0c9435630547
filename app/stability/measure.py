"""Measure techniques in sweeps: a row of figures and a verdict for each."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from app.render.techniques import parse_technique
from app.stability.bounds import QUANTITIES, UNBOUNDED, Quantity, exception_of
from app.stability.cases import Case, Sampling, applies, cases_of
from app.stability.compare import Comparison, Truth, compare, lasting_jump
from app.stability.points import FloatArray, IntArray
from app.stability.sweeps import Sweep

if TYPE_CHECKING:
    from app.render.renderer import Renderer


@dataclass(frozen=True, slots=True)
class Worst:
    """Where a row's largest excess is: a case, and some of its points, one or neighbours.

    ``found`` and ``expected`` are specular and diffuse at the first of them.
    """

    case: Case
    which: IntArray
    what: str
    measure: float
    found: tuple[float, float]
    expected: tuple[float, float] | None

    @classmethod
    def of(
        cls, case: Case, which: IntArray, what: str, measure: float, result: Comparison
    ) -> Worst:
        """Return it with the values of a comparison."""
        first = int(which[0])
        found = (float(result.found[0, first]), float(result.found[1, first]))
        if result.own is None:
            return cls(case, which, what, measure, found, None)
        expected = (float(result.own[0, first]), float(result.own[1, first]))
        return cls(case, which, what, measure, found, expected)


@dataclass(slots=True)
class Row:
    """What was found of one technique and quantity in one sweep."""

    sweep: str
    technique: str
    quantity: Quantity
    samples: int = 0
    non_finite: int = 0
    impossible: int = 0
    false_light: int = 0
    lost_light: int = 0
    errors: list[FloatArray] = field(default_factory=list)
    fit: list[FloatArray] = field(default_factory=list)
    roundings: float = 0.0
    jump: float = 0.0
    beyond: int = 0
    excepted: bool = False
    violated: bool = False
    causes: list[str] = field(default_factory=list)
    worst: Worst | None = None

    @property
    def verdict(self) -> str:
        """``holds``, ``exception``, ``violated``; ``not defined`` where only values are checked."""
        if self.violated:
            return "violated"
        if self.excepted:
            return "exception"
        return "holds" if self.errors else "not defined"

    def figures(self) -> dict[str, float | int | str | None]:
        """Return the row as numbers, by column."""
        error = np.concatenate([*self.errors, np.zeros(0)])
        fit = np.concatenate([*self.fit, np.zeros(0)])

        def quantile(values: FloatArray, share: float) -> float | None:
            return float(np.quantile(values, share)) if len(values) else None

        return {
            "sweep": self.sweep,
            "technique": self.technique,
            "quantity": self.quantity,
            "samples": self.samples,
            "non_finite": self.non_finite,
            "impossible": self.impossible,
            "false_light": self.false_light,
            "lost_light": self.lost_light,
            "error_median": quantile(error, 0.5),
            "error_p95": quantile(error, 0.95),
            "error_p99": quantile(error, 0.99),
            "error_max": quantile(error, 1.0),
            "roundings": self.roundings if len(error) else None,
            "beyond_bound": self.beyond,
            "jump": self.jump if len(error) else None,
            "ggx_mean": float(np.mean(fit)) if len(fit) else None,
            "ggx_p99": quantile(fit, 0.99),
            "ggx_max": quantile(fit, 1.0),
            "verdict": self.verdict,
            "cause": "; ".join(dict.fromkeys(self.causes)),
        }


def measure_case(
    renderer: Renderer,
    truth: Truth,
    technique: str,
    rows: tuple[Row, Row],
    sampling: Sampling,
) -> None:
    """Add what a technique gives in a case to its rows, specular and diffuse."""
    case, choice = truth.case, parse_technique(technique)
    result = compare(renderer, truth, technique, sampling.samples)
    named = [exception_of(choice, case.sweep, case.curved, quantity) for quantity in QUANTITIES]
    relaxed = result
    beyond = result.excess is not None and bool(np.any(result.excess > 0.0))
    if any(named) and (beyond or np.any(result.lost_light)):
        relaxed = compare(renderer, truth, technique, sampling.samples, excepted=True)
    for q, row in enumerate(rows):
        row.samples += len(case.points)
        exception = named[q]
        for name in ("non_finite", "impossible", "false_light", "lost_light"):
            flags = getattr(relaxed, name)[q]
            count = int(np.count_nonzero(flags))
            setattr(row, name, getattr(row, name) + count)
            if count:
                row.violated = True
                where = np.flatnonzero(flags)[:1]
                _note(row, Worst.of(case, where, name.replace("_", " "), math.inf, result))
        if result.error is None:
            if choice.name in UNBOUNDED:
                row.causes.append(UNBOUNDED[choice.name])
            continue
        assert result.excess is not None
        assert result.used is not None
        row.errors.append(result.error[q])
        row.roundings = max(row.roundings, float(np.max(result.used[q], initial=0.0)))
        index = int(np.argmax(result.excess[q]))
        worst = float(result.excess[q, index])
        _note(row, Worst.of(case, np.array([index]), "error", worst, result))
        over = int(np.count_nonzero(result.excess[q] > 0.0))
        row.beyond += over
        if over:
            assert relaxed.excess is not None
            if exception is not None and bool(np.all(relaxed.excess[q] <= 0.0)):
                row.excepted = True
                row.causes.append(exception.reason)
            else:
                row.violated = True
        if result.jump is None:
            continue
        assert result.jump_excess is not None
        index = int(np.argmax(result.jump_excess[q]))
        jump, excess = float(np.max(result.jump[q])), float(result.jump_excess[q, index])
        place, at = case, index
        if excess > 0.0:
            fine, place, at = lasting_jump(renderer, case, technique, index, q)
            assert fine.jump is not None
            assert fine.jump_excess is not None
            jump, excess = float(fine.jump[q, at]), float(fine.jump_excess[q, at])
        row.jump = max(row.jump, jump)
        if excess > 0.0:
            row.beyond += 1
            _note(row, Worst.of(place, np.array([at - 1, at]), "jump", excess, fine))
            if exception is not None and jump <= exception.jump:
                row.excepted = True
                row.causes.append(exception.reason)
            else:
                row.violated = True
    specular = rows[0]
    which, ggx = truth.ggx(max(4, sampling.compared // 10))
    if len(which):
        specular.fit.append(np.abs(result.found[0, which] - ggx))


def _note(row: Row, worst: Worst) -> None:
    if row.worst is None or worst.measure > row.worst.measure:
        row.worst = worst


def measure(
    renderer: Renderer, sweeps: list[Sweep], techniques: list[str], sampling: Sampling
) -> Iterator[tuple[int, int, dict[tuple[str, str], tuple[Row, Row]]]]:
    """Measure techniques in sweeps.

    Yields
    ------
    done, total, rows
        After each case, how many were done of how many, and the rows by sweep and technique.
    """
    cases = [case for sweep in sweeps for case in cases_of(sweep, sampling)]
    rows: dict[tuple[str, str], tuple[Row, Row]] = {}
    for done, case in enumerate(cases, start=1):
        truth = Truth(case, sampling.seed)
        for technique in techniques:
            if not applies(technique, case):
                continue
            key = case.sweep, technique
            if key not in rows:
                rows[key] = (Row(*key, "specular"), Row(*key, "diffuse"))
            measure_case(renderer, truth, technique, rows[key], sampling)
        yield done, len(cases), rows
