"""The techniques that shade, by the names that users type.

To add one: a line here, its entry function in ``shaders/``, and a feature in
`app.render.features` that selects it.
"""

from __future__ import annotations

from app.errors import InputError, expected_one_of

TECHNIQUES: dict[str, str] = {
    "ltc": "linearly transformed cosines: exact polygon integrals of a fitted GGX lobe, Lambert "
    "diffuse",
}
"""Name to one line of description, in the order in which help lists them."""


def check_technique(name: str) -> None:
    """Raise `InputError`, with the nearest match, unless ``name`` is a technique."""
    if name not in TECHNIQUES:
        raise InputError(f"technique '{name}' is unknown, {expected_one_of(name, TECHNIQUES)}")
