"""Letters as outlines: any string in any font file.

HarfBuzz chooses and places the glyphs, with the font's kerning, ligatures and
marks, in runs of one script and direction (`app.text_runs`). fontTools draws
them: TrueType's quadratics are raised to cubics exactly, CFF's cubics stay as
they are. A letter that the font lacks is an error that names it, not a box.

Letters overlap, and in variable fonts so do the parts of one; the outline is
therefore filled by ``nonzero``. Lines stand under each other as `TextSource`
says, and the box around all of their ink has its middle at the origin, so that
a text light is where its plane is. Letters spread by ``spacing`` form no
ligatures, as is the custom.

The language is set to "undetermined": glyphs must not depend on whose machine
a scene is opened on.
"""

from __future__ import annotations

import io
import logging
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import uharfbuzz
from fontTools.pens.basePen import BasePen
from fontTools.ttLib import TTFont
from numpy.typing import NDArray

from app.errors import InputError, os_reason, require_file
from app.loops import Piece, closed_loop, extent, outline_of
from app.scene import Outline, TextSource
from app.text_runs import Run, visual_runs
from ltc.resources import resource_path

FloatArray = NDArray[np.float64]
Vec2 = tuple[float, float]

FONT_SUFFIXES = (".ttf", ".otf", ".ttc", ".otc", ".woff", ".woff2")

LARGEST_FONT = 128 * 2**20
"""Bytes of a font file; the largest ones, of all Chinese characters, have a third of it."""

LONGEST_TEXT = 10_000
"""Characters of a text; thousands of letters are already more curves than a light needs."""

LARGEST_EXTENT = 1e15
"""In units of the plane; what is larger has squares that leave float32."""

TAB = "    "

SPREAD = {"liga": False, "clig": False}
"""HarfBuzz features of letters that are spread."""

NAMED_LETTERS = 8
"""Letters that an error about missing ones names."""


def text_outline(source: TextSource) -> Outline:
    """Return the outline of a text.

    Parameters
    ----------
    source : TextSource
        An empty ``font`` is the one in ``assets/fonts``.

    Returns
    -------
    Outline
        Filled by ``nonzero``, the middle of its bounding box at the origin,
        ``source.size`` units of the plane to the em.

    Raises
    ------
    InputError
        If the font cannot be read or lacks a letter, or nothing is to be seen.
    """
    if not source.text.strip():
        raise InputError("the text is empty, expected at least one letter")
    if len(source.text) > LONGEST_TEXT:
        raise InputError(
            f"the text has {len(source.text)} characters, expected at most {LONGEST_TEXT}"
        )
    path = font_path(source)
    font = _font(path)
    lines = [line.rstrip().replace("\t", TAB) for line in source.text.splitlines()]
    placed = [_placed(font, line, source.spacing * font.em, path) for line in lines]
    share = {"left": 0.0, "center": 0.5, "right": 1.0}[source.align]
    loops: list[FloatArray] = []
    for number, (glyphs, width) in enumerate(placed):
        start = (-share * width, -number * source.line_height * font.em)
        for index, position in glyphs:
            offset = np.add(start, position)
            loops += [loop + offset for loop in _glyph(font, index, path)]
    if not loops:
        raise InputError(f"{path}: the text has nothing to draw, expected letters with an outline")
    low, high = extent(loops)
    farthest = float(np.max(high - low)) * source.size / font.em
    if not farthest <= LARGEST_EXTENT:
        raise InputError(
            f"the text is {farthest:g} long or high, expected at most {LARGEST_EXTENT:g}"
        )
    middle = 0.5 * (low + high)
    scale = source.size / font.em
    return outline_of([(loop - middle) * scale for loop in loops], "nonzero")


def font_path(source: TextSource) -> Path:
    """Return the file of a text's font."""
    if source.font:
        return Path(source.font)
    return resource_path("assets", "fonts", "SourceSans3-Bold.otf")


# Fonts


@dataclass(eq=False)
class _Font:
    """A font, twice: as HarfBuzz and as fontTools see it."""

    shaper: Any
    tables: Any
    drawings: Any
    em: int
    glyphs: dict[int, list[FloatArray]] = field(default_factory=dict)
    """Loops of the glyphs drawn so far, by index, in font units."""


def _font(path: Path) -> _Font:
    kinds = f"a font file ({', '.join(FONT_SUFFIXES)})"
    require_file(path, kinds)
    try:
        state = path.stat()
        if state.st_size > LARGEST_FONT:
            raise InputError(
                f"{path}: the file has {state.st_size} bytes, expected at most {LARGEST_FONT}"
            )
        return _read_font(path, state.st_mtime_ns, state.st_size)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({os_reason(error)}), expected {kinds}") from None


@lru_cache(maxsize=8)
def _read_font(path: Path, changed: int, size: int) -> _Font:
    """Read a font; ``changed`` and ``size`` tell apart what was once the same file."""
    del changed, size
    logging.getLogger("fontTools").setLevel(logging.CRITICAL)  # or its warnings reach stderr
    data = path.read_bytes()
    if not data:
        raise InputError(f"{path}: the file is empty, expected a font")
    try:
        tables = TTFont(io.BytesIO(data), fontNumber=0, lazy=True)
        if tables.flavor is not None:  # WOFF: HarfBuzz needs it unpacked
            tables.flavor = None
            unpacked = io.BytesIO()
            tables.save(unpacked, reorderTables=None)
            data = unpacked.getvalue()
            tables = TTFont(io.BytesIO(data), lazy=True)
        if any(table not in tables for table in ("head", "maxp", "cmap")):
            raise ValueError
        if not any(table in tables for table in ("glyf", "CFF ", "CFF2")):
            raise InputError(
                f"{path}: the font has pictures of letters only, expected one with outlines"
            )
        face = uharfbuzz.Face(data, 0)
        em = int(tables["head"].unitsPerEm)
        if em < 1:
            raise ValueError
        return _Font(uharfbuzz.Font(face), tables, tables.getGlyphSet(), em)
    except (InputError, OSError):
        raise
    except Exception:  # a damaged file may raise anything
        raise _damaged(path) from None


def _damaged(path: Path) -> InputError:
    return InputError(
        f"{path}: damaged or no font, expected a font file ({', '.join(FONT_SUFFIXES)})"
    )


class _LoopPen(BasePen):  # type: ignore[misc]
    """Collects what fontTools draws as loops of pieces."""

    def __init__(self, glyphs: Any) -> None:
        super().__init__(glyphs)
        self.loops: list[list[Piece]] = []

    def _moveTo(self, pt: Vec2) -> None:  # noqa: N802 (fontTools' names)
        self.loops.append([])

    def _lineTo(self, pt: Vec2) -> None:  # noqa: N802
        self.loops[-1].append((self._getCurrentPoint(), pt))

    def _curveToOne(self, pt1: Vec2, pt2: Vec2, pt3: Vec2) -> None:  # noqa: N802
        self.loops[-1].append((self._getCurrentPoint(), pt1, pt2, pt3))

    def _qCurveToOne(self, pt1: Vec2, pt2: Vec2) -> None:  # noqa: N802
        self.loops[-1].append((self._getCurrentPoint(), pt1, pt2))


def _glyph(font: _Font, index: int, path: Path) -> list[FloatArray]:
    """Return the loops of a glyph in font units about its own origin."""
    if index not in font.glyphs:
        pen = _LoopPen(font.drawings)
        try:
            font.drawings[font.tables.getGlyphName(index)].draw(pen)
        except Exception:  # a damaged file may raise anything
            raise _damaged(path) from None
        loops = (closed_loop(pieces) for pieces in pen.loops)
        font.glyphs[index] = [loop for loop in loops if loop is not None]
    return font.glyphs[index]


# Shaping


def _placed(
    font: _Font, line: str, spacing: float, path: Path
) -> tuple[list[tuple[int, Vec2]], float]:
    """Return a line's glyphs and their places in font units, and its width."""
    glyphs: list[tuple[int, Vec2]] = []
    missing: dict[str, None] = {}
    x, last = 0.0, -1
    for run in visual_runs(line):
        infos, positions = _shaped(font, line, run, spacing)
        for info, position in zip(infos, positions, strict=True):
            if glyphs and info.cluster != last:
                x += spacing
            last = info.cluster
            if info.codepoint == 0:
                missing[line[info.cluster]] = None
            glyphs.append((info.codepoint, (x + position.x_offset, float(position.y_offset))))
            x += position.x_advance
    if missing:
        named = [f"{letter!r} (U+{ord(letter):04X})" for letter in missing]
        more = f" and {len(named) - NAMED_LETTERS} more" if len(named) > NAMED_LETTERS else ""
        raise InputError(
            f"{path}: the font has no glyph for {', '.join(named[:NAMED_LETTERS])}{more}, "
            "expected a font with these letters"
        )
    return glyphs, x


def _shaped(font: _Font, line: str, run: Run, spacing: float) -> tuple[Any, Any]:
    """Return HarfBuzz's glyphs of a run and their positions, from left to right."""
    buffer = uharfbuzz.Buffer()
    buffer.add_codepoints([ord(letter) for letter in line], run.start, run.end - run.start)
    buffer.direction = "rtl" if run.right_to_left else "ltr"
    buffer.script = run.script
    buffer.language = "und"
    uharfbuzz.shape(font.shaper, buffer, SPREAD if spacing else None)
    return buffer.glyph_infos, buffer.glyph_positions
