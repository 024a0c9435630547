"""The editor and its edits: scenes in, scenes out, and a history that keeps its word."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app import edits, lights, planes, sliders, step_names
from app.editor import NOTHING, Editor, Selection, duplicate_selected, remove_selected
from app.scene import (
    ALPHA_MIN,
    AreaLight,
    Camera,
    Material,
    Outline,
    Plane,
    PolygonContour,
    Scene,
    SceneError,
    SceneObject,
)
from app.vectors import cross, dot, length, normalize, rotate, subtract

SQUARE = PolygonContour(((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)))
LIGHT = AreaLight("key", Outline((SQUARE,)))
SCENE = Scene(
    materials=(Material("floor"), Material("metal")),
    objects=(SceneObject("floor", "plane", "floor"), SceneObject("ball", "sphere", "metal")),
    lights=(LIGHT, replace(LIGHT, name="fill")),
)


@pytest.fixture
def editor() -> Editor:
    return Editor(SCENE)


def moved(scene: Scene, s: float) -> Scene:
    return edits.replace_light(scene, 0, lights.move_vertex(scene.lights[0], (0, 0), (s, -1.0)))


# --- history ----------------------------------------------------------------


def test_undo_and_redo_return_to_the_same_scenes(editor: Editor) -> None:
    scenes = [SCENE]
    for i in range(5):
        assert editor.apply(f"edit {i}", moved(editor.scene, -2.0 - i))
        scenes.append(editor.scene)
    for expected in reversed(scenes[:-1]):
        editor.undo()
        assert editor.scene == expected
    assert editor.undo() is None
    for expected in scenes[1:]:
        editor.redo()
        assert editor.scene == expected
    assert editor.redo() is None
    assert editor.steps == ("Open", *(f"edit {i}" for i in range(5)))


def test_an_edit_that_changes_nothing_leaves_no_step(editor: Editor) -> None:
    assert not editor.apply("nothing", replace(SCENE))
    editor.begin("drag")
    editor.update(moved(SCENE, -3.0))
    editor.update(SCENE)
    assert not editor.commit()
    assert editor.undo_name is None


def test_a_drag_is_one_step(editor: Editor) -> None:
    editor.begin("Move corner")
    for i in range(20):
        editor.update(moved(editor.scene, -1.0 - 0.1 * i))
    assert editor.commit()
    assert editor.steps == ("Open", "Move corner")
    assert editor.undo() == "Move corner"
    assert editor.scene == SCENE


def test_staging_under_one_name_is_one_drag_and_another_name_commits_it(editor: Editor) -> None:
    for s in (-2.0, -3.0, -4.0):
        editor.stage("a", moved(editor.scene, s))
    editor.stage("b", edits.rename_light(editor.scene, 0, "sun"))
    editor.commit()
    assert editor.steps == ("Open", "a", "b")


def test_cancelling_a_drag_restores_the_scene_and_spares_the_camera(editor: Editor) -> None:
    editor.begin("drag")
    editor.update(moved(SCENE, -3.0))
    camera = Camera(eye=(3.0, 3.0, 3.0))
    editor.look(camera)
    assert editor.undo() == "drag"
    assert editor.scene == replace(SCENE, camera=camera)
    assert not editor.is_dragging


def test_undo_spares_the_camera_and_looking_is_no_edit(editor: Editor) -> None:
    editor.apply("edit", moved(SCENE, -3.0))
    camera = Camera(eye=(1.0, 2.0, 3.0))
    editor.look(camera)
    assert editor.undo_name == "edit"
    editor.undo()
    assert editor.scene.camera == camera
    assert not editor.is_modified


def test_a_new_edit_after_undo_drops_what_was_undone(editor: Editor) -> None:
    editor.apply("a", moved(SCENE, -2.0))
    editor.apply("b", moved(SCENE, -3.0))
    editor.undo()
    editor.apply("c", moved(SCENE, -4.0))
    assert editor.steps == ("Open", "a", "c")
    assert editor.redo_name is None


def test_unsaved_mark_follows_the_scene_not_the_number_of_steps(editor: Editor, tmp_path) -> None:
    editor.apply("a", moved(SCENE, -2.0))
    assert editor.is_modified
    editor.mark_saved(tmp_path / "a.json")
    assert not editor.is_modified
    editor.undo()
    assert editor.is_modified
    editor.redo()
    assert not editor.is_modified


def test_unchanged_parts_are_shared(editor: Editor) -> None:
    editor.apply("a", moved(SCENE, -2.0))
    assert editor.scene.materials is SCENE.materials
    assert editor.scene.lights[1] is SCENE.lights[1]
    editor.undo()
    assert editor.scene.lights is SCENE.lights


def test_selection_never_outlives_its_object(editor: Editor) -> None:
    editor.selection = Selection.light(1, (0, 3))
    editor.apply(
        "remove corner",
        edits.replace_light(editor.scene, 1, lights.remove_vertex(editor.scene.lights[1], (0, 3))),
    )
    assert editor.selection == Selection.light(1)
    editor.apply("remove", edits.remove_light(editor.scene, 1))
    assert editor.selection == NOTHING
    editor.selection = Selection.object(7)
    assert editor.selection == NOTHING


def test_copying_and_removing_what_is_selected_are_steps_with_names(editor: Editor) -> None:
    editor.selection = Selection.light(0, (0, 1))
    editor.duplicate()
    assert editor.selection == Selection.light(2)
    editor.selection = Selection.light(0, (0, 1))
    editor.remove()
    assert editor.selection == Selection.light(0)
    editor.remove()
    editor.remove()
    assert editor.steps == (
        "Open", "Add light 'key 2'", "Remove corner of 'key'", "Remove light 'key'",
    )  # fmt: skip


def test_escape_cancels_a_drag_and_then_selects_nothing(editor: Editor) -> None:
    editor.selection = Selection.object(0)
    editor.begin("drag")
    editor.update(moved(editor.scene, -3.0))
    editor.escape()
    assert (editor.scene, editor.selection) == (SCENE, Selection.object(0))
    editor.escape()
    assert editor.selection == NOTHING


def test_update_without_begin_is_an_error(editor: Editor) -> None:
    with pytest.raises(RuntimeError, match="without begin"):
        editor.update(SCENE)
    with pytest.raises(IndexError):
        editor.go_to(3)


# --- outlines ---------------------------------------------------------------

SKEW = replace(LIGHT, plane=Plane((1.0, 2.0, 3.0), (2.0, 0.5, 0.0), (0.3, 1.0, -0.4)))


@given(st.floats(-5, 5), st.floats(-5, 5))
def test_plane_coordinates_round_trip(s: float, t: float) -> None:
    point = planes.point_on(SKEW.plane, (s, t))
    assert planes.coordinates_on(SKEW.plane, point) == pytest.approx((s, t), abs=1e-12)


def test_metric_of_a_skew_plane_measures_world_lengths() -> None:
    metric = planes.metric_from_plane(SKEW.plane)
    for a, b in (((0.0, 0.0), (1.0, 0.0)), ((0.0, 0.0), (0.0, 1.0)), ((1.0, -2.0), (0.5, 3.0))):
        world = length(subtract(planes.point_on(SKEW.plane, a), planes.point_on(SKEW.plane, b)))
        flat = np.linalg.norm(metric @ (np.array(a) - np.array(b)))
        assert flat == pytest.approx(world)


def test_nearest_edge_against_brute_force_in_the_world() -> None:
    rng = np.random.default_rng(3)
    for at in rng.uniform(-2, 2, (50, 2)):
        contour, edge, along = lights.nearest_edge(SKEW, (at[0], at[1]))
        found = lights.add_vertex(SKEW, contour, edge, along).outline.contours[0].points[edge + 1]
        target = np.array(planes.point_on(SKEW.plane, (at[0], at[1])))
        corners = np.array([planes.point_on(SKEW.plane, p) for p in SQUARE.points])
        weights = np.linspace(0, 1, 2001)[:, None]
        samples = np.concatenate(
            [a + weights * (b - a) for a, b in zip(corners, np.roll(corners, -1, 0), strict=True)]
        )
        brute = np.linalg.norm(samples - target, axis=-1).min()
        got = np.linalg.norm(np.array(planes.point_on(SKEW.plane, found)) - target)
        assert got <= brute + 1e-12
        assert got == pytest.approx(brute, abs=2e-3)


def test_a_new_vertex_lies_between_its_neighbours_and_comes_away_again() -> None:
    wider = lights.add_vertex(LIGHT, 0, 3, 0.25)
    assert wider.outline.contours[0].points[4] == pytest.approx((-1.0, 0.5))
    assert lights.remove_vertex(wider, (0, 4)) == LIGHT


def test_a_light_keeps_three_corners() -> None:
    triangle = lights.remove_vertex(LIGHT, (0, 0))
    assert len(triangle.outline.contours[0].points) == 3
    with pytest.raises(SceneError, match="3 is the fewest"):
        lights.remove_vertex(triangle, (0, 0))
    hole = lights.remove_vertex(lights.add_hole(LIGHT), (1, 0))
    assert lights.remove_vertex(hole, (1, 1)) == LIGHT


L_SHAPE = AreaLight(
    "L",
    Outline(
        (PolygonContour(((0.0, 0.0), (4.0, 0.0), (4.0, 1.0), (1.0, 1.0), (1.0, 4.0), (0.0, 4.0))),)
    ),
)


@pytest.mark.parametrize("light", [LIGHT, SKEW, L_SHAPE])
@pytest.mark.parametrize("fill_rule", ["evenodd", "nonzero"])
@pytest.mark.parametrize("reverse", [False, True])
def test_a_hole_lies_in_a_filled_place_and_empties_it(light, fill_rule, reverse) -> None:
    points = light.outline.contours[0].points
    contour = PolygonContour(points[::-1] if reverse else points)
    light = replace(light, outline=Outline((contour,), fill_rule))
    place, clearance, winding = lights.widest_place(light)
    assert abs(winding) == 1
    assert clearance > 0.0
    holed = lights.add_hole(light)
    hole = np.array(holed.outline.contours[1].points)
    metric = planes.metric_from_plane(light.plane)
    distances = np.linalg.norm(hole @ metric.T - place, axis=-1)
    assert distances == pytest.approx(0.5 * math.sqrt(2.0) * clearance)
    _, _, inside = lights.widest_place(holed)
    rule = {"evenodd": inside % 2 != 0, "nonzero": inside != 0}[fill_rule]
    assert rule  # what is filled now is elsewhere
    contours = [np.array(c.points) @ metric.T for c in holed.outline.contours]
    turns, _ = lights._winding_and_clearance(contours, place[None])
    assert (turns[0] % 2 == 0) if fill_rule == "evenodd" else (turns[0] == 0)


def test_the_widest_place_of_a_square_is_its_centre() -> None:
    place, clearance, _ = lights.widest_place(LIGHT)
    assert place == pytest.approx([0.0, 0.0], abs=1e-3)
    assert clearance == pytest.approx(1.0, abs=1e-3)


def test_no_hole_where_nothing_is_filled() -> None:
    flat = replace(LIGHT, outline=Outline((PolygonContour(((0.0, 0.0), (1.0, 0.0), (2.0, 0.0))),)))
    with pytest.raises(SceneError, match="no filled part"):
        lights.add_hole(flat)


# --- planes -----------------------------------------------------------------


@pytest.mark.parametrize("at", [(3.0, -2.0, 1.0), (0.0, 1.0, 5.0), (0.0, 1.0, -5.0)])
def test_an_aimed_light_faces_the_point_and_keeps_its_shape(at) -> None:
    aimed = lights.aim(LIGHT, at)
    way = normalize(subtract(at, lights.centre_of(LIGHT)))
    assert planes.normal_of(aimed.plane) == pytest.approx(way, abs=1e-12)
    assert lights.centre_of(aimed) == pytest.approx(lights.centre_of(LIGHT), abs=1e-12)
    assert length(aimed.plane.u) == pytest.approx(length(LIGHT.plane.u))
    assert dot(aimed.plane.u, aimed.plane.v) == pytest.approx(0.0, abs=1e-12)


def test_a_light_cannot_be_aimed_at_itself() -> None:
    with pytest.raises(SceneError, match="its own centre"):
        lights.aim(LIGHT, lights.centre_of(LIGHT))


def test_a_flipped_light_is_the_same_set_of_points_facing_away() -> None:
    flipped = lights.flip_light(SKEW)

    def corners(light):
        return {
            tuple(np.round(planes.point_on(light.plane, p), 9))
            for _, p in lights.vertices_of(light)
        }

    assert corners(flipped) == corners(SKEW)
    assert dot(planes.normal_of(SKEW.plane), planes.normal_of(flipped.plane)) == pytest.approx(-1.0)


def test_a_rigid_matrix_moves_points_as_it_moves_the_plane() -> None:
    turn = np.eye(4)
    turn[:3, :3] = [[0, 0, 1], [1, 0, 0], [0, 1, 0]]
    turn[:3, 3] = [1, 2, 3]
    plane = planes.transform_plane(SKEW.plane, turn)
    for st_ in ((0.0, 0.0), (1.0, -2.0)):
        expected = turn @ np.array([*planes.point_on(SKEW.plane, st_), 1.0])
        assert planes.point_on(plane, st_) == pytest.approx(tuple(expected[:3]))


# --- scenes -----------------------------------------------------------------


def test_a_new_light_faces_the_target_and_has_a_free_name() -> None:
    scene, index = edits.add_light(SCENE)
    scene, second = edits.add_light(scene)
    assert (index, second) == (2, 3)
    light = scene.lights[index]
    way = normalize(subtract(SCENE.camera.target, light.plane.origin))
    assert planes.normal_of(light.plane) == pytest.approx(way)
    assert length(cross(light.plane.u, light.plane.v)) == pytest.approx(1.0)
    assert [light.name for light in scene.lights[2:]] == ["light", "light 2"]


def test_duplicates_are_new_and_elsewhere() -> None:
    scene, index = edits.duplicate_light(SCENE, 0)
    assert scene.lights[index].name == "key 2"
    assert scene.lights[index].outline is LIGHT.outline
    assert lights.centre_of(scene.lights[index]) != lights.centre_of(LIGHT)
    scene, index = edits.duplicate_object(scene, 1)
    assert scene.objects[index].name == "ball 2"
    assert edits.remove_object(scene, index).objects == SCENE.objects


def test_names_stay_unique_and_materials_keep_their_objects() -> None:
    assert edits.rename_light(SCENE, 0, "fill").lights[0].name == "fill 2"
    assert edits.rename_light(SCENE, 0, "  ") is SCENE
    assert edits.rename_object(SCENE, 0, " ground ").objects[0].name == "ground"
    renamed = edits.rename_material(SCENE, "metal", "gold")
    assert renamed.objects[1].material == "gold"
    assert edits.unique_name("a 2", ["a", "a 2", "a 3"]) == "a 4"


def test_an_object_of_a_shared_material_gets_its_own() -> None:
    shared = edits.replace_object(SCENE, 1, replace(SCENE.objects[1], material="floor"))
    own = edits.own_material(shared, 1)
    assert own.objects[1].material == "floor 2"
    assert own.material_of(own.objects[1]).alpha == own.materials[0].alpha
    assert own.objects[0].material == "floor"


def test_a_mesh_comes_with_a_material_of_its_own_and_stands_on_the_ground() -> None:
    scene, index = edits.add_object(SCENE, "box", "metal")
    assert scene.objects[index].material == "metal 2"
    assert scene.materials[:-1] == SCENE.materials
    placed = scene.objects[index].transform
    assert placed.translate[1] == placed.scale[1]


@pytest.mark.parametrize(
    ("after", "name"),
    [
        (edits.add_light(SCENE)[0], "Add light 'light'"),
        (edits.remove_light(SCENE, 1), "Remove light 'fill'"),
        (edits.add_object(SCENE, "box", "box")[0], "Add object 'box'"),
        (edits.replace_light(SCENE, 0, lights.add_hole(LIGHT)), "Add outline of 'key'"),
        (edits.rename_object(SCENE, 1, "orb"), "Rename object 'ball'"),
        (
            edits.replace_material(SCENE, "metal", replace(SCENE.materials[1], alpha=(0.1, 0.1))),
            "Change roughness of 'metal'",
        ),
        (moved(SCENE, -2.0), "Change shape of 'key'"),
        (replace(SCENE, display=replace(SCENE.display, exposure=1.0)), "Change exposure"),
        (replace(SCENE, camera=Camera(eye=(9.0, 9.0, 9.0))), "Move camera"),
    ],
)
def test_steps_name_what_changed(after: Scene, name: str) -> None:
    assert step_names.describe(SCENE, after) == name


# --- sliders ----------------------------------------------------------------


@given(st.floats(0.011, 0.7), st.floats(-0.9, 0.9))
def test_sliders_and_alpha_are_inverse_where_nothing_is_clamped(
    roughness: float, anisotropy: float
) -> None:
    alpha = sliders.alpha_from_sliders(roughness, anisotropy)
    if min(alpha) > ALPHA_MIN and max(alpha) < 1.0:
        back = sliders.sliders_from_alpha(alpha)
        assert back == pytest.approx((roughness, anisotropy), abs=1e-9)


def test_alpha_is_roughness_squared_and_burleys_aspect() -> None:
    assert sliders.alpha_from_sliders(0.5) == (0.25, 0.25)
    assert sliders.alpha_from_sliders(0.0) == (ALPHA_MIN, ALPHA_MIN)
    wide, narrow = sliders.alpha_from_sliders(0.3, 1.0)
    assert wide / narrow == pytest.approx(10.0)
    assert wide * narrow == pytest.approx(0.3**4)


@given(st.tuples(*[st.floats(0.0, 1.0)] * 3))
def test_srgb_round_trip(colour) -> None:
    there = sliders.srgb_from_linear(colour)
    assert sliders.linear_from_srgb(there) == pytest.approx(colour, abs=1e-6)
    assert all(0.0 <= x <= 1.0 + 1e-12 for x in there)


@given(st.tuples(*[st.floats(-3.0, 3.0)] * 3))
def test_euler_angles_and_quaternions_describe_the_same_turn(angles) -> None:
    quaternion = sliders.quaternion_from_euler(angles)
    assert math.hypot(*quaternion) == pytest.approx(1.0)
    again = sliders.quaternion_from_euler(sliders.euler_from_quaternion(quaternion))
    assert abs(sum(a * b for a, b in zip(quaternion, again, strict=True))) == pytest.approx(1.0)


@pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.6, 0.0, 0.8)])
@pytest.mark.parametrize("angle", [0.0, 0.3, 3.1, -2.0])
def test_an_object_turned_by_a_matrix_turns_by_that_angle(axis, angle) -> None:
    rigid = np.eye(4)
    rigid[:3, :3] = np.array([rotate(e, axis, angle) for e in np.eye(3)]).T
    rigid[:3, 3] = (1.0, 2.0, 3.0)
    turned = edits.transform_object(SCENE.objects[1], rigid).transform
    expected = (math.cos(angle / 2), *(math.sin(angle / 2) * a for a in axis))
    assert abs(sum(a * b for a, b in zip(turned.rotate, expected, strict=True))) == pytest.approx(1)
    assert turned.translate == (1.0, 2.0, 3.0)
    twice = edits.transform_object(edits.transform_object(SCENE.objects[1], rigid), rigid)
    doubled = (math.cos(angle), *(math.sin(angle) * a for a in axis))
    product = sum(a * b for a, b in zip(twice.transform.rotate, doubled, strict=True))
    assert abs(product) == pytest.approx(1.0)


def test_what_is_selected_is_copied_and_removed() -> None:
    scene, chosen = duplicate_selected(SCENE, Selection.light(0))
    assert chosen == Selection.light(2)
    scene, chosen = remove_selected(scene, chosen)
    assert (scene, chosen) == (SCENE, NOTHING)
    scene, chosen = remove_selected(SCENE, Selection.light(0, (0, 1)))
    assert len(scene.lights[0].outline.contours[0].points) == 3
    assert chosen == Selection.light(0)
    scene, chosen = duplicate_selected(SCENE, Selection.object(1))
    assert remove_selected(scene, chosen)[0] == SCENE
    assert duplicate_selected(SCENE, NOTHING) == remove_selected(SCENE, NOTHING) == (SCENE, NOTHING)
