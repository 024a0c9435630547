"""Drawings: arcs on exact ellipses, areas in closed form, unions, and what goes wrong.

Beyond what is tested here, 150 random drawings with every feature were filled by
resvg and from the outlines made of them: but for the pixels along edges, at most 8 of
640,000 differ.
"""

from __future__ import annotations

import math
import random
import time
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from app import svg, svg_tree
from app.curves import bounds, evaluate, is_straight, signed_areas
from app.errors import InputError
from app.loops import closed_loop
from app.outline import area, contains
from app.scene import BezierContour, Outline, SvgSource
from app.svg import read_drawing, svg_outline
from app.svg_paths import SvgError, arc, length, path, shape, transform, view_box

BOX = (100.0, 50.0)
FRAME = '<path d="M0 0h100v100h-100zM1 1h98v98h-98z" fill-rule="evenodd"/>'
"""A thin frame, so that a drawing has its true size: what is in it is not moved or scaled."""
FRAME_AREA = 100.0**2 - 98.0**2


def page(elements: str, attributes: str = 'viewBox="0 0 100 100"') -> str:
    return (
        '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
        f"{attributes}>{elements}</svg>"
    )


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "a.svg"


def drawn(file: Path, elements: str, size: float = 100.0) -> Outline:
    file.write_text(page(elements), encoding="utf-8")
    return svg_outline(SvgSource(str(file), size))


def framed(file: Path, elements: str) -> float:
    """Return the area inside a frame that elements fill, in units of the page."""
    return area(drawn(file, FRAME + elements)) - FRAME_AREA


def is_filled(outline: Outline, x: float, y: float) -> bool:
    """Tell whether a point of the page is inside a framed drawing."""
    return contains(outline, (x - 50.0, 50.0 - y))


def loops(outline: Outline) -> list[NDArray]:
    assert all(isinstance(contour, BezierContour) for contour in outline.contours)
    return [np.array(contour.curves) for contour in outline.contours]


def box(outline: Outline) -> tuple[NDArray, NDArray]:
    low, high = bounds(np.concatenate(loops(outline)))
    return low.min(axis=0), high.max(axis=0)


def shape_area(tag: str, **attributes: str) -> float:
    made = [closed_loop(pieces) for pieces in shape(tag, attributes, BOX)]
    return sum(float(signed_areas(loop).sum()) for loop in made if loop is not None)


# Path data


@pytest.mark.parametrize(
    ("data", "wanted"),
    [
        ("M1 2L3 4", [[((1, 2), (3, 4))]]),
        ("m1,2l3,4z", [[((1, 2), (4, 6)), ((4, 6), (1, 2))]]),
        ("M1 2 3 4 5 6", [[((1, 2), (3, 4)), ((3, 4), (5, 6))]]),
        ("m1 2 3 4", [[((1, 2), (4, 6))]]),
        (" M .5.5-1-1e1,", [[((0.5, 0.5), (-1, -10))]]),
        ("M0 0H5h-2V4v1", [
            [((0, 0), (5, 0)), ((5, 0), (3, 0)), ((3, 0), (3, 4)), ((3, 4), (3, 5))]
        ]),
        ("M0 0 1 0ZM2 2", [[((0, 0), (1, 0)), ((1, 0), (0, 0))]]),
        ("M5 5h1zl0 1", [[((5, 5), (6, 5)), ((6, 5), (5, 5))], [((5, 5), (5, 6))]]),
        ("m5 5h1zm1 1h1", [[((5, 5), (6, 5)), ((6, 5), (5, 5))], [((6, 6), (7, 6))]]),
        ("M0 0C1 1 2 1 3 0s2-1 3 0", [
            [((0, 0), (1, 1), (2, 1), (3, 0)), ((3, 0), (4, -1), (5, -1), (6, 0))]
        ]),
        ("M0 0S2 1 3 0", [[((0, 0), (0, 0), (2, 1), (3, 0))]]),
        ("M1 1q1 1 2 0T5 1t2 0", [
            [((1, 1), (2, 2), (3, 1)), ((3, 1), (4, 0), (5, 1)), ((5, 1), (6, 2), (7, 1))]
        ]),
        ("M0 0Q1 1 2 0S4 1 5 0", [[((0, 0), (1, 1), (2, 0)), ((2, 0), (2, 0), (4, 1), (5, 0))]]),
        ("M0 0A0 5 0 0 1 3 3", [[((0, 0), (3, 3))]]),
        ("M0 0A5 5 0 0 1 0 0", []),
        ("", []),
        ("M1 1", []),
    ],
)  # fmt: skip
def test_path_data(data: str, wanted: list) -> None:
    assert path(data) == wanted


def test_flags_need_no_space() -> None:
    assert path("M0 0a1 2 3 01.5.5") == path("M 0,0 a 1,2 3 0,1 0.5,0.5")


@pytest.mark.parametrize(
    ("data", "said"),
    [
        ("L1 1", "begins with 'L', expected M"),
        ("1 1", 'found "1 1" in path data, expected a command'),
        ("M1", "found the end in path data after 'M', expected a number"),
        ("M1 1Lx", "found \"x\" in path data after 'L'"),
        ("M1 1z5", "expected a command"),
        ("M0 0A1 1 0 2 1 3 3", "expected a flag"),
        ("M0 0Lnan 1", "expected a number"),
        ("M0 0L1e300 1", "found the number 1e+300"),
        ("M0 0C1 2 3 4 5", "found the end"),
    ],
)
def test_mistakes_in_path_data(data: str, said: str) -> None:
    with pytest.raises(SvgError) as caught:
        path(data)
    assert said in str(caught.value)


# Arcs and shapes


def test_arcs_are_on_their_ellipse() -> None:
    generator = random.Random(2)
    t = np.linspace(0.0, 1.0, 101)
    for _ in range(300):
        rx, ry = (10.0 ** generator.uniform(-2.0, 2.0) for _ in range(2))
        turn = generator.uniform(-360.0, 360.0)
        first, sweep = generator.uniform(0.0, 7.0), generator.uniform(-6.2, 6.2)
        cosine, sine = math.cos(math.radians(turn)), math.sin(math.radians(turn))
        axes = np.array([[rx * cosine, rx * sine], [-ry * sine, ry * cosine]])
        centre = np.array([generator.uniform(-9.0, 9.0) for _ in range(2)])
        ends = [
            centre + np.array([math.cos(a), math.sin(a)]) @ axes for a in (first, first + sweep)
        ]
        start, end = ((float(p[0]), float(p[1])) for p in ends)
        made = arc(start, rx, ry, turn, abs(sweep) > math.pi, sweep > 0.0, end)
        assert made[0][0] == start
        assert made[-1][3] == end
        assert all(before[3] == after[0] for before, after in pairwise(made))
        points = evaluate(np.array(made)[:, None], t[None, :])
        on_circle = np.linalg.solve(axes.T, (points - centre).reshape(-1, 2).T).T
        # 3.7e-7 is the cubics' own; the centre is lost to rounding where ends nearly meet.
        loss = 1e-15 * np.abs(centre).max() / min(rx, ry) / abs(math.sin(0.5 * sweep)) ** 2
        assert np.abs(np.hypot(*on_circle.T) - 1.0).max() < 4e-7 + 100.0 * loss
        angles = np.unwrap(np.arctan2(on_circle[:, 1], on_circle[:, 0]))
        assert angles[-1] - angles[0] == pytest.approx(sweep, abs=1e-6)


def test_radii_that_are_too_small_grow() -> None:
    made = np.array(arc((0.0, 0.0), 1.0, 0.5, 0.0, False, True, (8.0, 0.0)))
    points = evaluate(made[:, None], np.linspace(0.0, 1.0, 50)[None, :]).reshape(-1, 2)
    assert np.abs(np.hypot((points[:, 0] - 4.0) / 4.0, points[:, 1] / 2.0) - 1.0).max() < 4e-7
    assert points[:, 1].min() == pytest.approx(-2.0, rel=1e-3)


def test_areas_of_shapes() -> None:
    close = {"rel": 5e-7}  # of the arcs
    pi = math.pi
    assert shape_area("circle", cx="3", cy="4", r="5") == pytest.approx(25 * pi, **close)
    assert shape_area("ellipse", rx="5", ry="2") == pytest.approx(10 * pi, **close)
    assert shape_area("ellipse", rx="5") == pytest.approx(25 * pi, **close)
    assert shape_area("rect", x="1", width="30", height="20") == 600.0
    rounded = shape_area("rect", width="30", height="20", rx="5", ry="2")
    assert rounded == pytest.approx(600 - (4 - pi) * 10, **close)
    assert shape_area("rect", width="30", height="20", ry="2", rx="auto") == pytest.approx(
        600 - (4 - pi) * 4, **close
    )
    # Radii of more than half a side are half of it: an ellipse.
    assert shape_area("rect", width="30", height="20", rx="99") == pytest.approx(pi * 150, **close)
    assert shape_area("polygon", points="0,0 4,0 4 3") == 6.0
    assert shape_area("polyline", points="0 0 4 0 4 3 7") == 6.0
    for nothing in (
        {"tag": "circle", "r": "0"}, {"tag": "ellipse", "rx": "1", "ry": "-1"},
        {"tag": "rect", "width": "3"}, {"tag": "polygon", "points": ""}, {"tag": "path"},
    ):  # fmt: skip
        assert shape_area(**nothing) == 0.0


def test_lengths() -> None:
    assert length("96", 0.0) == length("1in", 0.0) == length(" 72pt ", 0.0) == 96.0
    assert length("25.4mm", 0.0) == pytest.approx(length("2.54cm", 0.0), rel=1e-15)
    assert length("101.6Q", 0.0) == pytest.approx(96.0)
    assert length("6pc", 0.0) == length("6em", 0.0) == 96.0
    assert length("25%", 80.0) == 20.0
    assert shape_area("rect", width="10%", height="10%") == pytest.approx(50.0)
    for wrong in ("", "abc", "1 2", "3furlongs", "1e99"):
        with pytest.raises(SvgError, match="expected"):
            length(wrong, 0.0)


def test_transforms() -> None:
    def at(text: str, x: float, y: float) -> list[float]:
        return (transform(text) @ [x, y, 1.0])[:2].tolist()

    assert at("", 3, 4) == [3, 4]
    assert at("translate(5)", 3, 4) == [8, 4]
    assert at("translate(5,6)scale(2)", 3, 4) == [11, 14]
    assert at("scale(2 3), translate(5px 6)", 3, 4) == [16, 30]
    assert at("rotate(90)", 3, 4) == [-4, 3]
    assert at("rotate(-270deg)", 3, 4) == [-4, 3]
    assert at("rotate(90, 3 4)", 3, 5) == [2, 4]
    assert at("rotate(30)", 2, 0) == pytest.approx([math.sqrt(3.0), 1.0])
    assert at("skewX(45)", 0, 4) == pytest.approx([4, 4])
    assert at("skewY(45)", 4, 0) == pytest.approx([4, 4])
    assert at("matrix(1 2 3 4 5 6)", 1, 10) == [36, 48]
    for wrong in ("foo(1)", "scale()", "matrix(1 2 3)", "rotate(1 2)", "scale(a)", "scale(2", "2"):
        with pytest.raises(SvgError, match="expected"):
            transform(wrong)


def test_view_boxes() -> None:
    def at(box: tuple[float, float], **attributes: str) -> list[float]:
        matrix, inner = view_box({"viewBox": "10 20 4 2", **attributes}, box)
        assert inner == (4.0, 2.0)
        return [*(matrix @ [10, 20, 1])[:2], *(matrix @ [14, 22, 1])[:2]]

    assert at((8.0, 4.0)) == [0, 0, 8, 4]
    assert at((8.0, 8.0)) == [0, 2, 8, 6]
    assert at((8.0, 8.0), preserveAspectRatio="xMinYMax") == [0, 4, 8, 8]
    assert at((8.0, 8.0), preserveAspectRatio="none") == [0, 0, 8, 8]
    assert at((8.0, 8.0), preserveAspectRatio="xMidYMid slice") == [-4, 0, 12, 8]


# Drawings


def test_a_circle_is_round_upright_and_in_the_middle(file: Path) -> None:
    outline = drawn(file, '<circle cx="70" cy="20" r="7"/>', 3.0)
    points = evaluate(loops(outline)[0][:, None], np.linspace(0.0, 1.0, 99)[None, :])
    assert np.abs(np.hypot(points[..., 0], points[..., 1]) - 1.5).max() < 1.5 * 4e-7
    assert area(outline) == pytest.approx(math.pi * 1.5**2, rel=5e-7)
    assert outline.contours[0].kinds == ("smooth",) * 12


def test_the_picture_stands_upright(file: Path) -> None:
    outline = drawn(file, '<path d="M10 10h80l-80 20z"/>', 8.0)
    low, high = box(outline)
    assert low.tolist() == pytest.approx([-4.0, -1.0])
    assert high.tolist() == pytest.approx([4.0, 1.0])
    assert contains(outline, (-3.0, 0.8))  # the long side is above, the tip below on the left
    assert contains(outline, (-3.9, -0.7))
    assert not contains(outline, (3.0, -0.7))


def test_lines_stay_straight_and_quadratics_exact(file: Path) -> None:
    outline = drawn(file, '<path d="M0 0L9 1 5 7z" transform="rotate(33)skewX(12)"/>', 1.0)
    assert is_straight(loops(outline)[0]).all()
    outline = drawn(file, '<path d="M0 0Q50 100 100 0z"/>', 100.0)
    assert area(outline) == pytest.approx(2 / 3 * 50 * 100, rel=1e-12)


def test_transforms_scale_areas(file: Path) -> None:
    circle = '<circle r="5" transform="{}"/>'
    for text, factor in (
        ("translate(50 50)", 1.0),
        ("translate(50 50) rotate(77) scale(2 3)", 6.0),
        ("matrix(1 .5 .25 -1 50 50)", 1.125),
    ):
        made = framed(file, circle.format(text))
        assert made == pytest.approx(25 * math.pi * factor, rel=1e-6)
    nested = '<g transform="translate(50 50)"><g transform="scale(2)">' + circle + "</g></g>"
    assert framed(file, nested.format("scale(.5)")) == pytest.approx(25 * math.pi, rel=1e-6)
    grouped = drawn(file, FRAME + nested.format("translate(10 0)"))
    assert is_filled(grouped, 70, 50)
    assert not is_filled(grouped, 50, 50)


def test_copies(file: Path) -> None:
    circle = math.pi * 25
    defined = '<defs><circle id="c" r="5"/></defs>'
    assert framed(file, defined + '<use href="#c" x="20" y="20"/>') == pytest.approx(circle, 1e-6)
    twice = '<use href="#c" x="20" y="20"/><use xlink:href="#c" transform="translate(70 70)"/>'
    assert framed(file, defined + twice) == pytest.approx(2 * circle, rel=1e-6)
    symbol = (
        '<symbol id="s" viewBox="0 0 10 10"><rect width="5" height="10"/></symbol>'
        '<use href="#s" x="20" y="30" width="20" height="40"/>'
    )
    outline = drawn(file, FRAME + symbol)
    assert area(outline) - FRAME_AREA == pytest.approx(10 * 20)
    assert is_filled(outline, 25, 45)
    assert not is_filled(outline, 25, 35)
    nested = (
        '<svg x="20" y="20" width="40" height="20" viewBox="0 0 2 1"><path d="M0 0h2v1z"/></svg>'
    )
    assert framed(file, nested) == pytest.approx(400.0)
    assert framed(file, defined) == pytest.approx(0.0, abs=1e-9)


RIGHT = '<path d="M10 10h40v40h-40z" {}/>'
LEFT = '<path d="M30 30v40h40v-40z" {}/>'
RING = '<path d="M10 10h40v40h-40zM20 20h20v20h-20z" {}/>'
EIGHT = '<path d="M10 10L50 50V10L10 50z" {}/>'


@pytest.mark.parametrize(
    ("elements", "wanted"),
    [
        (RIGHT, 1600),
        (RIGHT + LEFT, 2 * 1600 - 400),  # wound against each other
        (RIGHT + RIGHT, 1600),
        (RING.format(""), 1600),
        (RING.format('fill-rule="evenodd"'), 1200),
        (RING.format('style="fill-rule: evenodd"'), 1200),
        (RING.format('fill-rule="evenodd"') + LEFT, 1200 + 1600 - 400 + 100),
        (RING.format('fill-rule="evenodd"') + RING.format('fill-rule="evenodd"'), 1200),
        ('<g fill-rule="evenodd">' + RING + "</g>" + RIGHT, 1600),
        (EIGHT, 800),
        (EIGHT + RIGHT, 1600),
        (EIGHT + '<path d="M10 10v40h40v-40z"/>', 1600),
        (RIGHT + '<path d="M30 30h-10l-5 10z"/>', 1600),
        (RIGHT + '<path d="M60 30h-20v10z"/><path d="M60 30h-20v-10z"/>', 1600 + 2 * 25),
        (EIGHT + '<rect x="60" y="60" width="10" height="10" fill-rule="evenodd"/>', 900),
    ],
)
def test_elements_are_united(file: Path, elements: str, wanted: float) -> None:
    elements = elements.replace("{}", "")
    assert framed(file, elements) == pytest.approx(wanted, rel=1e-9)
    file.write_text(page(elements + '<path d="M0 0h1v1h-1zM99 99h1v1h-1z"/>'), encoding="utf-8")
    assert area(svg_outline(SvgSource(str(file), 100.0))) == pytest.approx(wanted + 2, rel=1e-9)


def test_what_is_alone_is_kept_as_written(file: Path) -> None:
    ring = RING.format('fill-rule="evenodd"')
    outline = drawn(file, ring, 40.0)
    assert outline.fill_rule == "evenodd"
    assert [len(loop) for loop in loops(outline)] == [4, 4]
    assert loops(outline)[0][0, 0].tolist() == [-20.0, 20.0]
    outline = drawn(file, EIGHT.format("") + '<circle cx="80" cy="80" r="5"/>')
    assert outline.fill_rule == "nonzero"
    assert [len(loop) for loop in loops(outline)] == [4, 12]


@pytest.mark.parametrize(
    "hidden",
    [
        'fill="none"',
        'style="fill:none"',
        'style="fill: NONE !important"',
        'fill="transparent"',
        'fill="#ff000000"',
        'fill="rgba(255, 0, 0, 0)"',
        'fill-opacity="0"',
        'opacity="0%"',
        'display="none"',
        'visibility="hidden"',
        'class="big clear"',
        'id="gone"',
        'fill="red" style="fill:inherit;display:none"',
    ],
)
def test_what_is_hidden_is_left_out(file: Path, hidden: str) -> None:
    sheet = "<style>/* x */ .clear , .zz {fill:none} #gone{display:none}</style>"
    element = f'<rect x="20" y="20" width="60" height="60" {hidden}/>'
    assert framed(file, sheet + element) == pytest.approx(0.0, abs=1e-9)
    inside = f'<g {hidden}><rect x="20" y="20" width="60" height="60"/></g>'
    assert framed(file, sheet + inside) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    "shown",
    [
        "",
        'fill="white"',
        'fill="url(#gradient)"',
        'fill="rgb(0, 0, 0)"',
        'fill="none" style="fill:red"',
        'fill="none" class="red"',
        'fill="#ff0000ff" stroke="red"',
        'opacity="0.5"',
    ],
)
def test_every_colour_is_light(file: Path, shown: str) -> None:
    sheet = "<style><![CDATA[ @import 'x'; rect{fill:none} rect.red{fill:#f00} path{} ]]></style>"
    element = f'<rect x="20" y="20" width="60" height="60" {shown}/>'
    if "class" in shown:
        element = sheet + element
    assert framed(file, element) == pytest.approx(3600.0)


def test_a_child_may_be_visible_again(file: Path) -> None:
    group = '<g visibility="hidden" fill="none"><rect x="9" y="9" width="9" height="9" {}/></g>'
    assert framed(file, group.format('visibility="visible" fill="red"')) == pytest.approx(81.0)


def test_what_is_left_out_is_said(file: Path) -> None:
    elements = (
        '<rect width="9" height="9" stroke="red"/><path d="M0 0L500 500" stroke="red"/>'
        '<text>A</text><image href="a.png"/><g clip-path="url(#c)" mask="url(#m)"/>'
        '<use href="#gone"/><metadata/><clipPath id="c"><rect width="900" height="1"/></clipPath>'
    )
    file.write_text(page(elements), encoding="utf-8")
    drawing = read_drawing(SvgSource(str(file), 9.0))
    assert area(drawing.outline) == pytest.approx(81.0)
    assert drawing.left_out == (
        "a stroke (2 times)",
        "text (a drawing program turns it into paths)",
        "a picture",
        "a clip",
        "a mask",
        "a copy of something that is not there",
    )


def test_foreign_elements_are_passed_over(file: Path) -> None:
    file.write_text(
        '<?xml version="1.0"?><!DOCTYPE svg PUBLIC "-//W3C//DTD SVG 1.1//EN" '
        '"http://www.w3.org/Graphics/SVG/1.1/DTD/svg11.dtd" ['
        '<!ENTITY ns_svg "http://www.w3.org/2000/svg"><!ENTITY ns_ai "http://ns.adobe.com/">]>'
        '<svg xmlns="&ns_svg;" xmlns:i="&ns_ai;" i:viewOrigin="1 2">'
        '<switch><foreignObject/><g i:extraneous="self"><rect width="4" height="2"/></g></switch>'
        '<i:pgf><path xmlns="http://www.w3.org/2000/svg" d="M0 0h99v99z"/></i:pgf></svg>'
    )
    assert area(svg_outline(SvgSource(str(file), 4.0))) == pytest.approx(8.0)


def test_no_namespace_is_no_error(file: Path) -> None:
    file.write_text('<svg><rect width="4" height="2"/></svg>')
    assert area(svg_outline(SvgSource(str(file), 4.0))) == pytest.approx(8.0)


def test_other_encodings(file: Path) -> None:
    text = page('<g id="ü"/><rect width="4" height="2"/>')
    for encoding in ("utf-16", "latin-1"):
        head = f'<?xml version="1.0" encoding="{encoding}"?>'
        file.write_bytes((head + text).encode(encoding))
        assert area(svg_outline(SvgSource(str(file), 4.0))) == pytest.approx(8.0)


# Errors


def refused(file: Path, content: str | bytes) -> str:
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(InputError) as caught:
        svg_outline(SvgSource(str(file)))
    assert str(caught.value).startswith(str(file))
    return str(caught.value).removeprefix(str(file))


def test_what_is_wrong_is_one_sentence(file: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"gone\.svg: there is no such file"):
        svg_outline(SvgSource(str(tmp_path / "gone.svg")))
    with pytest.raises(InputError, match="this is a folder"):
        svg_outline(SvgSource(str(tmp_path)))
    assert "the file is empty" in refused(file, " ")
    assert "line 1, column 1: not valid XML (syntax error)" in refused(file, "hello")
    assert "not valid XML" in refused(file, b"\x89PNG\r\n\x1a\n\0\0")
    assert "not valid XML (mismatched tag)" in refused(file, "<svg><g></svg>")
    assert "line 2" in refused(file, "<svg>\n<path d=1/></svg>")
    assert "unknown encoding" in refused(file, '<?xml version="1.0" encoding="klingon"?><svg/>')
    assert "the outermost element is <html>" in refused(file, "<html/>")
    assert "<unknown>" in refused(file, '<svg xmlns="http://example.org"/>')
    assert "found nothing filled, expected" in refused(file, page(""))
    only_strokes = refused(file, page('<path fill="none" stroke="red" d="M0 0h9v9z"/>' * 2))
    assert "nothing filled but a stroke (2 times), expected filled shapes" in only_strokes
    assert "nothing filled but text" in refused(file, page("<text>A</text>"))
    for flat in ("M0 0h9", "M0 0L9 3zM5 5l3 1", "M0 0h9v9h-9z"):
        squashed = f'<path d="{flat}" transform="scale(1 0)"/>'
        assert "nothing filled" in refused(file, page(squashed))
    assert "line 2: <path>: found \"x\" in path data after 'L'" in refused(
        file, page('\n<path d="M0 0Lx"/>')
    )
    assert "<g>: found foo with 1 numbers" in refused(file, page('<g transform="foo(3)"/>'))
    assert '<svg>: found the viewBox "0 0 1"' in refused(file, page("", 'viewBox="0 0 1"'))
    assert '<rect>: found "x", expected a length' in refused(file, page('<rect width="x"/>'))
    assert "<use>: found" in refused(file, page('<g id="a"/><use href="#a" x="x"/>'))
    far = '<g transform="scale(1e15)">' * 25 + '<path d="M0 0h9v9z"/>' + "</g>" * 25
    assert "coordinates beyond 1e+15" in refused(file, page(far))


def test_entities_that_grow_are_refused(file: Path) -> None:
    lol = "".join(f'<!ENTITY l{i} "{f"&l{i - 1};" * 10}">' for i in range(1, 10))
    bomb = f'<!DOCTYPE svg [<!ENTITY l0 "lol">{lol}]><svg><text>&l9;</text></svg>'
    assert "the entity 'l1' is external, long or made of others" in refused(file, bomb)
    for entity in ('e SYSTEM "file:///etc/passwd"', '% e "x"', f'e "{"x" * 500}"'):
        assert "the entity 'e'" in refused(file, f"<!DOCTYPE svg [<!ENTITY {entity}>]><svg/>")
    many = '<!DOCTYPE svg [<!ENTITY e "x">]><svg><text>' + "&e;" * 5000 + "</text></svg>"
    assert "used more than" in refused(file, many)


def test_copies_without_end_are_refused(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(svg, "MOST_ELEMENTS", 20_000)
    start = time.perf_counter()
    itself = '<g id="a"><path d="M0 0h1v1z"/><use href="#a"/></g>'
    assert "copies of copies" in refused(file, page(itself))
    levels = "".join(f'<g id="g{i + 1}">' + f'<use href="#g{i}"/>' * 10 + "</g>" for i in range(12))
    assert "copies of copies" in refused(file, page('<g id="g0"/>' + levels))
    assert "nested deeper" in refused(file, "<svg>" + "<g>" * 100_000)
    assert time.perf_counter() - start < 30.0


def test_huge_files_are_refused(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(svg_tree, "LARGEST_FILE", 100)
    assert "expected at most 100" in refused(file, page("<g/>" * 100))


def test_hostile_text_takes_no_longer(file: Path) -> None:
    start = time.perf_counter()
    many = 200_000
    for elements in (
        f"<style>{'a' * many}</style>",
        f"<style>{'/*' * many}</style>",
        "<style>" + "".join(f".c{i}{{fill:none}}" for i in range(5000)) + "</style>"
        + '<path class="c7 c8" d="M0 0h1v1z"/>' * 5000,
        f'<g transform="{"scale(1)" * (many // 20)}"/>',
    ):  # fmt: skip
        assert "nothing filled" in refused(file, page(elements))
    for elements in (
        f'<rect width="{"1" * many}x"/>',
        f'<path d="M0 0L{"1" * many}"/>',
        f'<path d="M0 0{"h" * many}"/>',
        f'<polygon points="{"1" * many}x"/>',
    ):
        assert len(refused(file, page(elements))) < 200
    assert time.perf_counter() - start < 20.0


def test_too_many_curves_are_refused(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(svg, "MOST_CURVES", 10)
    assert "line 1: <path>: found more than 10 curves" in refused(
        file, page('<path d="M0 0h1v1z"/>' * 4)
    )


def test_damaged_drawings_are_outlines_or_sentences(file: Path) -> None:
    generator = random.Random(4)
    whole = page(
        '<style>.a{fill:none}</style><defs><circle id="c" r="10%"/></defs><g transform="scale(2)">'
        '<rect class="b" width="9mm" height="5" rx="2"/><use href="#c" x="5"/></g>'
        '<path d="M1 1a5 3 20 1 0 9 9C1 2 3 4 5 6s1 2 3 4Q5 5 6 6T9 8h1v-9z" fill-rule="evenodd"/>'
    ).encode()
    letters = b"0123456789.-+eE<>/&;\"'%zMLHVCSQTA ()#\x00\xff"
    for _ in range(400):
        data = bytearray(whole)
        for _ in range(generator.choice((1, 2, 5))):
            data[generator.randrange(len(data))] = generator.choice(letters)
        file.write_bytes(data)
        try:
            outline = svg_outline(SvgSource(str(file)))
        except InputError as error:
            assert "\n" not in str(error)
        else:
            low, high = box(outline)
            assert np.max(high - low) == pytest.approx(2.0)


def test_ten_thousand_curves_in_many_elements(file: Path) -> None:
    leaf = "m0 0c1 1 2 1 3 0s-1 -2 -3 -1 -2 1 0 1z"
    rows = "".join(
        f'<path transform="translate({i % 50} {i // 50})" d="{leaf}"/>' for i in range(3334)
    )
    file.write_text(page(rows), encoding="utf-8")
    start = time.perf_counter()
    collected = svg._Collector(file, svg_tree.read_tree(file))
    collected.draw_root()
    assert sum(len(element.loops[0]) for element in collected.elements) >= 10_000
    # About a second; this only forbids anything quadratic.
    assert time.perf_counter() - start < 20.0
