"""Scene files in the window: open, save, drop, and the question before a loss."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from app.editor import NOTHING, Editor, Selection
from app.gui.beginning import first_material, first_selection, new_scene
from app.gui.documents import Documents
from app.gui.file_types import FileType
from app.gui.imports import Imports
from app.gui.messages import Messages
from app.scene import Scene
from app.scene_io import demo_scenes, load_scene, save_scene


class Chooser:
    """Answers with a path, or as if cancelled if it has none."""

    def __init__(self) -> None:
        self.path: Path | None = None
        self.proposals: list[Path] = []

    def ask_open(
        self, title: str, kind: FileType, folder: Path, then: Callable[[Path], None]
    ) -> None:
        self.ask_save(title, kind, folder, then)

    def ask_save(
        self, title: str, kind: FileType, proposal: Path, then: Callable[[Path], None]
    ) -> None:
        self.proposals.append(proposal)
        if self.path is not None:
            then(self.path)


class Desk:
    """Documents and what they work on."""

    def __init__(self) -> None:
        self.editor, self.messages, self.chooser = Editor(new_scene()), Messages(), Chooser()
        self.imports = Imports(self.editor, self.messages, self.chooser)
        self.documents = Documents(
            self.editor, self.messages, self.chooser, self.imports, self.editor.open
        )

    def edit(self) -> Scene:
        scene = replace(self.editor.scene, lights=())
        self.editor.apply("Edit", scene)
        return scene

    @property
    def said(self) -> list[str]:
        return [message.text for message in self.messages.shown]


@pytest.fixture
def desk() -> Desk:
    return Desk()


def test_nothing_is_asked_without_unsaved_edits(desk: Desk) -> None:
    done = []
    desk.documents.unless_unsaved(lambda: done.append(1))
    assert done
    assert desk.documents.question is None


@pytest.mark.parametrize(("answer", "goes_on"), [("discard", True), ("cancel", False)])
def test_unsaved_edits_are_asked_about_once(desk: Desk, answer, goes_on: bool) -> None:
    edited = desk.edit()
    desk.documents.new()
    assert desk.editor.scene == edited
    assert desk.documents.question == "Save the changes to this scene first?"
    desk.documents.answer(answer)
    assert desk.documents.question is None
    assert (desk.editor.scene == new_scene()) == goes_on


def test_saving_first_asks_for_a_name_and_then_goes_on(desk: Desk, tmp_path: Path) -> None:
    edited = desk.edit()
    desk.documents.new()
    desk.documents.answer("save")
    assert desk.editor.scene == edited, "cancelled: nothing is lost"
    desk.chooser.path = tmp_path / "mine.json"
    desk.documents.new()
    desk.documents.answer("save")
    assert load_scene(tmp_path / "mine.json") == edited
    assert desk.editor.scene == new_scene()


def test_what_cannot_be_saved_is_not_lost(desk: Desk, tmp_path: Path) -> None:
    edited = desk.edit()
    desk.chooser.path = tmp_path / "missing" / "mine.json"
    desk.documents.new()
    desk.documents.answer("save")
    assert desk.editor.scene == edited
    assert desk.editor.is_modified
    assert "does not exist" in desk.said[0]


def test_a_demo_opens_without_a_file_and_a_file_with_it(desk: Desk, tmp_path: Path) -> None:
    desk.documents.open(next(iter(demo_scenes().values())))
    assert desk.editor.path is None
    own = tmp_path / "own.json"
    save_scene(new_scene(), own)
    desk.documents.open(own)
    assert desk.editor.path == own
    desk.edit()
    desk.documents.save()
    assert desk.chooser.proposals == []
    assert load_scene(own).lights == ()


def test_dropped_files_are_opened_added_or_refused(desk: Desk, tmp_path: Path) -> None:
    mesh, text = tmp_path / "wide.obj", tmp_path / "notes.txt"
    mesh.write_text("v 0 2 0\nv 100 2 0\nv 0 102 0\nf 1 2 3\n")
    desk.documents.drop([str(mesh), str(text)])
    item = desk.editor.scene.objects[-1]
    assert desk.editor.selection == Selection.object(len(desk.editor.scene.objects) - 1)
    assert item.transform.scale == pytest.approx((0.01, 0.01, 0.01))
    assert item.transform.translate == pytest.approx((0.0, -0.02, 0.0)), "it stands on the ground"
    assert desk.said == [
        "notes.txt: found '.txt', expected a scene (.json), or a mesh, a drawing, a font or a "
        "picture (.glb, .gltf, .obj, .ply, .stl, .svg, .ttf, .otf, .ttc, .otc, .woff, .woff2, "
        ".png, .jpg, .jpeg, .webp, .gif, .tif, .tiff, .exr, .hdr)"
    ]


def test_a_failure_of_the_program_itself_becomes_a_message(capsys) -> None:
    messages = Messages()
    with messages.guard():
        raise KeyError("x")
    assert messages.shown[0].text == "Something went wrong: 'x'"
    assert "KeyError" in capsys.readouterr().err


def test_the_first_look_is_at_a_light_in_the_picture() -> None:
    scene = new_scene()
    assert first_selection(scene) == Selection.light(0)
    assert first_material(scene) == "floor"
    dark = replace(scene, lights=tuple(replace(light, visible=False) for light in scene.lights))
    assert first_selection(dark) == NOTHING
    assert first_material(Scene()) == ""
