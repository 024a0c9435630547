"""The techniques that shade, by the names that users type.

To add one: a line here, its entry function in ``shaders/``, and a feature in
`app.render.features` that selects it.
"""

from __future__ import annotations

from dataclasses import dataclass

from app.errors import InputError, expected_one_of
from app.scene import Scene


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
        Whether its specular part looks up the tables of `app.render.tables`.
    """

    description: str
    anisotropic: bool
    has_tables: bool


TECHNIQUES: dict[str, Technique] = {
    "ltc": Technique(
        "linearly transformed cosines: exact polygon integrals of a fitted GGX lobe, Lambert "
        "diffuse",
        anisotropic=False,
        has_tables=True,
    ),
    "ggx": Technique(
        "GGX itself as a contour integral in half-vector space, anisotropic, without tables; "
        "Lambert diffuse",
        anisotropic=True,
        has_tables=False,
    ),
}
"""By name, in the order in which help lists them."""

AUTOMATIC = "auto"
"""Stands for `suited_technique`."""

AUTOMATIC_DESCRIPTION = "ggx where a glossy material is anisotropic, else ltc, which costs less"

DEFAULT_TECHNIQUE = "ltc"
"""Used where techniques do not differ."""


def find_technique(name: str) -> Technique:
    """Return a technique by its own name, not ``auto``.

    Raises
    ------
    InputError
        If there is none of this name; says which is nearest.
    """
    if name not in TECHNIQUES:
        known = (AUTOMATIC, *TECHNIQUES)
        raise InputError(f"technique '{name}' is unknown, {expected_one_of(name, known)}")
    return TECHNIQUES[name]


def suited_technique(name: str, anisotropic: bool) -> str:
    """Return the technique that ``name`` stands for.

    Parameters
    ----------
    name : str
        A technique or ``auto``.
    anisotropic : bool
        Whether something glossy is anisotropic.

    Raises
    ------
    InputError
        If there is no technique of this name.

    Notes
    -----
    ``auto`` is ``ltc`` for isotropic scenes: its mean error of .002 is below what
    one sees, and ``ggx`` takes 2 to 3 times as long for a sixth of it. Anisotropic
    lobes ``ltc`` cannot shade at all.
    """
    if name == AUTOMATIC:
        return "ggx" if anisotropic else "ltc"
    find_technique(name)
    return name


def technique_of(scene: Scene, name: str) -> str:
    """Return the technique that ``name`` stands for in a scene; raises as `suited_technique`."""
    used = scene.object_materials()
    return suited_technique(name, any(m.is_anisotropic and any(m.f0) for m in used))
