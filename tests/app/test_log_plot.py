"""Plots: the Pareto front, marks where they belong, labels that do not overlap, both file forms."""

from __future__ import annotations

import io
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from PIL import Image

from app.cli.drawing import NAMESPACE, Drawing, Line, Mark, Words, png_file, svg_element, svg_file
from app.cli.log_plot import HEIGHT, WIDTH, Point, log_plot
from app.measure.front import pareto_front


def test_pareto_front() -> None:
    assert pareto_front([(1.0, 9.0), (2.0, 3.0), (3.0, 3.0), (4.0, 1.0), (2.0, 3.0)]) == [
        True, True, False, True, True,
    ]  # fmt: skip
    assert pareto_front([]) == []


def test_nothing_beats_the_front_and_something_beats_the_rest() -> None:
    rng = np.random.default_rng(0)
    for count in (1, 2, 30):
        pairs = [(float(a), float(b)) for a, b in rng.integers(0, 12, (count, 2))]
        for pair, on_front in zip(pairs, pareto_front(pairs), strict=True):
            better = [o for o in pairs if o[0] <= pair[0] and o[1] <= pair[1] and o != pair]
            assert on_front is (not better)


def marks(drawing: Drawing | None) -> np.ndarray:
    assert drawing is not None
    return np.array([(part.x, part.y) for part in drawing.parts if isinstance(part, Mark)])


def test_a_decade_is_the_same_everywhere() -> None:
    points = [Point(10.0**k, 10.0**-k, f"p<{k}", "#123456", 10.0**k, 10.0**k) for k in range(4)]
    plot = log_plot(points, "a & b", "x", "y")
    assert plot is not None
    steps = np.diff(marks(plot), axis=0)
    np.testing.assert_allclose(steps, np.tile(steps[:1], (3, 1)), atol=1e-9)
    assert (steps > 0.0).all()  # dearer to the right, more exact further down
    element = ET.fromstring(svg_element(plot))
    assert {"p<0", "p<3", "x", "y"} <= {text.text for text in element.iter("text")}


def test_marks_stay_inside() -> None:
    rng = np.random.default_rng(0)
    for spread in (0.0, 0.1, 12.0):
        xs, ys = 10.0 ** rng.uniform(-spread - 1e-9, spread + 1e-9, (2, 30))
        points = [Point(x, y, "label", "red", x / 3, x * 3) for x, y in zip(xs, ys, strict=True)]
        # Zero has no logarithm: it is put onto the axis.
        points.append(Point(1.0, 0.0, "none", "red", 1.0, 1.0))
        places = marks(log_plot(points, "t", "x", "y"))
        assert len(places) == 31
        assert (places > 0.0).all()
        assert (places < (WIDTH, HEIGHT)).all()


def test_labels_overlap_neither_each_other_nor_marks() -> None:
    rng = np.random.default_rng(1)
    xs, ys = 10.0 ** rng.uniform(-1.0, 1.0, (2, 40))
    points = [Point(x, y, "some label", "red", x, x) for x, y in zip(xs, ys, strict=True)]
    plot = log_plot(points, "t", "x", "y")
    assert plot is not None
    boxes = [
        (part.x, part.y - 8.0, part.x + 55.0, part.y)
        for part in plot.parts
        if isinstance(part, Words) and part.text == "some label"
    ]
    assert len(boxes) > 5
    for index, (left, top, right, bottom) in enumerate(boxes):
        for other in boxes[index + 1 :]:
            apart = right <= other[0] or other[2] <= left or bottom <= other[1] or other[3] <= top
            assert apart


def test_nothing_to_show() -> None:
    assert log_plot([], "t", "x", "y") is None
    assert log_plot([Point(1.0, 0.0, "a", "red", 1.0, 1.0)], "t", "x", "y") is None


SHAPES = ("circle", "square", "triangle", "diamond", "down", "cross")


@pytest.mark.parametrize("shape", SHAPES)
def test_files(shape) -> None:
    """Both forms show a mark where it is, on white, in its colour."""
    drawing = Drawing(
        60, 40, "a <title>",
        [
            Line(((5.0, 35.0), (55.0, 35.0)), "#0000ff", dash=4.0),
            Mark(20.0, 15.0, shape, "#ff0000", True, tip="x & y"),
            Words(30.0, 38.0, "words", "middle", 9.0),
            Words(55.0, 20.0, "up", "middle", 9.0, turned=True),
        ],
    )  # fmt: skip
    element = ET.fromstring(svg_file(drawing))
    assert element.tag == f"{{{NAMESPACE}}}svg"
    assert "://" not in svg_element(drawing), "pages load nothing, and need no name for it"
    image = Image.open(io.BytesIO(png_file(drawing, scale=3))).convert("RGB")
    assert image.size == (180, 120)
    pixels = np.asarray(image).astype(int)
    assert (pixels[0, 0] == 255).all()
    assert np.abs(pixels[45, 60] - (255, 0, 0)).max() <= 8
    red = (pixels[..., 0] > 200) & (pixels[..., 1] < 100)
    rows, columns = np.nonzero(red)
    assert (rows.mean(), columns.mean()) == pytest.approx((45.0, 60.0), abs=3.0)
    assert ((pixels[..., 2] > 200) & (pixels[..., 0] < 100)).sum() > 50
    dark = (pixels.max(axis=-1) < 128)[:, 150:]
    assert dark.any(), "turned words"
