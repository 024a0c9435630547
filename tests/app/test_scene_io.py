"""Scene files: the documented example, defaults, and round trips to the bit."""

from __future__ import annotations

import json
import math
import os
import random
import time
from dataclasses import replace
from decimal import Decimal
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.errors import InputError
from app.json_reader import LARGEST_NUMBER
from app.json_writer import LINE_LENGTH
from app.scene import (
    ANCHOR_KINDS,
    COLOR_SPACES,
    FILL_RULES,
    PICTURE_FITS,
    TEXT_ALIGNS,
    TONE_MAPS,
    AreaLight,
    BezierContour,
    Camera,
    Display,
    Material,
    Outline,
    Picture,
    Plane,
    PolygonContour,
    Scene,
    SceneError,
    SceneObject,
    SvgSource,
    TextSource,
    Transform,
)
from app.scene_io import demo_scenes, load_scene, save_scene, scene_from_json, scene_to_json
from app.svg import svg_outline
from app.text import text_outline

EXAMPLE = """{
  "format": "ltc-scene/1",
  "camera": {"eye": [0, 1.2, 4], "target": [0, 0.8, 0], "up": [0, 1, 0], "fov_y": 45.0},
  "materials": {
    "floor": {"diffuse": [0.2, 0.2, 0.2], "f0": [0.04, 0.04, 0.04], "alpha": [0.1, 0.1],
              "rotation": 0.0}
  },
  "objects": [
    {"name": "floor", "mesh": "plane", "material": "floor",
     "transform": {"translate": [0, 0, 0], "rotate": [1, 0, 0, 0], "scale": [10, 10, 10]}}
  ],
  "lights": [
    {"name": "key",
     "plane": {"origin": [0, 1, -2], "u": [1, 0, 0], "v": [0, 1, 0]},
     "outline": {"fill_rule": "evenodd",
                 "contours": [{"polygon": [[-1, -1], [1, -1], [1, 1], [-1, 1]]}]},
     "radiance": [5, 5, 5], "two_sided": false, "visible": true}
  ],
  "display": {"exposure": 0.0, "tone_map": "agx"}
}
"""

SQUARE = PolygonContour(((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)))


def read(text: str) -> Scene:
    return scene_from_json(text, None, "test")


def document(**parts: object) -> str:
    return json.dumps({"format": "ltc-scene/1", **parts})


def test_the_documented_example() -> None:
    assert read(EXAMPLE) == Scene(
        materials=(Material("floor", (0.2, 0.2, 0.2), (0.04, 0.04, 0.04), (0.1, 0.1), 0.0),),
        objects=(SceneObject("floor", "plane", "floor", Transform(scale=(10.0, 10.0, 10.0))),),
        lights=(
            AreaLight("key", Outline((SQUARE,)), Plane(origin=(0.0, 1.0, -2.0)), (5.0, 5.0, 5.0)),
        ),
        camera=Camera(fov_y=math.radians(45.0)),
        display=Display(),
    )


def test_everything_but_the_format_has_a_default() -> None:
    assert read(document()) == Scene()
    parts = document(
        camera={}, materials={"m": {}}, objects=[{}, {"transform": {}}],
        lights=[{}, {"plane": {}, "outline": {}}], display={},
    )  # fmt: skip
    scene = read(parts)
    assert scene.camera == Camera()
    assert scene.display == Display()
    assert scene.materials == (Material("m"), Material("default"))
    assert [item.name for item in scene.objects] == ["object 1", "object 2"]
    assert [item.material for item in scene.objects] == ["default", "default"]
    assert [light.name for light in scene.lights] == ["light 1", "light 2"]
    assert scene.lights[1] == AreaLight("light 2", Outline((SQUARE,)))


def test_a_picture_by_its_file_alone() -> None:
    scene = scene_from_json(document(lights=[{"picture": "p/a.png"}]), Path("/b/c"), "test")
    assert scene.lights[0].picture == Picture("/b/c/p/a.png")
    written = json.loads(scene_to_json(scene, Path("/b")))["lights"][0]["picture"]
    assert written == {
        "file": "c/p/a.png", "color_space": "auto", "fit": "stretch", "offset": [0, 0],
        "scale": [1, 1], "rotation": 0, "mirror": [False, False], "frames_per_second": 0,
        "start": 0,
    }  # fmt: skip


def test_missing_names_step_aside() -> None:
    scene = read(document(objects=[{}, {"name": "object 1"}, {"name": "object 3"}, {}]))
    assert [item.name for item in scene.objects] == ["object 2", "object 1", "object 3", "object 4"]


def test_a_material_named_default_is_the_default() -> None:
    scene = read(document(materials={"default": {"alpha": [0.5, 0.5]}}, objects=[{}]))
    assert scene.materials == (Material("default", alpha=(0.5, 0.5)),)


def test_a_byte_order_mark_is_no_error(tmp_path: Path) -> None:
    path = tmp_path / "bom.json"
    path.write_bytes(b"\xef\xbb\xbf" + EXAMPLE.encode())
    assert load_scene(path) == read(EXAMPLE)


# Round trips

names = st.text(
    st.characters(exclude_categories=("Cs",), exclude_characters="\0"), min_size=1, max_size=12
).filter(lambda text: bool(text.strip()))
numbers = st.floats(-LARGEST_NUMBER, LARGEST_NUMBER)
shares = st.floats(0.0, 1.0)
alphas = st.floats(1e-4, 1.0)


def triples(values: st.SearchStrategy[float]) -> st.SearchStrategy[tuple[float, ...]]:
    return st.tuples(values, values, values)


@st.composite
def rotations(draw: st.DrawFn) -> tuple[float, ...]:
    quaternion = draw(st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda q: math.hypot(*q) > 0.1))
    norm = math.hypot(*quaternion)
    return tuple(x / norm for x in quaternion)


def valid(strategy: st.SearchStrategy, **fields: st.SearchStrategy) -> st.SearchStrategy:
    """Build objects of a dataclass from fields, without those that it refuses."""

    def build(values: dict) -> object | None:
        try:
            return strategy(**values)
        except SceneError:
            return None

    return st.fixed_dictionaries(fields).map(build).filter(lambda made: made is not None)


cameras = valid(
    Camera,
    eye=triples(numbers),
    target=triples(numbers),
    up=triples(numbers),
    fov_y=st.floats(math.radians(1.0), math.radians(170.0)),
)
transforms = valid(
    Transform, translate=triples(numbers), rotate=rotations(), scale=triples(numbers)
)
places = st.tuples(numbers, numbers)
polygons = st.lists(places, min_size=3, max_size=40).map(
    lambda points: PolygonContour(tuple(points))
)


@st.composite
def chains(draw: st.DrawFn) -> BezierContour:
    points = draw(st.lists(st.tuples(places, places, places), min_size=1, max_size=12))
    kinds = st.lists(st.sampled_from(ANCHOR_KINDS), min_size=len(points), max_size=len(points))
    anchors = [*points[1:], points[0]]
    return BezierContour(
        tuple((*curve, after[0]) for curve, after in zip(points, anchors, strict=True)),
        tuple(draw(st.just([]) | kinds)),
    )


outlines = valid(
    Outline,
    contours=st.lists(polygons | chains(), min_size=1, max_size=3).map(tuple),
    fill_rule=st.sampled_from(FILL_RULES),
)
sources = valid(
    TextSource,
    text=st.text(st.characters(exclude_categories=("Cs",)), max_size=20),
    font=st.sampled_from(("", "/fonts/a.ttf", "/scenes/ü b.otf")),
    size=st.floats(1e-9, LARGEST_NUMBER),
    align=st.sampled_from(TEXT_ALIGNS),
    spacing=numbers,
    line_height=numbers,
) | valid(SvgSource, path=st.sampled_from(("/a.svg", "/b/c d.svg")), size=st.floats(1e-9, 1e9))
pictures = valid(
    Picture,
    file=st.sampled_from(("/a.png", "/scenes/ü b_%04d.exr", "/meshes/scenes/c.gif")),
    color_space=st.sampled_from(COLOR_SPACES),
    fit=st.sampled_from(PICTURE_FITS),
    offset=places,
    scale=st.tuples(st.floats(1e-9, 1e9), st.floats(1e-9, 1e9)),
    rotation=st.floats(-1e6, 1e6),
    mirror=st.tuples(st.booleans(), st.booleans()),
    frames_per_second=st.floats(0.0, 1000.0),
    start=numbers,
)
lights = valid(
    AreaLight,
    name=names,
    outline=outlines,
    plane=valid(Plane, origin=triples(numbers), u=triples(numbers), v=triples(numbers)),
    radiance=triples(st.floats(0.0, LARGEST_NUMBER)),
    two_sided=st.booleans(),
    visible=st.booleans(),
    source=st.none() | sources,
    picture=st.none() | pictures,
)
materials = valid(
    Material,
    name=names,
    diffuse=triples(shares),
    f0=triples(shares),
    alpha=st.tuples(alphas, alphas),
    rotation=st.floats(-1e6, 1e6),
)


@st.composite
def scenes(draw: st.DrawFn) -> Scene:
    used = draw(st.lists(materials, max_size=3, unique_by=lambda m: m.name))
    objects = []
    if used:
        meshes = st.sampled_from(("plane", "sphere", "/meshes/a.obj", "/plane", "/b c/ü.glb"))
        items = valid(
            SceneObject,
            name=names,
            mesh=meshes,
            material=st.sampled_from([material.name for material in used]),
            transform=transforms,
        )
        objects = draw(st.lists(items, max_size=3, unique_by=lambda item: item.name))
    return Scene(
        tuple(used),
        tuple(objects),
        tuple(draw(st.lists(lights, max_size=3, unique_by=lambda light: light.name))),
        draw(cameras),
        draw(valid(Display, exposure=st.floats(-32, 32), tone_map=st.sampled_from(TONE_MAPS))),
    )


@settings(max_examples=50)
@given(scenes())
def test_text_round_trip_is_exact(scene: Scene) -> None:
    for base in (None, Path("/meshes/scenes"), Path("/")):
        text = scene_to_json(scene, base)
        assert scene_from_json(text, base, "again") == scene
        assert scene_to_json(scene_from_json(text, base, "again"), base) == text


@settings(max_examples=20)
@given(scenes())
def test_file_round_trip_is_exact(tmp_path_factory: pytest.TempPathFactory, scene: Scene) -> None:
    path = tmp_path_factory.mktemp("scenes") / "scene.json"
    scene = replace(scene, objects=tuple(replace(o, mesh="disc") for o in scene.objects))
    save_scene(scene, path)
    assert load_scene(path) == scene
    assert [item.name for item in path.parent.iterdir()] == ["scene.json"]


def test_every_angle_survives() -> None:
    # About one angle in ten is no multiple of pi/180 by any float64.
    generator = random.Random(4)
    for _ in range(3000):
        angle = generator.uniform(-7.0, 7.0) * 10.0 ** generator.uniform(-12.0, 3.0)
        scene = Scene(materials=(Material("m", rotation=angle),))
        assert read(scene_to_json(scene, None)) == scene


@pytest.mark.parametrize("degrees", ["45", "30", "0.1", "90", "-12.75", "1e-05", "359.99", "33.3"])
def test_angles_keep_their_short_text(degrees: str) -> None:
    scene = read(document(materials={"m": {"rotation": float(degrees)}}))
    assert scene.materials[0].rotation == math.radians(float(degrees))
    written = json.loads(scene_to_json(scene, None), parse_float=Decimal, parse_int=Decimal)
    assert written["materials"]["m"]["rotation"] == Decimal(degrees)


def test_demo_scenes_keep_their_values_when_saved(tmp_path: Path) -> None:
    demos = demo_scenes()
    assert demos
    for path in demos.values():
        scene = load_scene(path)
        save_scene(scene, tmp_path / path.name)
        assert load_scene(tmp_path / path.name) == scene


def test_written_files_are_readable() -> None:
    points = tuple((math.cos(i), math.sin(i)) for i in range(200))
    scene = replace(read(EXAMPLE), lights=(AreaLight("l", Outline((PolygonContour(points),))),))
    text = scene_to_json(scene, None)
    assert max(len(line) for line in text.splitlines()) <= LINE_LENGTH
    assert '  "camera": {"eye": [0, 1.2, 4], "target": [0, 0.8, 0], ' in text


# Curves


def read_contour(**fields: object) -> BezierContour:
    (light,) = read(document(lights=[{"outline": {"contours": [fields]}}])).lights
    (contour,) = light.outline.contours
    assert isinstance(contour, BezierContour)
    return contour


def arcs(count: int) -> list[list[list[float]]]:
    """Return a closed chain of curves about the origin as a file holds them."""
    turn = 2.0 * math.pi / count
    handle = 4.0 / 3.0 * math.tan(turn / 4.0)
    circle = [(math.cos(i * turn), math.sin(i * turn)) for i in range(count)]
    return [
        [[x, y], [x - handle * y, y + handle * x], [z + handle * w, w - handle * z], [z, w]]
        for (x, y), (z, w) in zip(circle, [*circle[1:], circle[0]], strict=True)
    ]


def test_curves_and_polygons_in_one_outline() -> None:
    curves = arcs(4)
    text = document(
        lights=[
            {
                "outline": {
                    "fill_rule": "nonzero",
                    "contours": [
                        {"polygon": SQUARE.points},
                        {"bezier": curves, "kinds": ["smooth", "corner", "symmetric", "smooth"]},
                    ],
                }
            }
        ]
    )
    (light,) = read(text).lights
    assert light.outline.contours == (
        SQUARE,
        BezierContour(
            tuple(tuple(tuple(point) for point in curve) for curve in curves),
            ("smooth", "corner", "symmetric", "smooth"),
        ),
    )
    assert read(scene_to_json(read(text), None)) == read(text)


def test_a_chain_without_its_last_side_is_closed_by_a_straight_one() -> None:
    curves = arcs(4)[:3]
    contour = read_contour(bezier=curves, kinds=["smooth"] * 3)
    assert len(contour.curves) == 4
    start, end = contour.curves[2][3], contour.curves[0][0]
    assert contour.curves[3] == (
        start,
        pytest.approx((2 / 3 * start[0] + end[0] / 3, 2 / 3 * start[1] + end[1] / 3), abs=1e-15),
        pytest.approx((start[0] / 3 + 2 / 3 * end[0], start[1] / 3 + 2 / 3 * end[1]), abs=1e-15),
        end,
    )
    assert contour.kinds == ("smooth", "smooth", "smooth", "corner")
    assert read_contour(bezier=curves, kinds=["smooth"] * 4).kinds == ("smooth",) * 4


@pytest.mark.parametrize("size", [1e-9, 1.0, 1e12])
def test_ends_that_nearly_meet_do(size: float) -> None:
    generator = random.Random(3)
    curves = [[[x * size, y * size] for x, y in curve] for curve in arcs(12)]
    for curve in curves:
        curve[3] = [value + generator.uniform(-5e-7, 5e-7) * size for value in curve[3]]
    contour = read_contour(bezier=curves)
    assert len(contour.curves) == 12
    for curve, written in zip(contour.curves, curves, strict=True):
        assert curve[0] == tuple(written[0])
        for point, there in zip(curve, written, strict=True):
            assert math.dist(point, there) < 1e-6 * size


def test_a_straight_side_that_is_snapped_stays_straight() -> None:
    back = [[3.0, 0.0], [2.0, 1.0], [1.0, 1.0], [0.0, 0.0]]
    tilted = [[3.0 * k / 3, 1e-6 * k / 3] for k in range(4)]
    curve = read_contour(bezier=[tilted, back]).curves[0]
    for k, point in enumerate(curve):
        assert point == pytest.approx((k, 0.0), abs=1e-15)


def test_written_coordinates_stay_where_ends_meet() -> None:
    curves = arcs(7)
    contour = read_contour(bezier=curves)
    assert [[list(point) for point in curve] for curve in contour.curves] == curves


def test_ten_thousand_curves() -> None:
    start = time.perf_counter()
    scene = read(document(lights=[{"outline": {"contours": [{"bezier": arcs(10_000)}]}}]))
    text = scene_to_json(scene, None)
    assert read(text) == scene
    assert max(len(line) for line in text.splitlines()) <= LINE_LENGTH
    # About half a second on one core; this only forbids anything quadratic.
    assert time.perf_counter() - start < 20.0


# Mesh paths


def mesh_scene(mesh: str) -> Scene:
    return Scene((Material("m"),), (SceneObject("o", mesh, "m"),))


def test_mesh_paths_are_relative_to_the_file(tmp_path: Path) -> None:
    mesh = tmp_path / "meshes" / "a mesh.obj"
    mesh.parent.mkdir()
    mesh.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    folder = tmp_path / "scenes" / "deep"
    folder.mkdir(parents=True)
    save_scene(mesh_scene(str(mesh)), folder / "s.json")
    written = json.loads((folder / "s.json").read_text())
    assert written["objects"][0]["mesh"] == "../../meshes/a mesh.obj"
    assert load_scene(folder / "s.json").objects[0].mesh == str(mesh)
    # Both folders move together.
    moved = tmp_path / "elsewhere"
    moved.mkdir()
    (tmp_path / "meshes").rename(moved / "meshes")
    (tmp_path / "scenes").rename(moved / "scenes")
    there = load_scene(moved / "scenes" / "deep" / "s.json")
    assert there.objects[0].mesh == str(moved / "meshes" / "a mesh.obj")


def test_a_relative_scene_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "m.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    monkeypatch.chdir(tmp_path)
    save_scene(mesh_scene(str(tmp_path / "m.obj")), "s.json")
    assert json.loads(Path("s.json").read_text())["objects"][0]["mesh"] == "m.obj"
    assert load_scene("s.json").objects[0].mesh == str(tmp_path / "m.obj")


def test_a_file_named_like_a_built_in() -> None:
    text = scene_to_json(mesh_scene("/folder/plane"), Path("/folder"))
    assert json.loads(text)["objects"][0]["mesh"] == "./plane"
    assert scene_from_json(text, Path("/folder"), "x").objects[0].mesh == "/folder/plane"


def test_a_linked_folder(tmp_path: Path) -> None:
    real = tmp_path / "real" / "scenes"
    real.mkdir(parents=True)
    (tmp_path / "link").symlink_to(real)
    (tmp_path / "real" / "m.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    save_scene(mesh_scene(str(tmp_path / "real" / "m.obj")), tmp_path / "link" / "s.json")
    for folder in (tmp_path / "link", real):
        assert load_scene(folder / "s.json").objects[0].mesh == str(tmp_path / "real" / "m.obj")


# Text and drawings

LINES = {"string": "To\nfly", "size": 0.5, "align": "left", "spacing": 0.1, "line_height": 1.5}
DRAWING = '<svg xmlns="http://www.w3.org/2000/svg"><circle r="3"/></svg>'


def test_a_light_of_text_gets_its_outline() -> None:
    (light,) = read(document(lights=[{"text": LINES}])).lights
    source = TextSource("To\nfly", "", 0.5, "left", 0.1, 1.5)
    assert light == AreaLight("light 1", text_outline(source), source=source)
    for written in ("To fly", {"text": "To fly"}, {"string": "To fly"}):
        (light,) = read(document(lights=[{"text": written}])).lights
        assert light.source == TextSource("To fly")


def test_a_light_of_a_drawing_gets_its_outline(tmp_path: Path) -> None:
    drawing = tmp_path / "a.svg"
    drawing.write_text(DRAWING)
    source = SvgSource(str(drawing), 3.0)
    for written in ({"path": "a.svg", "size": 3}, {"path": "../a.svg", "size": 3}):
        folder = tmp_path / "in" if written["path"] == "../a.svg" else tmp_path
        folder.mkdir(exist_ok=True)
        text = document(lights=[{"svg": written}])
        (light,) = scene_from_json(text, folder, "test").lights
        assert light == AreaLight("light 1", svg_outline(source), source=source)
    (light,) = scene_from_json(document(lights=[{"svg": "a.svg"}]), tmp_path, "test").lights
    assert light.source == SvgSource(str(drawing))


def test_an_outline_needs_no_source(tmp_path: Path) -> None:
    outline = {"contours": [{"polygon": SQUARE.points}]}
    text = {"string": "no such letter: \u4e2d", "font": "gone/font.ttf"}
    path = tmp_path / "s.json"
    path.write_text(
        document(
            lights=[
                {"outline": outline, "text": text},
                {"outline": outline, "svg": {"path": "gone.svg"}},
                {"outline": outline, "text": {"string": ""}},
            ]
        )
    )
    scene = load_scene(path)
    assert [light.outline for light in scene.lights] == [Outline((SQUARE,))] * 3
    assert [light.source for light in scene.lights] == [
        TextSource(text["string"], str(tmp_path / "gone" / "font.ttf")),
        SvgSource(str(tmp_path / "gone.svg")),
        TextSource(""),
    ]
    save_scene(scene, path)
    assert load_scene(path) == scene


def test_paths_of_sources_are_relative_to_the_file(tmp_path: Path) -> None:
    outline = Outline((SQUARE,))
    scene = Scene(
        lights=(
            AreaLight("a", outline, source=TextSource("A", str(tmp_path / "fonts" / "a b.ttf"))),
            AreaLight("b", outline, source=SvgSource(str(tmp_path / "scenes" / "b.svg"), 3.0)),
            AreaLight("c", outline, source=TextSource("C")),
        )
    )
    (tmp_path / "scenes").mkdir()
    path = tmp_path / "scenes" / "s.json"
    save_scene(scene, path)
    written = json.loads(path.read_text())["lights"]
    assert written[0]["text"]["font"] == "../fonts/a b.ttf"
    assert written[1]["svg"] == {"path": "b.svg", "size": 3}
    assert written[2]["text"]["font"] == ""
    assert load_scene(path) == scene


# Saving


def test_a_failed_save_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "s.json"
    save_scene(Scene(), path)
    before = path.read_bytes()

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(InputError, match="no space left on device"):
        save_scene(read(EXAMPLE), path)
    assert path.read_bytes() == before
    assert [item.name for item in tmp_path.iterdir()] == ["s.json"]


def test_saving_keeps_permissions(tmp_path: Path) -> None:
    path = tmp_path / "s.json"
    save_scene(Scene(), path)
    path.chmod(0o640)
    save_scene(read(EXAMPLE), path)
    assert path.stat().st_mode & 0o777 == 0o640


@pytest.mark.parametrize(
    ("scene", "said"),
    [
        (Scene(materials=(Material("\ud800"),)), "half a character"),
        (Scene(materials=(Material(" "),)), "expected a name"),
        (Scene(camera=Camera(eye=(1e300, 0.0, 0.0))), "between -1e+15 and 1e+15"),
    ],
)
def test_what_would_not_open_is_not_saved(tmp_path: Path, scene: Scene, said: str) -> None:
    with pytest.raises(InputError) as caught:
        save_scene(scene, tmp_path / "s.json")
    assert said in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_save_errors_name_the_place(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="this is a folder"):
        save_scene(Scene(), tmp_path)
    with pytest.raises(InputError, match="does not exist"):
        save_scene(Scene(), tmp_path / "nowhere" / "s.json")


def test_a_million_characters() -> None:
    generator = random.Random(1)
    points = [[generator.random(), generator.random()] for _ in range(30_000)]
    text = document(lights=[{"outline": {"contours": [{"polygon": points}]}}])
    assert len(text) > 1_000_000
    scene = read(text)
    assert len(scene.lights[0].outline.contours[0].points) == 30_000
    assert read(scene_to_json(scene, None)) == scene


@settings(max_examples=150)
@given(st.text(max_size=60) | st.binary(max_size=60).map(lambda b: b.decode("latin-1")))
def test_any_text_is_a_scene_or_one_sentence(text: str) -> None:
    with pytest.raises(InputError) as caught:
        read(text)
    assert "\n" not in str(caught.value)


json_values = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner),
    max_leaves=8,
)


@settings(max_examples=250)
@given(st.data())
def test_any_value_anywhere_is_a_scene_or_one_sentence(data: st.DataObject) -> None:
    tree = json.loads(EXAMPLE)
    node, key = tree, data.draw(st.sampled_from(sorted(set(tree))))
    while data.draw(st.booleans()) and isinstance(node[key], dict | list) and node[key]:
        node = node[key]
        choices = sorted(node) if isinstance(node, dict) else list(range(len(node)))
        key = data.draw(st.sampled_from(choices))
    node[key] = data.draw(json_values)
    try:
        scene = read(json.dumps(tree))
    except InputError as error:
        assert str(error).startswith("test: ")
        assert "\n" not in str(error)
    else:
        assert read(scene_to_json(scene, None)) == scene
