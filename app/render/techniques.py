"""The techniques that shade, by the names that users type.

To add one: a line here, its entry function in ``shaders/``, and a feature in
`app.render.features` that selects it.
"""

from __future__ import annotations

from dataclasses import dataclass

from app.errors import InputError, expected_one_of


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

DEFAULT_TECHNIQUE = "ltc"


def find_technique(name: str) -> Technique:
    """Return a technique.

    Raises
    ------
    InputError
        If there is none of this name; says which is nearest.
    """
    if name not in TECHNIQUES:
        raise InputError(f"technique '{name}' is unknown, {expected_one_of(name, TECHNIQUES)}")
    return TECHNIQUES[name]
