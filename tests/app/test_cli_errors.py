"""Bad input: each case one sentence on stderr that says what and where, and exit code 2.

No case gets as far as OpenGL.
"""

from __future__ import annotations

import io
import json
import os
import re
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from app.cli.main import app, run
from app.images import exr_bytes, png_bytes
from app.render.techniques import TECHNIQUES, VARIANTS

ROOT = Path(__file__).resolve().parents[2]

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
PLY_HEAD = (
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
)
PIXELS = np.arange(60, dtype=np.uint8).reshape(4, 5, 3)
SHOT = ("shot", "scene.json", "-o", "out.png")
PROBE = ("probe", "scene.json", "points.npz", "-o", "out.npz")


def scene(**parts: object) -> str:
    return json.dumps({"format": "ltc-scene/1", **parts})


def outline(*contours: object, **more: object) -> str:
    return scene(lights=[{"outline": {"contours": list(contours), **more}}])


def mesh_scene(path: str) -> str:
    return scene(objects=[{}, {"mesh": path}])


def points(**changes: object) -> bytes:
    """Return a point file; a change of None leaves an array out."""
    arrays: dict[str, object] = {
        "position": np.zeros((3, 3)),
        "normal": np.tile([0.0, 1.0, 0.0], (3, 1)),
        "tangent": np.tile([1.0, 0.0, 0.0], (3, 1)),
        "view": np.tile([0.0, 0.6, 0.8], (3, 1)),
        "alpha": np.full((3, 2), 0.25),
    }
    arrays.update(changes)
    buffer = io.BytesIO()
    np.savez(buffer, **{name: array for name, array in arrays.items() if array is not None})
    return buffer.getvalue()


def row(values: list[float], first: list[float], count: int = 3) -> np.ndarray:
    """Return ``count`` rows: the first good, the second bad."""
    return np.array([first, values] + [first] * (count - 2))


@dataclass
class Case:
    """Files by name (None is a folder), the arguments, and parts of the sentence."""

    files: dict[str, str | bytes | None]
    parts: tuple[str, ...]
    arguments: tuple[str, ...] = SHOT
    named: str = field(default="scene.json")


def bad_scene(text: str | bytes | None, *parts: str) -> Case:
    return Case({"scene.json": text}, parts)


def bad_mesh(name: str, content: str | bytes | None, *parts: str) -> Case:
    files = {"scene.json": mesh_scene(name)}
    if content is not None:
        files[name] = content
    return Case(files, ("objects[1].mesh", *parts))


def bad_drawing(elements: str, *parts: str) -> Case:
    files = {"scene.json": scene(lights=[{}, {"svg": {"path": "a.svg"}}])}
    drawing = f'<svg xmlns="http://www.w3.org/2000/svg">{elements}</svg>'
    return Case({**files, "a.svg": drawing}, ("lights[1].svg", "a.svg: ", *parts))


def bad_points(content: bytes | str | None, *parts: str) -> Case:
    return Case({"scene.json": scene(), "points.npz": content}, parts, PROBE, "points.npz")


def bad_arguments(*arguments: str, parts: tuple[str, ...], **files: str | bytes) -> Case:
    return Case({"scene.json": scene(), **files}, parts, arguments, "")


NAN_OBJ = TRIANGLE.replace("v 1 0 0", "v nan 0 0")

CASES: dict[str, Case] = {
    # The file
    "missing": Case({}, ("no such file", "expected a scene file")),
    "folder": bad_scene(None, "this is a folder", "expected a scene file"),
    "empty": bad_scene("", "the file is empty", '"format": "ltc-scene/1"'),
    "blank": bad_scene(" \n\t ", "the file is empty"),
    "only a byte order mark": bad_scene(b"\xef\xbb\xbf", "the file is empty"),
    "not UTF-8": bad_scene(b'{"format": "\xff"}', "byte 12 is 0xff", "expected UTF-8"),
    "UTF-16": bad_scene(scene().encode("utf-16"), "UTF-16", "expected UTF-8"),
    "a picture": bad_scene(b"\x89PNG\r\n\x1a\n" + bytes(40), "byte 0 is 0x89", "UTF-8"),
    # The syntax
    "no JSON": bad_scene("hello", "line 1, column 1", "found 'h'", "not valid JSON"),
    "cut off": bad_scene(scene()[:-1], "the end of the file", "not valid JSON"),
    "trailing comma": bad_scene(
        '{\n  "format": "ltc-scene/1",\n}', "line ", "not valid JSON"
    ),
    "two documents": bad_scene(scene() + scene(), "line 1, column 26", "not valid JSON"),
    "single quotes": bad_scene("{'format': 'ltc-scene/1'}", "column 2", "double quotes"),
    "NaN": bad_scene(
        '{"format": "ltc-scene/1",\n "display": {"exposure": NaN}}',
        "line 2, column 26", "found NaN", "finite number",
    ),
    "Infinity": bad_scene(
        '{"format": "ltc-scene/1", "display": {"exposure": -Infinity}}', "found -Infinity"
    ),
    "nested too deeply": bad_scene("[" * 200_000, "nested too deeply"),
    "an impossible exponent": bad_scene(
        '{"format": "ltc-scene/1", "display": {"exposure": 1e99999999999999999999}}',
        "exponent", "expected numbers",
    ),
    "a number of a million digits": bad_scene(
        '{"format": "ltc-scene/1", "display": {"exposure": ' + "9" * 1_000_000 + "}}",
        "display.exposure", "999...", "between",
    ),
    # The document
    "a list": bad_scene("[]", "found an empty list", "format"),
    "a number": bad_scene("7", "found the number 7", "format"),
    "no format": bad_scene("{}", '"format" is missing', "ltc-scene/1"),
    "misspelt format": bad_scene('{"fromat": "ltc-scene/1"}', "missing", "'fromat'"),
    "a newer format": bad_scene('{"format": "ltc-scene/2"}', '"ltc-scene/2"', "newer version"),
    "another format": bad_scene('{"format": 1}', "found the number 1", "ltc-scene/1"),
    "unknown key": bad_scene(scene(lihgts=[]), '"lihgts"', "did you mean 'lights'"),
    "unknown key, no guess": bad_scene(scene(zzz=1), '"zzz"', "camera, materials"),
    "unknown key in a light": bad_scene(
        scene(lights=[{"radience": [1, 1, 1]}]), "lights[0]", "did you mean 'radiance'"
    ),
    "unknown key in a material": bad_scene(
        scene(materials={"m": {"roughness": 0.5}}), "materials.m", '"roughness"'
    ),
    "key twice": bad_scene(
        '{"format": "ltc-scene/1", "display": {"exposure": 1, "exposure": 2}}',
        "display", "'exposure' occurs twice",
    ),
    "material twice": bad_scene(
        '{"format": "ltc-scene/1", "materials": {"a": {}, "a": {}}}', "'a' occurs twice"
    ),
    "light's name twice": bad_scene(
        scene(lights=[{"name": "key"}, {}, {"name": "key"}]), "lights[2].name", "lights[0]"
    ),
    "object's name twice": bad_scene(
        scene(objects=[{"name": "o"}, {"name": "o"}]), "objects[1].name", "unique"
    ),
    "empty name": bad_scene(scene(objects=[{"name": ""}]), "objects[0].name", "a name"),
    "name is a number": bad_scene(scene(lights=[{"name": 3}]), "lights[0].name", "number 3"),
    "half a character": bad_scene(
        '{"format": "ltc-scene/1", "lights": [{"name": "\\ud800"}]}', "half a character"
    ),
    "camera is a list": bad_scene(scene(camera=[]), "camera", "expected an object"),
    "lights are an object": bad_scene(scene(lights={}), "lights", "expected a list of lights"),
    "materials are a list": bad_scene(scene(materials=[{}]), "materials", "by their names"),
    "null": bad_scene(scene(camera={"eye": None}), "camera.eye", "found null"),
    "boolean for a number": bad_scene(
        scene(camera={"eye": [0, True, 0]}), "camera.eye[1]", "found true", "a number"
    ),
    "text for a number": bad_scene(
        scene(display={"exposure": "1"}), "display.exposure", 'the text "1"'
    ),
    "number for a boolean": bad_scene(
        scene(lights=[{"visible": 1}]), "lights[0].visible", "true or false"
    ),
    "two numbers for three": bad_scene(
        scene(camera={"up": [0, 1]}), "camera.up", "a list of 2", "3 numbers [x, y, z]"
    ),
    "one alpha": bad_scene(
        scene(materials={"my floor": {"alpha": 0.1}}), 'materials["my floor"].alpha', "2 numbers"
    ),
    "huge number": bad_scene(
        scene(camera={"eye": [1e300, 0, 0]}), "camera.eye[0]", "between -1e+15 and 1e+15"
    ),
    # The values
    "field of view": bad_scene(
        scene(camera={"fov_y": 200}), "camera.fov_y: found 200 degrees", "1 and 170"
    ),
    "eye in the target": bad_scene(
        scene(camera={"eye": [1, 1, 1], "target": [1, 1, 1]}), "camera", "target equals eye"
    ),
    "up along the view": bad_scene(
        scene(camera={"eye": [0, 9, 0], "target": [0, 0, 0]}), "camera", "parallel"
    ),
    "alpha too large": bad_scene(
        scene(materials={"m": {"alpha": [2, 1]}}),
        "materials.m.alpha: found (2.0, 1.0)", "between 0.0001 and 1",
    ),
    "alpha zero": bad_scene(scene(materials={"m": {"alpha": [0, 0]}}), "materials.m", "alpha"),
    "reflects more than all": bad_scene(
        scene(materials={"m": {"diffuse": [0.5, 1.5, 0.5]}}),
        "materials.m.diffuse", "between 0 and 1",
    ),
    "negative radiance": bad_scene(
        scene(lights=[{"radiance": [1, -1, 1]}]),
        "lights[0].radiance: found (1.0, -1.0, 1.0)", "0 or more",
    ),
    "no unit quaternion": bad_scene(
        scene(objects=[{"transform": {"rotate": [2, 0, 0, 0]}}]),
        "objects[0].transform.rotate", "length 2", "unit quaternion",
    ),
    "scale of zero": bad_scene(
        scene(objects=[{"transform": {"scale": [1, 0, 1]}}]),
        "objects[0].transform.scale", "no zero",
    ),
    "parallel plane": bad_scene(
        scene(lights=[{}, {"plane": {"u": [0, 2, 0]}}]), "lights[1].plane.u", "parallel"
    ),
    "tone map": bad_scene(
        scene(display={"tone_map": "acse"}), "display.tone_map", "did you mean 'aces'"
    ),
    "exposure": bad_scene(
        scene(display={"exposure": 99}), "display.exposure", "between -32 and 32"
    ),
    "unknown material": bad_scene(
        scene(materials={"floor": {}}, objects=[{"material": "flor"}]),
        "objects[0].material", "'flor'", "did you mean 'floor'",
    ),
    # Outlines
    "no contours": bad_scene(outline(), "lights[0].outline", "no contours"),
    "two points": bad_scene(
        outline({"polygon": [[0, 0], [1, 0]]}),
        "lights[0].outline.contours[0].polygon", "2 points", "3 or more",
    ),
    "three coordinates": bad_scene(
        outline({"polygon": [[0, 0], [1, 0], [1, 1]]}, {"polygon": [[0, 0], [1, 0], [1, 1, 1]]}),
        "lights[0].outline.contours[1].polygon[2]", "a list of 3", "2 numbers [s, t]",
    ),
    "fill rule": bad_scene(
        outline({"polygon": [[0, 0], [1, 0], [1, 1]]}, fill_rule="even-odd"),
        "lights[0].outline.fill_rule", "did you mean 'evenodd'",
    ),
    "empty contour": bad_scene(outline({}), "lights[0].outline.contours[0]", '"polygon"'),
    "polygon and bezier": bad_scene(
        outline({"polygon": [[0, 0], [1, 0], [1, 1]], "bezier": []}),
        "lights[0].outline.contours[0]", "both polygon and bezier",
    ),
    "no curves": bad_scene(
        outline({"bezier": []}), "lights[0].outline.contours[0].bezier", "no curves"
    ),
    "a curve of three points": bad_scene(
        outline({"bezier": [[[0, 0], [1, 0], [1, 1], [0, 1]], [[0, 1], [1, 0], [0, 0]]]}),
        "lights[0].outline.contours[0].bezier[1]", "a list of 3", "4 points",
    ),
    "a handle of three numbers": bad_scene(
        outline({"bezier": [[[0, 0], [1, 0, 0], [1, 1], [0, 1]]]}),
        "lights[0].outline.contours[0].bezier[0][1]", "2 numbers [s, t]",
    ),
    "a gap between curves": bad_scene(
        outline({"bezier": [[[0, 0], [1, 0], [1, 1], [0, 1]], [[0, 1.1], [0, 1], [0, 0], [0, 0]]]}),
        "lights[0].outline.contours[0].bezier[1][0]", "found [0.0, 1.1]", "expected [0.0, 1.0]",
    ),
    "unknown kind of anchor": bad_scene(
        outline({"bezier": [[[0, 0], [1, 0], [0, 1], [0, 0]]], "kinds": ["smoth"]}),
        "lights[0].outline.contours[0].kinds[0]", "did you mean 'smooth'",
    ),
    "kinds for other anchors": bad_scene(
        outline({"bezier": [[[0, 0], [1, 0], [0, 1], [0, 0]]], "kinds": ["smooth", "corner"]}),
        "lights[0].outline.contours[0]", "2 kinds for 1 anchors",
    ),
    "kinds for a polygon": bad_scene(
        outline({"polygon": [[0, 0], [1, 0], [1, 1]], "kinds": ["corner"]}),
        "lights[0].outline.contours[0].kinds", "for a polygon",
    ),
    # Pictures
    "picture missing": bad_scene(
        scene(lights=[{"picture": "a.png"}]), "lights[0].picture: ", "a.png", "no such file"
    ),
    "picture of a light is a folder": bad_scene(
        scene(lights=[{"picture": "."}]), "lights[0].picture: ", "this is a folder"
    ),
    "picture cut off": Case(
        {"scene.json": scene(lights=[{"picture": "a.png"}]), "a.png": png_bytes(PIXELS)[:48]},
        ("lights[0].picture: ", "a.png", "damaged"),
    ),
    "frame missing": bad_scene(
        scene(lights=[{"picture": "a%03d.png"}]), "lights[0].picture: ", "such as a001.png"
    ),
    "picture without a file": bad_scene(
        scene(lights=[{"picture": {}}]), "lights[0].picture", '"file" is missing'
    ),
    "picture of another fit": bad_scene(
        scene(lights=[{"picture": {"file": "a.png", "fit": "cover"}}]),
        "lights[0].picture.fit", "stretch, fit, fill, tile",
    ),
    "picture without a size": bad_scene(
        scene(lights=[{"picture": {"file": "a.png", "scale": [1, 0]}}]),
        "lights[0].picture.scale", "above 0",
    ),
    "picture half mirrored": bad_scene(
        scene(lights=[{"picture": {"file": "a.png", "mirror": [True]}}]),
        "lights[0].picture.mirror", "2 of true and false",
    ),
    "texture": bad_scene(
        scene(lights=[{"texture": "a.png"}]), "lights[0]", '"texture"', "picture"
    ),
    # Sources
    "text without a string": bad_scene(
        scene(lights=[{"text": {"size": 2}}]), "lights[0].text", 'no "string"'
    ),
    "text of a number": bad_scene(scene(lights=[{"text": 3}]), "lights[0].text", "number 3"),
    "empty text": bad_scene(
        scene(lights=[{"text": {"string": " "}}]), "lights[0].text", "the text is empty"
    ),
    "size of no text": bad_scene(
        scene(lights=[{"text": {"string": "A", "size": 0}}]), "lights[0].text.size", "above 0"
    ),
    "misspelt key of a text": bad_scene(
        scene(lights=[{"text": {"string": "A", "lineheight": 1}}]), "did you mean 'line_height'"
    ),
    "alignment": bad_scene(
        scene(lights=[{"text": {"string": "A", "align": "centre"}}]),
        "lights[0].text.align", "did you mean 'center'",
    ),
    "font missing": bad_scene(
        scene(lights=[{"text": {"string": "A", "font": "gone.ttf"}}]),
        "lights[0].text", "gone.ttf: there is no such file", ".ttf, .otf",
    ),
    "font is a folder": bad_scene(
        scene(lights=[{"text": {"string": "A", "font": "."}}]), "lights[0].text", "is a folder"
    ),
    "font is no font": bad_scene(
        scene(lights=[{"text": {"string": "A", "font": "scene.json"}}]),
        "lights[0].text", "scene.json: damaged or no font",
    ),
    "letter not in the font": bad_scene(
        scene(lights=[{"text": "A\u4e2d"}]), "lights[0].text", "no glyph", "(U+4E2D)"
    ),
    "text and drawing": bad_scene(
        scene(lights=[{"text": "A", "svg": "a.svg"}]), "lights[0]", "both text and svg"
    ),
    "drawing without a path": bad_scene(
        scene(lights=[{"svg": {"size": 1}}]), "lights[0].svg", '"path" is missing'
    ),
    "drawing missing": bad_scene(
        scene(lights=[{"svg": {"path": "gone.svg"}}]),
        "lights[0].svg", "gone.svg: there is no such file", "(.svg)",
    ),
    "drawing is a folder": bad_scene(scene(lights=[{"svg": "."}]), "lights[0].svg", "is a folder"),
    "drawing is no XML": bad_scene(
        scene(lights=[{"svg": "scene.json"}]), "scene.json: line 1, column 1: not valid XML"
    ),
    "drawing of nothing": bad_drawing("", "nothing filled, expected filled shapes"),
    "drawing of strokes": bad_drawing(
        '<path d="M0 0h9v9z" fill="none" stroke="red"/>', "nothing filled but a stroke"
    ),
    "mistake in a path": bad_drawing('\n<path d="M0 0Lx"/>', "line 2: <path>", "a number"),
    "a drawing that copies itself": bad_drawing(
        '<g id="a"><use href="#a"/></g>', "line 1", "copies of copies"
    ),
    # Meshes
    "misspelt built-in": bad_mesh("spehre", None, "did you mean 'sphere'", ".obj"),
    "mesh missing": bad_mesh("bunny.obj", None, "bunny.obj", "no such file"),
    "mesh of unknown kind": bad_mesh("a.fbx", "x", "'.fbx'", ".gltf, .obj, .ply, .stl"),
    "mesh empty": bad_mesh("a.obj", "", "a.obj", "the file is empty"),
    "mesh without triangles": bad_mesh("a.obj", "v 0 0 0\n", "a.obj", "no triangles"),
    "mesh with NaN": bad_mesh("a.obj", NAN_OBJ, "a.obj", "finite coordinates"),
    "mesh too large": bad_mesh(
        "a.obj", TRIANGLE.replace("v 1", "v 1e30"), "a.obj", "1e+30", "at most 1e+15"
    ),
    "index out of range": bad_mesh(
        "a.ply", PLY_HEAD + "0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n", "uses vertex 7", "0 to 2"
    ),
    "index out of range in OBJ": bad_mesh(
        "a.obj", TRIANGLE.replace("f 1 2 3", "f 1 2 9"), "a.obj", "damaged"
    ),
    "zero area only": bad_mesh(
        "a.obj", TRIANGLE.replace("v 0 1 0", "v 2 0 0"), "a.obj", "zero area"
    ),
    "PLY cut off": bad_mesh("a.ply", PLY_HEAD + "0 0 0\n1 0", "a.ply", "damaged or cut off"),
    "STL cut off": bad_mesh("a.stl", bytes(80) + b"\x09\0\0\0" + bytes(60), "a.stl"),
    "GLB cut off": bad_mesh(
        "a.glb", b"glTF\x02\0\0\0\xff\0\0\0\x40\0\0\0JSON{", "a.glb", "damaged or cut off"
    ),
    "glTF is no JSON": bad_mesh("a.gltf", "{", "a.gltf", "damaged"),
    "glTF without its buffer": bad_mesh(
        "a.gltf",
        json.dumps(
            {
                "asset": {"version": "2.0"},
                "buffers": [{"uri": "gone.bin", "byteLength": 36}],
                "bufferViews": [{"buffer": 0, "byteLength": 36}],
                "accessors": [
                    {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}
                ],
                "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
                "nodes": [{"mesh": 0}],
                "scenes": [{"nodes": [0]}],
            }
        ),
        "a.gltf", "refers to the missing file 'gone.bin'",
    ),
    "mesh is a folder": Case(
        {"scene.json": mesh_scene("a.obj"), "a.obj": None}, ("objects[1].mesh", "is a folder")
    ),
    # Arguments
    "no output": bad_arguments("shot", "scene.json", parts=("shot --help",)),
    "no scene": bad_arguments("shot", "-o", "out.png", parts=("SCENE", "shot --help")),
    "unknown option": bad_arguments(*SHOT, "--siez", "1x1", parts=("--siez", "--size")),
    "unknown command": bad_arguments("shto", "scene.json", parts=("'shto'", "mean 'shot'")),
    "unknown demo scene": bad_arguments(
        "shot", "stil-life", "-o", "out.png", parts=("stil-life", "demo scene")
    ),
    "size without x": bad_arguments(*SHOT, "--size", "640", parts=("--size", "WIDTHxHEIGHT")),
    "size of words": bad_arguments(*SHOT, "--size", "axb", parts=("--size", "'axb'")),
    "size of zero": bad_arguments(*SHOT, "--size", "0x480", parts=("--size", "1 to 16384")),
    "size negative": bad_arguments(*SHOT, "--size", "-4x4", parts=("--size", "'-4x4'")),
    "size too large": bad_arguments(*SHOT, "--size", "99999x9", parts=("--size", "16384")),
    "cull nothing": bad_arguments(*SHOT, "--cull", "1/0", parts=("--cull", "1/0", "1/4096")),
    "cull too much": bad_arguments(*SHOT, "--cull", "1.5", parts=("--cull", "from 0 to 1")),
    "cull a word": bad_arguments(*SHOT, "--cull", "off", parts=("--cull", "'off'", "1/4096")),
    "no samples": bad_arguments(*SHOT, "--samples", "0", parts=("--samples", "1 to 65536")),
    "no error": bad_arguments(
        *SHOT, "--until-error", "0", parts=("--until-error is '0'", "such as 0.01 or 1%")
    ),
    "error of what has none": bad_arguments(
        *SHOT, "--until-error", "1%", parts=("--until-error", "ltc+residual")
    ),
    "samples not whole": bad_arguments(*SHOT, "--samples", "1.5", parts=("--samples", "1.5")),
    "unknown technique": bad_arguments(
        *SHOT, "--technique", "lct", parts=("'lct'", "did you mean 'ltc'")
    ),
    "picture of unknown kind": bad_arguments(
        "shot", "scene.json", "-o", "out.jpg", parts=("out.jpg", "'.jpg'", ".png, .exr")
    ),
    "picture without suffix": bad_arguments(
        "shot", "scene.json", "-o", "out", parts=("no suffix", ".png, .exr")
    ),
    "picture in no folder": bad_arguments(
        "shot", "scene.json", "-o", "no/out.png", parts=("no/out.png", "does not exist")
    ),
    "picture is a folder": bad_arguments("shot", "scene.json", "-o", ".", parts=("a folder",)),
    "picture in a file": bad_arguments(
        "shot", "scene.json", "-o", "scene.json/a.png", parts=("is not a folder",)
    ),
    "bench of nothing": bad_arguments("bench", parts=("SCENE", "bench --help")),
    "bench never": bad_arguments(
        "bench", "scene.json", "--repeats", "0", parts=("--repeats", "from 1")
    ),
    "bench backwards": bad_arguments(
        "bench", "scene.json", "--warm-up", "-1", parts=("--warm-up", "from 0")
    ),
    "bench at no alpha": bad_arguments(
        "bench", "scene.json", "--alpha", "0", parts=("--alpha is 0", "between 0.0001 and 1")
    ),
    "bench with half a pixel": bad_arguments(
        "bench", "scene.json", "--error", "0.5", parts=("--error is '0.5'", "from 0")
    ),
    "bench to text": bad_arguments(
        "bench", "scene.json", "--json", "a.txt", parts=("a.txt", ".json")
    ),
    "bench's second technique": bad_arguments(
        "bench", "scene.json", "--technique", "ltc", "--technique", "x", parts=("'x'",)
    ),
    "report of a missing scene": bad_arguments(
        "report", "gone.json", "-o", "out", parts=("gone.json", "no such file")
    ),
    "report nowhere": bad_arguments("report", "scene.json", parts=("--output", "report --help")),
    "report into no folder": bad_arguments(
        "report", "scene.json", "-o", "no/out", parts=("no/out", "does not exist")
    ),
    "report into a file": bad_arguments(
        "report", "scene.json", "-o", "scene.json", parts=("this is a file", "expected a folder")
    ),
    "report of no points": bad_arguments(
        "report", "scene.json", "-o", "out", "--points", "0", parts=("--points", "from 1")
    ),
    "report of no size": bad_arguments(
        "report", "scene.json", "-o", "out", "--size", "big", parts=("--size", "'big'")
    ),
    "report of never": bad_arguments(
        "report", "scene.json", "-o", "out", "--repeats", "0", parts=("--repeats", "from 1")
    ),
    "report's technique": bad_arguments(
        "report", "scene.json", "-o", "out", "--technique", "uniform:0", parts=('"0"', "4096")
    ),
    "report of two of one name": bad_arguments(
        "report", "scene.json", "./scene.json", "-o", "out", parts=("named 'scene' too",)
    ),
    "compare one picture": bad_arguments("compare", "a.exr", parts=("a.exr", "two to compare")),
    "compare a scene with a picture": bad_arguments(
        "compare", "scene.json", "a.exr", parts=("a.exr", "--against")
    ),
    "compare with an unknown technique": bad_arguments(
        "compare", "scene.json", "--against", "refrence", parts=("'refrence'", "mean 'reference'")
    ),
    "compare's view": bad_arguments(
        "compare", "scene.json", "--view", "sined", parts=("--view", "mean 'signed'")
    ),
    "compare's measure": bad_arguments(
        "compare", "scene.json", "--of", "hue", parts=("--of", "'hue'", "luminance")
    ),
    "compare's map": bad_arguments(
        "compare", "scene.json", "--map", "jet", parts=("--map", "'jet'", "magma")
    ),
    "compare's range": bad_arguments(
        "compare", "scene.json", "--range", "-1", parts=("--range is -1", "above 0")
    ),
    "compare's breakdown of noise": bad_arguments(
        "compare", "scene.json", "--technique", "reference", "--breakdown", "9",
        parts=("technique reference", "noise"),
    ),
    "compare's breakdown of pictures": bad_arguments(
        "compare", "a.png", "b.png", "--breakdown", "9", parts=("--breakdown", "needs a scene"),
    ),
    "compare to text": bad_arguments(
        "compare", "scene.json", "-o", "out.txt", parts=("out.txt", ".png")
    ),
    "compare pictures that are not there": bad_arguments(
        "compare", "a.png", "b.png", parts=("a.png", "no such file")
    ),
    "compare pictures of two kinds": bad_arguments(
        "compare", "a.png", "b.exr",
        **{"a.png": png_bytes(PIXELS), "b.exr": exr_bytes(PIXELS.astype(np.float32))},
        parts=("b.exr", "another .png"),
    ),
    "compare pictures of two sizes": bad_arguments(
        "compare", "a.png", "b.png",
        **{"a.png": png_bytes(PIXELS), "b.png": png_bytes(PIXELS[:2])},
        parts=("b.png", "5x2", "5x4"),
    ),
    "compare a damaged PNG": bad_arguments(
        "compare", "a.png", "a.png", **{"a.png": png_bytes(PIXELS)[:50]},
        parts=("a.png", "damaged"),
    ),
    "compare a damaged EXR": bad_arguments(
        "compare", "a.exr", "a.exr", **{"a.exr": "no picture"}, parts=("a.exr", "damaged"),
    ),
    "explain a technique": bad_arguments(
        "explain", "scene.json", "--technique", "q", parts=("'q'", "ltc")
    ),
    "probe to text": bad_arguments(
        "probe", "scene.json", "p.npz", "-o", "out.txt", parts=("out.txt", ".npz")
    ),
    "window of a missing scene": bad_arguments("gone.json", parts=("gone.json", "no such file")),
    "window of a bad option": bad_arguments("scene.json", "--size", "1x1", parts=("--size",)),
    # Points
    "points missing": Case({"scene.json": scene()}, ("no such file",), PROBE, "points.npz"),
    "points are a folder": bad_points(None, "this is a folder", ".npz"),
    "points are text": bad_points("hello", "damaged or no .npz", "numpy.savez"),
    "points are empty": bad_points("", "damaged or no .npz"),
    "points cut off": bad_points(points()[:200], "damaged or no .npz"),
    "points without view": bad_points(points(view=None, veiw=[0]), "one named view", "'veiw'"),
    "points flat": bad_points(points(position=np.zeros(3)), "position", "(3,)", "(n, 3)"),
    "alpha flat": bad_points(points(alpha=np.ones((3, 1))), "alpha", "(3, 1)", "(n, 2)"),
    "fewer views": bad_points(
        points(view=np.tile([0.0, 1.0, 0.0], (2, 1))), "view has 2 rows", "expected 3"
    ),
    "points are words": bad_points(points(position=np.full((3, 3), "a")), "position", "real"),
    "points are complex": bad_points(points(normal=np.ones((3, 3)) * 1j), "normal", "complex128"),
    "points are pickles": bad_points(
        points(position=np.full((3, 3), None, dtype=object)), "damaged or no .npz"
    ),
    "points not finite": bad_points(
        points(position=row([0, np.nan, 0], [0, 0, 0])), "position[1]", "nan", "finite"
    ),
    "points too far": bad_points(
        points(position=row([0, 1e20, 0], [0, 0, 0])), "position[1]", "at most 1e+15"
    ),
    "normal too long": bad_points(
        points(normal=row([0, 1.01, 0], [0, 1, 0])), "normal[1]", "length 1"
    ),
    "view of zero": bad_points(points(view=row([0, 0, 0], [0, 1, 0])), "view[1]", "length 1"),
    "tangent along the normal": bad_points(
        points(tangent=row([0, -1, 0], [1, 0, 0])), "tangent[1]", "parallel"
    ),
    "alpha of zero": bad_points(
        points(alpha=row([0.1, 0.0], [0.1, 0.1])), "alpha[1]", "between 0.0001 and 1"
    ),
}  # fmt: skip


@pytest.fixture
def prepared(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("LTC_VIEWER_TRACEBACK", raising=False)
    return tmp_path


def write(case: Case, folder: Path) -> set[str]:
    for name, content in case.files.items():
        path = folder / name
        if content is None:
            path.mkdir()
        elif isinstance(content, bytes):
            path.write_bytes(content)
        else:
            path.write_text(content, encoding="utf-8")
    return {path.name for path in folder.iterdir()}


def check_sentence(stderr: str, case: Case) -> None:
    assert stderr.endswith("\n")
    (line,) = stderr.splitlines()
    assert line.startswith(f"ltc-viewer: {case.named}")
    assert "Traceback" not in line
    assert len(line) < 500
    assert not line.endswith(".")
    for part in case.parts:
        assert part in line, f"{part!r} is not in {line!r}"


@pytest.mark.parametrize("name", CASES)
def test_bad_input_is_one_sentence(
    name: str, prepared: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    case = CASES[name]
    before = write(case, prepared)
    assert run(list(case.arguments)) == 2
    out, err = capfd.readouterr()
    assert out == ""
    check_sentence(err, case)
    assert {path.name for path in prepared.iterdir()} == before


@pytest.mark.parametrize(
    "name", ["trailing comma", "mesh with NaN", "unknown option", "alpha of zero"]
)
def test_bad_input_in_a_process_of_its_own(name: str, prepared: Path) -> None:
    case = CASES[name]
    write(case, prepared)
    done = subprocess.run(
        [sys.executable, "-m", "app", *case.arguments],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONWARNINGS": "default"},
        cwd=prepared,
        timeout=120,
    )
    assert done.returncode == 2
    assert done.stdout == ""
    check_sentence(done.stderr, case)


@pytest.mark.skipif(
    not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may read and write everything"
)
@pytest.mark.parametrize("what", ["scene", "picture"])
def test_permissions(what: str, prepared: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = prepared / "scene.json"
    path.write_text(scene())
    (path if what == "scene" else prepared).chmod(0o100)
    try:
        assert run(list(SHOT)) == 2
    finally:
        prepared.chmod(0o700)
    assert "permission denied" in capfd.readouterr().err


def test_a_denied_read_and_write_without_permissions(
    prepared: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def denied(*_: object) -> None:
        raise PermissionError(13, "Permission denied")

    (prepared / "scene.json").write_text(scene())
    with monkeypatch.context() as patch:
        patch.setattr(Path, "read_bytes", denied)
        assert run(list(SHOT)) == 2
    assert "scene.json: cannot be read (permission denied)" in capfd.readouterr().err
    with monkeypatch.context() as patch:
        patch.setattr(os, "access", lambda *_: False)
        assert run(list(SHOT)) == 2
    assert "out.png: permission denied" in capfd.readouterr().err


def test_no_display_is_a_failure_with_advice(
    prepared: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    (prepared / "scene.json").write_text(scene())
    for arguments in ([], ["scene.json"]):
        assert run(arguments) == 1
        out, err = capfd.readouterr()
        assert out == ""
        assert re.fullmatch(r"ltc-viewer: there is no display here .*shot .*\n", err)


def test_no_opengl_is_a_failure_with_advice(
    prepared: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    import app.context

    def missing() -> None:
        raise app.context.ContextError(app.context.explain_failure("libEGL.so.1 not loaded"))

    monkeypatch.setattr(app.context, "headless_context", missing)
    (prepared / "scene.json").write_text(scene())
    assert run(list(SHOT)) == 1
    out, err = capfd.readouterr()
    assert out == ""
    assert "apt-get install" in err
    assert err.count("\n") == 1
    # What can be told without OpenGL is told.
    assert run(["explain", "scene.json"]) == 0
    out, err = capfd.readouterr()
    assert "nothing to see" in out
    assert "Planned for the least that OpenGL 4.1 allows" in err


def test_an_error_of_the_program_is_exit_code_1(
    prepared: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def broken(*_: object) -> None:
        raise ZeroDivisionError("somewhere")

    monkeypatch.setattr("app.cli.shot.image_size", broken)
    assert run(list(SHOT)) == 1
    err = capfd.readouterr().err
    assert err == "ltc-viewer: internal error: ZeroDivisionError: somewhere\n"
    monkeypatch.setenv("LTC_VIEWER_TRACEBACK", "1")
    assert run(list(SHOT)) == 1
    assert "Traceback" in capfd.readouterr().err


@pytest.mark.parametrize("option", ["-h", "--help"])
@pytest.mark.parametrize("command", ["shot", "probe", "bench", "report", "compare", "explain"])
def test_help_shows_an_example(command: str, option: str) -> None:
    result = CliRunner().invoke(app, [command, option])
    assert result.exit_code == 0
    assert f"ltc-viewer {command} " in result.stdout
    assert "Example" in result.stdout
    assert result.stderr == ""


def test_help_of_the_program_names_every_command() -> None:
    result = CliRunner().invoke(app, ["--help"])
    assert result.exit_code == 0
    for word in ("shot", "probe", "bench", "report", "explain", "SCENE", "--version"):
        assert word in result.stdout
    assert "window" not in re.sub("(?i)the window|a window", "", result.stdout)


@pytest.mark.parametrize("command", ["shot", "probe", "bench", "report", "compare", "explain"])
def test_techniques_are_listed(command: str, capfd: pytest.CaptureFixture[str]) -> None:
    assert run([command, "--technique", "help"]) == 0
    out, err = capfd.readouterr()
    assert err == ""
    lines = out.splitlines()
    names = [line.split()[0].removesuffix("[:N]") for line in lines]
    assert names == ["auto", *TECHNIQUES, *(f"ltc/{variant}" for variant in VARIANTS)]


def test_version(capfd: pytest.CaptureFixture[str]) -> None:
    assert run(["--version"]) == 0
    assert capfd.readouterr().out.startswith("ltc-viewer ")
