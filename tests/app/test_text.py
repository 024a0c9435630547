"""Letters: their areas, places and order, every kind of font file, and what goes wrong."""

from __future__ import annotations

import io
import math
import random
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from fontTools.feaLib.builder import addOpenTypeFeaturesFromString
from fontTools.fontBuilder import FontBuilder
from fontTools.pens.areaPen import AreaPen
from fontTools.pens.t2CharStringPen import T2CharStringPen
from fontTools.pens.ttGlyphPen import TTGlyphPen
from fontTools.ttLib import TTCollection, TTFont
from fontTools.ttLib.tables.TupleVariation import TupleVariation
from numpy.typing import NDArray

from app.curves import bounds, evaluate, is_straight, signed_areas
from app.errors import InputError
from app.outline import area
from app.scene import BezierContour, Outline, TextSource
from app.text import LONGEST_TEXT, font_path, text_outline
from app.text_runs import visual_runs

EM = 1000
ADVANCE = {"A": 700, "V": 600, "f": 300, "i": 200, "fi": 450, "O": 800, "X": 500}
HEBREW = {"alef": 0x05D0, "bet": 0x05D1}
KERN = -120

FEATURES = f"""
languagesystem DFLT dflt;
feature kern {{ pos A V {KERN}; }} kern;
feature liga {{ sub f i by fi; }} liga;
"""


def box(pen, x0: int, y0: int, x1: int, y1: int) -> None:
    pen.moveTo((x0, y0))
    for point in ((x0, y1), (x1, y1), (x1, y0)):
        pen.lineTo(point)
    pen.closePath()


def ring(pen, radius: int) -> None:
    """Draw a closed curve of quadratics alone, without any point on the curve in the file."""
    corners = [
        (x * radius + 400, y * radius + 400) for x, y in ((1, 1), (1, -1), (-1, -1), (-1, 1))
    ]
    if isinstance(pen, TTGlyphPen):
        pen.qCurveTo(*corners, None)
        pen.closePath()
        return
    middle = [((a[0] + b[0]) / 2, (a[1] + b[1]) / 2) for a, b in pairwise([corners[-1], *corners])]
    pen.moveTo(middle[0])
    for corner, end in zip(corners, [*middle[1:], middle[0]], strict=True):
        pen.qCurveTo(corner, end)
    pen.closePath()


def draw(name: str, pen) -> None:
    if name == "O":
        ring(pen, 300)
    elif name == "X":  # two strokes that overlap, as in a variable font
        box(pen, 0, 200, 500, 300)
        box(pen, 200, 0, 300, 500)
    elif name not in ("space", ".notdef"):
        width = {"alef": 300, "bet": 500}.get(name) or ADVANCE[name] - 100
        box(pen, 0, 0, width, 500)


def build(cff: bool = False) -> TTFont:
    """Return a font of boxes, whose places are easy to tell."""
    names = [".notdef", "space", *ADVANCE, *HEBREW]
    builder = FontBuilder(EM, isTTF=not cff)
    builder.setupGlyphOrder(names)
    cmap = {ord(name): name for name in ADVANCE if len(name) == 1} | {0x20: "space"}
    builder.setupCharacterMap(cmap | {code: name for name, code in HEBREW.items()})
    advances = {name: (ADVANCE.get(name, 600), 0) for name in names}
    if cff:
        charstrings = {}
        for name in names:
            pen = T2CharStringPen(advances[name][0], None)
            draw(name, pen)
            charstrings[name] = pen.getCharString()
        builder.setupCFF("Test", {}, charstrings, {})
    else:
        glyphs = {}
        for name in names:
            pen = TTGlyphPen(None)
            draw(name, pen)
            glyphs[name] = pen.glyph()
        builder.setupGlyf(glyphs)
    builder.setupHorizontalMetrics(advances)
    builder.setupHorizontalHeader(ascent=800, descent=-200)
    builder.setupNameTable({"familyName": "Test", "styleName": "Regular"})
    builder.setupOS2()
    builder.setupPost()
    addOpenTypeFeaturesFromString(builder.font, FEATURES)
    return builder.font


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("fonts")


@pytest.fixture(scope="module")
def font(folder: Path) -> str:
    path = folder / "test.ttf"
    build().save(path)
    return str(path)


def curves(outline: Outline) -> list[NDArray]:
    assert all(isinstance(contour, BezierContour) for contour in outline.contours)
    return [np.array(contour.curves) for contour in outline.contours]


def boxes(outline: Outline) -> NDArray:
    """Return the contours' boxes (n, 2, 2): corner, axis."""
    found = [bounds(contour) for contour in curves(outline)]
    return np.array([(low.min(axis=0), high.max(axis=0)) for low, high in found])


def left_edges(text: str, font: str, **more: object) -> list[float]:
    """Return where the boxes of a text in the test font begin, from the first, in font units."""
    edges = sorted(boxes(text_outline(TextSource(text, font, EM, **more)))[:, 0, 0])
    return [round(edge - edges[0], 6) for edge in edges]


# Outlines


@pytest.mark.parametrize("letters", ["S&gB", "Light", "ЖΩ♥", "%@8"])
def test_areas_are_those_of_the_font(letters: str) -> None:
    font = TTFont(font_path(TextSource("")))
    glyphs, names = font.getGlyphSet(), font.getBestCmap()
    size = 0.7
    for letter in letters:
        pen = AreaPen(glyphs)
        glyphs[names[ord(letter)]].draw(pen)
        outline = text_outline(TextSource(letter, size=size))
        made = sum(float(signed_areas(contour).sum()) for contour in curves(outline))
        scale = (size / font["head"].unitsPerEm) ** 2
        assert made == pytest.approx(pen.value * scale, rel=1e-9)
        # Nothing overlaps in this font; PostScript winds counter-clockwise.
        assert area(outline) == pytest.approx(made, rel=1e-9)


def test_quadratics_are_raised_exactly(font: str) -> None:
    outline = text_outline(TextSource("O", font, 1.0))
    (made,) = curves(outline)
    assert len(made) == 4
    t = np.linspace(0.0, 1.0, 33)[:, None]
    for cubic in made:
        start, end = cubic[0], cubic[3]
        corner = 1.5 * cubic[1] - 0.5 * start
        quadratic = (1 - t) ** 2 * start + 2 * t * (1 - t) * corner + t**2 * end
        assert np.abs(evaluate(cubic, t[:, 0]) - quadratic).max() < 1e-15
        assert np.abs(np.abs(corner) - 0.3).max() < 1e-15
    assert outline.contours[0].kinds == ("smooth",) * 4


def test_straight_sides_are_straight(font: str) -> None:
    (made,) = curves(text_outline(TextSource("A", font, 0.37)))
    assert is_straight(made).all()
    assert outline_kinds("A", font) == ()


def outline_kinds(text: str, font: str) -> tuple[str, ...]:
    (contour,) = text_outline(TextSource(text, font)).contours
    assert isinstance(contour, BezierContour)
    return contour.kinds


def test_parts_that_overlap_are_one(font: str) -> None:
    outline = text_outline(TextSource("X", font, EM))
    assert outline.fill_rule == "nonzero"
    assert len(outline.contours) == 2
    assert area(outline) == pytest.approx(2 * 500 * 100 - 100 * 100)


def test_letters_that_overlap_are_one(font: str) -> None:
    apart = area(text_outline(TextSource("AA", font, EM)))
    assert apart == pytest.approx(2 * 600 * 500)
    together = area(text_outline(TextSource("AA", font, EM, spacing=-0.4)))
    assert together == pytest.approx((300 + 600) * 500)


# Places


def test_kerning_and_advances(font: str) -> None:
    assert left_edges("AA", font) == [0, 700]
    assert left_edges("VA", font) == [0, 600]
    assert left_edges("AV", font) == [0, 700 + KERN]
    assert left_edges("A V", font) == [0, 700 + 600]


def test_kerning_of_the_font_that_comes_along() -> None:
    tables = TTFont(font_path(TextSource("")))
    advances, names = tables["hmtx"], tables.getBestCmap()
    em = tables["head"].unitsPerEm

    def start_of_last(text: str) -> float:
        """Return how far the last letter is from where its advance would put it."""
        found = boxes(text_outline(TextSource(text, size=em)))
        first, last = (boxes(text_outline(TextSource(letter, size=em))) for letter in text)
        bearing = advances[names[ord(text[1])]][1] - advances[names[ord(text[0])]][1]
        assert len(found) == len(first) + len(last)
        shift = found[len(first) :, 0, 0].min() - found[: len(first), 0, 0].min()
        return float(shift - bearing - advances[names[ord(text[0])]][0])

    assert start_of_last("HH") == pytest.approx(0.0, abs=1e-6)
    assert start_of_last("AV") < -10
    assert start_of_last("To") < -10


def test_ligatures(font: str) -> None:
    assert len(text_outline(TextSource("fi", font)).contours) == 1
    assert left_edges("fif", font) == [0, 450]
    assert left_edges("fi", font, spacing=0.1) == [0, 300 + 100]  # spread letters form none
    joined = boxes(text_outline(TextSource("ff")))
    assert len(joined) == 1  # of the font that comes along


def test_spacing_is_between_letters(font: str) -> None:
    assert left_edges("AAA", font, spacing=0.25) == [0, 950, 1900]
    for align in ("left", "center", "right"):
        lines = boxes(text_outline(TextSource("AA\nA", font, EM, align, spacing=0.25)))
        share = {"left": 0.0, "center": 0.5, "right": 1.0}[align]
        assert lines[2, 0, 0] - lines[0, 0, 0] == pytest.approx(share * (700 + 250))
    # A mark belongs to its letter.
    marked = [boxes(text_outline(TextSource("x\u0301", spacing=s)))[:, :, 0] for s in (0.0, 1.0)]
    assert np.abs(marked[0] - marked[1]).max() < 1e-12


@pytest.mark.parametrize("ending", ["\n", "\r\n"])
def test_lines_stand_under_each_other(font: str, ending: str) -> None:
    outline = text_outline(TextSource(f"A  {ending}{ending}AA", font, EM, "right", line_height=1.5))
    found = boxes(outline)
    assert found[0, 0, 1] - found[1, 0, 1] == pytest.approx(2 * 1.5 * EM)
    assert found[0, 1, 0] == pytest.approx(found[2, 1, 0])


@pytest.mark.parametrize("align", ["left", "center", "right"])
def test_the_middle_is_the_origin(font: str, align: str) -> None:
    for text, file in (("A\nfi  AV", font), ("gy\nQ!", "")):
        found = boxes(text_outline(TextSource(text, file, 3.0, align)))
        low, high = found[:, 0].min(axis=0), found[:, 1].max(axis=0)
        assert np.abs(low + high).max() < 1e-12


def test_size_is_the_em(font: str) -> None:
    for size in (1e-6, 1.0, 1e6):
        found = boxes(text_outline(TextSource("A", font, size)))[0]
        assert found[1] - found[0] == pytest.approx([0.6 * size, 0.5 * size])


def test_tabs_are_spaces(font: str) -> None:
    assert left_edges("A\tA", font) == left_edges("A    A", font)


# Right to left


def widths_in_order(text: str, font: str) -> list[int]:
    found = boxes(text_outline(TextSource(text, font, EM)))
    return [round(x1 - x0) for x0, x1 in sorted(zip(found[:, 0, 0], found[:, 1, 0], strict=True))]


def test_right_to_left(font: str) -> None:
    assert widths_in_order("אב", font) == [500, 300]
    assert widths_in_order("אב A", font) == [600, 500, 300]
    assert widths_in_order("A אב V", font) == [600, 500, 300, 500]
    assert widths_in_order("א AV ב", font) == [500, 600, 500, 300]


@pytest.mark.parametrize(
    ("line", "shown"),
    [
        ("abc", "abc"),
        ("אבג", "גבא"),
        ("אב 123 גד", "דג 123 בא"),
        ("abc אב 12, 34 def", "abc 34 ,12 בא def"),
        ("אב 50% (abc) גד", "דג )abc( 50% בא"),
        ("a (אב) c", "a (בא) c"),
        ("אב a (b) ג", "ג a (b) בא"),
        ("عر 12-34", "34-12 رع"),
        ("אב 12-34", "12-34 בא"),
        ("a [ב) c", "a [ב) c"),
        ("", ""),
    ],
)
def test_the_order_of_mixed_lines(line: str, shown: str) -> None:
    """The orders are those of python-bidi (unmirrored), as are 20,000 random ones."""
    pieces = (
        line[run.start : run.end][:: -1 if run.right_to_left else 1] for run in visual_runs(line)
    )
    assert "".join(pieces) == shown


def test_runs_cover_every_character_once() -> None:
    generator = random.Random(7)
    for _ in range(500):
        letters = "abאבعر12٣ .,-+%$()[]\u0301!Ωж"
        line = "".join(generator.choice(letters) for _ in range(generator.randint(0, 20)))
        covered = [i for run in visual_runs(line) for i in range(run.start, run.end)]
        assert sorted(covered) == list(range(len(line)))


# Files


def test_every_kind_of_font_file(folder: Path, font: str) -> None:
    wanted = text_outline(TextSource("AVfi XO", font))
    for flavor in ("woff", "woff2"):
        packed = TTFont(font)
        packed.flavor = flavor
        path = folder / f"test.{flavor}"
        packed.save(path)
        assert path.read_bytes()[:4] in (b"wOFF", b"wOF2")
        assert text_outline(TextSource("AVfi XO", str(path))) == wanted
    collection = TTCollection()
    collection.fonts = [TTFont(font), TTFont(font_path(TextSource("")))]
    collection.save(folder / "test.ttc")
    assert text_outline(TextSource("AVfi XO", str(folder / "test.ttc"))) == wanted
    build(cff=True).save(folder / "test.otf")
    as_cff = text_outline(TextSource("AVfi X", str(folder / "test.otf")))
    assert np.array_equal(boxes(as_cff), boxes(text_outline(TextSource("AVfi X", font))))


def test_a_variable_font_at_its_default(folder: Path, font: str) -> None:
    variable = TTFont(font)
    builder = FontBuilder(font=variable)
    builder.setupFvar([("wght", 100, 400, 900, "Weight")], [])
    wider = [(100, 0)] * 4 + [(0, 0)] * 4
    builder.setupGvar({"A": [TupleVariation({"wght": (0.0, 1.0, 1.0)}, wider)]})
    variable.save(folder / "variable.ttf")
    path = str(folder / "variable.ttf")
    assert "fvar" in TTFont(path)
    assert text_outline(TextSource("AV", path)) == text_outline(TextSource("AV", font))


def test_a_file_that_changed_is_read_again(folder: Path, font: str) -> None:
    path = folder / "changing.ttf"
    path.write_bytes(Path(font).read_bytes())
    first = text_outline(TextSource("A", str(path)))
    path.write_bytes(font_path(TextSource("")).read_bytes())
    assert text_outline(TextSource("A", str(path))) == text_outline(TextSource("A"))
    assert first != text_outline(TextSource("A"))


def refused(text: str, font: str = "") -> str:
    with pytest.raises(InputError) as caught:
        text_outline(TextSource(text, font))
    return str(caught.value)


def test_what_is_wrong_is_one_sentence(folder: Path, font: str) -> None:
    for text in ("", " \n\t ", "\u00a0"):
        assert "the text is empty" in refused(text)
    assert f"at most {LONGEST_TEXT}" in refused("a" * (LONGEST_TEXT + 1))
    assert "no such file" in refused("a", str(folder / "gone.ttf"))
    assert "a folder" in refused("a", str(folder))
    (folder / "empty.ttf").write_bytes(b"")
    assert "empty.ttf: the file is empty" in refused("a", str(folder / "empty.ttf"))
    for content in (b"hello", b"\0\1\0\0" + bytes(40), b"OTTO", b"wOF2" + bytes(60), b"ttcf"):
        (folder / "no.ttf").write_bytes(content)
        assert "no.ttf: damaged or no font" in refused("a", str(folder / "no.ttf"))
    named = refused("A中b中c", font)
    assert "'中' (U+4E2D), 'b' (U+0062), 'c' (U+0063)" in named
    assert "and 12 more" in refused("".join(chr(0x4E00 + i) for i in range(20)))
    bitmap = TTFont(font)
    del bitmap["glyf"], bitmap["loca"]
    bitmap.save(folder / "bitmap.ttf")
    assert "pictures of letters only" in refused("A", str(folder / "bitmap.ttf"))


def test_letters_without_ink_are_nothing(folder: Path) -> None:
    drawn = build()
    drawn["cmap"].getBestCmap()[0x42] = "space"
    drawn.save(folder / "blank.ttf")
    assert "nothing to draw" in refused("B", str(folder / "blank.ttf"))


def test_damaged_fonts_are_outlines_or_sentences(folder: Path, font: str) -> None:
    generator = random.Random(11)
    path = folder / "damaged.ttf"
    for source in (Path(font).read_bytes(), (folder / "test.woff").read_bytes()):
        for _ in range(60):
            data = bytearray(source)
            for _ in range(generator.choice((1, 3, 30))):
                data[generator.randrange(len(data))] = generator.randrange(256)
            path.write_bytes(data[: generator.choice((len(data), generator.randrange(len(data))))])
            try:
                outline = text_outline(TextSource("AVfiOX אב", str(path)))
            except InputError as error:
                assert "\n" not in str(error)
            else:
                assert all(math.isfinite(x) for c in curves(outline) for x in c.flat)


def test_a_long_text() -> None:
    outline = text_outline(TextSource("Lorem ipsum dolor sit amet.\n" * 30, line_height=1.0))
    assert len(outline.contours) > 700


def test_the_licence_stands_beside_the_font() -> None:
    licence = font_path(TextSource("")).with_name("OFL.txt").read_text(encoding="utf-8")
    assert "SIL OPEN FONT LICENSE Version 1.1" in licence
    saved = io.BytesIO(font_path(TextSource("")).read_bytes())
    assert "Adobe" in TTFont(saved)["name"].getDebugName(0)
