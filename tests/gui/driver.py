"""Runs the scenarios in one application and writes what became of each as JSON.

Usage: python -m tests.gui.driver FOLDER
"""

from __future__ import annotations

# isort: off
import imgui_bundle  # noqa: F401  (first: glfw then takes the library that imgui-bundle carries)
import glfw
# isort: on

import json
import pickle
import sys
import time
import traceback
from dataclasses import replace
from pathlib import Path

import numpy as np
from imgui_bundle import imgui

from app import edits, lights, planes
from app import window as window_module
from app.colour_maps import VIRIDIS
from app.editor import NOTHING, Selection
from app.panels.export import Export
from app.panels.plan import PlanReport
from app.plan_rows import section_lines
from app.scene import (
    AreaLight,
    Camera,
    Display,
    Material,
    Outline,
    Plane,
    PolygonContour,
    RenderSettings,
    Scene,
    SceneObject,
    Transform,
)
from app.scene_io import load_scene
from tests.gui import comparing, lobes, measuring, outlines, picturing
from tests.gui.application import Application

CTRL, SHIFT = imgui.Key.mod_ctrl, imgui.Key.mod_shift
SAMPLES = 2

SCENE = Scene(
    materials=(
        Material("floor", (0.2, 0.2, 0.2), (0.04, 0.04, 0.04), (0.09, 0.09)),
        Material("red", (0.6, 0.1, 0.1), (0.04, 0.04, 0.04), (0.25, 0.25)),
    ),
    objects=(
        SceneObject("floor", "plane", "floor", Transform(scale=(6.0, 6.0, 6.0))),
        SceneObject("ball", "sphere", "red", Transform((1.3, 0.5, 0.3), scale=(0.5, 0.5, 0.5))),
    ),
    lights=(
        AreaLight(
            "key",
            Outline((PolygonContour(((-0.8, -0.6), (0.8, -0.6), (0.8, 0.6), (-0.8, 0.6))),)),
            Plane((-0.4, 1.1, -1.0)),
            (4.0, 3.6, 3.0),
        ),
    ),
    camera=Camera((0.0, 1.3, 4.5), (0.0, 0.8, 0.0)),
    display=Display(0.0, "agx"),
)


HIDDEN = replace(SCENE.lights[0], visible=False)


def start(app: Application) -> None:
    """Bring the application back to the first scene, its light selected."""
    app.window.show(SCENE, None)
    app.window.viewport.settings = RenderSettings(samples=SAMPLES)
    app.window.viewport.tool = "move"
    app.window.editor.selection = Selection.light(0)
    app.act(lambda ctx: ctx.mouse_move_to_pos(imgui.ImVec2(5.0, 695.0)))
    app.settle()


def drag_a_corner(app: Application, out: Path) -> None:
    before, x, y = app.picture(), *app.corner((0, 2))
    app.drag("vertex 0.2", 60.0, -40.0)
    points = app.scene.lights[0].outline.contours[0].points
    old = SCENE.lights[0].outline.contours[0].points
    assert [a == b for a, b in zip(points, old, strict=True)] == [True, True, False, True]
    assert np.allclose(app.corner((0, 2)), (x + 60.0, y - 40.0), atol=1.0)
    assert app.window.editor.steps == ("Open", "Move corner of 'key'")
    assert app.window.editor.selection == Selection.light(0, (0, 2))
    assert "•" in app.window.title
    after = app.picture()
    assert (np.abs(after.astype(int) - before).max(-1) > 8).mean() > 0.02
    lit = after[
        round(y - 30.0 - app.window.viewport.view.y), round(x + 40 - app.window.viewport.view.x)
    ]
    assert lit.min() > 120, "the light itself follows the corner"

    app.key(CTRL | imgui.Key.z)
    assert app.scene == SCENE
    assert np.array_equal(app.picture(), before), "undo brings the very same pixels back"
    assert "•" not in app.window.title
    app.key(CTRL | imgui.Key.y)
    assert app.scene.lights[0].outline.contours[0].points == points
    assert np.array_equal(app.picture(), after)
    app.key(CTRL | SHIFT | imgui.Key.z)
    assert app.window.editor.redo_name is None


def press_a_corner_without_moving_it(app: Application, out: Path) -> None:
    app.click("vertex 0.1")
    assert app.window.editor.selection == Selection.light(0, (0, 1))
    assert app.scene == SCENE
    assert app.window.editor.undo_name is None


def escape_cancels_a_drag(app: Application, out: Path) -> None:
    def action(ctx) -> None:
        ctx.mouse_move("//**/vertex 0.0")
        ctx.mouse_down(0)
        ctx.mouse_move_to_pos(imgui.ImVec2(ctx.inputs.mouse_pos_value.x + 50.0, 300.0))
        ctx.key_press(imgui.Key.escape)
        ctx.mouse_move_to_pos(imgui.ImVec2(300.0, 320.0))
        ctx.mouse_up(0)

    app.act(action)
    assert app.scene == SCENE
    assert app.window.editor.undo_name is None


def change_roughness_by_its_slider(app: Application, out: Path) -> None:
    app.window.editor.selection = Selection.object(1)
    app.settle()
    before = app.picture()
    app.enter("##roughness", 0.2)
    assert np.allclose(app.scene.materials[1].alpha, 0.04)
    assert app.window.editor.steps == ("Open", "Change roughness of 'red'")
    after = app.picture()
    assert not np.array_equal(after, before)
    programs = app.window.renderer.programs
    compiled = getattr(programs, "compiled", None)
    app.drag("##roughness", 40.0, 0.0)
    assert len(app.window.editor.steps) == 3, "one drag of a slider is one step"
    assert getattr(programs, "compiled", None) == compiled, "a value compiles nothing"
    app.key(CTRL | imgui.Key.z)
    app.key(CTRL | imgui.Key.z)
    assert app.scene.materials == SCENE.materials
    assert np.array_equal(app.picture(), before)


def add_and_remove_a_corner(app: Application, out: Path) -> None:
    app.drag("edge 0.0", 0.0, 40.0)
    points = app.scene.lights[0].outline.contours[0].points
    assert len(points) == 5
    assert points[1][1] < -0.6
    assert app.window.editor.steps == ("Open", "Add corner to 'key'")
    assert app.window.editor.selection.vertex == (0, 1)
    app.key(imgui.Key.delete)
    assert app.scene.lights == SCENE.lights
    app.window.editor.selection = Selection.light(0, (0, 0))
    app.key(imgui.Key.delete)
    assert len(app.scene.lights[0].outline.contours[0].points) == 3
    app.window.editor.selection = Selection.light(0, (0, 0))
    app.key(imgui.Key.delete)
    assert len(app.scene.lights[0].outline.contours[0].points) == 3
    assert any("3 is the fewest" in message.text for message in app.window.messages.shown)


def split_an_edge_by_double_click(app: Application, out: Path) -> None:
    at = app.on_screen(planes.point_on(SCENE.lights[0].plane, (0.81, 0.3)))

    def action(ctx) -> None:
        ctx.mouse_move_to_pos(imgui.ImVec2(*at))
        ctx.yield_(2)
        ctx.mouse_double_click(0)

    app.act(action)
    points = app.scene.lights[0].outline.contours[0].points
    assert len(points) == 5
    assert np.allclose(points[2], (0.8, 0.3), atol=0.02)
    app.act(lambda ctx: ctx.item_click("//**/vertex 0.2", 1))
    app.click("Remove corner")
    assert app.scene == SCENE


def cut_a_hole(app: Application, out: Path) -> None:
    x, y = app.on_screen(lights.centre_of(SCENE.lights[0]))
    view = app.window.viewport.view
    at = round(y - view.y), round(x - view.x)
    assert app.picture()[at].min() > 120
    app.click("###add hole")
    app.click("Square hole")
    assert len(app.scene.lights[0].outline.contours) == 2
    assert app.picture()[at].max() < 60, "one looks through the hole"
    app.drag("vertex 1.0", -20.0, -10.0)
    app.click("Remove hole")
    assert len(app.scene.lights[0].outline.contours) == 1
    assert app.scene == SCENE
    assert len(app.window.editor.steps) == 4


def add_copy_and_remove_lights(app: Application, out: Path) -> None:
    before = app.picture()
    app.click("###add light")
    app.click("Square")
    assert [light.name for light in app.scene.lights] == ["key", "light"]
    assert app.window.editor.selection == Selection.light(1)
    after = app.picture()
    assert (np.abs(after.astype(int) - before).max(-1) > 8).mean() > 0.02
    app.key(CTRL | imgui.Key.d)
    assert [light.name for light in app.scene.lights] == ["key", "light", "light 2"]
    app.key(imgui.Key.delete)
    app.window.editor.selection = Selection.light(1)
    app.key(imgui.Key.delete)
    assert app.scene.lights == SCENE.lights
    assert np.array_equal(app.picture(), before)


def select_by_clicking(app: Application, out: Path) -> None:
    x, y = app.on_screen((1.3, 0.5, 0.8))
    app.click_at(x, y)
    assert app.window.editor.selection == Selection.object(1)
    x, y = app.on_screen(planes.point_on(SCENE.lights[0].plane, (-0.5, 0.4)))
    app.click_at(x, y)
    assert app.window.editor.selection == Selection.light(0)
    view = app.window.viewport.view
    app.click_at(view.x + view.width - 8.0, view.y + 60.0)
    assert app.window.editor.selection == NOTHING
    assert app.window.editor.undo_name is None


def look_around(app: Application, out: Path) -> None:
    view = app.window.viewport.view
    x, y = view.x + 30.0, view.y + 120.0
    for button in (0, 2):
        camera = app.scene.camera
        app.drag_at(x, y, 80.0, 30.0, button)
        turned = app.scene.camera
        assert turned.target == camera.target
        assert turned.eye != camera.eye
        assert turned.eye[1] > camera.eye[1], "dragging down looks from higher up"
    camera = app.scene.camera
    target = app.on_screen(camera.target)
    app.drag_at(x, y, 50.0, 20.0, 1)
    assert app.scene.camera.target != camera.target
    assert app.scene.camera.fov_y == camera.fov_y
    moved = app.on_screen(camera.target)
    assert np.allclose(moved, (target[0] + 50.0, target[1] + 20.0), atol=8.0)
    distance = np.linalg.norm(np.subtract(app.scene.camera.eye, app.scene.camera.target))

    def wheel(ctx) -> None:
        ctx.mouse_move_to_pos(imgui.ImVec2(x, y))
        ctx.yield_(2)
        ctx.mouse_wheel_y(2.0)

    app.act(wheel)
    nearer = np.linalg.norm(np.subtract(app.scene.camera.eye, app.scene.camera.target))
    assert np.isclose(nearer, distance * 0.81)
    app.window.editor.selection = Selection.object(1)
    app.key(imgui.Key.f)
    assert np.allclose(app.scene.camera.target, (1.3, 0.5, 0.3), atol=1e-3)
    assert app.window.editor.undo_name is None
    assert not app.window.editor.is_modified


def move_and_turn_with_the_gizmo(app: Application, out: Path) -> None:
    centre = lights.centre_of(SCENE.lights[0])
    x, y = app.on_screen(centre)
    app.drag_at(x, y, 70.0, 0.0)
    light = app.scene.lights[0]
    assert light.outline is SCENE.lights[0].outline
    assert light.plane.origin[0] > SCENE.lights[0].plane.origin[0] + 0.2
    assert app.window.editor.steps == ("Open", "Move 'key'")
    app.key(CTRL | imgui.Key.z)
    assert app.scene == SCENE
    app.key(imgui.Key.e)
    assert app.window.viewport.tool == "rotate"
    app.settle()
    for radius in np.arange(40.0, 140.0, 4.0):
        app.drag_at(x + radius, y, 0.0, 50.0)
        if app.window.editor.undo_name is not None:
            break
        app.window.editor.look(SCENE.camera)
    assert app.window.editor.steps == ("Open", "Rotate 'key'")
    turned = app.scene.lights[0]
    assert np.allclose(lights.centre_of(turned), centre, atol=1e-5)
    assert np.isclose(np.linalg.norm(turned.plane.u), 1.0)


def aim_and_look_by_the_context_menu(app: Application, out: Path) -> None:
    place = (0.6, 0.0, 0.9)
    x, y = app.on_screen(place)

    def menu(item: str) -> None:
        def action(ctx) -> None:
            ctx.mouse_move_to_pos(imgui.ImVec2(x, y))
            ctx.yield_(2)
            ctx.mouse_click(1)
            ctx.item_click(f"//$FOCUSED/{item}")

        app.act(action)

    menu("###aim here")
    light = app.scene.lights[0]
    way = np.subtract(place, lights.centre_of(light))
    facing = planes.normal_of(light.plane)
    assert np.dot(way, facing) / np.linalg.norm(way) > 0.9999
    assert app.window.editor.steps == ("Open", "Aim 'key'")
    app.key(CTRL | imgui.Key.z)
    menu("Look here")
    assert np.allclose(app.scene.camera.target, place, atol=0.02)
    assert app.scene.lights == SCENE.lights


def every_panel_edits_the_scene(app: Application, out: Path) -> None:
    """One step for each control, and undone all is as it was."""

    def change(window: str, item: str, value: float | str) -> None:
        steps = len(app.window.editor.steps)
        app.act(lambda ctx: ctx.window_focus(f"//{window}"))
        app.act(lambda ctx: ctx.item_input_value(f"//{window}/**/{item}", value))
        assert len(app.window.editor.steps) == steps + 1, f"{window} {item}"

    def press(window: str, item: str) -> None:
        steps = len(app.window.editor.steps)
        app.act(lambda ctx: ctx.window_focus(f"//{window}"))
        app.act(lambda ctx: ctx.item_click(f"//{window}/**/{item}"))
        assert len(app.window.editor.steps) == steps + 1, f"{window} {item}"

    change("Light", "##radiance", 7.0)
    assert max(app.scene.lights[0].radiance) == 7.0
    change("Light", "##azimuth", 30.0)
    change("Light", "##elevation", -20.0)
    normal = planes.normal_of(app.scene.lights[0].plane)
    assert np.isclose(np.degrees(np.arcsin(normal[1])), -20.0, atol=1e-3)
    assert np.isclose(np.degrees(np.arctan2(normal[0], normal[2])), 30.0, atol=1e-3)
    press("Light", "##two-sided")
    press("Light", "Aim at centre")
    press("Light", "Flip side")
    change("Display", "##exposure", -1.5)
    app.window.editor.selection = Selection.object(1)
    app.frame()
    press("Material", "Gold")
    assert app.scene.materials[1].f0 == (1.0, 0.71, 0.29)
    change("Material", "##name", "brass")
    assert app.scene.objects[1].material == "brass"
    change("Object", "##name", "orb")
    steps = len(app.window.editor.steps) - 1
    app.act(lambda ctx: ctx.window_focus("//Material"))
    for _ in range(steps):
        app.key(CTRL | imgui.Key.z)
    assert app.scene == SCENE


def see_the_cost(app: Application, out: Path) -> None:
    """The view is chosen in the Display panel; its legend stands over the picture."""

    def choose(view: str) -> None:
        app.act(lambda ctx: ctx.window_focus("//Display"))
        app.act(lambda ctx: ctx.item_click("//Display/##view"))
        app.act(lambda ctx: ctx.item_click(f"//$FOCUSED/{view}"))
        app.settle()

    before, viewport = app.picture(), app.window.viewport
    choose("cost")
    assert viewport.settings.view == "cost"
    # A quadrilateral cut by the ball's horizon takes five edges for each of two lobes.
    assert app.window.renderer.radiance().max() == 10.0
    lower_left = app.pixels()[-200:, : viewport.view.pixels[0]].reshape(-1, 3)
    for colour in (VIRIDIS[0], VIRIDIS[-1]):
        assert np.abs(lower_left - np.array(colour, float)).max(axis=1).min() <= 8.0
    choose("radiance")
    assert np.array_equal(app.picture(), before)


def watch_the_noise_fall(app: Application, out: Path) -> None:
    """The status bar tells the error of random samples as they gather, and of nothing else."""
    picture = app.window.viewport.picture
    assert picture.noise is None
    found = []
    for samples in (2, 16):
        settings = app.window.viewport.settings
        app.window.viewport.settings = replace(settings, technique="reference", samples=samples)
        app.settle()
        assert picture.noise is not None
        assert picture.noise.samples == picture.samples[0] == samples
        assert picture.seconds > 0.0
        found.append(picture.noise.relative)
    assert found[1] < 0.6 * found[0]
    app.window.viewport.settings = replace(app.window.viewport.settings, technique="ltc")
    app.settle()
    assert picture.noise is None


def skip_faint_lights(app: Application, out: Path) -> None:
    def choose(share: str) -> None:
        app.act(lambda ctx: ctx.window_focus("//Display"))
        app.act(lambda ctx: ctx.item_click("//Display/##skip"))
        app.act(lambda ctx: ctx.item_click(f"//$FOCUSED/{share}"))
        app.settle()

    viewport, renderer = app.window.viewport, app.window.renderer
    try:
        choose("up to 1\\/256 of white")
        assert viewport.settings.cull == 1 / 256
        skipped, passes = renderer.radiance(), renderer.lighting_passes
        app.enter("##exposure", 1.0)
        app.settle()
        assert renderer.lighting_passes > passes, "what is too faint depends on it"
        app.key(CTRL | imgui.Key.z)
        choose("nothing")
        assert viewport.settings.cull == 0.0
        missing = np.abs(renderer.radiance() - skipped).max()
        assert 0.0 < missing <= 1.001 / 256 * 2.0**-SCENE.display.exposure
    finally:
        viewport.settings = replace(viewport.settings, cull=0.0)


def save_reload_compare(app: Application, out: Path) -> None:
    path = out / "saved.json"
    app.drag("vertex 0.2", 30.0, -20.0)
    app.act(lambda ctx: ctx.item_input_value("//Light/light key/##radiance", 2.5))
    app.window.documents.save_as(path)
    assert not app.window.editor.is_modified
    app.frame()
    assert app.window.title.startswith("saved.json —")
    saved, picture = app.scene, app.picture()
    app.drag("vertex 0.0", -30.0, 20.0)
    app.key(CTRL | imgui.Key.s)
    assert load_scene(path) == app.scene
    app.key(CTRL | imgui.Key.z)
    app.key(CTRL | imgui.Key.s)
    app.window.show(SCENE, None)
    app.window.documents.load(path)
    assert app.scene == saved
    assert app.window.editor.path == path
    assert np.array_equal(app.picture(), picture)


def save_and_open_by_the_dialog(app: Application, out: Path) -> None:
    folder = out / "scenes"
    folder.mkdir()
    (folder / "notes.txt").write_text("not a scene")
    app.click("###add hole")
    app.click("Square hole")
    edited = app.scene
    app.key(CTRL | imgui.Key.s)
    field = "//Save the scene/##name"
    app.act(lambda ctx: ctx.item_input_value(field, str(folder / "mine")))
    app.frame()
    assert load_scene(folder / "mine.json") == edited
    assert not app.window.editor.is_modified
    app.window.show(SCENE, folder / "other.json")
    app.key(CTRL | imgui.Key.o)
    files = app.window.dialogs._inside._files
    assert [file.name for file in files] == ["mine.json"]
    app.click("mine.json")
    app.click("###accept file")
    app.frame()
    assert app.scene == edited
    app.key(CTRL | imgui.Key.o)
    app.key(imgui.Key.escape)
    assert not app.window.dialogs.is_open
    assert app.scene == edited


def same_picture_as_headless(app: Application, out: Path) -> None:
    picture = app.picture()
    shot = app.window.viewport.picture.shot
    assert shot is not None
    shot = replace(shot, settings=replace(shot.settings, samples=SAMPLES))
    (out / "shot.pickle").write_bytes(pickle.dumps(shot))
    np.save(out / "picture.npy", picture)


def idle_when_nothing_changes(app: Application, out: Path) -> None:
    passes = app.window.renderer.lighting_passes
    assert app.window.viewport.picture.samples == (SAMPLES, SAMPLES)
    for _ in range(100):
        app.frame()
    assert app.window.renderer.lighting_passes == passes
    app.enter("##exposure", 1.0)
    app.settle()
    assert app.window.renderer.lighting_passes == passes, "exposure needs no lighting"
    app.act(lambda ctx: ctx.item_input_value("//Light/light key/##radiance", 2.0))
    app.settle()
    assert app.window.renderer.lighting_passes > passes


def fewer_samples_than_there_are(app: Application, out: Path) -> None:
    """Wanting fewer samples than were gathered leaves nothing to do, and draws nothing."""
    window, passes = app.window, app.window.renderer.lighting_passes
    window.viewport.settings = replace(window.viewport.settings, samples=1)
    app.settle()
    assert window.viewport.picture.samples == (SAMPLES, SAMPLES)
    for _ in range(20):
        app.frame()
    assert window.renderer.lighting_passes == passes
    window.viewport.settings = replace(window.viewport.settings, samples=SAMPLES + 1)
    app.settle()
    assert window.viewport.picture.samples == (SAMPLES + 1, SAMPLES + 1)
    assert window.renderer.lighting_passes == passes + 1


def read_the_plan(app: Application, out: Path) -> None:
    """The panel holds what ``explain`` prints, and follows the scene."""
    drawn = []
    draw = window_module.plan_panel

    def record(report: PlanReport) -> None:
        drawn.append(report)
        draw(report)

    window_module.plan_panel = record
    try:
        app.click("###Plan")
        app.settle()
        _same_as_explained(app, drawn[-1])
        before = drawn[-1]
        app.window.editor.apply("Hide", edits.replace_light(SCENE, 0, HIDDEN))
        app.settle()
        app.frame()
        _same_as_explained(app, drawn[-1])
        assert "light shapes" in {row.name for row in before.sections[1].rows}
        assert "light shapes" not in {row.name for row in drawn[-1].sections[1].rows}
        assert any(row.why == "no light is visible" for row in drawn[-1].sections[-1].rows)
        count = len(drawn)
        app.frame()
        assert drawn[-1] is drawn[count - 1], "nothing is planned again for the same picture"
    finally:
        window_module.plan_panel = draw
        app.click("###Light")


def _same_as_explained(app: Application, report: PlanReport) -> None:
    shot = app.window.viewport.picture.shot
    assert shot is not None
    plan = app.window.renderer.plan(replace(shot, settings=app.window.viewport.settings))
    assert report == PlanReport(plan.title, plan.summary(), plan.sections())
    for section in report.sections:
        for line in section_lines(section):
            assert line in plan.text()


def export_pictures(app: Application, out: Path) -> None:
    for kind in ("png", "exr"):
        app.window.exports.start(out / f"picture.{kind}", Export(kind, 160, 90, 2))
        app.until(lambda: not app.window.exports.is_busy)
        assert (out / f"picture.{kind}").is_file()
    shot = replace(
        app.window.viewport.picture.shot,
        scene=SCENE,
        settings=replace(app.window.viewport.settings, samples=2),
        width=160,
        height=90,
    )
    (out / "export.pickle").write_bytes(pickle.dumps(shot))

    asked = []
    app.window.dialogs.ask_save = lambda *arguments: asked.append(arguments)
    app.key(CTRL | imgui.Key.e)
    app.click("###choose file")
    del app.window.dialogs.ask_save
    title, _, proposal, then = asked[0]
    assert title == "Export a picture"
    assert proposal.suffix == ".png"
    app.window.exports.form = Export("png", 64, 36, 1)
    then(out / "dialog.png")
    app.until(lambda: not app.window.exports.is_busy)
    assert (out / "dialog.png").is_file()
    app.window.exports.start(out / "missing" / "picture.png", Export("png", 16, 9, 1))
    app.until(lambda: not app.window.exports.is_busy)
    assert any("does not exist" in message.text for message in app.window.messages.shown)


def failures_become_messages(app: Application, out: Path) -> None:
    path = out / "broken.json"
    path.write_text('{"format": "ltc-scene/1", "ligths": []}')
    app.window.documents.load(path)
    assert any("ligths" in message.text for message in app.window.messages.shown)
    assert app.scene == SCENE
    app.window.dropped.append(str(out / "notes.txt"))
    app.frame()
    assert any("notes.txt" in message.text for message in app.window.messages.shown)
    missing = edits.add_object(SCENE, str(out / "missing.glb"), "missing")[0]
    app.window.editor.apply("Add a missing mesh", missing)
    app.settle()
    assert any("missing.glb" in message.text for message in app.window.messages.shown)
    app.key(CTRL | imgui.Key.z)
    app.settle()
    assert app.window.viewport.picture.samples == (SAMPLES, SAMPLES)


def meshes_can_be_dropped(app: Application, out: Path) -> None:
    path = out / "triangle.obj"
    path.write_text("v 0 0 0\nv 100 0 0\nv 0 100 0\nf 1 2 3\n")
    app.window.dropped.append(str(path))
    app.frame()
    assert app.scene.objects[-1].name == "triangle"
    assert np.isclose(app.scene.objects[-1].transform.scale[0], 0.01)
    app.settle()
    assert not [m for m in app.window.messages.shown if "triangle" in m.text and m.is_failure]


def unsaved_edits_are_asked_about(app: Application, out: Path) -> None:
    app.click("###add hole")
    app.click("Square hole")
    edited = app.scene
    app.key(CTRL | imgui.Key.q)
    app.click("###cancel")
    assert not app.window.params.app_shall_exit
    assert app.scene == edited
    app.key(CTRL | imgui.Key.s)
    assert app.window.dialogs.is_open
    assert not app.window.params.callbacks.confirm_exit(), "closing the window asks as well"
    app.click("###cancel")
    app.frame()
    assert not app.window.dialogs.is_open, "the question takes the place of the dialog"
    app.key(CTRL | imgui.Key.n)
    app.click("###discard")
    assert app.scene != edited
    assert [light.name for light in app.scene.lights] == ["light"]
    assert not app.window.editor.is_modified
    app.settle()


def names_and_visibility(app: Application, out: Path) -> None:
    app.act(lambda ctx: ctx.item_input_value("//Light/**/##name", "sun"))
    assert app.scene.lights[0].name == "sun"
    assert len(app.window.editor.steps) == 2, "typing a name is one step"
    app.click("###visible")
    assert not app.scene.lights[0].visible
    x, y = app.on_screen(lights.centre_of(SCENE.lights[0]))
    view = app.window.viewport.view
    assert app.picture()[round(y - view.y), round(x - view.x)].max() < 60
    app.key(CTRL | imgui.Key.z)
    app.key(CTRL | imgui.Key.z)
    assert app.scene == SCENE


def menus_open(app: Application, out: Path) -> None:
    def walk(ctx) -> None:
        ctx.set_ref("##MainMenuBar")
        ctx.menu_click("View/Outlines and handles")
        ctx.menu_click("View/Outlines and handles")

    app.act(walk)
    app.act(lambda ctx: (ctx.set_ref("##MainMenuBar"), ctx.menu_click("File/Open demo/###02-quad")))
    assert app.window.editor.path is None
    assert app.scene != SCENE
    for name in ("Camera", "Performance", "Display"):
        app.act(lambda ctx, name=name: ctx.window_focus(f"//{name}"))
    app.settle()


SCENARIOS = (
    drag_a_corner,
    press_a_corner_without_moving_it,
    escape_cancels_a_drag,
    change_roughness_by_its_slider,
    add_and_remove_a_corner,
    split_an_edge_by_double_click,
    cut_a_hole,
    add_copy_and_remove_lights,
    select_by_clicking,
    look_around,
    move_and_turn_with_the_gizmo,
    aim_and_look_by_the_context_menu,
    every_panel_edits_the_scene,
    see_the_cost,
    watch_the_noise_fall,
    skip_faint_lights,
    save_reload_compare,
    save_and_open_by_the_dialog,
    same_picture_as_headless,
    idle_when_nothing_changes,
    fewer_samples_than_there_are,
    read_the_plan,
    export_pictures,
    failures_become_messages,
    meshes_can_be_dropped,
    unsaved_edits_are_asked_about,
    names_and_visibility,
    menus_open,
    *outlines.SCENARIOS,
    *comparing.SCENARIOS,
    *lobes.SCENARIOS,
    *measuring.SCENARIOS,
    *picturing.SCENARIOS,
)


def main(out: Path, only: list[str]) -> None:
    results: dict[str, dict[str, object]] = {}
    app = Application(SCENE)
    for scenario in SCENARIOS:
        if only and scenario.__name__ not in only:
            continue
        began = time.perf_counter()
        failure = ""
        try:
            start(app)
            scenario(app, out)
        except Exception:
            failure = traceback.format_exc()
        results[scenario.__name__] = {
            "failure": failure,
            "seconds": time.perf_counter() - began,
        }
        (out / "results.json").write_text(json.dumps(results, indent=1))
    app.close()
    glfw.terminate()


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
