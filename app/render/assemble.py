"""A small preprocessor for GLSL: one text per program, holding nothing it does not need.

Shaders under ``shaders/`` are written in GLSL 4.10 with two additions that are
resolved here, in Python, before any driver sees them:

``#include "ltc/polygon.glsl"``
    Inserts a file, named from the shader root, the first time it is met.
``#if HAS_SPECULAR``, ``#elif``, ``#else``, ``#endif``
    Conditions over the program's features. Branches not taken vanish, with
    their includes, so the assembled text proves what a scene compiles.

Features are numbers, and each is defined: an unknown name in a condition is an
error, not a silent zero. Comments are dropped (some drivers reject letters
beyond ASCII even there), and ``#line`` directives keep the origin of every line,
so that `Source.locate` turns a driver's message into a file and a line.

moderngl's own includes do not nest, and moderngl-window only overwrites defines
that are already present, hence this module.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from app.errors import expected_one_of

VERSION = "#version 410 core"

_INCLUDE = re.compile(r'\s*#\s*include\s+"([^"]+)"\s*$')
_DIRECTIVE = re.compile(r"\s*#\s*(\w+)\s*(.*?)\s*$")
_TOKEN = re.compile(r"\s*(\d+|[A-Za-z_]\w*|&&|\|\||[!<>=]=|[<>!()+\-*/%])")


class ShaderError(Exception):
    """A shader that does not assemble, compile or link.

    Attributes
    ----------
    file : str
        Name from the shader root, or the program's name if no file is to blame.
    line : int
        1-based; 0 if unknown.
    message : str
        What is wrong, without the place.
    log : str
        The driver's full log, if there is one.
    """

    def __init__(self, file: str, line: int, message: str, log: str = "") -> None:
        self.file = file
        self.line = line
        self.message = message
        self.log = log
        super().__init__(f"{file}:{line}: {message}" if line else f"{file}: {message}")


@dataclass(frozen=True)
class Source:
    """An assembled shader: its text, and the files that ``#line`` numbers refer to."""

    text: str
    files: tuple[str, ...]

    def locate(self, file_index: int, line: int) -> tuple[str, int]:
        """Return (file, line) for a place in a driver's message."""
        if 0 <= file_index < len(self.files):
            return self.files[file_index], line
        return self.files[0], 0

    @property
    def lines(self) -> int:
        """Number of lines with code."""
        return sum(1 for line in self.text.splitlines() if line and not line.startswith("#line"))


def assemble(entry: str, features: Mapping[str, int], roots: Sequence[Path]) -> Source:
    """Return the text of a shader for the given features.

    Parameters
    ----------
    entry : str
        File name from the shader root, such as ``"passes/lighting.frag"``.
    features : mapping of str to int
        Every name that conditions, or array bounds, of these files use.
    roots : sequence of Path
        Folders searched in order; the first that has a file wins.

    Raises
    ------
    ShaderError
        A file is missing, a condition names an unknown feature or is
        malformed, or ``#if`` and ``#endif`` do not match.
    """
    assembler = _Assembler(features, roots)
    assembler.add_file(entry, "", 0)
    head = [VERSION, *(f"#define {name} {value}" for name, value in sorted(features.items()))]
    return Source("\n".join([*head, *assembler.out, ""]), tuple(assembler.files))


class _Assembler:
    def __init__(self, features: Mapping[str, int], roots: Sequence[Path]) -> None:
        self.features = features
        self.roots = roots
        self.files: list[str] = []
        self.out: list[str] = []

    def read(self, name: str, from_file: str, from_line: int) -> str:
        for root in self.roots:
            path = root / name
            if path.is_file():
                try:
                    return path.read_text(encoding="utf-8")
                except (OSError, UnicodeDecodeError) as error:
                    raise ShaderError(name, 0, f"cannot be read ({error})") from error
        known = sorted(
            {
                path.relative_to(root).as_posix()
                for root in self.roots
                for path in root.rglob("*.*")
                if path.is_file()
            }
        )
        where = (from_file, from_line) if from_file else (name, 0)
        raise ShaderError(
            *where, f'there is no shader file "{name}", {expected_one_of(name, known)}'
        )

    def add_file(self, name: str, from_file: str, from_line: int) -> None:
        if name in self.files:
            return
        text = self.read(name, from_file, from_line)
        index = len(self.files)
        self.files.append(name)
        self.out.append(f"// {name}")
        # Per open #if: line, taken now, any branch taken so far, #else seen.
        stack: list[tuple[int, bool, bool, bool]] = []
        expected_line = -1
        for number, line in enumerate(_without_comments(text).splitlines(), start=1):
            active = all(taken for _, taken, _, _ in stack)
            directive = _DIRECTIVE.match(line)
            keyword = directive.group(1) if directive else ""
            rest = directive.group(2) if directive else ""
            if keyword == "if":
                taken = active and self.holds(rest, name, number)
                stack.append((number, taken, taken, False))
            elif keyword in ("elif", "else"):
                if not stack or stack[-1][3]:
                    raise ShaderError(name, number, f"#{keyword} without #if")
                opened, _, any_taken, _ = stack.pop()
                outer = all(taken for _, taken, _, _ in stack)
                taken = (
                    outer
                    and not any_taken
                    and (keyword == "else" or self.holds(rest, name, number))
                )
                stack.append((opened, taken, any_taken or taken, keyword == "else"))
            elif keyword == "endif":
                if not stack:
                    raise ShaderError(name, number, "#endif without #if")
                stack.pop()
            elif not active:
                continue
            elif keyword in ("ifdef", "ifndef"):
                raise ShaderError(
                    name, number, f"#{keyword} is not for shaders here, expected #if FEATURE"
                )
            elif keyword == "version":
                raise ShaderError(name, number, f"#version is set by the assembler ({VERSION})")
            elif keyword == "include":
                include = _INCLUDE.match(line)
                if include is None:
                    raise ShaderError(name, number, 'expected #include "folder/file.glsl"')
                self.add_file(include.group(1), name, number)
                expected_line = -1
            elif line.strip():
                if number != expected_line:
                    self.out.append(f"#line {number} {index}")
                self.out.append(line.rstrip())
                expected_line = number + 1
        if stack:
            raise ShaderError(name, stack[-1][0], "#if without #endif")

    def holds(self, condition: str, file: str, line: int) -> bool:
        return _Condition(condition, self.features, file, line).value() != 0


class _Condition:
    """Recursive descent over the integer expressions of ``#if``."""

    LEVELS = (("||",), ("&&",), ("==", "!="), ("<", ">", "<=", ">="), ("+", "-"), ("*", "/", "%"))

    def __init__(self, text: str, features: Mapping[str, int], file: str, line: int) -> None:
        self.text = text
        self.features = features
        self.place = (file, line)
        self.tokens: list[str] = []
        at = 0
        while at < len(text.rstrip()):
            token = _TOKEN.match(text, at)
            if token is None:
                raise self.error(f"cannot read the condition '{text}' at '{text[at:].strip()}'")
            self.tokens.append(token.group(1))
            at = token.end()
        self.next = 0

    def error(self, message: str) -> ShaderError:
        return ShaderError(*self.place, message)

    def value(self) -> int:
        result = self.binary(0)
        if self.next != len(self.tokens):
            raise self.error(f"cannot read the condition '{self.text}'")
        return result

    def take(self) -> str:
        if self.next >= len(self.tokens):
            raise self.error(f"the condition '{self.text}' ends early")
        self.next += 1
        return self.tokens[self.next - 1]

    def binary(self, level: int) -> int:
        if level == len(self.LEVELS):
            return self.unary()
        left = self.binary(level + 1)
        while self.next < len(self.tokens) and self.tokens[self.next] in self.LEVELS[level]:
            operator = self.take()
            left = self.apply(operator, left, self.binary(level + 1))
        return left

    def unary(self) -> int:
        token = self.take()
        if token == "!":
            return int(not self.unary())
        if token == "-":
            return -self.unary()
        if token == "(":
            inner = self.binary(0)
            if self.take() != ")":
                raise self.error(f"the condition '{self.text}' lacks a ')'")
            return inner
        if token.isdigit():
            return int(token)
        if token in self.features:
            return int(self.features[token])
        if re.match(r"[A-Za-z_]", token):
            raise self.error(
                f"unknown feature '{token}', {expected_one_of(token, sorted(self.features))}"
            )
        raise self.error(f"cannot read the condition '{self.text}' at '{token}'")

    def apply(self, operator: str, a: int, b: int) -> int:
        if operator in ("/", "%") and b == 0:
            raise self.error(f"the condition '{self.text}' divides by zero")
        return {
            "||": lambda: int(bool(a) or bool(b)),
            "&&": lambda: int(bool(a) and bool(b)),
            "==": lambda: int(a == b),
            "!=": lambda: int(a != b),
            "<": lambda: int(a < b),
            ">": lambda: int(a > b),
            "<=": lambda: int(a <= b),
            ">=": lambda: int(a >= b),
            "+": lambda: a + b,
            "-": lambda: a - b,
            "*": lambda: a * b,
            "/": lambda: a // b,
            "%": lambda: a % b,
        }[operator]()


def _without_comments(text: str) -> str:
    """Return ``text`` with comments replaced by blanks; lines keep their numbers."""

    def blank(match: re.Match[str]) -> str:
        return " " + "\n" * match.group(0).count("\n")

    return re.sub(r"//[^\n]*|/\*.*?\*/", blank, text, flags=re.DOTALL)
