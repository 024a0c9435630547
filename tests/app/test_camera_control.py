"""Camera movements and the way between pixels and the world."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app import camera_control as control
from app.scene import Camera
from app.vectors import add, dot, length, normalize, scale, subtract

CAMERA = Camera(eye=(1.0, 2.0, 5.0), target=(0.2, 0.5, -0.3))
W, H = 640.0, 360.0
angles = st.floats(-10.0, 10.0)


@given(angles, angles)
def test_orbit_keeps_distance_target_and_horizon(yaw: float, pitch: float) -> None:
    turned = control.orbit(CAMERA, yaw, pitch)
    assert turned.target == CAMERA.target
    assert control.distance_of(turned) == pytest.approx(control.distance_of(CAMERA))
    assert dot(control.basis_of(turned).right, CAMERA.up) == pytest.approx(0.0, abs=1e-12)


def test_orbit_stops_short_of_both_poles_and_comes_back() -> None:
    for sign in (1.0, -1.0):
        camera = CAMERA
        for _ in range(100):
            camera = control.orbit(camera, 0.1, sign * 0.3)
        view = normalize(subtract(camera.eye, camera.target))
        assert abs(math.acos(sign * view[1]) - control.POLE_MARGIN) < 1e-9
        assert abs(control.orbit(camera, 0.0, -sign * 1.0).eye[1]) < abs(camera.eye[1])


def test_orbit_works_about_any_up() -> None:
    camera = Camera(eye=(4.0, 0.0, 0.5), target=(0.0, 0.0, 0.0), up=(0.0, 0.0, 2.0))
    turned = control.orbit(camera, math.pi / 2.0, 0.0)
    assert turned.eye == pytest.approx((0.0, 4.0, 0.5))


def test_a_full_turn_returns() -> None:
    assert control.orbit(CAMERA, 2.0 * math.pi, 0.0).eye == pytest.approx(CAMERA.eye)


@given(st.floats(-300, 300), st.floats(-300, 300))
def test_the_target_follows_the_pointer_when_panning(dx: float, dy: float) -> None:
    panned = control.pan(CAMERA, dx, dy, H)
    x, y, depth = control.project(panned, CAMERA.target, W, H)
    assert (x, y) == pytest.approx((W / 2 + dx, H / 2 + dy), abs=1e-6)
    assert depth == pytest.approx(control.distance_of(CAMERA))


@given(st.floats(-1000.0, 1000.0))
def test_dolly_never_reaches_the_target_nor_leaves(steps: float) -> None:
    moved = control.dolly(CAMERA, steps)
    limits = (control.DISTANCE_MIN * 0.999, control.DISTANCE_MAX * 1.001)
    assert limits[0] <= control.distance_of(moved) <= limits[1]
    assert moved.target == CAMERA.target


@pytest.mark.parametrize("aspect", [0.4, 1.0, 2.5])
def test_a_framed_sphere_fits_the_picture_and_fills_it(aspect: float) -> None:
    centre, radius = (3.0, -1.0, 2.0), 0.7
    camera = control.frame(CAMERA, centre, radius, aspect)
    axes = control.basis_of(camera)
    extent = []
    for angle in np.linspace(0.0, 2.0 * np.pi, 60):
        rim = add(
            centre,
            add(
                scale(axes.right, radius * math.cos(angle)),
                scale(axes.up, radius * math.sin(angle)),
            ),
        )
        x, y, _ = control.project(camera, rim, aspect * 100.0, 100.0)
        extent.append(max(abs(x / (aspect * 100.0) - 0.5), abs(y / 100.0 - 0.5)) * 2.0)
    assert 0.6 < max(extent) < 1.0


@given(st.floats(-2, 2), st.floats(-2, 2), st.floats(-8, 3))
def test_rays_go_through_projected_points(x: float, y: float, z: float) -> None:
    point = (x, y, z)
    px, py, depth = control.project(CAMERA, point, W, H)
    direction = control.ray_through(CAMERA, px, py, W, H)
    offset = subtract(point, CAMERA.eye)
    assert dot(direction, offset) / length(offset) == pytest.approx(1.0, abs=1e-12)
    assert depth <= length(offset) + 1e-12


def test_projection_agrees_with_the_matrices() -> None:
    clip = control.clip_from_view(CAMERA, W / H) @ control.view_from_world(CAMERA)
    for point in ((0.0, 0.0, 0.0), (1.0, -1.0, -4.0)):
        x, y, z, w = clip @ np.array([*point, 1.0])
        got = control.project(CAMERA, point, W, H)
        assert got == pytest.approx(((x / w * 0.5 + 0.5) * W, (0.5 - y / w * 0.5) * H, w))
        assert -1.0 < z / w < 1.0


def test_projecting_many_points_is_projecting_each() -> None:
    points = np.random.default_rng(5).uniform(-1.0, 1.0, (20, 3))
    each = np.array([control.project(CAMERA, tuple(point), W, H) for point in points])
    assert control.project_all(CAMERA, points, W, H) == pytest.approx(each)
    assert control.project_all(CAMERA, points.reshape(4, 5, 3), W, H).shape == (4, 5, 3)
    points[7] = CAMERA.eye
    assert np.isnan(control.project_all(CAMERA, points, W, H)).all(-1).tolist() == [
        i == 7 for i in range(20)
    ]


@pytest.mark.parametrize("aspect", [0.3, 1.0, 1.7])
def test_a_widened_camera_shows_the_width_of_a_wide_picture(aspect: float) -> None:
    wide = control.widened(CAMERA, aspect)
    across = math.tan(wide.fov_y / 2.0) * aspect
    wanted = math.tan(CAMERA.fov_y / 2.0) * control.LEAST_ASPECT
    assert across == pytest.approx(wanted) or wide.fov_y == control.WIDEST
    assert control.widened(CAMERA, control.LEAST_ASPECT) is CAMERA


def test_nothing_behind_the_eye_is_projected() -> None:
    behind = subtract(CAMERA.eye, control.basis_of(CAMERA).forward)
    assert control.project(CAMERA, behind, W, H) is None
    assert control.clip_to_view(CAMERA, behind, CAMERA.eye) is None
    clipped = control.clip_to_view(CAMERA, behind, CAMERA.target)
    assert clipped is not None
    assert clipped[1] == CAMERA.target
    assert control.project(CAMERA, clipped[0], W, H) is not None
    assert control.clip_to_view(CAMERA, CAMERA.target, behind)[1] == pytest.approx(clipped[0])


def test_plane_intersection_and_its_limits() -> None:
    hit = control.intersect_plane(
        (0.0, 2.0, 0.0), (1.0, -1.0, 0.0), (0.0, 0.0, 0.0), (0.0, 3.0, 0.0)
    )
    assert hit == pytest.approx((2.0, 0.0, 0.0))
    away = control.intersect_plane(
        (0.0, 2.0, 0.0), (1.0, 1.0, 0.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0)
    )
    assert away is None
    edge_on = control.intersect_plane(
        (0.0, 2.0, 0.0), (1.0, -0.001, 0.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0)
    )
    assert edge_on is None
