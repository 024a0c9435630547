"""The table of keys: every key exists, and means one thing."""

from __future__ import annotations

from typing import get_args

from app.gui.keyboard import chord_of
from app.gui.shortcuts import KEYS, WHILE_TYPING, Action


def test_every_action_has_keys_that_exist_and_belong_to_it_alone() -> None:
    assert set(KEYS) == set(get_args(Action))
    chords = [chord_of(key) for keys in KEYS.values() for key in keys]
    assert len(chords) == len(set(chords))


def test_no_letter_acts_while_text_is_typed() -> None:
    assert all(key.startswith("Ctrl+") for action in WHILE_TYPING for key in KEYS[action])
