"""What of a light is seen and can be grabbed, without a window."""

from __future__ import annotations

import math

import numpy as np
import pytest

from app import contours, edits, lights, planes, presets
from app.camera_control import dolly
from app.curves import evaluate
from app.gui.beginning import new_scene
from app.gui.grips import MOST_VERTICES, Grip, grips_of, nearest_grip, sorted_by_distance
from app.gui.overlays import FLAT, Sight, View, on_plane
from app.scene import AreaLight, Camera, Outline, Plane, PolygonContour

VIEW = View(100.0, 50.0, 1200.0, 800.0, (1200, 800))
FRONT = Sight(VIEW, Camera((0.0, 0.0, 4.0), (0.0, 0.0, 0.0)), 1.0)
HEART = AreaLight("heart", presets.heart(2.0), Plane((0.0, 0.0, 0.0)))
SQUARE = PolygonContour(((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)))


def of_kind(grips: list[Grip], what: str) -> list[str]:
    return [grip.name for grip in grips if grip.what == what]


@pytest.mark.parametrize("distance", [0.3, 1.0, 4.0, 30.0])
def test_lines_that_stand_for_curves_cannot_be_told_from_them(distance: float) -> None:
    """At every zoom, and where perspective stretches a part of the curve most."""
    rng = np.random.default_rng(3)
    curves = contours.segments_of(HEART.outline).curves
    for _ in range(10):
        way = rng.normal(size=3)
        eye = distance * way / np.linalg.norm(way)
        sight = Sight(VIEW, Camera(tuple(eye), (0.0, 0.05, 0.02), (0.1, 1.0, 0.2)), 1.0)
        counts = sight.piece_counts(curves, HEART.plane)
        for curve, count in zip(curves, counts.tolist(), strict=True):
            places = np.linspace(0.0, 1.0, count + 1)
            halves = 0.5 * (places[:-1] + places[1:])
            ends = VIEW.project_all(sight.camera, on_plane(HEART.plane, evaluate(curve, places)))[
                :, :2
            ]
            middle = VIEW.project_all(sight.camera, on_plane(HEART.plane, evaluate(curve, halves)))[
                :, :2
            ]
            a, b = ends[:-1], ends[1:]
            sides = b - a
            lengths = np.hypot(sides[:, 0], sides[:, 1])
            away = middle - a
            with np.errstate(invalid="ignore", divide="ignore"):
                miss = np.abs(sides[:, 0] * away[:, 1] - sides[:, 1] * away[:, 0]) / lengths
            inside = np.array([VIEW.contains(x, y) for x, y in middle.tolist()])
            # Away from the middle of the picture a step in depth shifts a point as well: by its
            # distance from the middle over the focal length, 0.75 at most in this picture.
            assert np.nanmax(miss[inside], initial=0.0) <= 1.8 * FLAT


def test_what_is_off_the_screen_is_not_subdivided() -> None:
    curves = contours.segments_of(HEART.outline).curves
    aside = Sight(VIEW, Camera((9.0, 0.0, 4.0), (9.0, 0.0, 0.0)), 1.0)
    assert aside.piece_counts(curves, HEART.plane).tolist() == [1] * len(curves)
    within = Sight(VIEW, Camera((0.0, 0.0, 0.01), (0.0, 0.5, 0.0)), 1.0)
    assert (within.piece_counts(curves, HEART.plane) > 1).any(), "part of it is behind the eye"


def test_grips_lie_on_what_they_move() -> None:
    grips = {grip.name: grip for grip in grips_of(FRONT, HEART, None)}
    contour = HEART.outline.contours[0]
    at = FRONT.project(planes.point_on(HEART.plane, contours.points_of(contour)[2]))
    assert grips["vertex 0.2"].at == pytest.approx(at)
    assert grips["vertex 0.2"].kind == "smooth"
    handle = grips["handle 0.1.2"]
    place = contour.curves[1][2]
    assert handle.at == pytest.approx(FRONT.project(planes.point_on(HEART.plane, place)))
    assert handle.anchor == pytest.approx(at)
    x, y = grips["vertex 0.2"].at
    assert FRONT.plane_point(HEART.plane, x, y) == pytest.approx(contours.points_of(contour)[2])
    middle = grips["edge 0.0"].at
    halfway = lights.point_along(HEART, 0, 0, 0.5)
    assert middle == pytest.approx(FRONT.project(planes.point_on(HEART.plane, halfway)))


def test_straight_segments_show_no_handles_and_retracted_ones_neither() -> None:
    line = lights.straighten(HEART, 0, 0)
    names = of_kind(grips_of(FRONT, line, (0, 0)), "handle")
    assert not [name for name in names if name.startswith("handle 0.0.")]
    short = lights.retract_handle(HEART, 0, 1, 1)
    assert "handle 0.1.1" not in of_kind(grips_of(FRONT, short, (0, 1)), "handle")
    square = AreaLight("square", Outline((SQUARE,)), HEART.plane)
    assert of_kind(grips_of(FRONT, square, (0, 0)), "handle") == []
    assert len(of_kind(grips_of(FRONT, square, None), "edge")) == 4


def test_in_a_crowd_only_the_selected_anchor_shows_handles() -> None:
    ring = AreaLight("ring", presets.ring(), HEART.plane)
    assert of_kind(grips_of(FRONT, ring, None), "handle") == []
    names = of_kind(grips_of(FRONT, ring, (1, 3)), "handle")
    assert names == ["handle 1.2.1", "handle 1.2.2", "handle 1.3.1", "handle 1.3.2"]


def test_points_that_would_hide_the_light_are_shown_from_near() -> None:
    scene, index = edits.add_text(new_scene(), "many letters")
    light = scene.lights[index]
    far = Sight(VIEW, dolly(scene.camera, -8.0), 1.0)
    assert grips_of(far, light, None) == []
    chosen = of_kind(grips_of(far, light, (0, 1)), "vertex")
    assert chosen
    assert all(name.startswith("vertex 0.") for name in chosen)
    origin = np.array(light.plane.origin)
    eye = origin + 0.4 * np.array(planes.normal_of(light.plane))
    near = Sight(VIEW, Camera(tuple(eye), tuple(origin)), 1.0)
    assert 0 < len(of_kind(grips_of(near, light, None), "vertex")) < MOST_VERTICES


def test_more_points_than_can_be_shown_leave_the_selected_one() -> None:
    turns = np.linspace(0.0, 2.0 * math.pi, MOST_VERTICES + 1, endpoint=False)
    many = PolygonContour(tuple((1.6 * math.cos(t), 1.6 * math.sin(t)) for t in turns))
    # So near that neighbours are far apart: only their number counts then.
    huge = Sight(View(0.0, 0.0, 9000.0, 9000.0, (9000, 9000)), FRONT.camera, 1.0)
    light = AreaLight("many", Outline((many,)), HEART.plane)
    assert grips_of(huge, light, None) == []
    assert [grip.name for grip in grips_of(huge, light, (0, 7))] == ["vertex 0.7"]
    assert {g.name for g in grips_of(huge, light, None, "vertex 0.9")} == {"vertex 0.9"}


def test_what_is_held_stays_wherever_it_is_but_not_behind_the_eye() -> None:
    aside = Sight(VIEW, Camera((9.0, 0.0, 4.0), (9.0, 0.0, 0.0)), 1.0)
    assert grips_of(aside, HEART, None) == []
    assert [grip.name for grip in grips_of(aside, HEART, None, "vertex 0.2")] == ["vertex 0.2"]
    away = Sight(VIEW, Camera((0.0, 0.0, 4.0), (0.0, 0.0, 8.0)), 1.0)
    assert grips_of(away, HEART, (0, 2), "vertex 0.2") == []


def test_the_nearest_grip_comes_first() -> None:
    grips = grips_of(FRONT, HEART, None)
    for grip in grips:
        x, y = grip.at
        assert sorted_by_distance(grips, x + 1.0, y)[0] is grip
        assert nearest_grip(grips, x + 1.0, y, 9.0) is grip
        assert nearest_grip([grip], x + 10.0, y, 9.0) is None
