"""Every member of the packed layouts, read back by the shaders' own accessors."""

from __future__ import annotations

from pathlib import Path

import moderngl
import numpy as np
import pytest
from numpy.typing import NDArray

from app.render.features import LightNeeds, Limits
from app.render.pack import (
    LIGHT_HEADER,
    edges_of,
    light_geometry,
    pack_lights,
    pack_materials,
)
from app.render.programs import Programs, ProgramSpec, shader_roots
from app.render.state import FullScreenTriangle, begin_pass, release_framebuffer
from app.render.storage import TexelStorage
from app.scene import AreaLight, Material, Plane
from tests.gl.scenes import FRAME, SQUARE

LIGHTS = tuple(
    AreaLight(
        f"light {i}",
        FRAME if i % 2 else SQUARE,
        Plane((0.1 * i, 1.0, -2.0 - i), (1.0 + i, 0.3, 0.0), (0.2, 0.7, 0.1 * i)),
        (1.0 + i, 2.0 + i, 3.0 + i),
        two_sided=i % 3 == 0,
    )
    for i in range(5)
)
MATERIALS = tuple(
    Material(
        str(i),
        (0.1 * i, 0.2, 0.3),
        (0.4, 0.05 * i, 0.6),
        (0.1 + 0.1 * i, 0.9 - 0.1 * i),
        rotation=0.5 * i,
    )
    for i in range(5)
)


def echo(
    ctx: moderngl.Context, folder: Path, storage: TexelStorage, features: dict[str, int], code: str
) -> NDArray[np.float32]:
    """Return the (rows, columns, 4) values that a fragment shader makes of a storage.

    ``code`` assigns ``value`` from ``row`` and ``column``.
    """
    (folder / "echo.frag").write_text(
        f"{code}\nlayout(location = 0) out vec4 value;\n"
        "void main()\n{\n    value = echo(int(gl_FragCoord.y), int(gl_FragCoord.x));\n}\n",
        encoding="utf-8",
    )
    programs = Programs(ctx, (folder, *shader_roots()))
    program = programs.get(ProgramSpec.of("echo", "passes/fullscreen.vert", "echo.frag", features))
    target = ctx.framebuffer([ctx.texture((8, 5), 4, dtype="f4")])
    begin_pass(target, target.size)
    storage.bind(program, 0)
    triangle = FullScreenTriangle(ctx)
    triangle.draw(program)
    data = np.frombuffer(target.read(components=4, dtype="f4"), dtype=np.float32)
    texture = target.color_attachments[0]
    release_framebuffer(target)
    for thing in (triangle, texture, programs):
        thing.release()
    return data.reshape(5, 8, 4)


@pytest.mark.parametrize("block_bytes", [16384, 0], ids=["uniform block", "texture"])
def test_lights(ctx: moderngl.Context, tmp_path: Path, block_bytes: int) -> None:
    needs = LightNeeds.of(LIGHTS, Limits(uniform_block_bytes=block_bytes))
    assert (needs.uniform_texels > 0) == (block_bytes > 0)
    storage = TexelStorage(ctx, "light", "Lights")
    storage.update(pack_lights(LIGHTS), needs.uniform_texels)
    code = """
#include "common/light_data.glsl"
#include "passes/light_storage.glsl"
vec4 echo(int row, int column)
{
    PlanarLight light = light_at(row);
    if (column == 0) { return vec4(light.origin, light.radius); }
    if (column == 1) { return vec4(light.u, float(light.part_count)); }
    if (column == 2) { return vec4(light.v, float(light.first_part)); }
    if (column == 3) { return vec4(light.radiance, light.two_sided ? 1.0 : 0.0); }
    if (column == 4) { return light_texel(light.first_part); }
    return vec4(0.0);
}
"""
    got = echo(ctx, tmp_path, storage, {**needs.defines(), "HAS_PICTURES": 0}, code)
    storage.release()
    for i, light in enumerate(LIGHTS):
        geometry = light_geometry(light)
        u, v = np.array(light.plane.u), np.array(light.plane.v)
        normal = np.cross(u, v) / np.linalg.norm(np.cross(u, v))
        np.testing.assert_allclose(got[i, 0, :3], geometry.origin, rtol=1e-6)
        assert got[i, 0, 3] == pytest.approx(geometry.radius, rel=1e-6)
        np.testing.assert_allclose(got[i, 1, :3], u / np.linalg.norm(u), atol=1e-7)
        np.testing.assert_allclose(np.cross(got[i, 1, :3], got[i, 2, :3]), normal, atol=1e-6)
        assert got[i, 1, 3] == geometry.parts == (8 if i % 2 else 4)
        assert got[i, 2, 3] >= len(LIGHTS) * LIGHT_HEADER.itemsize // 16
        np.testing.assert_array_equal(got[i, 3], [*light.radiance, float(light.two_sided)])
        np.testing.assert_allclose(got[i, 4], edges_of(geometry.loops)[0], rtol=1e-6)
        # The outline's first corner in the world, from the packed numbers alone.
        corner = got[i, 0, :3] + got[i, 4, 0] * got[i, 1, :3] + got[i, 4, 1] * got[i, 2, :3]
        on_plane = np.linalg.solve(np.stack([u, v, normal], axis=1), corner - light.plane.origin)
        assert np.abs(on_plane[:2]).max() == pytest.approx(1.0, abs=1e-5)
        assert on_plane[2] == pytest.approx(0.0, abs=1e-5)


@pytest.mark.parametrize("uniform_texels", [16, 0], ids=["uniform block", "texture"])
def test_materials(ctx: moderngl.Context, tmp_path: Path, uniform_texels: int) -> None:
    storage = TexelStorage(ctx, "material", "Materials")
    storage.update(pack_materials(MATERIALS), uniform_texels)
    features = {
        "HAS_TANGENTS": 0,
        "MATERIAL_STORAGE_UNIFORM": int(uniform_texels > 0),
        "MATERIAL_TEXELS": uniform_texels,
        "STORAGE_TEXTURE_WIDTH": 1024,
    }
    code = """
#include "passes/material_storage.glsl"
vec4 echo(int row, int column)
{
    MaterialSample material = material_of_object(row);
    if (column == 0) { return vec4(material.diffuse, material_texel(3 * row).a); }
    if (column == 1) { return vec4(material.f0, 0.0); }
    return vec4(material.alpha, 0.0, 0.0);
}
"""
    got = echo(ctx, tmp_path, storage, features, code)
    storage.release()
    for i, material in enumerate(MATERIALS):
        np.testing.assert_allclose(got[i, 0], [*material.diffuse, material.rotation], rtol=1e-6)
        np.testing.assert_allclose(got[i, 1, :3], material.f0, rtol=1e-6)
        np.testing.assert_allclose(got[i, 2, :2], material.alpha, rtol=1e-6)
