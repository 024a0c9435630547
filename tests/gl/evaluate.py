"""Evaluate functions of the shader library over arrays: one pixel, one call."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TypeAlias

import moderngl
import numpy as np
from numpy.typing import ArrayLike, NDArray

from app.render.assemble import assemble
from ltc.resources import resource_path

AnyTexture: TypeAlias = moderngl.Texture | moderngl.Texture3D | moderngl.TextureArray

_WIDTH = 256
_TYPES = {1: "float", 2: "vec2", 3: "vec3", 4: "vec4"}
_SWIZZLES = {1: ".x", 2: ".xy", 3: ".xyz", 4: ""}
_VERTEX = """#version 410 core
void main()
{
    gl_Position = vec4(vec2((gl_VertexID << 1) & 2, gl_VertexID & 2) * 2.0 - 1.0, 0.0, 1.0);
}
"""


def evaluate(
    ctx: moderngl.Context,
    folder: Path,
    includes: Sequence[str],
    body: str,
    inputs: Mapping[str, ArrayLike],
    features: Mapping[str, int] | None = None,
    tables: Mapping[str, NDArray[np.float32]] | None = None,
    prelude: str = "",
    layers: Mapping[str, NDArray[np.float16]] | None = None,
) -> NDArray[np.float64]:
    """Return ``result``, a vec4 that ``body`` assigns, for every row of the inputs.

    Parameters
    ----------
    folder : Path
        An empty directory for the entry shader.
    includes : sequence of str
        Library files, named from the shader root.
    body : str
        GLSL statements. Inputs are variables of their names: float, vec2, vec3, vec4.
    inputs : mapping of str to (n,) or (n, 1..4) array
        Converted to float32.
    tables : mapping of str to (rows, columns, channels) float32
        Textures that the body may name as samplers; with a depth before the rows
        they are volumes.
    prelude : str
        Functions that the library only declares.
    layers : mapping of str to (layers, rows, columns, channels) float16
        Array textures with linear filtering.

    Returns
    -------
    (n, 4) float64
    """
    arrays = {name: np.asarray(value, dtype=np.float32) for name, value in inputs.items()}
    arrays = {k: v[:, None] if v.ndim == 1 else v for k, v in arrays.items()}
    count = len(next(iter(arrays.values())))
    rows = -(-count // _WIDTH)
    layers = layers or {}
    samplers = [*arrays, *(tables or {})]
    lines = [f'#include "{name}"' for name in includes]
    for name in samplers:
        flat = name in arrays or (tables or {})[name].ndim == 3
        kind = "sampler2D" if flat else "sampler3D"
        lines.append(f"uniform {kind} {name}{'_in' if name in arrays else ''};")
    lines += [f"uniform sampler2DArray {name};" for name in layers]
    lines += ["layout(location = 0) out vec4 result;", prelude, "void main()", "{"]
    lines += ["ivec2 place = ivec2(gl_FragCoord.xy);", "result = vec4(0.0);"]
    for name, value in arrays.items():
        width = value.shape[1]
        fetch = f"texelFetch({name}_in, place, 0){_SWIZZLES[width]}"
        lines.append(f"{_TYPES[width]} {name} = {fetch};")
    lines += [body, "}"]
    (folder / "evaluate.frag").write_text("\n".join(lines), encoding="utf-8")
    source = assemble("evaluate.frag", features or {}, [folder, resource_path("shaders")])

    held: list[AnyTexture | moderngl.Framebuffer | moderngl.Program] = []
    try:
        program = ctx.program(vertex_shader=_VERTEX, fragment_shader=source.text)
        held.append(program)
        unit = 0
        for name, value in arrays.items():
            padded = np.zeros((rows * _WIDTH, 4), dtype=np.float32)
            padded[:count, : value.shape[1]] = value
            texture = ctx.texture((_WIDTH, rows), 4, padded.tobytes(), dtype="f4")
            held.append(texture)
            unit = _bind(program, f"{name}_in", texture, unit)
        for name, table in (tables or {}).items():
            *size, channels = table.shape
            make = ctx.texture if table.ndim == 3 else ctx.texture3d
            texture = make(tuple(size[::-1]), channels, table.tobytes(), dtype="f4")
            held.append(texture)
            unit = _bind(program, name, texture, unit)
        for name, table in layers.items():
            depth, height, width, channels = table.shape
            array = ctx.texture_array((width, height, depth), channels, table.tobytes(), dtype="f2")
            held.append(array)
            unit = _bind(program, name, array, unit, moderngl.LINEAR)
        target = ctx.texture((_WIDTH, rows), 4, dtype="f4")
        framebuffer = ctx.framebuffer([target])
        held += [target, framebuffer]
        framebuffer.use()
        ctx.disable(moderngl.BLEND | moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        vertices = ctx.vertex_array(program, [])
        vertices.render(moderngl.TRIANGLES, vertices=3)
        vertices.release()
        data = np.frombuffer(target.read(), dtype=np.float32)
        return data.reshape(-1, 4)[:count].astype(np.float64)
    finally:
        (ctx.screen or ctx.detect_framebuffer(0)).use()  # a released one must not stay bound
        for item in held:
            item.release()


def _bind(
    program: moderngl.Program,
    name: str,
    texture: AnyTexture,
    unit: int,
    filtering: int = moderngl.NEAREST,
) -> int:
    """Bind to the next unit if the program uses the sampler; return the next free unit."""
    texture.filter = (filtering, filtering)
    if name not in program:
        return unit
    texture.use(unit)
    program[name] = unit
    return unit + 1
