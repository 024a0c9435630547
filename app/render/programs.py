"""Compiled programs, cached by their entry files and features.

When a changed shader no longer compiles, `Programs.reload` keeps the last good
program in use and reports the failure as a `ShaderError` with file and line.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from app.render.assemble import ShaderError, Source, assemble
from ltc.resources import resource_path

MAX_CACHED = 64
"""Least recently used programs beyond this number are released."""

# Mesa "2:31(5): error: ..." | NVIDIA "2(31) : error C1008: ..." | Apple, Intel, AMD
# "ERROR: 2:31: ...".
_LOG_LINE = re.compile(
    r"^\s*(?:(?:ERROR|error):\s*)?(?P<file>\d+)(?::(?P<a>\d+)(?:\(\d+\))?|\((?P<b>\d+)\))\s*:\s*"
    r"(?:error\s*(?:[A-Z]\d+)?\s*:\s*)?(?P<message>.+)$",
    re.MULTILINE,
)


@dataclass(frozen=True)
class ProgramSpec:
    """What a program is made of; equal specs are one program."""

    name: str
    vertex: str
    fragment: str
    features: tuple[tuple[str, int], ...] = ()

    @classmethod
    def of(
        cls, name: str, vertex: str, fragment: str, features: Mapping[str, int] | None = None
    ) -> ProgramSpec:
        """Return the spec with its features in one order, so that equal ones are equal."""
        return cls(name, vertex, fragment, tuple(sorted((features or {}).items())))

    def sources(self, roots: Sequence[Path]) -> tuple[Source, Source]:
        """Return the assembled vertex and fragment shader.

        Raises
        ------
        ShaderError
            If one does not assemble.
        """
        features = dict(self.features)
        return (
            assemble(self.vertex, features, roots),
            assemble(self.fragment, features, roots),
        )


@dataclass
class _Entry:
    sources: tuple[Source, Source]
    program: moderngl.Program


def shader_roots() -> tuple[Path, ...]:
    """Return the folders that shaders are read from."""
    return (resource_path("shaders"),)


class Programs:
    """The cache. ``compiled`` counts compilations since it was made."""

    def __init__(self, ctx: moderngl.Context, roots: Sequence[Path] | None = None) -> None:
        self._ctx = ctx
        self.roots = tuple(shader_roots() if roots is None else roots)
        self._entries: dict[ProgramSpec, _Entry] = {}
        self.compiled = 0

    def get(self, spec: ProgramSpec) -> moderngl.Program:
        """Return the linked program of ``spec``, compiling it the first time.

        Raises
        ------
        ShaderError
            If it does not assemble, compile or link.
        """
        entry = self._entries.pop(spec, None)
        if entry is None:
            sources = spec.sources(self.roots)
            entry = _Entry(sources, self._link(spec, sources))
            while len(self._entries) >= MAX_CACHED:
                oldest = next(iter(self._entries))
                self._entries.pop(oldest).program.release()
        self._entries[spec] = entry
        return entry.program

    def reload(self) -> bool:
        """Read all shader files again and relink what changed; True if anything did.

        Raises
        ------
        ShaderError
            The first failure, after all were tried. The programs that failed
            stay as they were.
        """
        failure: ShaderError | None = None
        changed = False
        for spec, entry in self._entries.items():
            try:
                sources = spec.sources(self.roots)
                if sources == entry.sources:
                    continue
                program = self._link(spec, sources)
            except ShaderError as error:
                failure = failure or error
                continue
            entry.program.release()
            entry.program, entry.sources = program, sources
            changed = True
        if failure:
            raise failure
        return changed

    def specs(self) -> tuple[ProgramSpec, ...]:
        """Return the cached programs, least recently used first."""
        return tuple(self._entries)

    def release(self) -> None:
        """Release every program."""
        for entry in self._entries.values():
            entry.program.release()
        self._entries.clear()

    def _link(self, spec: ProgramSpec, sources: tuple[Source, Source]) -> moderngl.Program:
        vertex, fragment = sources
        self.compiled += 1
        try:
            return self._ctx.program(vertex_shader=vertex.text, fragment_shader=fragment.text)
        except moderngl.Error as error:
            # A failed link leaves its error flag behind, which is not the caller's.
            _ = self._ctx.error
            raise shader_error(spec, sources, str(error)) from error


def shader_error(spec: ProgramSpec, sources: tuple[Source, Source], log: str) -> ShaderError:
    """Return a driver's log as an error that names our file and line."""
    source = sources[0] if "vertex_shader" in log else sources[1]
    found = _LOG_LINE.search(log)
    if found is None:
        lines = [line.strip() for line in log.splitlines() if line.strip(" =-")]
        return ShaderError(spec.name, 0, lines[-1] if lines else "does not link", log)
    file, line = source.locate(int(found["file"]), int(found["a"] or found["b"]))
    return ShaderError(file, line, found["message"].strip(), log)


def set_uniform(program: moderngl.Program, name: str, value: Any) -> None:
    """Set a uniform, unless this variant of the program has none of that name."""
    member = program.get(name, None)
    if isinstance(member, moderngl.Uniform):
        member.value = value


def write_uniform(program: moderngl.Program, name: str, matrix: NDArray[np.float64]) -> None:
    """Set a matrix uniform from rows (n, n) float64."""
    member = program.get(name, None)
    if isinstance(member, moderngl.Uniform):
        member.write(matrix.T.astype(np.float32).tobytes())
