"""Parsed JSON with a name for every place in it, so that errors can say where they are.

A reader is a function of a value and its place. What it refuses becomes a
`PlaceError`; whoever knows the file's name makes that an `InputError`.

Numbers keep their text while reading. Angles need that: degrees times pi/180
in float64 skips some radians, so that not every scene could be written. A
number with more digits than float64 needs is converted in decimal arithmetic;
with that every angle has a text that reads back to the very same bits
(`app.json_writer.degrees`), and ordinary ones stay short.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable
from decimal import Context, Decimal
from typing import Any, TypeVar

from app.errors import InputError, describe, expected_one_of, nearest
from app.scene import SceneError, Vec2, Vec3

LARGEST_NUMBER = 1e15
"""Beyond this the square of a number, times a scene's sizes, leaves float32."""

DECIMAL = Context(prec=60)
PI = Decimal("3.14159265358979323846264338327950288419716939937510582097494459")

T = TypeVar("T")


class PlaceError(Exception):
    """Something wrong at a place; becomes an `InputError` once the file's name is known."""

    def __init__(self, place: str, message: str) -> None:
        super().__init__(message)
        self.place = place
        self.message = message


class JsonObject(dict[str, Any]):
    """A JSON object that remembers a key that occurred twice."""

    repeated: str | None = None


def _object_of(pairs: list[tuple[str, Any]]) -> JsonObject:
    result = JsonObject()
    for key, value in pairs:
        if key in result:
            result.repeated = key
        result[key] = value
    return result


def parse_json(text: str, name: str) -> Any:
    """Return parsed JSON, its numbers as `Decimal`; errors call the text ``name``."""

    def constant(word: str) -> Any:
        line, column = _line_and_column(text, _constant_position(text, word))
        raise InputError(
            f"{name}: line {line}, column {column}: found {word}, expected a finite number"
        )

    try:
        return json.loads(
            text.removeprefix("\ufeff"),
            object_pairs_hook=_object_of,
            parse_float=Decimal,
            parse_int=Decimal,
            parse_constant=constant,
        )
    except json.JSONDecodeError as error:
        found = "the end of the file" if error.pos >= len(error.doc) else repr(error.doc[error.pos])
        expected = error.msg[0].lower() + error.msg[1:]
        raise InputError(
            f"{name}: line {error.lineno}, column {error.colno}: found {found}, "
            f"not valid JSON ({expected})"
        ) from None
    except RecursionError:
        raise InputError(
            f"{name}: lists or objects are nested too deeply, expected a scene file"
        ) from None
    except ArithmeticError:
        raise InputError(
            f"{name}: a number has an impossible exponent, "
            f"expected numbers up to {LARGEST_NUMBER:g}"
        ) from None


def _constant_position(text: str, word: str) -> int:
    """Return where NaN or Infinity stands outside quotes; the parser does not tell."""
    inside = False
    position = 0
    while position < len(text):
        character = text[position]
        if inside and character == "\\":
            position += 1
        elif character == '"':
            inside = not inside
        elif not inside and text.startswith(word, position):
            return position
        position += 1
    return 0


def _line_and_column(text: str, position: int) -> tuple[int, int]:
    before = text[:position]
    return before.count("\n") + 1, position - (before.rfind("\n") + 1) + 1


def place_of(place: str, key: str) -> str:
    """Return the place of a key: dotted where it is a plain word, else in brackets."""
    if key.isidentifier():
        return f"{place}.{key}" if place else key
    return f"{place}[{json.dumps(key)}]"


def check_fields(value: Any, place: str, known: Iterable[str], kind: str) -> JsonObject:
    """Check that a value is an object with known keys only."""
    if not isinstance(value, JsonObject):
        raise PlaceError(place, f"found {describe(value)}, expected an object ({kind})")
    if value.repeated is not None:
        raise PlaceError(
            place, f"the key '{value.repeated}' occurs twice, expected each key at most once"
        )
    for key in value:
        if key in known:
            continue
        guess = nearest(key, known)
        meant = f" (did you mean '{guess}'?)" if guess else ""
        raise PlaceError(
            place, f"found the unknown key {json.dumps(key)}, expected {', '.join(known)}{meant}"
        )
    return value


def read_list(value: Any, place: str, what: str) -> list[Any]:
    if not isinstance(value, list):
        raise PlaceError(place, f"found {describe(value)}, expected a list of {what}")
    return value


def read_number(value: Any, place: str) -> float:
    if not isinstance(value, Decimal):
        raise PlaceError(place, f"found {describe(value)}, expected a number")
    number = float(value)
    if not abs(number) <= LARGEST_NUMBER:
        raise PlaceError(
            place,
            f"found {describe(value)}, "
            f"expected a number between {-LARGEST_NUMBER:g} and {LARGEST_NUMBER:g}",
        )
    return number


def read_angle(value: Any, place: str) -> float:
    """Return radians from a number in degrees."""
    degrees = read_number(value, place)
    if value == Decimal(repr(degrees)):
        return math.radians(degrees)
    return float(DECIMAL.divide(DECIMAL.multiply(value, PI), Decimal(180)))


def read_numbers(value: Any, place: str, length: int, what: str) -> tuple[float, ...]:
    if not isinstance(value, list) or len(value) != length:
        raise PlaceError(place, f"found {describe(value)}, expected {length} numbers {what}")
    return tuple(read_number(item, f"{place}[{i}]") for i, item in enumerate(value))


def read_vec2(value: Any, place: str, what: str) -> Vec2:
    x, y = read_numbers(value, place, 2, what)
    return x, y


def read_vec3(value: Any, place: str) -> Vec3:
    x, y, z = read_numbers(value, place, 3, "[x, y, z]")
    return x, y, z


def read_colour(value: Any, place: str) -> Vec3:
    red, green, blue = read_numbers(value, place, 3, "[red, green, blue]")
    return red, green, blue


def read_rotation(value: Any, place: str) -> tuple[float, float, float, float]:
    w, x, y, z = read_numbers(value, place, 4, "[w, x, y, z] (a unit quaternion)")
    return w, x, y, z


def read_bool(value: Any, place: str) -> bool:
    if not isinstance(value, bool):
        raise PlaceError(place, f"found {describe(value)}, expected true or false")
    return value


def read_text(value: Any, place: str, what: str) -> str:
    """Return a text that can be a name: not blank, and without zero characters."""
    found = read_any_text(value, place, what)
    if not found.strip():
        raise PlaceError(place, f"found the empty text {json.dumps(found)}, expected {what}")
    if "\0" in found:
        raise PlaceError(place, f"found {describe(value)} with a zero character, expected {what}")
    return found


def read_any_text(value: Any, place: str, what: str = "a text") -> str:
    if not isinstance(value, str):
        raise PlaceError(place, f"found {describe(value)}, expected {what}")
    try:
        value.encode("utf-8")
    except UnicodeEncodeError:
        raise PlaceError(
            place, f"found {describe(value)} with half a character, expected {what}"
        ) from None
    return value


def read_choice(value: Any, place: str, choices: tuple[T, ...]) -> T:
    for choice in choices:
        if value == choice and isinstance(value, str):
            return choice
    names = [str(choice) for choice in choices]
    expected = expected_one_of(value if isinstance(value, str) else "", names)
    raise PlaceError(place, f"found {describe(value)}, {expected}")


Reader = Callable[[Any, str], Any]


def read_object(value: Any, place: str, kind: str, readers: dict[str, Reader]) -> dict[str, Any]:
    """Read the present keys of an object with the reader of each."""
    fields = check_fields(value, place, readers, kind)
    return {key: readers[key](item, place_of(place, key)) for key, item in fields.items()}


def build_part(place: str, owner: str, make: Callable[..., T], **values: Any) -> T:
    """Construct a part; turn its complaint about values into a fault at ``place``."""
    try:
        return make(**values)
    except SceneError as error:
        message = str(error).removeprefix(f"{owner}: ")
        field, _, rest = message.partition(" ")
        if field in values and field != "name":
            place = place_of(place, field)
            message = f"found {rest[3:]}" if rest.startswith("is ") else message
        raise PlaceError(place, message) from None


def read_name(value: Any, place: str) -> str:
    return read_text(value, place, "a name")


def fill_names(read: list[dict[str, Any]], place: str, kind: str) -> None:
    """Refuse repeated names; give nameless items "object 1", "object 2" by position."""
    first: dict[str, int] = {}
    for index, values in enumerate(read):
        if "name" not in values:
            continue
        name = values["name"]
        if name in first:
            raise PlaceError(
                f"{place}[{index}].name",
                f"found '{name}', the name of {place}[{first[name]}] already, "
                "expected unique names",
            )
        first[name] = index
    for index, values in enumerate(read):
        if "name" in values:
            continue
        number = index + 1
        while f"{kind} {number}" in first:
            number += 1
        values["name"] = f"{kind} {number}"
        first[values["name"]] = index
