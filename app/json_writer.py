"""JSON laid out for people: whatever fits on one line stays on one, points fill lines."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from decimal import Context, Decimal
from itertools import islice
from typing import Any

from app.errors import InputError
from app.json_reader import DECIMAL, PI, read_angle

LINE_LENGTH = 100
"""Columns of a written file; names and long numbers may exceed it."""


class Raw(str):
    """Text that stands in the file as it is: a number that needs its own digits."""


def degrees(radians: float) -> Raw:
    """Return the shortest decimal of degrees that reads back as exactly ``radians``."""
    exact = DECIMAL.divide(DECIMAL.multiply(Decimal(radians), Decimal(180)), PI)
    for digits in range(1, 40):
        text = format(Context(prec=digits).plus(exact).normalize(), "g")
        if read_angle(Decimal(text), "") == radians:
            return Raw(text)
    raise InputError(f"{radians} radians are no angle that a file can hold, expected a finite one")


def _plain_number(value: float) -> str:
    is_negative_zero = value == 0 and math.copysign(1.0, value) < 0.0
    if value == int(value) and abs(value) < 1e15 and not is_negative_zero:
        return str(int(value))
    return repr(float(value))


def layout(value: Any, depth: int, key_length: int = 0) -> str:
    """Write JSON with two spaces a level; whatever fits on one line stays on one."""
    few = sum(1 for _ in islice(_leaves(value), LINE_LENGTH)) < LINE_LENGTH
    if depth > 0 and few:
        line = _one_line(value)
        if len(line) + key_length + 2 * depth < LINE_LENGTH:
            return line
    indent = "  " * (depth + 1)
    if isinstance(value, dict) and value:
        keys = [json.dumps(key, ensure_ascii=False) + ": " for key in value]
        items = (
            key + layout(item, depth + 1, len(key))
            for key, item in zip(keys, value.values(), strict=True)
        )
        return "{\n" + indent + f",\n{indent}".join(items) + "\n" + indent[2:] + "}"
    if isinstance(value, list):
        items = (layout(item, depth + 1) for item in value)
        return "[\n" + indent + f",\n{indent}".join(items) + "\n" + indent[2:] + "]"
    if isinstance(value, tuple):  # of points or curves: as many on a line as fit
        return "[\n" + _filled(value, indent, 1) + "]"
    return _one_line(value)


def _leaves(value: Any) -> Iterator[Any]:
    if isinstance(value, dict):
        value = value.values()
    elif not isinstance(value, list | tuple):
        yield value
        return
    for item in value:
        yield from _leaves(item)


def _filled(items: tuple[Any, ...], indent: str, closing: int) -> str:
    """Lay out points or curves in lines, with ``closing`` brackets to follow the last."""
    lines: list[str] = []
    line = indent
    for item in items:
        word = _one_line(item)
        if len(indent) + len(word) + closing + 1 > LINE_LENGTH and isinstance(item[0], tuple):
            word = "[" + _filled(item, indent + " ", closing + 1).lstrip() + "]"
        if line == indent:
            line += word
        elif len(line) + len(word) + closing + 3 > LINE_LENGTH:
            lines.append(line + ",")
            line = indent + word
        else:
            line += ", " + word
    return "\n".join([*lines, line])


def _one_line(value: Any) -> str:
    if isinstance(value, Raw):
        return str(value)
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return _plain_number(value)
    if isinstance(value, dict):
        items = (
            f"{json.dumps(key, ensure_ascii=False)}: {_one_line(item)}"
            for key, item in value.items()
        )
        return "{" + ", ".join(items) + "}"
    return "[" + ", ".join(_one_line(item) for item in value) + "]"
