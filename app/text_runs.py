"""From a line of text to runs of one direction and one script, as they stand from left to right.

Shaping needs runs: Hebrew with a number in it, or Greek after Latin, is shaped
piece by piece. The order is that of the Unicode bidirectional algorithm (UAX 9)
without explicit embeddings: rules P2, P3, W1 to W7, N0 for the brackets of
ASCII, N1, N2, I1, I2 and L2. Scripts are those of the characters; spaces, digits
and marks go with the letters before them.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby
from unicodedata import bidirectional

from fontTools.unicodedata import script as script_of

STRONG = ("L", "R", "AL")
NUMBERS = ("EN", "AN")
DIRECTIONS = {"L": "L", "R": "R", "EN": "R", "AN": "R"}
"""How what has a direction counts for what stands beside it."""

BRACKETS = {")": "(", "]": "[", "}": "{"}
COMMON = ("Zyyy", "Zinh", "Zzzz")
"""Scripts of characters that belong to no script."""


@dataclass(frozen=True, slots=True)
class Run:
    """Characters ``start`` to ``end`` of a line, of one script, read in one direction."""

    start: int
    end: int
    right_to_left: bool
    script: str


def visual_runs(line: str) -> list[Run]:
    """Return the runs of a line from left to right."""
    levels, scripts = _levels(line), _scripts(line)
    runs: list[tuple[int, Run]] = []
    for (level, script), group in groupby(range(len(line)), key=lambda i: (levels[i], scripts[i])):
        indices = list(group)
        runs.append((level, Run(indices[0], indices[-1] + 1, level % 2 == 1, script)))
    # Rule L2, on whole runs: what is inside one is turned round by the shaper.
    for depth in range(max(levels, default=0), 0, -1):
        first = 0
        while first < len(runs):
            last = first
            while last < len(runs) and runs[last][0] >= depth:
                last += 1
            runs[first:last] = runs[first:last][::-1]
            first = max(last, first + 1)
    return [run for _, run in runs]


def _scripts(line: str) -> list[str]:
    found = [script_of(character) for character in line]
    current = next((script for script in found if script not in COMMON), "Latn")
    for i, script in enumerate(found):
        current = found[i] = current if script in COMMON else script
    return found


def _levels(line: str) -> list[int]:
    types = [bidirectional(character) or "L" for character in line]
    strong = next((kind for kind in types if kind in STRONG), "L")
    base = 0 if strong == "L" else 1
    towards = "R" if base else "L"
    _resolve_numbers(types, towards)
    _resolve_brackets(line, types, towards)
    _resolve_neutrals(types, towards)
    if base:
        return [base if kind == "R" else base + 1 for kind in types]
    return [{"L": 0, "R": 1}.get(kind, 2) for kind in types]


def _resolve_numbers(types: list[str], towards: str) -> None:
    """Apply rules W1 to W7: what numbers, and the signs in them, count as."""
    before = towards
    for i, kind in enumerate(types):  # W1
        before = types[i] = before if kind == "NSM" else kind
    strong = towards
    for i, kind in enumerate(types):  # W2, W3
        if kind in STRONG:
            strong = kind
        elif kind == "EN" and strong == "AL":
            types[i] = "AN"
    types[:] = ["R" if kind == "AL" else kind for kind in types]
    for i in range(1, len(types) - 1):  # W4
        left, kind, right = types[i - 1 : i + 2]
        if left == right and (
            (kind == "ES" and left == "EN") or (kind == "CS" and left in NUMBERS)
        ):
            types[i] = left
    for first, last in _stretches(types, ("ET",)):  # W5
        if "EN" in (*types[first - 1 : first], *types[last : last + 1]):
            types[first:last] = ["EN"] * (last - first)
    strong = towards
    for i, kind in enumerate(types):  # W6, W7
        if kind in STRONG:
            strong = kind
        elif kind == "EN" and strong == "L":
            types[i] = "L"
        elif kind in ("ES", "ET", "CS"):
            types[i] = "ON"


def _resolve_brackets(line: str, types: list[str], towards: str) -> None:
    """Apply rule N0: a pair of brackets goes one way, that of what it holds or follows."""
    opened: list[int] = []
    pairs = []
    for i, character in enumerate(line):
        if character in BRACKETS.values():
            opened.append(i)
        elif character in BRACKETS:
            matching = [at for at in opened if line[at] == BRACKETS[character]]
            if matching:
                pairs.append((matching[-1], i))
                del opened[opened.index(matching[-1]) :]
    for start, end in sorted(pairs):
        held = {DIRECTIONS.get(kind) for kind in types[start + 1 : end]} - {None}
        if not held:
            continue
        way = towards
        if towards not in held:
            before = (DIRECTIONS[kind] for kind in reversed(types[:start]) if kind in DIRECTIONS)
            way = next(before, towards)
        types[start] = types[end] = way


def _resolve_neutrals(types: list[str], towards: str) -> None:
    """Apply rules N1 and N2: spaces and signs go with what surrounds them, or with the line."""
    neutral = tuple(set(types) - set(DIRECTIONS))
    for first, last in _stretches(types, neutral):
        left = DIRECTIONS[types[first - 1]] if first else towards
        right = DIRECTIONS[types[last]] if last < len(types) else towards
        types[first:last] = [left if left == right else towards] * (last - first)


def _stretches(types: list[str], kinds: tuple[str, ...]) -> list[tuple[int, int]]:
    """Return where members of ``kinds`` stand next to each other: first, and one past the last."""
    found = []
    for inside, group in groupby(range(len(types)), key=lambda i: types[i] in kinds):
        indices = list(group)
        if inside:
            found.append((indices[0], indices[-1] + 1))
    return found
