"""What a scene needs is derived from it, rounded, and nothing else is compiled."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.errors import InputError
from app.render.features import LightingFeatures, Limits
from app.render.lighting import lighting_spec
from app.render.needs import needs_of
from app.render.plan import Plan, make_plan
from app.render.programs import ProgramSpec, shader_roots
from app.render.techniques import TECHNIQUES, find_technique
from app.scene import (
    AreaLight,
    Material,
    Outline,
    Plane,
    PolygonContour,
    RenderSettings,
    Scene,
    SceneObject,
    Shot,
)

LIMITS = Limits()
SQUARE = Outline((PolygonContour(((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))),))
KEY = AreaLight("key", SQUARE)
MATTE = Material("m", (0.5, 0.5, 0.5), (0.0, 0.0, 0.0))
GLOSSY = Material("m")
MIRROR = Material("m", (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))


def scene(material: Material = GLOSSY, *lights: AreaLight) -> Scene:
    return Scene((material,), (SceneObject("floor", "plane", "m"),), lights or (KEY,))


def features(of: Scene, samples: int = 1) -> LightingFeatures:
    return LightingFeatures.of(of, samples, LIMITS)


def plan(of: Scene, samples: int = 1) -> Plan:
    return make_plan(Shot(of, RenderSettings(samples=samples), 64, 32), LIMITS, shader_roots())


def lighting_text(of: Scene) -> str:
    return "".join(source.text for source in lighting_spec(features(of)).sources(shader_roots()))


def test_materials_decide_the_lobes() -> None:
    assert (features(scene(MATTE)).specular, features(scene(MATTE)).diffuse) == (False, True)
    assert (features(scene(MIRROR)).specular, features(scene(MIRROR)).diffuse) == (True, False)
    assert (features(scene(GLOSSY)).specular, features(scene(GLOSSY)).diffuse) == (True, True)


def test_materials_that_no_object_wears_do_not_count() -> None:
    unused = replace(scene(MATTE), materials=(MATTE, replace(MIRROR, name="unused")))
    assert features(unused) == features(scene(MATTE))


def test_lights_decide_sides_and_shapes() -> None:
    both = replace(KEY, name="both", two_sided=True)
    hidden = replace(KEY, visible=False)
    dark = replace(KEY, name="dark", radiance=(0.0, 0.0, 0.0), two_sided=True)
    f = features(scene(GLOSSY, KEY, both))
    assert f.lights.one_sided
    assert f.lights.two_sided
    assert not features(scene(GLOSSY, hidden)).shapes
    assert not features(scene(GLOSSY, KEY, dark)).lights.two_sided


def test_lights_without_an_inside_do_not_count() -> None:
    line = Outline((PolygonContour(((0.0, 0.0), (1.0, 0.0), (2.0, 0.0))),))
    flat = replace(KEY, name="flat", outline=line, two_sided=True)
    assert not features(scene(GLOSSY, KEY, flat)).lights.two_sided
    assert not features(scene(GLOSSY, flat)).lit


def test_nothing_to_see_needs_no_lighting_program() -> None:
    no_lights = replace(scene(), lights=())
    dark_and_hidden = scene(GLOSSY, replace(KEY, radiance=(0.0, 0.0, 0.0), visible=False))
    black = scene(Material("m", (0.0,) * 3, (0.0,) * 3), replace(KEY, visible=False))
    for empty in (no_lights, dark_and_hidden, black):
        needs = needs_of(empty, 16, LIMITS)
        assert not needs.lighting.lit
        assert needs.programs == ()
        assert [name for name, _ in needs.attachments] == ["radiance", "display"]


def test_values_compile_nothing() -> None:
    specs = {
        lighting_spec(
            features(
                scene(
                    replace(GLOSSY, alpha=(a, a), f0=(a, a, a), diffuse=(a, 0.0, 0.0)),
                    replace(KEY, radiance=(a, 2 * a, 3 * a), plane=Plane((a, 1.0, a))),
                )
            )
        )
        for a in (i / 100 for i in range(1, 101))
    }
    assert len(specs) == 1


def test_array_bounds_are_rounded() -> None:
    def spec(count: int) -> ProgramSpec:
        lights = [replace(KEY, name=str(i), plane=Plane((i, 0, 0))) for i in range(count)]
        return lighting_spec(features(scene(GLOSSY, *lights)))

    assert len({spec(n) for n in range(1, 9)}) == 4, "one each up to 1, 2, 4 and 8 lights"


def test_many_lights_move_to_a_texture() -> None:
    lights = [replace(KEY, name=str(i), plane=Plane((i, 0, 0))) for i in range(200)]
    assert features(scene(GLOSSY, *lights)).lights.uniform_texels == 0
    large = LightingFeatures.of(scene(GLOSSY, *lights), 1, Limits(uniform_block_bytes=65536))
    assert large.lights.texels <= large.lights.uniform_texels <= 65536 // 16
    # Every machine has room for a few lights in a block.
    assert features(scene(GLOSSY, *lights[:8])).lights.uniform_texels > 0


def test_too_much_is_one_sentence() -> None:
    small = Limits(texture_side=1)
    lights = [replace(KEY, name=str(i), plane=Plane((i, 0, 0))) for i in range(200)]
    with pytest.raises(InputError, match=r"lights: 200 lights with 800 edges .* at most 1024"):
        LightingFeatures.of(scene(GLOSSY, *lights), 1, small)
    objects = tuple(SceneObject(str(i), "plane", "m") for i in range(400))
    crowd = Scene((GLOSSY,), objects, (KEY,))
    with pytest.raises(InputError, match=r"objects: there are 400, expected at most 341"):
        LightingFeatures.of(crowd, 1, small)


def test_the_source_holds_only_what_is_needed() -> None:
    diffuse, mirror = lighting_text(scene(MATTE)), lighting_text(scene(MIRROR))
    for word in ("table", "lobe", "Lobe", "probe"):
        assert word not in diffuse
    assert "history" not in diffuse
    for word in ("probe", "bezier", "sampler2D light_texels", "sampler2D material_texels"):
        assert word not in mirror
    assert len(diffuse) < len(mirror)
    shapes_only = lighting_text(replace(scene(), objects=()))
    assert "shade_lights" not in shapes_only
    assert "material" not in shapes_only


def test_plans_differ_by_scene() -> None:
    lights = [replace(KEY, name=str(i), plane=Plane((i, 0, 0))) for i in range(300)]
    matte, glossy, many = plan(scene(MATTE)), plan(scene()), plan(scene(GLOSSY, *lights), 4)
    assert matte.tables == ()
    assert [table.name for table in glossy.tables] == ["table_residual", "table_albedo"]
    assert "uniform block" in glossy.buffers[-2].form
    assert "texture" in many.buffers[-2].form
    assert len(many.attachments) == len(glossy.attachments) + 1
    assert {left.what for left in matte.left_out} > {"specular shading", "tables of the technique"}
    assert not {left.what for left in many.left_out} & {"specular shading", "diffuse shading"}
    assert matte.bytes < glossy.bytes < many.bytes
    saved = sum(left.bytes for left in matte.left_out if left.what == "tables of the technique")
    assert matte.bytes + saved == glossy.bytes
    for p in (matte, glossy, many):
        assert p.title in p.text()
        assert all(left.why in p.text() for left in p.left_out)


def test_equal_features_are_equal_keys() -> None:
    assert lighting_spec(features(scene())) == lighting_spec(
        features(
            replace(
                scene(), objects=(SceneObject("a", "box", "m"), SceneObject("b", "sphere", "m"))
            )
        )
    )


def test_techniques() -> None:
    find_technique("ltc")
    assert all(
        description and "\n" not in description
        for description in (t.description for t in TECHNIQUES.values())
    )
    with pytest.raises(InputError, match=r"technique 'lct' is unknown.*did you mean 'ltc'"):
        find_technique("lct")
