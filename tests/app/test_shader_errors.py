"""Every driver's way of naming a line ends at our file and line."""

from __future__ import annotations

import pytest

from app.render.assemble import Source
from app.render.programs import ProgramSpec, shader_error

SPEC = ProgramSpec.of("lighting", "passes/a.vert", "passes/b.frag")
SOURCES = (
    Source("", ("passes/a.vert", "common/v.glsl")),
    Source("", ("passes/b.frag", "ltc/x.glsl", "common/y.glsl")),
)
HEAD = "GLSL Compiler failed\n\n{}\n===============\n"


@pytest.mark.parametrize(
    ("driver", "line"),
    [
        ("Mesa", "2:31(5): error: `x' undeclared"),
        ("NVIDIA", '2(31) : error C1503: undefined variable "x"'),
        ("Apple", "ERROR: 2:31: Use of undeclared identifier 'x'"),
        ("Intel and AMD", "ERROR: 2:31: 'x' : undeclared identifier"),
    ],
)
def test_places(driver: str, line: str) -> None:
    log = HEAD.format("fragment_shader") + "\n" + line + "\n2:32(1): error: another"
    error = shader_error(SPEC, SOURCES, log)
    assert (error.file, error.line) == ("common/y.glsl", 31), driver
    assert "undefined" in error.message or "undeclared" in error.message
    assert "error" not in error.message.lower()
    assert error.log == log
    assert str(error).startswith("common/y.glsl:31: ")


def test_vertex_shaders_have_their_own_files() -> None:
    log = HEAD.format("vertex_shader") + "1:7(2): error: syntax error"
    error = shader_error(SPEC, SOURCES, log)
    assert (error.file, error.line) == ("common/v.glsl", 7)


def test_link_errors_name_the_program() -> None:
    log = "GLSL Linker failed\n\nProgram\n=======\nerror: unresolved reference to function `f'"
    error = shader_error(SPEC, SOURCES, log)
    assert (error.file, error.line) == ("lighting", 0)
    assert "unresolved reference" in str(error)


def test_unknown_file_numbers_name_the_entry() -> None:
    error = shader_error(SPEC, SOURCES, HEAD.format("fragment_shader") + "9:4(1): error: odd")
    assert (error.file, error.line) == ("passes/b.frag", 0)
