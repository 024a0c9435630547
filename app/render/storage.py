"""GPU storage for arrays of vec4 records: a uniform block, or a texture when they are many."""

from __future__ import annotations

import moderngl
import numpy as np
from numpy.typing import NDArray

from app.render.features import STORAGE_TEXTURE_WIDTH
from app.render.programs import set_uniform


def storage_bytes(texels: int, uniform_texels: int) -> int:
    """Return the bytes that `TexelStorage` takes for ``texels`` records."""
    if uniform_texels:
        return 16 * uniform_texels
    return 16 * STORAGE_TEXTURE_WIDTH * _rows(texels)


def _rows(texels: int) -> int:
    """Return the rows of a texture that holds so many texels; even none needs one."""
    return max(1, -(-texels // STORAGE_TEXTURE_WIDTH))


class TexelStorage:
    """Owner of one uniform buffer or one RGBA32F texture. ``uploads`` counts its fillings."""

    def __init__(self, ctx: moderngl.Context, name: str, block: str) -> None:
        self._ctx = ctx
        self.name = name
        self.block = block
        self._buffer: moderngl.Buffer | None = None
        self._texture: moderngl.Texture | None = None
        self.uploads = 0

    def update(self, texels: NDArray[np.float32], uniform_texels: int) -> None:
        """Upload (n, 4) texels; to a block of ``uniform_texels``, or a texture if that is 0."""
        if uniform_texels:
            filled = np.zeros((uniform_texels, 4), dtype=np.float32)
        else:
            rows = _rows(len(texels))
            filled = np.zeros((rows * STORAGE_TEXTURE_WIDTH, 4), dtype=np.float32)
        filled[: len(texels)] = texels
        if self.bytes != filled.nbytes or (self._buffer is None) == bool(uniform_texels):
            self.release()
            if uniform_texels:
                self._buffer = self._ctx.buffer(reserve=filled.nbytes, dynamic=True)
            else:
                self._texture = self._ctx.texture((STORAGE_TEXTURE_WIDTH, rows), 4, dtype="f4")
                self._texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        if self._buffer is not None:
            self._buffer.write(filled.tobytes())
        elif self._texture is not None:
            self._texture.write(filled.tobytes())
        self.uploads += 1

    def bind(self, program: moderngl.Program, unit: int) -> None:
        """Make ``program`` read from here; ``unit`` is free for a texture and for a block."""
        block = program.get(self.block, None)
        if self._buffer is not None and isinstance(block, moderngl.UniformBlock):
            block.binding = unit
            self._buffer.bind_to_uniform_block(unit)
        elif self._texture is not None:
            set_uniform(program, f"{self.name}_texels", unit)
            self._texture.use(unit)

    @property
    def bytes(self) -> int:
        """Bytes held on the GPU."""
        if self._buffer is not None:
            return int(self._buffer.size)
        if self._texture is not None:
            return 16 * self._texture.width * self._texture.height
        return 0

    def release(self) -> None:
        """Release the GPU object; the storage can be filled again."""
        for thing in (self._buffer, self._texture):
            if thing is not None:
                thing.release()
        self._buffer = self._texture = None
