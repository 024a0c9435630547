"""Compare float32 on the GPU with float64, sweep by sweep and technique by technique."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from app.render.techniques import TECHNIQUES, Choice, parse_technique
from app.scene import AreaLight, PolygonContour, RenderSettings, Scene
from app.stability.bounds import (
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
from app.stability.definitions import Definition, Integral, Value, definition_of, exact
from app.stability.points import BoolArray, FloatArray, IntArray, Points, Seen, certainly_dark
from app.stability.sweeps import DIMENSIONS, Placing, Sweep

if TYPE_CHECKING:
    from app.render.renderer import Renderer

Counts: TypeAlias = NDArray[np.intp]

LEAST_POINTS = 8
"""Of a cloud, however few are asked for."""

JITTERS = 6
"""Times that a point's inputs are moved to see what roundings do."""

BATCHES = 16
"""Independent estimates by a sampled technique, for their standard error."""

FEW_SETTINGS = 8
"""Of a technique with as many settings, or fewer, each is measured; of others the usual one."""


@dataclass(frozen=True, slots=True)
class Sampling:
    """How many points: of all clouds of a sweep, of each series, and of those compared with GGX.

    ``samples`` are a sampled technique's estimates of a point, a multiple of `BATCHES`.
    """

    points: int = 800
    steps: int = 160
    compared: int = 100
    samples: int = 512
    seed: int = 0


@dataclass(frozen=True, slots=True)
class Case:
    """Points that see one light: a cloud, or neighbours along a series at places ``t``."""

    sweep: str
    name: str
    light: AreaLight
    points: Points
    defined: bool = True
    place: Placing | None = None
    t: FloatArray | None = None

    @property
    def scene(self) -> Scene:
        """The light alone."""
        return Scene(lights=(self.light,))

    @property
    def is_series(self) -> bool:
        """Whether points are neighbours."""
        return self.t is not None

    @property
    def curved(self) -> bool:
        """Whether the light has curves."""
        return not all(isinstance(c, PolygonContour) for c in self.light.outline.contours)

    def between(self, t: FloatArray) -> Case:
        """Return the same series at other places."""
        assert self.place is not None
        return Case(
            self.sweep, self.name, self.light, self.place(t), self.defined, self.place, t
        )  # fmt: skip


def cases_of(sweep: Sweep, sampling: Sampling) -> list[Case]:
    """Return the cases of a sweep; the same for the same sampling."""
    cases = []
    count = max(LEAST_POINTS, math.ceil(sampling.points / len(sweep.clouds)))
    for index, cloud in enumerate(sweep.clouds):
        sobol = qmc.Sobol(DIMENSIONS, rng=np.random.default_rng((sampling.seed, index)))
        u = sobol.random(1 << (count - 1).bit_length())[:count]
        cases.append(Case(sweep.name, cloud.name, cloud.light, cloud.place(u), cloud.defined))
    t = np.linspace(0.0, 1.0, sampling.steps)
    for series in sweep.series:
        start = Case(sweep.name, series.name, series.light, series.place(t), place=series.place)
        cases.append(start.between(t))
    return cases


def compared_techniques() -> list[str]:
    """Return every technique of the registry; of those with few settings, each of them."""
    names = []
    for name, technique in TECHNIQUES.items():
        parameter = technique.parameter
        if parameter is None or parameter.most - parameter.least > FEW_SETTINGS:
            names.append(name)
            continue
        numbers = range(parameter.least, parameter.most + 1)
        ordered = sorted(numbers, key=lambda n: (n != parameter.default, n))
        names += [str(parse_technique(f"{name}:{number}")) for number in ordered]
    return names


def applies(technique: str, case: Case) -> bool:
    """Whether a technique is meant for a case: brushed metal is not for all."""
    return parse_technique(technique).technique.anisotropic or not case.points.anisotropic


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
        largest = largest + RARE / samples
        moved = deviation
        lost[:] = False
    else:
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


# --- Rows ---------------------------------------------------------------------------------


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
