"""How things begin: the first scene, a new one, and what of a scene is shown first."""

from __future__ import annotations

from pathlib import Path

from app import edits, lights
from app.camera_control import project
from app.editor import NOTHING, Selection
from app.scene import Material, Scene, SceneObject, Transform
from app.scene_io import demo_scenes, load_scene


def new_scene() -> Scene:
    """Return what "New" shows: a glossy floor and one light over it."""
    floor = Material("floor", (0.25, 0.25, 0.25), (0.05, 0.05, 0.05), (0.0225, 0.0225))
    ground = SceneObject("floor", "plane", "floor", Transform(scale=(6.0, 6.0, 6.0)))
    return edits.add_light(Scene(materials=(floor,), objects=(ground,)))[0]


def first_scene(path: Path | None) -> tuple[Scene, Path | None]:
    """Return the scene to begin with and its file: the one asked for, a demo, or a new one.

    Raises
    ------
    InputError
        If the file that was asked for cannot be read.
    """
    if path is not None:
        return load_scene(path), path
    demo = next(iter(demo_scenes().values()), None)
    return (load_scene(demo) if demo is not None else new_scene()), None


def first_selection(scene: Scene) -> Selection:
    """Return the light with the fewest corners amid the picture: the one to try first."""
    shown = []
    for index, light in enumerate(scene.lights):
        at = project(scene.camera, lights.centre_of(light), 16.0, 9.0)
        if light.visible and at is not None and 1.0 < at[0] < 15.0 and 1.0 < at[1] < 8.0:
            shown.append((len(lights.vertices_of(light)), index))
    return Selection.light(min(shown)[1]) if shown else NOTHING


def first_material(scene: Scene) -> str:
    """Return the material to show first: that of a real thing, not of floor or wall, if any."""
    things = [item for item in scene.objects if item.mesh not in ("plane", "box")]
    return next((item.material for item in (*things, *scene.objects)), "")
