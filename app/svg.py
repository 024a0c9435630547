"""Drawings as outlines: what an SVG file fills.

The shape of the light is the union of everything that is filled, whatever its
colour: paths, rectangles, circles, ellipses, polygons and polylines, in groups,
in `use`d copies and under transforms, upright and with its middle at the
origin. What is hidden or filled with nothing is left out, and so are strokes,
texts, pictures, clips and masks; `Drawing.left_out` says which of these there
were.

Each element has a fill rule of its own, an outline only one. If all elements
have the same and none reaches into another's box, they are kept as written.
Otherwise an element that may overlap others, or whose rule is ``evenodd``, is
replaced by its boundary (`app.outline.boundary`), which winds once around the
inside, and ``nonzero`` joins the elements: windings of their insides only add.
A convex element is its own boundary, turned the right way.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from app.curves import reversed_curves
from app.errors import InputError
from app.loops import closed_loop, convex_turn, extent, outline_of
from app.outline import boundary
from app.scene import FillRule, Outline, SvgSource
from app.svg_paths import LARGEST_NUMBER, Box, SvgError, length, shape, transform, view_box
from app.svg_tree import DEEPEST, Node, all_nodes, read_tree, style_of, style_sheet

FloatArray = NDArray[np.float64]

MOST_ELEMENTS = 200_000
"""Elements that are drawn, copies included: ten ``use`` of ten ``use`` of ... grow fast."""

DEFAULT_BOX: Box = (300.0, 150.0)
"""The viewport of a drawing that says nothing about its size, as in CSS."""

MOST_CURVES = 100_000
"""Curves of a drawing; a light with a thousandth of that is elaborate."""

SMALLEST = 1e-100
"""Drawings whose longer side is less are nothing."""

SHAPES = ("path", "rect", "circle", "ellipse", "polygon", "polyline")
GROUPS = ("g", "a", "switch")
LEFT_OUT = {
    "text": "text (a drawing program turns it into paths)",
    "image": "a picture",
    "foreignObject": "foreign content",
}
"""Elements that are seen in a drawing but cannot be read, and what they are called."""

CLEAR = re.compile(
    r"none|transparent|#[0-9a-f]{3}0|#[0-9a-f]{6}00|(?:rgb|hsl)a\((?:[^,]+,){3}\s*0?\.?0*%?\s*\)"
)
"""Paints that leave nothing to see."""


@dataclass(frozen=True)
class Drawing:
    """The outline of a drawing, and in words what of it is missing there."""

    outline: Outline
    left_out: tuple[str, ...]


def svg_outline(source: SvgSource) -> Outline:
    """Return the outline of a drawing.

    Parameters
    ----------
    source : SvgSource
        The longer side of what is filled has the length ``source.size``.

    Returns
    -------
    Outline
        The middle of its bounding box at the origin, what is up in the drawing
        along +t.

    Raises
    ------
    InputError
        If the file cannot be read, is not SVG, or fills nothing.
    """
    return read_drawing(source).outline


def read_drawing(source: SvgSource) -> Drawing:
    """Return `svg_outline` with what was left out; arguments and errors are the same."""
    path = Path(source.path)
    root = read_tree(path)
    collector = _Collector(path, root)
    with np.errstate(all="ignore"):  # what leaves float64 is found where loops are kept
        collector.draw_root()
    left_out = tuple(
        f"{name} ({count} times)" if count > 1 else name
        for name, count in collector.left_out.items()
    )
    elements = [element for element in collector.elements if element.loops]
    outline = _united(elements, source.size)
    if outline is None:
        only = f" but {', '.join(left_out)}" if left_out else ""
        raise InputError(f"{path}: found nothing filled{only}, expected filled shapes")
    return Drawing(outline, left_out)


# Drawing


@dataclass(eq=False)
class _Element:
    """A filled shape: loops (k, 4, 2) and their rule."""

    loops: list[FloatArray]
    rule: FillRule


class _Collector:
    """Walks over a drawing and keeps its filled shapes, in the coordinates of the page."""

    def __init__(self, path: Path, root: Node) -> None:
        self.elements: list[_Element] = []
        self.left_out: Counter[str] = Counter()
        self._path = path
        self._root = root
        self._sheet = style_sheet(root)
        self._by_id: dict[str, Node] = {}
        for node in all_nodes(root):
            self._by_id.setdefault(node.attributes.get("id", ""), node)
        self._visited = 0
        self._curves = 0

    def draw_root(self) -> None:
        """Collect everything."""
        self._draw(self._root, np.eye(3), {}, DEFAULT_BOX, 0)

    def _draw(
        self, node: Node, matrix: FloatArray, inherited: dict[str, str], box: Box, depth: int
    ) -> None:
        self._visited += 1
        if self._visited > MOST_ELEMENTS or depth > DEEPEST:
            raise InputError(
                f"{self._path}: line {node.line}: copies of copies make more than "
                f"{MOST_ELEMENTS} elements or {DEEPEST} levels, expected a drawing"
            )
        style = style_of(node, self._sheet, inherited)
        if style.get("display") == "none" or _is_zero(style.get("opacity")):
            return
        try:
            if "transform" in node.attributes:
                matrix = matrix @ transform(node.attributes["transform"])
            if node.tag in SHAPES:
                self._fill(node, matrix, style, box)
                return
            if node.tag == "svg":
                matrix, box = self._viewport(node, matrix, box, node is self._root)
        except SvgError as error:
            raise InputError(f"{self._path}: line {node.line}: <{node.tag}>: {error}") from None
        if node.tag == "use":
            self._use(node, matrix, style, box, depth)
        elif node.tag in GROUPS or node.tag in ("svg", "symbol"):
            self._count_clips(style)
            for child in node.children:
                if child.tag != "symbol":
                    self._draw(child, matrix, style, box, depth + 1)
        elif node.tag in LEFT_OUT:
            self.left_out[LEFT_OUT[node.tag]] += 1

    def _count_clips(self, style: dict[str, str]) -> None:
        for key, name in (("clip-path", "a clip"), ("mask", "a mask")):
            if style.get(key, "none") != "none":
                self.left_out[name] += 1

    def _fill(self, node: Node, matrix: FloatArray, style: dict[str, str], box: Box) -> None:
        if style.get("visibility", "visible") != "visible":
            return
        self._count_clips(style)
        if not CLEAR.fullmatch(style.get("stroke", "none")):
            self.left_out["a stroke"] += 1
        if CLEAR.fullmatch(style.get("fill", "")) or _is_zero(style.get("fill-opacity")):
            return
        rule: FillRule = "evenodd" if style.get("fill-rule") == "evenodd" else "nonzero"
        loops = [closed_loop(pieces) for pieces in shape(node.tag, node.attributes, box)]
        placed = [loop @ matrix[:2, :2].T + matrix[:2, 2] for loop in loops if loop is not None]
        if not all((np.abs(loop) <= LARGEST_NUMBER).all() for loop in placed):
            raise SvgError(
                f"found coordinates beyond {LARGEST_NUMBER:g}, expected smaller transforms"
            )
        self._curves += sum(len(loop) for loop in placed)
        if self._curves > MOST_CURVES:
            raise SvgError(f"found more than {MOST_CURVES} curves so far, expected at most these")
        self.elements.append(_Element(placed, rule))

    def _viewport(
        self, node: Node, matrix: FloatArray, box: Box, is_root: bool
    ) -> tuple[FloatArray, Box]:
        """Return matrix and viewport for what is inside an <svg> or <symbol>."""
        attributes = node.attributes
        if is_root and "viewBox" in attributes:
            # Without a width or height of its own a drawing is as large as its viewBox.
            _, box = view_box(attributes, box)
        sides = []
        for name, whole in zip(("width", "height"), box, strict=True):
            given = attributes.get(name, "auto").strip()
            sides.append(whole if given == "auto" else length(given, whole))
        if not is_root:
            corner = [
                length(attributes.get(name, "0"), whole)
                for name, whole in zip(("x", "y"), box, strict=True)
            ]
            matrix = matrix @ _moved(*corner)
        inner, box = view_box(attributes, (sides[0], sides[1]))
        return matrix @ inner, box

    def _use(
        self, node: Node, matrix: FloatArray, style: dict[str, str], box: Box, depth: int
    ) -> None:
        reference = node.attributes.get("href", "").strip()
        target = self._by_id.get(reference[1:]) if reference.startswith("#") else None
        if target is None or not reference[1:]:
            self.left_out["a copy of something that is not there"] += 1
            return
        try:
            x, y = (
                length(node.attributes.get(name, "0"), whole)
                for name, whole in zip(("x", "y"), box, strict=True)
            )
            matrix = matrix @ _moved(x, y)
            if target.tag in ("symbol", "svg"):
                sized = {
                    key: value
                    for key, value in node.attributes.items()
                    if key in ("width", "height")
                }
                target = Node(
                    target.tag, {**target.attributes, **sized}, target.line, target.children
                )
                if target.tag == "symbol":
                    matrix, box = self._viewport(target, matrix, box, False)
        except SvgError as error:
            raise InputError(f"{self._path}: line {node.line}: <{node.tag}>: {error}") from None
        self._draw(target, matrix, style, box, depth + 1)


def _moved(x: float, y: float) -> FloatArray:
    return np.array([[1.0, 0.0, x], [0.0, 1.0, y], [0.0, 0.0, 1.0]])


def _is_zero(opacity: str | None) -> bool:
    """Tell whether an opacity, a number or per cent, is none."""
    try:
        return opacity is not None and float(opacity.removesuffix("%")) <= 0.0
    except ValueError:
        return False


# Joining


def _united(elements: list[_Element], size: float) -> Outline | None:
    """Return the union of elements, upright and ``size`` long, as one outline; None if empty."""
    loops = [loop for element in elements for loop in element.loops]
    low, high = extent(loops) if loops else (np.zeros(2), np.zeros(2))
    longer = float(np.max(high - low))
    if not longer > SMALLEST:
        return None
    # Rows of an SVG file run downwards.
    scale = size / longer * np.array([1.0, -1.0])
    middle = 0.5 * (low + high)
    for element in elements:
        element.loops = [(loop - middle) * scale for loop in element.loops]
    outline = _joined(elements)
    return outline if outline is not None and boundary(outline) else None


def _joined(elements: list[_Element]) -> Outline | None:
    """Return the union of elements as one outline; the module says how."""
    alone = _alone(elements)
    rules = {element.rule for element in elements}
    if all(alone) and len(rules) == 1:
        return outline_of([loop for element in elements for loop in element.loops], rules.pop())
    loops: list[FloatArray] = []
    for element, is_alone in zip(elements, alone, strict=True):
        if is_alone and element.rule == "nonzero":
            loops += element.loops
        elif len(element.loops) == 1 and (turn := convex_turn(element.loops[0])):
            loops.append(element.loops[0] if turn > 0 else reversed_curves(element.loops[0]))
        else:
            loops += boundary(outline_of(element.loops, element.rule))
    return outline_of(loops, "nonzero") if loops else None


def _alone(elements: list[_Element]) -> list[bool]:
    """Tell of each element whether its box touches no other's."""
    boxes = [extent(element.loops) for element in elements]
    low, high = (np.array(corners) for corners in zip(*boxes, strict=True))
    touched = [
        np.count_nonzero(np.all((low <= high[i]) & (high >= low[i]), axis=1))
        for i in range(len(elements))
    ]
    return [count == 1 for count in touched]
