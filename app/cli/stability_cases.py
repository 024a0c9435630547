"""Worst cases of ``ltc-viewer stability`` as files that ``probe`` and ``shot`` take."""

from __future__ import annotations

import io
import shlex
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from app.files import replace_file
from app.render.techniques import find_technique
from app.scene import Camera, Material, Scene, SceneObject, Transform
from app.scene_io import scene_to_json
from app.stability.measure import Worst
from app.stability.points import FloatArray, Points, across
from app.vectors import quaternion_of

SURFACE = "surface"


@dataclass(frozen=True, slots=True)
class CaseFiles:
    """What was written of a worst case, and the commands that show it."""

    name: str
    what: str
    probe: str
    shot: str
    # Specular and diffuse at the first point.
    found: tuple[float, float]
    expected: tuple[float, float] | None

    def figures(self) -> dict[str, Any]:
        """Return it for ``results.json``."""
        return {
            "case": self.name, "what": self.what, "probe": self.probe, "shot": self.shot,
            "found": self.found, "expected": self.expected,
        }  # fmt: skip


def write_case(folder: Path, technique: str, worst: Worst, samples: int) -> CaseFiles:
    """Write a scene and points, ``cases/SWEEP--TECHNIQUE`` in a folder that is there.

    The scene has the light, and for a look a plate at the first point with the point's normal,
    tangent and alphas, seen from its viewer.
    """
    case = worst.case
    which = worst.which
    if case.points.anisotropic and not case.points.pick(which).anisotropic:
        # A lobe is looked up in the anisotropic table if another point of the file needs it.
        uneven = np.flatnonzero(case.points.alpha[:, 0] != case.points.alpha[:, 1])
        which = np.concatenate([which, uneven[:1]])
    points = case.points.pick(which)
    stem = folder / "cases" / f"{case.sweep}--{technique.replace(':', '-')}"
    buffer = io.BytesIO()
    np.savez(buffer, **points.inputs())  # type: ignore[arg-type]
    scene, array = stem.with_suffix(".json"), stem.with_suffix(".npz")
    for path, data in (
        (scene, scene_to_json(_with_plate(case.scene, points), None).encode("utf-8")),
        (array, buffer.getvalue()),
    ):
        replace_file(path, data, "a case")
    drawn = f" --samples {samples}" if find_technique(technique).is_sampled else ""
    paths = f"{shlex.quote(str(scene))} {shlex.quote(str(array))}"
    return CaseFiles(
        case.name,
        worst.what,
        f"ltc-viewer probe {paths} --technique {technique}{drawn} -o probed.npz",
        f"ltc-viewer shot {shlex.quote(str(scene))} --technique {technique}{drawn} -o shot.png",
        worst.found,
        worst.expected,
    )


def _with_plate(scene: Scene, points: Points) -> Scene:
    """Return the scene with a plate at the first of the points, and their viewer's camera.

    The light itself is not drawn: it would often hide the plate.
    """
    point = points.pick(slice(0, 1))
    p, n, t, view = (a[0] for a in (point.position, point.normal, point.tangent, point.view))
    size = float(np.clip(np.linalg.norm(scene.lights[0].plane.u), *PLATE_SIZES))
    material = Material(SURFACE, (1.0, 1.0, 1.0), (1.0, 1.0, 1.0), _numbers(point.alpha[0]))
    turn = quaternion_of(np.stack([t, n, np.cross(t, n)], axis=-1))
    plate = SceneObject("plate", "plane", SURFACE, Transform(_numbers(p), turn, (size,) * 3))
    up = across(view[None], n[None])[0]
    camera = Camera(_numbers(p + size * view), _numbers(p), _numbers(up))
    lights = tuple(replace(light, visible=False) for light in scene.lights)
    return replace(scene, materials=(material,), objects=(plate,), lights=lights, camera=camera)


PLATE_SIZES = (0.1, 10.0)
"""The plate is as large as the light, but neither smaller nor larger than these [m]."""


def _numbers(values: FloatArray) -> Any:
    return tuple(float(x) for x in values)
