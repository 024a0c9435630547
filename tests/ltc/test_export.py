"""Exports: every format is read back and holds the same numbers, or shader code that is whole."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from ltc import formats
from ltc.__main__ import main
from ltc.anisotropic import AnisotropicTable
from ltc.check import Fault, check
from ltc.containers import Image, read_dds, read_ktx2
from ltc.export import ENDINGS, exr_bytes, files, halves, notes, snippet, textures
from ltc.formats import AnisotropicGrid, Grid, IsotropicGrid
from ltc.resources import resource_path
from ltc.snippets import LANGUAGES, translate
from ltc.table import load_isotropic
from tests.ltc.published import sound, write_dds, write_inc, write_npy

SHIPPED = resource_path("luts", "ltc_isotropic.npz")


@cache
def isotropic() -> Grid:
    return IsotropicGrid.of(load_isotropic())


@cache
def anisotropic() -> Grid:
    rng = np.random.default_rng(3)
    residual = np.zeros((2, 3, 2, 4, 7), np.float16)
    residual[:, :-1, 1, :, :3] = rng.uniform(-0.1, 0.1, (2, 2, 4, 3))
    albedo = np.full((2, 2, 3, 2), 0.75, np.float16)
    return AnisotropicGrid(AnisotropicTable(residual, albedo, albedo))


GRIDS: list[Callable[[], Grid]] = [isotropic, anisotropic]


def written(grid: Grid, folder: Path, name: str, half: bool = False) -> dict[str, bytes]:
    """Return the files of an export by the part of their names that tells the texture."""
    made = files(grid, folder / name, half)
    return {path.stem.removeprefix("t."): data for path, data in made.items()}


@pytest.mark.parametrize("grid", GRIDS)
@pytest.mark.parametrize("half", [False, True])
@pytest.mark.parametrize("ending", ["dds", "ktx2"])
def test_texture_files(grid: Callable[[], Grid], half: bool, ending: str, tmp_path: Path) -> None:
    wanted = textures(grid())
    found = written(grid(), tmp_path, f"t.{ending}", half)
    assert set(found) == set(wanted)
    for name, image in wanted.items():
        if ending == "dds":
            back = read_dds(found[name])
        else:
            back, told = read_ktx2(found[name])
            assert "M = M0 (I + X)" in told["ltc.notes"]
        with np.errstate(under="ignore"):
            expected = image.astype(np.float16) if half else image
        assert back.dtype == expected.dtype
        np.testing.assert_array_equal(back, expected)


@pytest.mark.parametrize("grid", GRIDS)
@pytest.mark.parametrize("half", [False, True])
def test_exr(grid: Callable[[], Grid], half: bool, tmp_path: Path) -> None:
    OpenEXR = pytest.importorskip("OpenEXR")
    wanted = textures(grid())
    for name, data in written(grid(), tmp_path, "t.exr", half).items():
        path = tmp_path / "back.exr"
        path.write_bytes(data)
        with OpenEXR.File(str(path), separate_channels=True) as file:
            channels = file.channels()
            back = np.stack([channels[c].pixels for c in "RGBA"[: len(channels)]], axis=-1)
            assert "GGX" in file.header()["comments"]
        image = wanted[name]
        with np.errstate(under="ignore"):
            expected = image.astype(np.float16) if half else image
        np.testing.assert_array_equal(back, expected.reshape(-1, *image.shape[-2:]))


def test_exr_without_openexr(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "OpenEXR", None)
    with pytest.raises(ValueError, match="EXR needs OpenEXR: pip install openexr"):
        exr_bytes(np.zeros((2, 2, 4), np.float32), [])


@pytest.mark.parametrize("grid", GRIDS)
def test_npz(grid: Callable[[], Grid], tmp_path: Path) -> None:
    wanted = textures(grid())
    (tmp_path / "t.npz").write_bytes(written(grid(), tmp_path, "t.npz")["t"])
    with np.load(tmp_path / "t.npz", allow_pickle=False) as archive:
        assert set(archive.files) == {*wanted, "notes"}
        for name, image in wanted.items():
            np.testing.assert_array_equal(archive[name], image)
        assert archive["notes"].tobytes().decode() == "\n".join(notes(grid(), wanted))


def numbers(text: str) -> np.ndarray:
    words = re.findall(r"-?\d+\.?\d*(?:e[-+]?\d+)?", text)
    return np.array([float(word) for word in words]).astype(np.float32)


@pytest.mark.parametrize("grid", GRIDS)
def test_c_header(grid: Callable[[], Grid], tmp_path: Path) -> None:
    wanted = textures(grid())
    text = written(grid(), tmp_path, "t.h")["t"].decode()
    assert text.count("#ifndef LTC_T_H") == text.count("#endif") == 1
    for name, image in wanted.items():
        body = re.search(rf"ltc_{name}\[[^\]]*\] = \{{(.*?)\}};", text, re.S)
        assert body is not None
        np.testing.assert_array_equal(numbers(body[1]), image.astype(np.float32).ravel())
        assert f"#define LTC_{name.upper()}_WIDTH {image.shape[-2]}" in text


def test_c_header_compiles(tmp_path: Path) -> None:
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        pytest.skip("no C compiler")
    (tmp_path / "t.h").write_bytes(written(isotropic(), tmp_path, "t.h")["t"])
    (tmp_path / "main.c").write_text(
        '#include <stdio.h>\n#include "t.h"\n#include "t.h"\nint main(void) {\n'
        "fwrite(ltc_residual, sizeof ltc_residual, 1, stdout);\n"
        "fwrite(ltc_albedo, sizeof ltc_albedo, 1, stdout);\nreturn 0; }\n"
    )
    command = [compiler, "-Wall", "-Werror", "-o", str(tmp_path / "a"), str(tmp_path / "main.c")]
    subprocess.run(command, check=True)
    out = subprocess.run([str(tmp_path / "a")], check=True, capture_output=True).stdout
    wanted = np.concatenate([image.ravel() for image in textures(isotropic()).values()])
    np.testing.assert_array_equal(np.frombuffer(out, np.float32), wanted)


@pytest.mark.parametrize("grid", GRIDS)
def test_javascript(grid: Callable[[], Grid], tmp_path: Path) -> None:
    wanted = textures(grid())
    text = written(grid(), tmp_path, "t.js")["t"].decode()
    for name, image in wanted.items():
        found = re.search(rf"export const {name} = \{{ (.*?), data:.*?\(\[(.*?)\]\)", text, re.S)
        assert found is not None
        np.testing.assert_array_equal(numbers(found[2]), image.astype(np.float32).ravel())
        sizes = [int(n) for n in re.findall(r"\d+", found[1])]
        assert sizes == list(image.shape)


def test_javascript_runs(tmp_path: Path) -> None:
    node = shutil.which("node")
    if node is None:
        pytest.skip("no node")
    (tmp_path / "t.mjs").write_bytes(written(isotropic(), tmp_path, "t.js")["t"])
    (tmp_path / "main.mjs").write_text(
        "import * as t from './t.mjs';\n"
        "console.log(JSON.stringify([t.residual.width, t.albedo.channels,"
        " [...t.residual.data], [...t.albedo.data]]));\n"
    )
    done = subprocess.run(
        [node, str(tmp_path / "main.mjs")], check=True, capture_output=True, text=True
    )
    width, channels, *data = json.loads(done.stdout)
    assert (width, channels) == (16, 2)
    for values, image in zip(data, textures(isotropic()).values(), strict=True):
        np.testing.assert_array_equal(np.array(values, np.float32), image.ravel())


def test_text_keeps_what_six_decimals_lose(tmp_path: Path) -> None:
    """A published table through text and back: the doctor finds no singular matrix."""
    cut = formats.read(write_inc(tmp_path, sound("heitz", (20, 20)), ".6f"))
    assert Fault.DECIMALS in check(cut, rectangles=10, albedo_views=10).faults
    whole = formats.read(write_dds(tmp_path, sound("heitz", (20, 20))))
    text = written(whole, tmp_path, "t.js")["t"].decode()
    (tmp_path / "ltc.js").write_text(
        "\n".join(
            f"var g_{name} = [{', '.join(map(str, pad(image).ravel().tolist()))}];"
            for name, image in textures(whole).items()
        )
    )
    back = formats.read([tmp_path / "ltc.js"])
    assert check(back, rectangles=10, albedo_views=10).faults == ()
    assert "ltc_1" in text


def pad(image: Image) -> Image:
    return np.concatenate([image, np.zeros((*image.shape[:-1], 4 - image.shape[-1]))], axis=-1)


def test_published_tables_travel(tmp_path: Path) -> None:
    table = sound("heitz", (12, 12))
    grid = formats.read(write_dds(tmp_path, table))
    assert main(["export", *map(str, sorted(tmp_path.glob("*.dds"))), "-o",
                 str(tmp_path / "out.dds")]) == 0  # fmt: skip
    again = formats.read([tmp_path / "out.ltc_1.dds", tmp_path / "out.ltc_2.dds"])
    u = formats.nodes(grid)
    for a, b in zip(again.at(u), grid.at(u), strict=True):
        np.testing.assert_array_equal(a, b)
    # From matrices: the same inverse over its middle entry.
    from_text = textures(formats.read(write_inc(tmp_path, table)))["ltc_1"]
    np.testing.assert_allclose(from_text, textures(grid)["ltc_1"], rtol=2e-5, atol=1e-12)
    kt = formats.read(write_npy(tmp_path, sound("kt", (4, 3, 5, 2))))
    made = textures(kt)
    whole = np.concatenate(list(made.values()), axis=-1)
    samples = kt.at(formats.nodes(kt))
    assert whole.shape == (12, 5, 2, 12)
    np.testing.assert_allclose(
        whole[..., :9].reshape(samples.matrix.shape), samples.matrix, rtol=1e-6
    )
    np.testing.assert_allclose(whole[..., 9].ravel(), samples.albedo.ravel(), rtol=1e-6)
    missing = formats.read([tmp_path / "matrix.npy"])
    assert "The table has no A: zeros." in notes(missing, textures(missing))


def test_halves_refuse_what_they_cannot_hold() -> None:
    with pytest.raises(ValueError, match="x goes up to 1e"):
        halves({"x": np.full((2, 2, 1), 1e5, np.float32)})
    with pytest.raises(ValueError, match=r"texel \[1, 0\] of x is too small"):
        halves({"x": np.array([[[0.0], [1.0]], [[1e-9], [1.0]]], np.float32)})


@pytest.mark.parametrize("grid", GRIDS)
@pytest.mark.parametrize("language", LANGUAGES)
def test_shader_code_is_whole(grid: Callable[[], Grid], language: str, tmp_path: Path) -> None:
    """What is compiled and run is in tests/gl; this holds without any tool."""
    text = written(grid(), tmp_path, f"t.{language}")["t"].decode()
    code = re.sub(r"//[^\n]*", "", text)
    assert "@" not in text
    assert "FETCH" not in code
    for opening, closing in ("()", "{}"):
        assert code.count(opening) == code.count(closing)
    foreign = {
        "glsl": r"\b(float[234]|lerp|rsqrt|vec[234]f|Load|fn|var)\b",
        "hlsl": r"\b(i?vec[234]|mix|inversesqrt|texelFetch|sampler[23]D|fn|var)\b",
        "wgsl": r"\b(i?vec[234]|float[234]?|int|inversesqrt|texelFetch|sampler[23]D|Load)\b",
    }[language]
    assert not re.findall(foreign, code)
    # The same calculation in the same order in all three.
    reference = re.sub(r"//[^\n]*", "", snippet(grid(), "glsl"))
    assert signs(code) == signs(reference)


def signs(code: str) -> str:
    """Return the operators of a text, without those that only one language has."""
    return re.sub(r"[^-+*/=.]", "", code.replace("->", "").replace(".Load", ""))


def test_an_unknown_language_is_refused() -> None:
    with pytest.raises(ValueError, match="'metal', expected one of glsl"):
        translate("", "metal")


class TestCommand:
    def test_writes_and_names_the_files(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        for ending in ENDINGS:
            if ending == ".exr":
                pytest.importorskip("OpenEXR")
            output = tmp_path / f"ggx{ending}"
            assert main(["export", str(SHIPPED), "-o", str(output)]) == 0
            told = [Path(line) for line in capsys.readouterr().out.split()]
            assert told
            assert all(path.is_file() for path in told)
        assert (tmp_path / "ggx.residual.ktx2").is_file()
        assert not list(tmp_path.glob(".*"))

    def test_is_atomic(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        (tmp_path / "t.h").write_text("old")

        def fail(self: Path, target: Path) -> None:
            raise KeyboardInterrupt

        monkeypatch.setattr(Path, "replace", fail)
        with pytest.raises(KeyboardInterrupt):
            main(["export", str(SHIPPED), "-o", str(tmp_path / "t.h")])
        assert (tmp_path / "t.h").read_text() == "old"
        assert list(tmp_path.iterdir()) == [tmp_path / "t.h"]

    @pytest.mark.parametrize(
        ("table", "output", "more", "message"),
        [
            ("none.npz", "t.h", [], "none.npz: no such file"),
            (str(SHIPPED), "t.xyz", [], "ends in '.xyz', expected .dds"),
            (str(SHIPPED), "none/t.h", [], "no such folder"),
            (str(SHIPPED), "t.h", ["--half"], "half floats are for .dds"),
            (str(SHIPPED), "folder.h", [], "is a folder"),
            ("table.npz", "table.npz", [], "is the table itself"),
            ("ltc_1.dds", "t.glsl", [], "shader code is written for this project's tables"),
        ],
    )
    def test_bad_input(
        self,
        table: str,
        output: str,
        more: list[str],
        message: str,
        tmp_path: Path,
        monkeypatch: pytest.MonkeyPatch,
        capsys: pytest.CaptureFixture[str],
    ) -> None:
        monkeypatch.chdir(tmp_path)
        Path("folder.h").mkdir()
        Path("table.npz").write_bytes(SHIPPED.read_bytes())
        write_dds(tmp_path, sound("heitz", (6, 6)))
        assert main(["export", table, "-o", output, *more]) == 2
        printed = capsys.readouterr()
        assert message in printed.err
        assert printed.err.count("\n") == 1
        assert printed.out == ""
