"""One technique on one case: float32 on the GPU beside float64, and what must hold."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from app.render.techniques import Choice, parse_technique
from app.scene import RenderSettings
from app.stability.bounds import (
    DEVIATIONS,
    MOST,
    MOST_ON_OUTLINE,
    QUANTITIES,
    RARE,
    UNBOUNDED,
    Bound,
    Quantity,
    bound_of,
    exception_of,
    least_seen,
)
from app.stability.cases import Case
from app.stability.definitions import Definition, Integral, Value, definition_of, exact
from app.stability.points import BoolArray, FloatArray, IntArray, Seen, certainly_dark

if TYPE_CHECKING:
    from app.render.renderer import Renderer

JITTERS = 6
"""Times that a point's inputs are moved to see what roundings do."""

BATCHES = 16
"""Independent estimates by a sampled technique, for their standard error."""


class Truth:
    """The float64 values of a case, each computed once whatever techniques ask for it."""

    def __init__(self, case: Case, seed: int = 0) -> None:
        self.case = case
        rounded = case.points.rounded()
        self.seen = Seen.of(case.light, rounded)
        self.dark = certainly_dark(case.light, rounded)
        self._values: dict[str, Value] = {}
        self._jitters: dict[str, FloatArray] = {}
        self._seed = seed

    def value(self, key: str, integral: Integral) -> FloatArray:
        """Return the values (2, n) of an integral that ``key`` names."""
        if key not in self._values:
            self._values[key] = integral(self.seen)
        return np.array(self._values[key])

    def jitter(self, definition: Definition, which: BoolArray) -> FloatArray:
        """Return, (2, n), what roundings change; only where ``which`` (n) says so, else 0."""
        known = self._jitters.setdefault(definition.key, np.full((2, len(self.seen)), np.nan))
        missing = np.flatnonzero(which & np.isnan(known[0]))
        if len(missing):
            seen = self.seen.pick(missing)
            rng = np.random.default_rng(self._seed)
            start = self.value(definition.key, definition.own)[:, missing]
            moved = np.zeros(start.shape)
            for _ in range(JITTERS):
                other = np.array(definition.own(seen.jittered(rng)))
                moved = np.maximum(moved, np.abs(other - start))
            known[:, missing] = moved
        return np.where(np.isnan(known), 0.0, known)

    def ggx(self, count: int) -> tuple[IntArray, FloatArray]:
        """Return up to ``count`` points, evenly through the case, and exact GGX there."""
        total = len(self.seen)
        which = np.unique(np.linspace(0, total - 1, min(count, total)).astype(np.intp))
        if not self.case.defined:
            which = which[:0]
        key = f"some {count}"
        if key not in self._values:
            self._values[key] = exact(self.seen.pick(which))
        return which, self._values[key].specular


@dataclass(frozen=True, slots=True)
class Comparison:
    """A technique's float32 on a case beside float64; arrays are (2, n), specular and diffuse.

    Without a definition there are neither errors nor jumps. ``excess`` is by how much an error
    is beyond its bound, negative within; ``used`` how many of its roundings it takes.
    """

    found: FloatArray
    own: FloatArray | None
    error: FloatArray | None
    excess: FloatArray | None
    used: FloatArray | None
    jump: FloatArray | None  # (2, n): from the point before
    jump_excess: FloatArray | None
    non_finite: BoolArray
    impossible: BoolArray
    false_light: BoolArray
    lost_light: BoolArray
    bounds: tuple[Bound | None, Bound | None]


def compare(
    renderer: Renderer,
    truth: Truth,
    technique: str,
    samples: int = 512,
    excepted: bool = False,
) -> Comparison:
    """Shade a case by a technique and hold it against its definition and bound.

    ``excepted``: against what `app.stability.bounds.EXCEPTIONS` allow there instead.
    """
    case, choice = truth.case, parse_technique(technique)
    bounds = (
        _allowed(choice, case, "specular", excepted),
        _allowed(choice, case, "diffuse", excepted),
    )
    sampled = choice.technique.is_sampled
    found, deviation = _shade(renderer, case, technique, samples if sampled else 0)
    with np.errstate(invalid="ignore"):
        # A sampled technique's noise may go beyond, and below 0 where it estimates a difference.
        noise = 8.0 * deviation + RARE / samples if sampled else np.zeros(found.shape)
        most = np.inf if choice.name in UNBOUNDED else MOST if case.defined else MOST_ON_OUTLINE
        impossible = (found < -noise) | (found > most + noise)
        false_light = truth.dark & (found > 0.0)
    bad = ~np.isfinite(found)
    definition = definition_of(choice, truth.seen)
    if definition is None or not case.defined or bounds[0] is None or bounds[1] is None:
        none = np.zeros(found.shape, dtype=np.bool_)
        return Comparison(
            found, None, None, None, None, None, None, bad, impossible, false_light, none, bounds
        )
    own = truth.value(definition.key, definition.own)
    error = np.abs(np.where(bad, np.inf, found - own))
    largest = np.array([[bounds[0].largest], [bounds[1].largest]])
    roundings = np.array([[bounds[0].roundings], [bounds[1].roundings]])
    least = least_seen(choice, case.curved)
    if excepted:
        least = max(least, bounds[0].largest)
    lost = (found == 0.0) & (own > least)
    if sampled:
        largest = largest + RARE / samples + DEVIATIONS * deviation
        lost[:] = False
    moved = truth.jitter(definition, np.any((error > largest) | lost, axis=0))
    lost &= own > least + 2.0 * roundings * moved
    beyond = np.maximum(error - largest, 0.0)
    used = np.divide(beyond, moved, out=np.where(beyond > 0.0, np.inf, 0.0), where=moved > 0.0)
    excess = error - largest - roundings * moved
    jump = jump_excess = None
    if case.is_series and not sampled:
        smooth = own
        if definition.smooth is not definition.own:
            smooth = truth.value(f"{definition.key}, smooth", definition.smooth)
        jump = _jumps(np.where(bad, 0.0, found - smooth))
        allowed = np.array([[bounds[0].jump], [bounds[1].jump]])
        moved = truth.jitter(definition, np.any(jump > allowed, axis=0))
        jump_excess = jump - allowed - 2.0 * roundings * moved
    return Comparison(
        found, own, error, excess, used, jump, jump_excess, bad, impossible, false_light, lost,
        bounds,
    )  # fmt: skip


def _allowed(choice: Choice, case: Case, quantity: Quantity, excepted: bool) -> Bound | None:
    named = exception_of(choice, case.sweep, case.curved, quantity) if excepted else None
    return named or bound_of(choice, case.curved, quantity)


def _shade(
    renderer: Renderer, case: Case, technique: str, samples: int
) -> tuple[FloatArray, FloatArray]:
    """Return radiance (2, n) and its standard error, which is 0 unless ``samples`` are drawn."""
    inputs = case.points.inputs()
    batches = BATCHES if samples else 1
    tiled = {name: np.tile(array, (batches, 1)) for name, array in inputs.items()}
    settings = RenderSettings(technique, max(samples // batches, 1))
    out = renderer.probe(case.scene, settings, **tiled)  # type: ignore[arg-type]
    found = np.stack([out[name][:, 0] for name in QUANTITIES]).astype(np.float64)
    found = found.reshape(2, batches, -1)
    mean = np.mean(found, axis=1)
    if batches == 1:
        return mean, np.zeros(mean.shape)
    return mean, np.std(found, axis=1, ddof=1) / math.sqrt(batches)


def _jumps(error: FloatArray) -> FloatArray:
    """Return by how much errors (2, n) step from the point before more than next to it.

    A slope steps alike on both sides; the outermost steps have but one neighbour and count 0.
    """
    step = np.abs(np.diff(error, axis=1))
    out = np.zeros(error.shape)
    around = np.maximum(step[:, :-2], step[:, 2:])
    out[:, 2:-1] = np.maximum(step[:, 1:-1] - around, 0.0)
    return out


REFINED = 48
"""Steps that three steps of a series are divided into where one of them looks like a jump."""


def lasting_jump(
    renderer: Renderer, case: Case, technique: str, index: int, quantity: int, rounds: int = 3
) -> tuple[Comparison, Case, int]:
    """Look again at a step of a series that looks like a jump, ever more finely.

    Returns
    -------
    comparison, case, index
        Of the finest look, and its largest jump: what is left of a kink is little.
    """
    for _ in range(rounds):
        assert case.t is not None
        low, high = case.t[max(index - 2, 0)], case.t[min(index + 1, len(case.t) - 1)]
        case = case.between(np.linspace(low, high, REFINED))
        comparison = compare(renderer, Truth(case), technique)
        assert comparison.jump_excess is not None
        index = int(np.argmax(comparison.jump_excess[quantity]))
        if comparison.jump_excess[quantity, index] <= 0.0:
            break
    return comparison, case, index
