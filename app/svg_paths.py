"""The geometry of SVG: path data, basic shapes, transforms and lengths.

Shapes become loops of pieces (`app.loops`) in their own coordinates. Lines,
quadratics and cubics are what the file says; arcs of ellipses become cubics of
at most 30 degrees, which stay within 4e-7 radii of the ellipse.

What is written wrongly raises `SvgError` with what was found and expected. A
browser would draw a path up to its first mistake; here the mistake is named.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from itertools import pairwise
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.errors import quote
from app.loops import Piece

FloatArray = NDArray[np.float64]
Point: TypeAlias = tuple[float, float]
Pieces: TypeAlias = list[Piece]

ARC_STEP = math.radians(30.0)
"""The longest turn of one cubic; its radial error is 3.7e-7 (it falls with the sixth power)."""

LARGEST_NUMBER = 1e15
"""Of coordinates and what moves them; beyond it squares leave float32."""

UNITS = {
    "": 1.0, "px": 1.0, "pt": 96 / 72, "pc": 16.0, "in": 96.0, "cm": 96 / 2.54, "mm": 9.6 / 2.54,
    "q": 2.4 / 2.54, "em": 16.0, "rem": 16.0, "ex": 8.0,
}  # fmt: skip
"""Pixels of a unit of length; those of a font are a browser's for its default font."""

NUMBER = re.compile(r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?")
GAP = re.compile(r"[\s,]*")
FLAG = re.compile(r"[01]")
LENGTH = re.compile(rf"\s*({NUMBER.pattern})\s*([a-zA-Z]*|%)\s*")
FUNCTION = re.compile(r"([a-zA-Z]+)\s*\(([^()]*)\)")

ARGUMENTS = {"M": 2, "L": 2, "H": 1, "V": 1, "C": 6, "S": 4, "Q": 4, "T": 2, "A": 7, "Z": 0}
"""How many numbers the commands of path data take."""

Box: TypeAlias = tuple[float, float]
"""Width and height of a viewport, which percentages refer to."""


class SvgError(ValueError):
    """A value that SVG does not know; the message is found and expected, without the place."""


# Numbers


def length(text: str, whole: float) -> float:
    """Return a length in pixels; ``whole`` is what per cent refer to."""
    match = LENGTH.fullmatch(text)
    if match is None or (match[2] != "%" and match[2].lower() not in UNITS):
        raise SvgError(f"found {quote(text)}, expected a length such as 12 or 3mm")
    unit = whole / 100.0 if match[2] == "%" else UNITS[match[2].lower()]
    return _checked(float(match[1]) * unit)


def _checked(number: float) -> float:
    if not abs(number) <= LARGEST_NUMBER:
        raise SvgError(f"found the number {number:g}, expected at most {LARGEST_NUMBER:g}")
    return number


def _after_gap(text: str, position: int) -> int:
    """Return where spaces and commas end."""
    match = GAP.match(text, position)
    return match.end() if match else position


def numbers(text: str) -> list[float]:
    """Return the numbers of a list such as "0,0 10,5"."""
    found, position = [], _after_gap(text, 0)
    while position < len(text):
        match = NUMBER.match(text, position)
        if match is None:
            raise SvgError(f"found {quote(text[position:])}, expected a number")
        found.append(_checked(float(match[0])))
        position = _after_gap(text, match.end())
    return found


# Transforms


def transform(text: str) -> FloatArray:
    """Return the matrix (3, 3) of a list of transforms, which acts on columns (x, y, 1)."""
    matrix, position = np.eye(3), _after_gap(text, 0)
    while position < len(text):
        match = FUNCTION.match(text, position)
        if match is None:
            raise SvgError(f"found {quote(text[position:])}, expected a transform")
        matrix = matrix @ _function(match[1], numbers(_without_units(match[2])))
        position = _after_gap(text, match.end())
    return matrix


def _without_units(text: str) -> str:
    return re.sub(r"(?<=[\d.])(px|deg)\b", "", text)


def _function(name: str, values: list[float]) -> FloatArray:
    count = len(values)
    if name == "matrix" and count == 6:
        a, b, c, d, e, f = values
        return _matrix(a, b, c, d, e, f)
    if name == "translate" and count in (1, 2):
        return _matrix(1, 0, 0, 1, values[0], values[1] if count > 1 else 0.0)
    if name == "scale" and count in (1, 2):
        return _matrix(values[0], 0, 0, values[-1], 0, 0)
    if name == "rotate" and count in (1, 3):
        x, y = values[1:] if count > 1 else (0.0, 0.0)
        cosine, sine = _cosine_sine(values[0])
        turned = _matrix(cosine, sine, -sine, cosine, 0, 0)
        return _matrix(1, 0, 0, 1, x, y) @ turned @ _matrix(1, 0, 0, 1, -x, -y)
    if name in ("skewX", "skewY") and count == 1:
        tangent = _checked(math.tan(math.radians(values[0])))
        across, down = (tangent, 0.0) if name == "skewX" else (0.0, tangent)
        return _matrix(1, down, across, 1, 0, 0)
    raise SvgError(
        f"found {name} with {count} numbers, expected matrix, translate, scale, rotate, "
        "skewX or skewY with theirs"
    )


def _matrix(a: float, b: float, c: float, d: float, e: float, f: float) -> FloatArray:
    return np.array([[a, c, e], [b, d, f], [0.0, 0.0, 1.0]])


def _cosine_sine(degrees: float) -> Point:
    """Return cosine and sine, exact at quarter turns, so that what was upright stays so."""
    quarter = {0.0: (1.0, 0.0), 90.0: (0.0, 1.0), 180.0: (-1.0, 0.0), 270.0: (0.0, -1.0)}
    angle = math.fmod(degrees, 360.0)
    return quarter.get(angle % 360.0) or (
        math.cos(math.radians(angle)),
        math.sin(math.radians(angle)),
    )


def view_box(attributes: Mapping[str, str], box: Box) -> tuple[FloatArray, Box]:
    """Return the matrix that fits an element's viewBox into a viewport, and the inner viewport."""
    if "viewBox" not in attributes:
        return np.eye(3), box
    values = numbers(attributes["viewBox"])
    if len(values) != 4 or not (values[2] > 0.0 and values[3] > 0.0):
        raise SvgError(
            f"found the viewBox {quote(attributes['viewBox'])}, expected x, y, width and height"
        )
    x, y, width, height = values
    across, down = box[0] / width, box[1] / height
    words = attributes.get("preserveAspectRatio", "xMidYMid meet").split()
    align = words[0] if words else "xMidYMid"
    if align != "none":
        across = down = max(across, down) if "slice" in words else min(across, down)
    share = {"Min": 0.0, "Mid": 0.5, "Max": 1.0}
    left = (box[0] - width * across) * share.get(align[1:4], 0.0)
    top = (box[1] - height * down) * share.get(align[5:8], 0.0)
    matrix = _matrix(across, 0.0, 0.0, down, left - x * across, top - y * down)
    return matrix, (width, height)


# Shapes


def shape(tag: str, attributes: Mapping[str, str], box: Box) -> list[Pieces]:
    """Return the loops of a path or basic shape, still open where the file leaves them so."""
    if tag == "path":
        return path(attributes.get("d", ""))
    if tag in ("polygon", "polyline"):
        values = numbers(attributes.get("points", ""))
        corners = list(zip(values[0::2], values[1::2], strict=False))
        return [list(pairwise(corners))]

    diagonal = math.hypot(*box) / math.sqrt(2.0)
    wholes = {"x": box[0], "cx": box[0], "width": box[0], "rx": box[0]}
    wholes |= {"y": box[1], "cy": box[1], "height": box[1], "ry": box[1], "r": diagonal}

    def get(name: str) -> float:
        return length(attributes.get(name, "0"), wholes[name])

    if tag == "circle":
        return _ellipse((get("cx"), get("cy")), get("r"), get("r"))
    across, down = _radii(attributes, get)
    if tag == "ellipse":
        return _ellipse((get("cx"), get("cy")), across, down)
    return _rectangle(get("x"), get("y"), get("width"), get("height"), across, down)


def _radii(attributes: Mapping[str, str], get: Callable[[str], float]) -> tuple[float, float]:
    """Return rx and ry; one that is not given, or is auto, equals the other."""
    given = {
        name: get(name) for name in ("rx", "ry") if attributes.get(name, "auto").strip() != "auto"
    }
    across = given.get("rx", given.get("ry", 0.0))
    return max(across, 0.0), max(given.get("ry", across), 0.0)


def _ellipse(centre: Point, across: float, down: float) -> list[Pieces]:
    if not (across > 0.0 and down > 0.0):
        return []
    axes = np.array([[across, 0.0], [0.0, down]])
    return [_turn(centre, axes, 0.0, 2.0 * math.pi, None, None)]


def _rectangle(
    x: float, y: float, width: float, height: float, across: float, down: float
) -> list[Pieces]:
    if not (width > 0.0 and height > 0.0):
        return []
    right, bottom = x + width, y + height
    across, down = min(across, 0.5 * width), min(down, 0.5 * height)
    if across == 0.0 or down == 0.0:
        corners = ((x, y), (right, y), (right, bottom), (x, bottom))
        return [list(zip(corners, (*corners[1:], corners[0]), strict=True))]
    sides = (
        ((x + across, y), (right - across, y), (right, y + down)),
        ((right, y + down), (right, bottom - down), (right - across, bottom)),
        ((right - across, bottom), (x + across, bottom), (x, bottom - down)),
        ((x, bottom - down), (x, y + down), (x + across, y)),
    )
    pieces: Pieces = []
    for start, before, after in sides:
        pieces.append((start, before))
        pieces += arc(before, across, down, 0.0, False, True, after)
    return [pieces]


# Arcs


def arc(
    start: Point, rx: float, ry: float, rotation: float, large: bool, sweep: bool, end: Point
) -> Pieces:
    """Return an elliptical arc as cubics; arguments as in path data, ``rotation`` in degrees.

    SVG 1.1, appendix F.6: radii that are too small grow until the ends fit.
    """
    rx, ry = abs(rx), abs(ry)
    if start == end:
        return []
    if rx == 0.0 or ry == 0.0:
        return [(start, end)]
    cosine, sine = _cosine_sine(rotation)
    # In half chords and radii: the ellipse is a circle of radius 1.
    dx, dy = 0.5 * (start[0] - end[0]), 0.5 * (start[1] - end[1])
    u, v = (cosine * dx + sine * dy) / rx, (cosine * dy - sine * dx) / ry
    reach = math.hypot(u, v)
    if reach > 1.0:
        rx, ry, u, v, reach = rx * reach, ry * reach, u / reach, v / reach, 1.0
    away = math.sqrt((1.0 - reach) * (1.0 + reach)) / reach
    if large == sweep:
        away = -away
    centre_u, centre_v = away * v, -away * u
    first = math.atan2(v - centre_v, u - centre_u)
    last = math.atan2(-v - centre_v, -u - centre_u)
    turn = math.fmod(last - first, 2.0 * math.pi)
    if sweep and turn <= 0.0:
        turn += 2.0 * math.pi
    elif not sweep and turn >= 0.0:
        turn -= 2.0 * math.pi
    axes = np.array([[rx * cosine, rx * sine], [-ry * sine, ry * cosine]])
    middle = np.array([0.5 * (start[0] + end[0]), 0.5 * (start[1] + end[1])])
    centre = middle + centre_u * axes[0] + centre_v * axes[1]
    return _turn((float(centre[0]), float(centre[1])), axes, first, turn, start, end)


def _turn(
    centre: Point,
    axes: FloatArray,
    first: float,
    turn: float,
    start: Point | None,
    end: Point | None,
) -> Pieces:
    """Return centre + cos(t) axes[0] + sin(t) axes[1], t from ``first`` by ``turn``, as cubics.

    The ends are taken as given, or, where None, made one.
    """
    count = max(1, math.ceil(abs(turn) / ARC_STEP - 1e-9))
    step = turn / count
    angles = first + step * np.arange(count + 1)
    directions = np.stack((np.cos(angles), np.sin(angles)), axis=-1)
    ahead = np.stack((-directions[:, 1], directions[:, 0]), axis=-1)
    reach = 4.0 / 3.0 * math.tan(0.25 * step)
    anchors = centre + directions @ axes
    leaving, arriving = reach * (ahead @ axes), -reach * (ahead @ axes)
    points = np.stack(
        (anchors[:-1], anchors[:-1] + leaving[:-1], anchors[1:] + arriving[1:], anchors[1:]), axis=1
    )
    pieces: Pieces = [tuple((x, y) for x, y in piece) for piece in points.tolist()]
    start = pieces[0][0] if start is None else start
    pieces[0] = (start, *pieces[0][1:])
    pieces[-1] = (*pieces[-1][:-1], start if end is None else end)
    return pieces


# Path data


def path(data: str) -> list[Pieces]:
    """Return the subpaths of path data (SVG 1.1, 8.3) that have any piece."""
    loops: list[Pieces] = []
    here: Point = (0.0, 0.0)
    first = here
    handle: Point | None = None
    before = ""
    for command, values in _commands(data):
        kind = command.upper()
        base = here if command.islower() else (0.0, 0.0)
        if kind == "M":
            here = first = (base[0] + values[0], base[1] + values[1])
            loops.append([])
        elif kind == "Z":
            if here != first:
                loops[-1].append((here, first))
            here = first
        else:
            if before == "Z":  # a new subpath begins where the last one did
                loops.append([])
            pieces, handle = _piece(kind, values, base, here, handle, before)
            loops[-1] += pieces
            here = _end(kind, values, base, here)
        before = kind
    return [loop for loop in loops if loop]


def _end(kind: str, values: list[float], base: Point, here: Point) -> Point:
    if kind == "H":
        return (base[0] + values[0], here[1])
    if kind == "V":
        return (here[0], base[1] + values[0])
    return (base[0] + values[-2], base[1] + values[-1])


def _piece(
    kind: str, values: list[float], base: Point, here: Point, handle: Point | None, before: str
) -> tuple[Pieces, Point | None]:
    """Return the pieces of a command, and the handle that a smooth command after it mirrors."""
    end = _end(kind, values, base, here)
    if kind in "LHV":
        return [(here, end)], None
    if kind == "A":
        rx, ry, rotation, large, sweep = values[:5]
        return arc(here, rx, ry, rotation, bool(large), bool(sweep), end), None
    points = [
        (base[0] + x, base[1] + y) for x, y in zip(values[:-2:2], values[1:-2:2], strict=True)
    ]
    if kind in "ST":
        mirrored = here
        if handle is not None and before in ("CS" if kind == "S" else "QT"):
            mirrored = (2.0 * here[0] - handle[0], 2.0 * here[1] - handle[1])
        points.insert(0, mirrored)
    return [(here, *points, end)], points[-1]


def _commands(data: str) -> Iterator[tuple[str, list[float]]]:
    """Yield the commands of path data with their numbers, repeated ones spelt out."""
    position = _after_gap(data, 0)
    command, is_first = "", True
    while position < len(data):
        letter = data[position]
        if letter.upper() in ARGUMENTS:
            command = letter
            position = _after_gap(data, position + 1)
        elif command in ("", "Z", "z"):
            raise SvgError(f"found {quote(data[position:])} in path data, expected a command")
        if is_first and command.upper() != "M":
            raise SvgError(f"path data begins with '{command}', expected M")
        is_first = False
        values = []
        for index in range(ARGUMENTS[command.upper()]):
            pattern = FLAG if command in "Aa" and index in (3, 4) else NUMBER
            match = pattern.match(data, position)
            if match is None:
                found = quote(data[position:]) if position < len(data) else "the end"
                wanted = "a flag, 0 or 1" if pattern is FLAG else "a number"
                raise SvgError(f"found {found} in path data after '{command}', expected {wanted}")
            values.append(_checked(float(match[0])))
            position = _after_gap(data, match.end())
        yield command, values
        command = {"M": "L", "m": "l"}.get(command, command)
