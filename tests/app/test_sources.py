"""Lights of presets, text and drawings: made, made again, and named in the history."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app import edits, lights, planes, sources
from app.editor import Editor, Selection
from app.errors import InputError
from app.gui.beginning import new_scene
from app.gui.file_types import DRAWING_FILES
from app.gui.imports import Imports
from app.gui.messages import Messages
from app.presets import PRESETS
from app.scene import Scene, SvgSource, TextSource
from app.step_names import describe
from app.vectors import cross, dot, length, subtract
from ltc.resources import resource_path
from tests.app.test_documents import Chooser

SCENE = new_scene()
FONT = resource_path("assets", "fonts", "SourceSans3-Bold.otf")
DRAWING = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 20 10">
<rect x="0" y="0" width="20" height="10"/>{}</svg>"""


@pytest.fixture
def drawing(tmp_path: Path) -> Path:
    path = tmp_path / "logo.svg"
    path.write_text(DRAWING.format(""))
    return path


def facing_the_eye(scene: Scene, index: int) -> float:
    """Return the cosine between a light's normal and the direction to the eye."""
    plane = scene.lights[index].plane
    way = subtract(scene.camera.eye, plane.origin)
    return dot(planes.normal_of(plane), way) / length(way)


@pytest.mark.parametrize("name", PRESETS)
def test_a_preset_is_as_large_as_a_new_light_and_faces_the_eye(name: str) -> None:
    scene, index = edits.add_preset(SCENE, name)
    light = scene.lights[index]
    assert light.name == name.lower()
    assert lights.size_of(light) == pytest.approx(edits.new_size(SCENE.camera))
    assert lights.centre_of(light) == pytest.approx(light.plane.origin, abs=1e-9)
    assert facing_the_eye(scene, index) > 0.5
    assert describe(SCENE, scene) == f"Add light '{name.lower()}'"


def test_new_lights_are_upright_and_not_mirrored_for_who_looks() -> None:
    scene, index = edits.add_text(SCENE, "F")
    plane, camera = scene.lights[index].plane, scene.camera
    right = cross(subtract(camera.target, camera.eye), camera.up)
    assert dot(plane.u, right) > 0.0
    assert dot(plane.v, camera.up) > 0.0


def test_a_text_is_made_again_and_keeps_its_place(drawing: Path) -> None:
    scene, index = edits.add_text(SCENE, "Ab")
    light = scene.lights[index]
    assert isinstance(light.source, TextSource)
    longer = sources.remade(light, replace(light.source, text="Abba"))
    assert len(longer.outline.contours) > len(light.outline.contours)
    assert longer.plane == light.plane
    assert sources.remade(longer, light.source) == light
    drawn = sources.remade(light, SvgSource(str(drawing), 2.0))
    assert lights.extent_of(drawn) == ((-1.0, -0.5), (1.0, 0.5))
    with pytest.raises(InputError, match="empty"):
        sources.remade(light, replace(light.source, text=" "))


def test_another_size_is_the_same_shape_without_reading_the_file(drawing: Path) -> None:
    scene, index = edits.add_drawing(SCENE, str(drawing))
    light = scene.lights[index]
    assert light.name == "logo"
    wanted = sources.remade(light, SvgSource(str(drawing), 3.0))
    drawing.unlink()
    got = sources.resized(light, 3.0)
    assert got.source == wanted.source
    assert np.allclose(lights.extent_of(got), lights.extent_of(wanted), atol=1e-12)
    plain = replace(light, source=None)
    assert sources.resized(plain, 3.0) is plain


def test_a_turned_text_can_be_read_from_the_other_side() -> None:
    scene, index = edits.add_text(SCENE, "F")
    light = scene.lights[index]
    turned = lights.flip_light(light)
    assert turned.outline is light.outline
    assert turned.source == light.source
    assert lights.centre_of(turned) == pytest.approx(lights.centre_of(light), abs=1e-12)
    facing = dot(planes.normal_of(light.plane), planes.normal_of(turned.plane))
    assert facing == pytest.approx(-1.0)
    assert turned.plane.v == pytest.approx(light.plane.v)


def test_steps_name_what_of_a_source_changed(drawing: Path) -> None:
    scene, index = edits.add_text(SCENE, "a")
    light = scene.lights[index]
    assert isinstance(light.source, TextSource)

    def named(**change) -> str:
        after = sources.remade(light, replace(light.source, **change))
        return describe(scene, edits.replace_light(scene, index, after))

    assert named(text="b") == "Change text of 'text'"
    assert named(font=str(FONT)) == "Change font of 'text'"
    assert named(line_height=2.0) == "Change line height of 'text'"
    assert named(align="left") == "Change alignment of 'text'"
    drawn = edits.replace_light(scene, index, sources.remade(light, SvgSource(str(drawing))))
    assert describe(scene, drawn) == "Make 'text' anew"
    drawing.write_text(DRAWING.format('<rect x="30" width="10" height="10"/>'))
    again = sources.remade(drawn.lights[index], SvgSource(str(drawing)))
    assert describe(drawn, edits.replace_light(drawn, index, again)) == "Reload 'text'"
    shaped = edits.replace_light(scene, index, lights.remove_contour(light, 0))
    assert describe(scene, shaped) == "Remove outline of 'text'"


# --- files --------------------------------------------------------------------


class Desk:
    """Imports and what they work on."""

    def __init__(self) -> None:
        self.editor, self.messages, self.chooser = Editor(SCENE), Messages(), Chooser()
        self.imports = Imports(self.editor, self.messages, self.chooser)

    @property
    def said(self) -> list[str]:
        return [message.text for message in self.messages.shown]

    @property
    def source(self):
        light = self.editor.selected_light
        assert light is not None
        return light.source


def test_a_dropped_drawing_is_a_light_and_says_what_is_missing(tmp_path: Path) -> None:
    desk, path = Desk(), tmp_path / "logo.svg"
    path.write_text(DRAWING.format("<text>hello</text>"))
    assert desk.imports.take(path)
    assert desk.editor.selection == Selection.light(1)
    assert desk.source == SvgSource(str(path), desk.source.size)
    assert desk.editor.steps == ("Open", "Add light 'logo'")
    assert desk.said[0].startswith("logo.svg: left out text")
    path.write_text("<svg")
    assert desk.imports.take(path)
    assert len(desk.editor.scene.lights) == 2
    assert len(desk.said) == 2
    desk.editor.undo()
    assert desk.editor.scene == SCENE


def test_a_dropped_font_sets_the_selected_text_or_a_new_one(tmp_path: Path) -> None:
    desk = Desk()
    own = tmp_path / "own.otf"
    own.write_bytes(FONT.read_bytes())
    assert desk.imports.take(own)
    assert desk.source.font == str(own)
    desk.editor.apply("type", edits.add_text(SCENE, "words")[0])
    desk.editor.selection = Selection.light(1)
    assert desk.imports.take(own)
    assert (desk.source.text, desk.source.font) == ("words", str(own))
    assert desk.editor.undo_name == "Change font of 'text'"
    before = desk.editor.scene
    broken = tmp_path / "broken.ttf"
    broken.write_bytes(b"no font")
    assert desk.imports.take(broken)
    assert desk.editor.scene is before
    assert "broken.ttf" in desk.said[0]


def test_fonts_and_drawings_are_asked_for_beside_the_ones_there_are(
    tmp_path: Path, drawing: Path
) -> None:
    desk = Desk()
    desk.chooser.path = drawing
    desk.imports.ask_drawing()
    assert desk.source.path == str(drawing)
    other = tmp_path / "other.svg"
    other.write_text(DRAWING.format('<rect x="30" width="10" height="10"/>'))
    desk.chooser.path = other
    desk.imports.ask_source(desk.editor.scene.lights[1])
    assert desk.chooser.proposals[-1] == tmp_path
    assert desk.source.path == str(other)
    assert desk.editor.undo_name == "Change drawing of 'logo'"
    desk.editor.apply("text", edits.add_text(desk.editor.scene)[0])
    desk.editor.selection = Selection.light(2)
    desk.chooser.path = FONT
    desk.imports.ask_source(desk.editor.scene.lights[2])
    assert desk.source.font == str(FONT)
    assert desk.said == []
    assert DRAWING_FILES[1] == (".svg",)
