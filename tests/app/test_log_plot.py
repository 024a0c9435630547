"""Plots as text: the Pareto front, marks where they belong, labels that do not overlap."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
import pytest

from app.cli.log_plot import HEIGHT, WIDTH, Point, log_plot, pareto_front


def test_pareto_front() -> None:
    assert pareto_front([(1.0, 9.0), (2.0, 3.0), (3.0, 3.0), (4.0, 1.0), (2.0, 3.0)]) == [
        True, True, False, True, True,
    ]  # fmt: skip
    assert pareto_front([]) == []


def circles(text: str) -> list[tuple[float, float]]:
    found = ET.fromstring(text).iter("circle")
    return [(float(c.attrib["cx"]), float(c.attrib["cy"])) for c in found]


def test_a_decade_is_the_same_everywhere() -> None:
    points = [Point(10.0**k, 10.0**-k, f"p<{k}", "#123456", 10.0**k, 10.0**k) for k in range(4)]
    text = log_plot(points, "a & b", "x", "y")
    places = np.array(circles(text))
    steps = np.diff(places, axis=0)
    # Coordinates are written to a tenth of a pixel.
    assert steps == pytest.approx(np.tile(steps[:1], (3, 1)), abs=0.2)
    assert (steps > 0.0).all()  # dearer to the right, more exact further down
    labels = {element.text for element in ET.fromstring(text).iter("text")}
    assert {"p<0", "p<3", "x", "y"} <= labels


def test_marks_stay_inside() -> None:
    rng = np.random.default_rng(0)
    for spread in (0.0, 0.1, 12.0):
        xs, ys = 10.0 ** rng.uniform(-spread - 1e-9, spread + 1e-9, (2, 30))
        points = [Point(x, y, "label", "red", x / 3, x * 3) for x, y in zip(xs, ys, strict=True)]
        # Zero has no logarithm: it is put onto the axis.
        points.append(Point(1.0, 0.0, "none", "red", 1.0, 1.0))
        places = np.array(circles(log_plot(points, "t", "x", "y")))
        assert len(places) == 31
        assert (places > 0.0).all()
        assert (places < (WIDTH, HEIGHT)).all()


def test_nothing_to_show() -> None:
    assert "nothing to show" in log_plot([], "t", "x", "y")
    assert "nothing to show" in log_plot([Point(1.0, 0.0, "a", "red", 1.0, 1.0)], "t", "x", "y")
