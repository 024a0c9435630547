"""The techniques that shade, by the names that users type.

A name may be followed by a number, ``uniform:30``: what it means and from where to where it
goes is the technique's own. Behind a stroke ``ltc`` takes a variant, ``ltc/table-8``: choices
within it that are there to be measured, not to be used. Within the renderer a technique is its
canonical text, without the number where that is the default (`suited_technique`), so that equal
texts are equal programs.

To add one: a line here, its entry function in ``shaders/``, and a feature in
`app.render.features` that selects it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

from app.errors import InputError, expected_one_of, quote
from app.scene import Scene


@dataclass(frozen=True, slots=True)
class Parameter:
    """The number that may follow a technique's name: a whole one from ``least`` to ``most``."""

    meaning: str
    least: int
    most: int
    default: int


@dataclass(frozen=True, slots=True)
class Technique:
    """What the renderer must know of a technique.

    Attributes
    ----------
    description : str
        One line for ``--technique help``.
    anisotropic : bool
        Whether it shades alpha_x apart from alpha_y, and so reads tangents.
    has_tables : bool
        Whether its specular part looks up the tables of `app.render.tables`: the isotropic one
        where nothing is anisotropic, for which it then takes no tangent.
    is_sampled : bool
        Whether a sample of a pixel is a random estimate that others must be averaged with,
        rather than the result.
    curves : {"tree", "whole", "edges"}
        How it takes curves: cut into a tree of pieces that turn little; each as it is; or as
        so many edges as its number says, which makes polygons of them.
    curve_rule : int
        The feature CURVE_RULE: how it integrates along curves that are whole.
    has_own_diffuse : bool
        Whether its diffuse part differs from the form factors that the others share.
    skips_lobes : bool
        Whether it can leave out a light's lobe at a point: where the material has none, and
        where a bound puts it below what can be seen.
    parameter : Parameter, optional
        What a number behind its name means.
    """

    description: str
    anisotropic: bool
    has_tables: bool
    curves: Literal["tree", "whole", "edges"] = "tree"
    curve_rule: int = 0
    is_sampled: bool = False
    skips_lobes: bool = False
    has_own_diffuse: bool = False
    parameter: Parameter | None = None


TECHNIQUES: dict[str, Technique] = {
    "ltc": Technique(
        "linearly transformed cosines: a fitted GGX lobe, isotropic or anisotropic, integrated "
        "along the outline, Lambert diffuse",
        anisotropic=True,
        has_tables=True,
        parameter=Parameter("quadrature nodes a panel of a curve", 2, 6, 4),
        skips_lobes=True,
    ),
    "ggx": Technique(
        "GGX itself as a contour integral in half-vector space, anisotropic, without tables; "
        "Lambert diffuse",
        anisotropic=True,
        has_tables=False,
        parameter=Parameter("quadrature nodes an edge", 1, 4, 2),
        skips_lobes=True,
    ),
    "adaptive": Technique(
        "ltc with curves halved until triangles between chords add little, as published by Kuge "
        "et al. 2022",
        anisotropic=True,
        has_tables=True,
        curves="whole",
        curve_rule=1,
        skips_lobes=True,
    ),
    "adaptive-extrapolated": Technique(
        "adaptive with the same chords, extrapolated to the curve",
        anisotropic=True,
        has_tables=True,
        curves="whole",
        curve_rule=2,
        skips_lobes=True,
    ),
    "uniform": Technique(
        "ltc with every curve cut into the same number of edges",
        anisotropic=True,
        has_tables=True,
        curves="edges",
        parameter=Parameter("edges a curve", 1, 4096, 18),
        skips_lobes=True,
    ),
    "reference": Technique(
        "GGX and Lambert estimated by random directions, without bias but with noise: what "
        "many samples converge to is exact",
        anisotropic=True,
        has_tables=False,
        is_sampled=True,
        has_own_diffuse=True,
    ),
    "ltc+residual": Technique(
        "ltc and an estimate of what it lacks, by random directions: close after few "
        "samples, exact in the limit",
        anisotropic=True,
        has_tables=True,
        is_sampled=True,
    ),
    "representative-point": Technique(
        "a baseline, what engines did before: each light as its point nearest the mirrored view, "
        "by Karis 2013",
        anisotropic=True,
        has_tables=False,
        curves="edges",
        has_own_diffuse=True,
        parameter=Parameter("edges a curve", 1, 4096, 18),
    ),
}
"""By name, in the order in which help lists them."""


PICTURE_TAPS = 5
"""Looks that a lobe takes at a light's picture, along the longer axis of what it sees of it."""


@dataclass(frozen=True, slots=True)
class Variant:
    """What is done otherwise than in ``ltc``.

    Attributes
    ----------
    description : str
        For ``--technique help``.
    residual : int, optional
        Texels on each axis of the residual's texture, 0 for no residual: the closed-form guess.
    divides : bool
        Whether what is cut off below the surface is made up for.
    cuts_at_lobe : bool
        Whether lights are cut at the lobe's own horizon instead of the surface's.
    picture_taps : int
        Looks that a lobe takes at a light's picture, `ltc.textured`'s number; 0 for one where
        Heitz et al. 2016 look, at the foot of the perpendicular, and as wide.
    """

    description: str
    residual: int | None = None
    divides: bool = True
    cuts_at_lobe: bool = False
    picture_taps: int = PICTURE_TAPS

    @property
    def is_of_pictures(self) -> bool:
        """Whether it differs only where lights have pictures."""
        return self.picture_taps != PICTURE_TAPS


VARIANTS: dict[str, Variant] = {
    "no-table": Variant("the closed-form guess alone, without the fitted residual", residual=0),
    "table-4": Variant("the residual in 4 x 4 texels instead of 16 x 16", residual=4),
    "table-8": Variant("the residual in 8 x 8 texels", residual=8),
    "table-32": Variant("the residual in 32 x 32 texels", residual=32),
    "undivided": Variant(
        "cut at the surface's horizon, but not divided by the share of the lobe above it",
        divides=False,
    ),
    "published-clip": Variant(
        "as published: cut at the lobe's own horizon, so that light leaks in from below the "
        "surface",
        divides=False,
        cuts_at_lobe=True,
    ),
    "foot-tap": Variant(
        "one look at a light's picture, where and as wide as published, on the levels of here",
        picture_taps=0,
    ),
    "taps-1": Variant("one look at a light's picture instead of 5", picture_taps=1),
    "taps-3": Variant("3 looks at a light's picture", picture_taps=3),
    "taps-9": Variant("9 looks at a light's picture", picture_taps=9),
}
"""Of ``ltc``, to measure what its choices are worth."""

AUTOMATIC = "auto"
"""Stands for `suited_technique`."""

AUTOMATIC_DESCRIPTION = "ggx where a glossy material is anisotropic, else ltc, which costs less"

DEFAULT_TECHNIQUE = "ltc"
"""Used where techniques do not differ."""


class Choice(NamedTuple):
    """A technique by its bare name, and its number; None where it takes none."""

    name: str
    number: int | None
    variant: str = ""

    @property
    def skips_lobes(self) -> bool:
        """Whether lobes of lights can be left out at a point; not by what was published."""
        return self.technique.skips_lobes and not self.changes.cuts_at_lobe

    @property
    def changes(self) -> Variant:
        """What its variant does otherwise."""
        return VARIANTS[self.variant] if self.variant else Variant("")

    @property
    def without_curves(self) -> Choice:
        """What is the same for outlines without curves, of ``ltc`` and those that follow it."""
        return parse_technique(DEFAULT_TECHNIQUE)._replace(variant=self.variant)

    @property
    def technique(self) -> Technique:
        """What the renderer must know of it."""
        return TECHNIQUES[self.name]

    @property
    def curves(self) -> Literal["tree", "whole"] | int:
        """How curves are packed for it, as `app.render.pack.CurveForm`."""
        form = self.technique.curves
        if form != "edges":
            return form
        assert self.number is not None
        return self.number

    @property
    def follows_ltc(self) -> bool:
        """Whether it is ``ltc`` but for how it takes curves."""
        return self.technique.curves != "tree" and self.technique.has_tables

    @property
    def curve_nodes(self) -> int:
        """Nodes of a panel wherever pieces of the tree are integrated: ``ltc``'s number."""
        parameter = TECHNIQUES[DEFAULT_TECHNIQUE].parameter
        assert parameter is not None
        own = self.number if self.name == DEFAULT_TECHNIQUE else None
        return parameter.default if own is None else own

    def __str__(self) -> str:
        parameter = self.technique.parameter
        usual = parameter is None or parameter.default == self.number
        text = self.name if usual else f"{self.name}:{self.number}"
        return f"{text}/{self.variant}" if self.variant else text


def parse_technique(text: str) -> Choice:
    """Return the technique that a text such as ``ltc`` or ``uniform:30`` names, not ``auto``.

    Raises
    ------
    InputError
        If there is none of this name, saying which is nearest, or its number is wrong.
    """
    text, stroke, variant = text.partition("/")
    if stroke:
        return _with_variant(parse_technique(text), variant)
    name, colon, number = text.partition(":")
    if name not in TECHNIQUES:
        known = (AUTOMATIC, *TECHNIQUES)
        raise InputError(f"technique '{name}' is unknown, {expected_one_of(name, known)}")
    parameter = TECHNIQUES[name].parameter
    if not colon:
        return Choice(name, parameter.default if parameter else None)
    if parameter is None:
        raise InputError(f"technique '{name}' takes no number, found {quote(text)}")
    whole = number.isascii() and number.isdigit() and len(number) <= 9
    if not whole or not parameter.least <= int(number) <= parameter.most:
        raise InputError(
            f"technique '{name}': the number of {parameter.meaning} is {quote(number)}, expected "
            f"a whole number from {parameter.least} to {parameter.most}"
        )
    return Choice(name, int(number))


def _with_variant(choice: Choice, variant: str) -> Choice:
    if choice.name != DEFAULT_TECHNIQUE:
        raise InputError(
            f"technique '{choice.name}' has no variants, found {quote('/' + variant)} behind it, "
            f"expected them behind '{DEFAULT_TECHNIQUE}'"
        )
    if variant not in VARIANTS:
        raise InputError(
            f"technique '{choice.name}': the variant is {quote(variant)}, "
            f"{expected_one_of(variant, VARIANTS)}"
        )
    return choice._replace(variant=variant)


def find_technique(text: str) -> Technique:
    """Return what the renderer must know of a technique; raises as `parse_technique`."""
    return parse_technique(text).technique


def suited_technique(text: str, anisotropic: bool) -> str:
    """Return the technique that ``text`` stands for, in canonical form.

    Parameters
    ----------
    text : str
        A technique, with its number if it takes one, or ``auto``.
    anisotropic : bool
        Whether something glossy is anisotropic.

    Raises
    ------
    InputError
        If there is no technique of this name, or its number is wrong.

    Notes
    -----
    ``auto`` is ``ltc`` for isotropic scenes: its mean error of .002 is below what
    one sees, and ``ggx`` takes 2 to 3 times as long for a sixth of it. Anisotropic lobes are
    long lunes, which no transform of a cosine has: there ``ltc`` errs .004, by 1 to 5 % of
    a whole picture's mean and with streaks missing on brushed disks, against .0003 by ``ggx``.
    """
    if text == AUTOMATIC:
        return "ggx" if anisotropic else "ltc"
    return str(parse_technique(text))


def technique_of(scene: Scene, text: str) -> str:
    """Return the technique that ``text`` stands for in a scene; raises as `suited_technique`."""
    used = scene.object_materials()
    return suited_technique(text, any(m.is_anisotropic and any(m.f0) for m in used))


def technique_lines() -> list[str]:
    """Return the lines of ``--technique help``: names, numbers they take, and what they do."""
    rows = [(AUTOMATIC, AUTOMATIC_DESCRIPTION)]
    for name, technique in TECHNIQUES.items():
        parameter = technique.parameter
        if parameter is None:
            rows.append((name, technique.description))
            continue
        span = f"{parameter.least} to {parameter.most}, {parameter.default} by default"
        rows.append((f"{name}[:N]", f"{technique.description}; N {parameter.meaning}, {span}"))
    rows += [
        (f"{DEFAULT_TECHNIQUE}/{name}", f"to measure: {variant.description}")
        for name, variant in VARIANTS.items()
    ]
    width = max(len(name) for name, _ in rows)
    return [f"{name:{width}}  {description}" for name, description in rows]
