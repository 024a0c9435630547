"""What leaving out saves: every demo scene takes less than one program for all scenes."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import pytest

from app.render.everything import KEPT, everything_on
from app.render.features import LightingFeatures, LightNeeds, Limits
from app.render.plan import make_plan
from app.render.plan_difference import difference_text
from app.render.programs import shader_roots
from app.scene import (
    AreaLight,
    Material,
    Outline,
    PolygonContour,
    RenderSettings,
    Scene,
    SceneObject,
    Shot,
)
from app.scene_io import demo_scenes, load_scene

LIMITS = Limits()
DARK = Material("m", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
SQUARE = Outline((PolygonContour(((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))),))
LEAST = Scene(
    (DARK,), (SceneObject("floor", "plane", "m"),), (AreaLight("key", SQUARE, visible=False),)
)
"""A scene that needs nothing but a light's record."""


def features(scene: Scene = LEAST, technique: str = "ltc") -> LightingFeatures:
    return LightingFeatures.of(scene, 1, LIMITS, technique)


def test_every_feature_is_forced_or_kept_for_a_reason() -> None:
    """A new feature that is forgotten here would make the comparison a lie."""
    needed, full = features(), everything_on(features())
    for record, forced in ((needed, full), (needed.lights, full.lights)):
        for field in fields(record):
            mine, theirs = getattr(record, field.name), getattr(forced, field.name)
            if field.name in KEPT:
                assert theirs == mine, field.name
            elif isinstance(mine, bool):
                assert theirs is True, field.name
            elif field.name not in ("uniform_materials", "lights"):
                assert theirs != mine, f"{field.name}: not forced, and not among KEPT"
    known = {field.name for record in (LightingFeatures, LightNeeds) for field in fields(record)}
    assert set(KEPT) <= known
    one_sided = features(replace(LEAST, materials=(replace(DARK, f0=(0.04,) * 3),)))
    assert one_sided.uniform_materials > 0
    assert everything_on(one_sided).uniform_materials == 0


def test_a_feature_of_a_new_kind_is_refused() -> None:
    @dataclass(frozen=True)
    class More(LightingFeatures):
        layers: int = 0

    old = features()
    new = More(*(getattr(old, field.name) for field in fields(LightingFeatures)))
    with pytest.raises(TypeError, match="feature 'layers': everything_on does not know"):
        everything_on(new)


def test_everything_is_the_same_for_all_scenes_but_for_what_is_kept() -> None:
    """One program, whatever the scene: that is what it stands for."""
    specs = set()
    for name in ("02-quad", "05-many-lights", "08-letters"):
        full = everything_on(features(load_scene(demo_scenes()[name])))
        specs.add(tuple(sorted(full.defines().items())))
    assert len(specs) == 1


@pytest.mark.parametrize("name", demo_scenes())
def test_every_demo_scene_takes_less(name: str) -> None:
    shot = Shot(load_scene(demo_scenes()[name]), RenderSettings(), 320, 180)
    plan = make_plan(shot, LIMITS, shader_roots())
    full = make_plan(shot, LIMITS, shader_roots(), everything=True)
    assert plan.lines < full.lines
    assert sum(p.characters for p in plan.programs) < sum(p.characters for p in full.programs)
    assert len(plan.attachments) < len(full.attachments)
    attached = [sum(part.bytes for part in p.attachments) for p in (plan, full)]
    assert attached[0] < attached[1]
    assert plan.bytes < full.bytes
    text = difference_text(plan, full)
    assert f"{plan.lines} " in text
    assert f"{full.lines} " in text
