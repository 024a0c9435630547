"""The table of keys: every key exists, and means one thing."""

from __future__ import annotations

from pathlib import Path
from typing import get_args

import pytest

from app.gui.keyboard import chord_of
from app.gui.shortcuts import KEYS, WHILE_TYPING, Action, key_of


def test_every_action_has_keys_that_exist_and_belong_to_it_alone() -> None:
    assert set(KEYS) == set(get_args(Action))
    chords = [chord_of(key) for keys in KEYS.values() for key in keys]
    assert len(chords) == len(set(chords))


def test_no_letter_acts_while_text_is_typed() -> None:
    assert all(key.startswith("Ctrl+") for action in WHILE_TYPING for key in KEYS[action])


def test_the_page_about_shapes_names_the_real_keys() -> None:
    page = Path(__file__).resolve().parents[2] / "docs" / "shaping-lights.md"
    if not page.is_file():
        pytest.skip("needs the source tree")
    text = page.read_text("utf-8")
    actions: tuple[Action, ...] = ("corner", "smooth", "symmetric", "line", "curve", "reverse")
    assert all(key_of(action) in text for action in (*actions, "remove"))
