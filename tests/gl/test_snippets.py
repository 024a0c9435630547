"""Exported shader code gives the lobes that Python gives: GLSL and WGSL run, HLSL compiled."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path

import moderngl
import numpy as np
import pytest

from ltc import brdf, transform
from ltc.anisotropic import AnisotropicTable, node_views, stretched_length, tied
from ltc.export import snippet, textures
from ltc.formats import AnisotropicGrid, Grid, IsotropicGrid
from ltc.table import load_isotropic
from tests.gl.evaluate import evaluate

COUNT = 1500
KINDS = ("isotropic", "anisotropic")
CALLS = {
    "isotropic": "ltc_lobe(residual, albedo, alpha, s, c)",
    "anisotropic": "ltc_lobe(residual_1, residual_2, albedo, alpha, ratio, v)",
}


@cache
def table(kind: str) -> Grid:
    """Return the shipped isotropic table, or a rough anisotropic one with a lively residual."""
    if kind == "isotropic":
        return IsotropicGrid.of(load_isotropic())
    shape = (3, 4, 5, 4)
    ax, ay, v = node_views(shape)
    v[..., 2] = np.maximum(v[..., 2], 1e-7 * ax)
    A, B = brdf.directional_albedo(v, ax, ay, step=0.3)
    A = np.minimum(A, 1.0)
    u = (1.0 - (B / A) ** 0.2) / stretched_length(ax, ay, v)
    X = np.random.default_rng(5).uniform(-0.15, 0.15, (4, 3, 4, 5, 7))
    halves = [tied(x, i == 0).astype(np.float16) for i, x in enumerate((X, A, np.maximum(u, 0.0)))]
    return AnisotropicGrid(AnisotropicTable(*halves))


def cases(kind: str) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(7)

    def single(x: np.ndarray) -> np.ndarray:
        return x.astype(np.float32).astype(np.float64)

    theta = np.radians(
        np.where(
            rng.random(COUNT) < 0.7,
            rng.uniform(0.0, 89.0, COUNT),
            90.0 - 10.0 ** rng.uniform(-2.0, 0.0, COUNT),
        )
    )
    alpha = single(10.0 ** rng.uniform(-4.0, 0.0, COUNT))
    if kind == "isotropic":
        return {"alpha": alpha, "s": single(np.sin(theta)), "c": single(np.cos(theta))}
    phi = rng.uniform(-np.pi, np.pi, COUNT)
    phi[:40] = np.repeat([0.0, np.pi / 2, np.pi, -np.pi / 2], 10)  # the seams
    theta[:3] = 0.0
    s = np.sin(theta)
    v = single(np.stack([s * np.cos(phi), s * np.sin(phi), np.cos(theta)], axis=-1))
    other = single(10.0 ** rng.uniform(-4.0, 0.0, COUNT))
    other[40:60] = alpha[40:60]
    return {"alpha": alpha, "ratio": other, "v": v}


def expected(kind: str, inputs: dict[str, np.ndarray]):  # type: ignore[no-untyped-def]
    if kind == "isotropic":
        ax = ay = inputs["alpha"]
        wo = np.stack([inputs["s"], 0.0 * ax, inputs["c"]], axis=-1)
    else:
        ax, ay, wo = inputs["alpha"], inputs["ratio"], inputs["v"]
    wo = wo / np.linalg.norm(wo, axis=-1, keepdims=True)
    return table(kind).lookup(ax, ay, wo)


def compare(kind: str, inputs: dict[str, np.ndarray], rows: np.ndarray, rest: np.ndarray) -> None:
    """rows: (n, 3, 3) of M^-1 up to scale; rest: above, albedo, Fresnel part."""
    want = expected(kind, inputs)
    assert np.all(np.isfinite(rows))
    assert np.all(np.isfinite(rest))
    np.testing.assert_allclose(rest[:, 0], 1.0 - transform.leak(want.matrix), atol=3e-6)
    np.testing.assert_allclose(rest[:, 1], want.albedo, atol=2e-6)
    np.testing.assert_allclose(rest[:, 2], want.fresnel, atol=4e-6)
    # M^-1 M is a multiple of the identity. Rounding of the view alone turns lobes by 6e-8,
    # which a lobe feels times its steepness; most cases must be far better.
    unit = rows @ want.matrix
    scale = np.trace(unit, axis1=1, axis2=2) / 3.0
    assert np.all(scale > 0.0)
    away = np.max(np.abs(unit / scale[:, None, None] - np.eye(3)), axis=(1, 2))
    sharp = np.minimum(inputs["alpha"], inputs.get("ratio", inputs["alpha"]))
    assert np.median(away * sharp) < 1e-7
    # At grazing views lobes are as thin as alpha v_z across, and rounding the view shows.
    grazing = inputs["v"][:, 2] < 0.03 if "v" in inputs else np.zeros(COUNT, dtype=bool)
    assert np.max(away[~grazing] * sharp[~grazing]) < 2e-6
    assert np.max(away * sharp) < 1e-4
    # The lobe's axis, in radians.
    axis = np.linalg.inv(rows / np.max(np.abs(rows), axis=(1, 2), keepdims=True))[:, :, 2]
    axis /= np.linalg.norm(axis, axis=-1, keepdims=True)
    turn = np.linalg.norm(np.cross(axis, want.matrix[:, :, 2]), axis=-1)
    assert np.percentile(turn[~grazing], 99) < 2e-6
    assert np.max(turn[~grazing]) < 3e-5
    assert np.max(turn) < 2e-4


def images(kind: str) -> dict[str, np.ndarray]:
    return {name: image.astype(np.float32) for name, image in textures(table(kind)).items()}


@pytest.mark.parametrize("kind", KINDS)
def test_glsl(kind: str, ctx: moderngl.Context, tmp_path: Path) -> None:
    (tmp_path / "snippet.glsl").write_text(snippet(table(kind), "glsl"), encoding="utf-8")
    inputs = cases(kind)

    def run(result: str) -> np.ndarray:
        body = f"LtcLobe lobe = {CALLS[kind]}; result = {result};"
        return evaluate(ctx, tmp_path, ["snippet.glsl"], body, inputs, tables=images(kind))

    rows = np.stack([run(f"vec4(lobe.row{i}, 0.0)")[:, :3] for i in range(3)], axis=1)
    rest = run("vec4(lobe.above, lobe.albedo, lobe.fresnel, 0.0)")[:, :3]
    compare(kind, inputs, rows, rest)


WGSL_MAIN = """
{bindings}
@group(0) @binding(8) var<storage, read> inputs: array<vec4f>;
@group(0) @binding(9) var<storage, read_write> outputs: array<vec4f>;

@compute @workgroup_size(1)
fn main(@builtin(global_invocation_id) id: vec3u) {{
    let alpha = inputs[2u * id.x].x;
    let ratio = inputs[2u * id.x].y;
    let s = inputs[2u * id.x].z;
    let c = inputs[2u * id.x].w;
    let v = inputs[2u * id.x + 1u].xyz;
    let lobe = {call};
    outputs[3u * id.x] = vec4f(lobe.row0, lobe.above);
    outputs[3u * id.x + 1u] = vec4f(lobe.row1, lobe.albedo);
    outputs[3u * id.x + 2u] = vec4f(lobe.row2, lobe.fresnel);
}}
"""

# In a process of its own: two users of OpenGL take each other's context away.
WGSL_RUNNER = """
import json, sys
import numpy as np
import wgpu
from wgpu.utils.compute import compute_with_buffers  # tells whether the package is whole

folder = sys.argv[1]
adapters = wgpu.gpu.enumerate_adapters_sync()
if not adapters:
    sys.exit(77)
try:
    device = adapters[0].request_device_sync()
except RuntimeError:  # an adapter whose driver cannot do what WebGPU asks
    sys.exit(77)
data = np.load(folder + "/data.npz")
names = json.loads(str(data["names"]))
code = open(folder + "/code.wgsl").read()
module = device.create_shader_module(code=code)
entries = []
use = wgpu.BufferUsage
for i, name in enumerate(names):
    image = data[name]
    depth = image.shape[0] if image.ndim == 4 else 1
    height, width = image.shape[-3:-1]
    texture = device.create_texture(
        size=(width, height, depth), dimension="3d" if image.ndim == 4 else "2d",
        format="rgba32float",
        usage=wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_DST)
    device.queue.write_texture(
        {"texture": texture}, np.ascontiguousarray(image),
        {"bytes_per_row": 16 * width, "rows_per_image": height}, (width, height, depth))
    entries.append({"binding": i, "resource": texture.create_view()})
given = device.create_buffer_with_data(data=data["inputs"], usage=use.STORAGE)
size = 48 * int(data["count"])
result = device.create_buffer(size=size, usage=use.STORAGE | use.COPY_SRC)
for place, buffer in ((8, given), (9, result)):
    entries.append({"binding": place, "resource": {"buffer": buffer, "offset": 0,
                                                    "size": buffer.size}})
pipeline = device.create_compute_pipeline(
    layout="auto", compute={"module": module, "entry_point": "main"})
group = device.create_bind_group(layout=pipeline.get_bind_group_layout(0), entries=entries)
encoder = device.create_command_encoder()
work = encoder.begin_compute_pass()
work.set_pipeline(pipeline)
work.set_bind_group(0, group)
work.dispatch_workgroups(int(data["count"]))
work.end()
device.queue.submit([encoder.finish()])
np.save(folder + "/out.npy", np.frombuffer(device.queue.read_buffer(result), np.float32))
"""


@pytest.mark.parametrize("kind", KINDS)
def test_wgsl(kind: str, tmp_path: Path) -> None:
    pytest.importorskip("wgpu")
    made, inputs = images(kind), cases(kind)
    flat = {}
    for name, image in made.items():
        padded = np.zeros((*image.shape[:-1], 4), np.float32)
        padded[..., : image.shape[-1]] = image
        flat[name] = padded
    rows = np.zeros((COUNT, 8), np.float32)
    for i, name in enumerate(("alpha", "ratio", "s", "c")):
        if name in inputs:
            rows[:, i] = inputs[name]
    if "v" in inputs:
        rows[:, 4:7] = inputs["v"]
    kinds = {3: "texture_2d<f32>", 4: "texture_3d<f32>"}
    bindings = "\n".join(
        f"@group(0) @binding({i}) var {name}: {kinds[image.ndim]};"
        for i, (name, image) in enumerate(flat.items())
    )
    main = WGSL_MAIN.format(bindings=bindings, call=CALLS[kind])
    (tmp_path / "code.wgsl").write_text(snippet(table(kind), "wgsl") + main)
    np.savez(tmp_path / "data.npz", names=json.dumps(list(flat)), inputs=rows, count=COUNT, **flat)
    # Limits on OpenGL's version are not WebGPU's business.
    environment = {k: v for k, v in os.environ.items() if not k.startswith("MESA_GL")}
    done = subprocess.run(
        [sys.executable, "-c", WGSL_RUNNER, str(tmp_path)],
        env=environment,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    if done.returncode == 77:
        pytest.skip("no device for WebGPU here")
    assert done.returncode == 0, done.stderr
    out = np.load(tmp_path / "out.npy").reshape(COUNT, 3, 4).astype(np.float64)
    compare(kind, inputs, out[:, :, :3], out[:, :, 3])


HLSL_MAIN = {
    "isotropic": "Texture2D<float4> A; Texture2D<float4> B;\n"
    "float4 main(float4 p: SV_Position) : SV_Target {{ LtcLobe l = ltc_lobe(A, B, p.x, p.y, p.z);",
    "anisotropic": "Texture3D<float4> A; Texture3D<float4> B; Texture3D<float4> C;\n"
    "float4 main(float4 p: SV_Position) : SV_Target {{"
    " LtcLobe l = ltc_lobe(A, B, C, p.x, p.y, p.xyz);",
}


@pytest.mark.parametrize("kind", KINDS)
def test_hlsl_compiles(kind: str, tmp_path: Path) -> None:
    compiler = shutil.which("glslangValidator") or shutil.which("glslang")
    if compiler is None:
        pytest.skip("glslang is not installed")
    ends = " return float4(l.row0 + l.row1 + l.row2, l.above + l.albedo + l.fresnel); }\n"
    main = HLSL_MAIN[kind].replace("{{", "{") + ends
    file = tmp_path / "code.frag"
    file.write_text(snippet(table(kind), "hlsl") + main)
    command = [compiler, "-D", "-V", "-S", "frag", "-e", "main", "-o", str(tmp_path / "o"), file]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
