"""The GLSL preprocessor, without a GPU."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import pytest

from app.render.assemble import ShaderError, assemble


def write(root: Path, files: dict[str, str]) -> Path:
    for name, text in files.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text, encoding="utf-8")
    return root


def code_of(text: str) -> list[str]:
    """Lines without version, defines, #line and origin comments."""
    return [line.strip() for line in text.splitlines() if line and line[0] not in "#/"]


def test_includes_nest_and_come_once(tmp_path: Path) -> None:
    write(
        tmp_path,
        {
            "main.frag": '#include "a.glsl"\n#include "b.glsl"\nvoid main() {}\n',
            "a.glsl": '#include "b.glsl"\nfloat a;\n',
            "b.glsl": '#include "a.glsl"\nfloat b;\n',
        },
    )
    source = assemble("main.frag", {}, [tmp_path])
    assert code_of(source.text) == ["float b;", "float a;", "void main() {}"]
    assert source.files == ("main.frag", "a.glsl", "b.glsl")
    assert source.text.startswith("#version 410 core\n")


@pytest.mark.parametrize(
    ("condition", "holds"),
    [
        ("A", True),
        ("!A", False),
        ("A && B", False),
        ("A || B", True),
        ("!(A && B) && N == 8", True),
        ("N > 4 + 4", False),
        ("N >= 4 * 2 && N % 3 == 2", True),
        ("N - 8", False),
        ("-N < 0", True),
        ("B || A && B", False),
        ("(B || A) && !B", True),
    ],
)
def test_conditions(tmp_path: Path, condition: str, holds: bool) -> None:
    write(tmp_path, {"x.frag": f"#if {condition}\nyes\n#else\nno\n#endif\n"})
    source = assemble("x.frag", {"A": 1, "B": 0, "N": 8}, [tmp_path])
    assert code_of(source.text) == ["yes" if holds else "no"]


def test_branches_not_taken_leave_nothing_behind(tmp_path: Path) -> None:
    write(
        tmp_path,
        {
            "x.frag": '#if BEZIER\n#include "bezier.glsl"\n#if UNKNOWN_IN_DEAD_CODE\n#endif\n'
            "#elif POLYGON\npolygon\n#elif 1\nnever\n#else\nneither\n#endif\nend\n",
            "bezier.glsl": "bezier\n",
        },
    )
    source = assemble("x.frag", {"BEZIER": 0, "POLYGON": 1}, [tmp_path])
    assert code_of(source.text) == ["polygon", "end"]
    assert "bezier" not in source.text
    assert source.files == ("x.frag",)


def test_comments_go_and_lines_keep_their_numbers(tmp_path: Path) -> None:
    write(
        tmp_path,
        {
            "x.frag": "// naïve π\n/* two\nlines */ float a;\n"
            '#include "b.glsl"\n\n\nfloat c; // end\n',
            "b.glsl": "\nfloat b;\n",
        },
    )
    source = assemble("x.frag", {}, [tmp_path])
    assert source.text.isascii()
    lines = source.text.splitlines()
    places = {}
    for directive, line in pairwise(lines):
        if directive.startswith("#line"):
            number, index = map(int, directive.split()[1:])
            places[line.strip()] = source.locate(index, number)
    assert places == {
        "float a;": ("x.frag", 3),
        "float b;": ("b.glsl", 2),
        "float c;": ("x.frag", 7),
    }


def test_features_are_defined(tmp_path: Path) -> None:
    write(tmp_path, {"x.frag": "float a[N];\n"})
    assert "#define N 8" in assemble("x.frag", {"N": 8}, [tmp_path]).text


def test_first_root_wins(tmp_path: Path) -> None:
    write(tmp_path, {"mine/a.glsl": "mine\n", "theirs/a.glsl": "theirs\n"})
    source = assemble("a.glsl", {}, [tmp_path / "mine", tmp_path / "theirs"])
    assert code_of(source.text) == ["mine"]


@pytest.mark.parametrize(
    ("text", "line", "part"),
    [
        ("\n#if SPECULR\n#endif\n", 2, "unknown feature 'SPECULR', expected one of SPECULAR"),
        ("#if SPECULR\n#endif\n", 1, "did you mean 'SPECULAR'?"),
        ('#include "ltc/polygn.glsl"\n', 1, "did you mean 'ltc/polygon.glsl'?"),
        ("#include <polygon>\n", 1, "expected #include"),
        ("#if 1\n", 1, "#if without #endif"),
        ("#endif\n", 1, "#endif without #if"),
        ("#if 1\n#else\n#else\n#endif\n", 3, "#else without #if"),
        ("#ifdef SPECULAR\n#endif\n", 1, "#ifdef"),
        ("#version 450\n", 1, "#version"),
        ("#if (SPECULAR\n#endif\n", 1, "ends early"),
        ("#if SPECULAR SPECULAR\n#endif\n", 1, "cannot read"),
        ("#if SPECULAR $ 1\n#endif\n", 1, "cannot read"),
        ("#if 1 / 0\n#endif\n", 1, "divides by zero"),
        ("#if\n#endif\n", 1, "ends early"),
    ],
)
def test_errors_name_the_place(tmp_path: Path, text: str, line: int, part: str) -> None:
    write(tmp_path, {"x.frag": text, "ltc/polygon.glsl": ""})
    with pytest.raises(ShaderError) as caught:
        assemble("x.frag", {"SPECULAR": 1}, [tmp_path])
    assert (caught.value.file, caught.value.line) == ("x.frag", line)
    assert part in str(caught.value)


def test_a_missing_entry_names_the_nearest(tmp_path: Path) -> None:
    write(tmp_path, {"passes/lighting.frag": ""})
    with pytest.raises(ShaderError, match=r"did you mean 'passes/lighting.frag'"):
        assemble("passes/lihgting.frag", {}, [tmp_path])
