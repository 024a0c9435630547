"""The elements of an SVG file and their style, before any geometry.

A file is data from anywhere. expat parses it, without external entities, with
few and short internal ones (Illustrator writes some for its namespaces), and to
a limited depth. Style comes from attributes, from ``style`` and from the simple
selectors (names, classes, ids) of ``<style>``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.parsers import expat

from app.errors import InputError
from app.files import read_file

LARGEST_FILE = 32 * 2**20
"""Bytes of an SVG file."""

DEEPEST = 200
"""Levels of elements in each other."""

LONGEST_ENTITY = 100
MOST_ENTITIES = 1000
"""Characters of an entity, and uses of any: together they add no more than a page of text."""

SVG = "http://www.w3.org/2000/svg"
XLINK = "http://www.w3.org/1999/xlink"

STYLED = (
    "fill", "fill-rule", "fill-opacity", "opacity", "display", "visibility", "stroke",
    "clip-path", "mask",
)  # fmt: skip
INHERITED = ("fill", "fill-rule", "fill-opacity", "visibility", "stroke")

SELECTOR = re.compile(r"(\*|[\w-]+)?((?:[.#][\w-]+)*)")


@dataclass(eq=False)
class Node:
    """An element: its name without a namespace, and where in the file it begins."""

    tag: str
    attributes: dict[str, str]
    line: int
    children: list[Node] = field(default_factory=list)
    texts: list[str] = field(default_factory=list)


def read_tree(path: Path) -> Node:
    """Return the root of an SVG file; foreign elements have no tag, foreign attributes are gone.

    Raises
    ------
    InputError
        If the file cannot be read or is no SVG.
    """
    data = _read(path)
    parser = expat.ParserCreate(namespace_separator=" ")
    parser.buffer_text = True
    top = Node("", {}, 0)
    stack = [top]

    def place() -> str:
        return f"{path}: line {parser.CurrentLineNumber}"

    def start(name: str, attributes: dict[str, str]) -> None:
        space, _, local = name.rpartition(" ")
        known = space in ("", SVG)
        kept = {
            key.removeprefix(XLINK + " "): value
            for key, value in attributes.items()
            if " " not in key or key.startswith(XLINK)
        }
        node = Node(local if known else "", kept, parser.CurrentLineNumber)
        stack[-1].children.append(node)
        stack.append(node)
        if len(stack) > DEEPEST:
            raise InputError(
                f"{place()}: elements are nested deeper than {DEEPEST}, expected a drawing"
            )

    def end(_name: str) -> None:
        stack.pop()

    def text(characters: str) -> None:
        if stack[-1].tag == "style":
            stack[-1].texts.append(characters)

    def entity(*declared: Any) -> None:
        name, is_parameter, value = declared[:3]
        if is_parameter or value is None or len(value) > LONGEST_ENTITY or "&" in value:
            raise InputError(
                f"{place()}: the entity '{name}' is external, long or made of others, "
                "expected plain XML"
            )
        if data.count(b"&") > MOST_ENTITIES:
            raise InputError(
                f"{place()}: entities are used more than {MOST_ENTITIES} times, expected plain XML"
            )

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = text
    parser.EntityDeclHandler = entity
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        reason = expat.errors.messages.get(error.code, "an error")
        raise InputError(
            f"{path}: line {error.lineno}, column {error.offset + 1}: not valid XML ({reason}), "
            "expected an SVG file"
        ) from None
    except (ValueError, LookupError, UnicodeError):  # an encoding that Python does not have
        raise InputError(f"{path}: the file has an unknown encoding, expected UTF-8") from None
    root = top.children[0]
    if root.tag != "svg":
        raise InputError(
            f"{path}: the outermost element is <{root.tag or 'unknown'}>, expected <svg>"
        )
    return root


def _read(path: Path) -> bytes:
    data = read_file(path, "an SVG file", ".svg", LARGEST_FILE)
    if not data.strip():
        raise InputError(f"{path}: the file is empty, expected <svg>")
    return data


# Style


@dataclass(frozen=True)
class Rule:
    """One simple selector of a style sheet and what it sets."""

    tag: str
    classes: frozenset[str]
    ids: frozenset[str]
    values: dict[str, str]

    def applies(self, node: Node) -> bool:
        return (
            self.tag in ("", "*", node.tag)
            and self.ids <= {node.attributes.get("id", "")}
            and self.classes <= set(node.attributes.get("class", "").split())
        )

    @property
    def weight(self) -> tuple[int, int, bool]:
        return len(self.ids), len(self.classes), self.tag not in ("", "*")

    @property
    def key(self) -> str:
        """One thing that an element must have for the rule to apply, empty if there is none."""
        for sign, names in (("#", self.ids), (".", self.classes)):
            if names:
                return sign + min(names)
        return "" if self.tag == "*" else self.tag


class StyleSheet:
    """The rules of a drawing, found by what they apply to."""

    def __init__(self, rules: Iterable[Rule]) -> None:
        self._by_key: dict[str, list[tuple[int, Rule]]] = {}
        for order, rule in enumerate(sorted(rules, key=lambda rule: rule.weight)):
            self._by_key.setdefault(rule.key, []).append((order, rule))

    def of(self, node: Node) -> list[Rule]:
        """Return the rules that apply to an element, those that win last."""
        if not self._by_key:
            return []
        classes = node.attributes.get("class", "").split()
        keys = {
            "",
            node.tag,
            "#" + node.attributes.get("id", ""),
            *("." + name for name in classes),
        }
        found = [pair for key in keys for pair in self._by_key.get(key, ())]
        return [rule for _, rule in sorted(found, key=lambda pair: pair[0]) if rule.applies(node)]


def style_of(node: Node, sheet: StyleSheet, inherited: dict[str, str]) -> dict[str, str]:
    """Return an element's style from that of the one around it, in lower case."""
    style = {key: value for key, value in inherited.items() if key in INHERITED}
    own = {key: node.attributes[key].strip().lower() for key in STYLED if key in node.attributes}
    for rule in sheet.of(node):
        own |= rule.values
    own |= _declarations(node.attributes.get("style", ""))
    return style | {key: value for key, value in own.items() if value != "inherit"}


def style_sheet(root: Node) -> StyleSheet:
    """Return the rules of all style sheets of a drawing."""
    sheet = "".join(part for node in all_nodes(root) if node.tag == "style" for part in node.texts)
    rules = []
    for block in _without_comments(sheet).split("}"):
        head, _, body = block.rpartition("{")
        values = _declarations(body)
        # What comes before belongs to @media and @import, whose conditions are taken as met.
        selectors = head.rpartition("{")[2].rpartition(";")[2] if values else ""
        for selector in selectors.split(","):
            match = SELECTOR.fullmatch(selector.strip())
            if match is None or not match[0]:
                continue
            names = re.findall(r"([.#])([\w-]+)", match[2])
            rules.append(
                Rule(
                    match[1] or "",
                    frozenset(name for sign, name in names if sign == "."),
                    frozenset(name for sign, name in names if sign == "#"),
                    values,
                )
            )
    return StyleSheet(rules)


def _without_comments(sheet: str) -> str:
    kept, position = [], 0
    while (start := sheet.find("/*", position)) >= 0:
        kept.append(sheet[position:start])
        end = sheet.find("*/", start + 2)
        position = end + 2 if end >= 0 else len(sheet)
    return " ".join([*kept, sheet[position:]])


def _declarations(text: str) -> dict[str, str]:
    pairs = (part.partition(":") for part in text.split(";"))
    found = {
        name.strip().lower(): value.replace("!important", "").strip().lower()
        for name, _, value in pairs
    }
    return {name: found[name] for name in STYLED if name in found}


def all_nodes(node: Node) -> Iterator[Node]:
    """Yield an element and all inside it."""
    yield node
    for child in node.children:
        yield from all_nodes(child)
