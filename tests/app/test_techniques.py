"""Technique names with numbers: what they stand for, and what is said of wrong ones."""

from __future__ import annotations

import re

import pytest

from app.errors import InputError
from app.render.techniques import (
    TECHNIQUES,
    VARIANTS,
    parse_technique,
    suited_technique,
    technique_lines,
)


@pytest.mark.parametrize(
    ("text", "name", "number", "canonical"),
    [
        ("ltc", "ltc", 4, "ltc"),
        ("ltc:6", "ltc", 6, "ltc:6"),
        ("ggx", "ggx", 2, "ggx"),
        ("ggx:2", "ggx", 2, "ggx"),
        ("ggx:4", "ggx", 4, "ggx:4"),
        ("adaptive", "adaptive", None, "adaptive"),
        ("uniform", "uniform", 18, "uniform"),
        ("uniform:018", "uniform", 18, "uniform"),
        ("uniform:1", "uniform", 1, "uniform:1"),
        ("uniform:4096", "uniform", 4096, "uniform:4096"),
        ("ltc:4/table-8", "ltc", 4, "ltc/table-8"),
        ("ltc:2/undivided", "ltc", 2, "ltc:2/undivided"),
    ],
)
def test_names_and_numbers(text: str, name: str, number: int | None, canonical: str) -> None:
    choice = parse_technique(text)
    assert (choice.name, choice.number, str(choice)) == (name, number, canonical)
    assert suited_technique(text, anisotropic=True) == canonical
    assert str(parse_technique(canonical)) == canonical


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("unifrm:3", "'unifrm' is unknown.*did you mean 'uniform'"),
        ("adaptive:4", "'adaptive' takes no number, found \"adaptive:4\""),
        ("uniform:0", 'number of edges a curve is "0", expected a whole number from 1 to 4096'),
        ("uniform:4097", '"4097"'),
        ("uniform:", '""'),
        ("uniform:1.5", '"1.5"'),
        ("uniform:-1", '"-1"'),
        ("uniform:٣", "number of edges"),
        ("uniform:" + "9" * 5000, "expected a whole number"),
        ("ggx:5", 'number of quadrature nodes an edge is "5", expected a whole number from 1 to 4'),
        ("", "'' is unknown"),
        ("ltc/tables-8", "variant is \"tables-8\".*did you mean 'table-8'"),
        ("ltc/", 'variant is ""'),
        ("ggx/undivided", "'ggx' has no variants"),
        ("auto/undivided", "'auto' is unknown"),
        (":3", "'' is unknown"),
    ],
)
def test_wrong_ones_are_told_in_a_sentence(text: str, words: str) -> None:
    with pytest.raises(InputError, match=words) as error:
        parse_technique(text)
    assert len(str(error.value)) < 300


def test_help_says_what_numbers_mean() -> None:
    lines = technique_lines()
    variants = [f"ltc/{name}" for name in VARIANTS]
    names = [re.split(r"[\s\[]", line)[0] for line in lines]
    assert names == ["auto", *TECHNIQUES, *variants]
    for line, technique in zip(lines[1:], TECHNIQUES.values(), strict=False):
        assert ("[:N]" in line) == (technique.parameter is not None)
        if technique.parameter:
            assert technique.parameter.meaning in line
