"""What must hold: how far float32 may be from a technique's definition, and the exceptions.

An error may be as large as the technique's own rules of quadrature make it (`Bound.largest`),
and beyond that as large as what the definition itself changes by when everything that float32
knows of a point, its frame, the directions to the light, the view and the roughness, is moved
by a rounding or so (`Bound.roundings` times `app.stability.points.Seen.jittered`): no
float32 computation can do better than a few of these. At alpha 1e-4 one rounding of a direction,
6e-8, is 6e-4 of the lobe; in a plane through the point it decides whether a light is seen.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from app.render.techniques import TECHNIQUES, Choice

Quantity: TypeAlias = Literal["specular", "diffuse"]
QUANTITIES: tuple[Quantity, Quantity] = ("specular", "diffuse")

MOST = 1.0 + 1e-3
"""Radiance of a white material under a light of radiance 1: no more than the light's, and what
tables, quadrature and float32 add."""

MOST_ON_OUTLINE = 1.05
"""The same for points on the outline itself, where there is no integral to be compared with."""

LOST = 1e-5
"""What a definition must give at least, by more than what roundings do, where a result of exactly
zero counts as light that was lost; with curves it must be more than chords may take."""


@dataclass(frozen=True, slots=True)
class Bound:
    """How far a technique's float32 may be from its float64 definition, light radiance 1.

    ``jump`` is by how much the error may change at once where the exact value does not, and
    ``reason`` says where the numbers come from.
    """

    largest: float
    roundings: float
    jump: float
    reason: str


@dataclass(frozen=True, slots=True)
class Named:
    """An exception: where a bound does not hold, what holds instead, and the cause.

    ``techniques`` are bare names, ``sweep`` is one of `app.stability.sweeps.make_sweeps`, and
    ``curved`` says which lights are meant.
    """

    techniques: tuple[str, ...]
    sweep: str
    curved: bool
    quantities: tuple[Quantity, ...]
    bound: Bound


ROUNDINGS = 8.0
"""Of all deterministic techniques: what the longest chain of float32 operations from a point to
its light and lobe gathers. Seen: 4 for `ltc`, 6 for `ggx`."""

PANELS = {2: 1e-2, 3: 1e-3, 4: 5e-4, 5: 1e-4, 6: 1e-4}
"""Of curves by nodes a panel: docs/curves.md measures a leaf's largest error, 1e-2, 5.5e-4,
8e-5, 7e-6 and 7e-7, and certifies chords to 1e-3, 3e-4, 1e-4, 3e-5 and 1e-5; a light has some."""

FAN = {1: 0.16, 2: 0.024, 3: 0.018, 4: 0.012}
"""Of the mean of G2/G1 on a fan by nodes an edge, against GGX itself, which is what there is to
compare with along curves: the largest errors in docs/ggx.md and here, where a lobe of .4 by .02
seen at 86 degrees errs .0145 with 3 nodes and .0091 with 4."""

STEP = 1e-4
"""A jump that nobody sees: a fortieth of an 8-bit step."""


def bound_of(choice: Choice, curved: bool, quantity: Quantity) -> Bound | None:
    """Return what must hold of a technique for lights with or without curves.

    None for techniques that nobody has defined in `app.stability.definitions`.
    """
    technique = choice.technique
    if technique.is_sampled:
        return SAMPLED
    nodes = choice.number
    if technique.has_tables and (technique.curves == "tree" or not curved):
        if not curved:
            return LTC_POLYGON[quantity]
        return Bound(
            PANELS[choice.curve_nodes], ROUNDINGS, PANELS[choice.curve_nodes],
            "quadrature of panels, and chords that stand for curves, each certified",
        )  # fmt: skip
    if technique.has_tables:
        return TWIN
    if choice.name == "ggx" and nodes is not None:
        if quantity == "diffuse":
            return LTC_POLYGON["diffuse"] if not curved else Bound(
                PANELS[choice.curve_nodes], ROUNDINGS, PANELS[choice.curve_nodes],
                "Lambert along curves, as with ltc",
            )  # fmt: skip
        if not curved:
            return Bound(
                1e-4, ROUNDINGS, 0.1 * FAN[nodes],
                "closed forms; jumps are those of the fan's mean against exact GGX",
            )  # fmt: skip
        return Bound(
            FAN[nodes], ROUNDINGS, 0.1 * FAN[nodes], "the mean of G2/G1 on a fan, against exact GGX"
        )
    return None


LTC_POLYGON: dict[Quantity, Bound] = {
    "specular": Bound(1e-4, ROUNDINGS, STEP, "closed forms in float32 (README)"),
    "diffuse": Bound(1e-5, ROUNDINGS, 1e-5, "Lambert's closed form in float32 (README)"),
}

TWIN = Bound(
    1e-4, ROUNDINGS, 1e-2,
    "the same edges in float64; rounding may decide whether a triangle is halved. Jumps are the "
    "method's own",
)  # fmt: skip

DEVIATIONS = 6.0
"""Of a sampled technique: standard errors that an estimate may be off by. One of 5e8 is more."""

RARE = 12.0
"""The same where a handful of samples carries all, which a standard error does not see: radiance
times samples that may be missed."""

SAMPLED = Bound(
    0.0, ROUNDINGS, 1.0,
    f"besides {DEVIATIONS:g} standard errors of the mean, and {RARE:g} over the samples where few "
    "carry all. Noise jumps",
)  # fmt: skip


def least_seen(choice: Choice, curved: bool) -> float:
    """Return what a definition must give for a result of zero to count as lost light."""
    return PANELS[choice.curve_nodes] if curved else LOST


EXCEPTIONS: tuple[Named, ...] = (
    Named(
        ("ltc", "ggx"), "near", True, QUANTITIES,
        Bound(
            2e-2, ROUNDINGS, 1e-2,
            "Panels of a curve meet within 6e-8 of its length, and what gap is left is felt from a "
            "hundredth of a millimetre on: as 1e-3 there, as 1e-2 a micrometre away.",
        ),
    ),
    Named(
        ("reference", "ltc+residual"), "distance", False, ("specular",),
        Bound(
            0.5, ROUNDINGS, 1.0,
            "Whether a direction meets a light is decided in the light's plane, in float32: a "
            "light of 10⁵ times the distance is known to 6e-3 of the distance there, more than "
            "sharp lobes are wide.",
        ),
    ),
    Named(
        ("adaptive", "adaptive-extrapolated"), "near", True, QUANTITIES,
        Bound(
            0.5, ROUNDINGS, 1e-2,
            "Ends of chords are known to 6e-8 of a curve's length, each by itself, where halving "
            "goes on until triangles are as small.",
        ),
    ),
)  # fmt: skip


UNBOUNDED = {
    "representative-point": "The published estimate has no bound: at a mirror its scale is 9/4 of "
    "the light's radiance, at grazing views many times that (ltc.representative_point). Neither "
    "its size nor its error is held to anything, but it must be finite and dark where no light is.",
}
"""Techniques, by bare name, whose values may exceed the light's radiance, with the cause."""


def exception_of(choice: Choice, sweep: str, curved: bool, quantity: Quantity) -> Bound | None:
    """Return what holds of a technique in a sweep where its bound does not; None if it does."""
    for item in EXCEPTIONS:
        here = item.sweep == sweep and item.curved == curved and quantity in item.quantities
        if here and choice.name in item.techniques:
            return item.bound
    return None


assert all(name in TECHNIQUES for item in EXCEPTIONS for name in item.techniques)
