"""Pictures of lights on the GPU: their atlas, and their blurred levels, made there.

Levels are made as `ltc.prefilter` defines them, in float32, and stored as half floats
(`app.render.picture_layout`). A picture is filtered anew when its texels, the light's outline or
how it lies on the light are others; the rest of the atlas stays. What an outline covers of each
texel is computed exactly, once for an outline.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import moderngl
import numpy as np
from numpy.typing import NDArray

from app.caching import ByteCache
from app.curves import line_as_cubic
from app.render.picture_layout import BORDER, FloatArray, LaidPicture, PictureLayout
from app.render.programs import Programs, ProgramSpec, set_uniform, write_uniform
from app.render.state import FullScreenTriangle, begin_pass, release_framebuffer
from ltc.picture_cells import coverage
from ltc.prefilter import HALF_SCALE, PAD

Image = NDArray[np.float32]

LEVEL_BORDER = 4
"""Texels around a level while it is made: the widest filter's support never leaves them."""

BASE = ProgramSpec.of("picture base", "passes/fullscreen.vert", "passes/picture_base.frag")
DOWN = ProgramSpec.of("picture down", "passes/fullscreen.vert", "passes/picture_down.frag")
UP = ProgramSpec.of("picture up", "passes/fullscreen.vert", "passes/picture_up.frag")
COPY = ProgramSpec.of("picture copy", "passes/fullscreen.vert", "passes/picture_copy.frag")

PICTURE_PROGRAMS = (BASE, DOWN, UP, COPY)

COVERAGE_BYTES = 64 * 2**20
"""Of what outlines cover, kept for pictures that play."""


@dataclass(frozen=True)
class _Held:
    """What a picture in the atlas was made of."""

    picture: LaidPicture

    def is_still(self, other: LaidPicture) -> bool:
        mine = self.picture
        return (
            mine.frame.texels is other.frame.texels
            and mine.light.outline == other.light.outline
            and mine.light.picture == other.light.picture
            # A light that is turned in space changes these by roundings.
            and np.allclose(mine.picture_from_texel(), other.picture_from_texel(), 1e-9, 1e-12)
            and (mine.source, mine.levels) == (other.source, other.levels)
        )


class PictureAtlas:
    """Owner of the atlas. ``filtered`` counts the pictures that were laid and blurred."""

    def __init__(self, ctx: moderngl.Context, programs: Programs) -> None:
        self._ctx = ctx
        self._programs = programs
        self._texture: moderngl.Texture | None = None
        self._held: dict[int, _Held] = {}
        self._triangle = FullScreenTriangle(ctx)
        self.filtered = 0

    @property
    def bytes(self) -> int:
        """Bytes held on the GPU."""
        texture = self._texture
        return 0 if texture is None else 8 * texture.width * texture.height

    def holds(self, layout: PictureLayout) -> bool:
        """Return whether the pictures of a layout are held as they are there, and no others."""
        return self._held.keys() == layout.pictures.keys() and all(
            self._held[index].is_still(picture) for index, picture in layout.pictures.items()
        )

    def update(self, layout: PictureLayout) -> None:
        """Hold the pictures of a layout and no others."""
        if not layout.pictures:
            self.release()
            return
        size = (layout.width, layout.height)
        if self._texture is None or self._texture.size != size:
            self.release()
            self._texture = self._ctx.texture(size, 4, dtype="f2")
            self._texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
            self._texture.repeat_x = self._texture.repeat_y = False
        for index, picture in layout.pictures.items():
            held = self._held.get(index)
            if held is None or not held.is_still(picture):
                self._fill(picture)
                self._held[index] = _Held(picture)
                self.filtered += 1
        for index in self._held.keys() - layout.pictures.keys():
            del self._held[index]

    def forget(self) -> None:
        """Fill everything again with the next update."""
        self._held.clear()

    def bind(self, program: moderngl.Program, unit: int) -> None:
        """Make ``program`` read from here, if it reads pictures."""
        if self._texture is not None and "light_pictures" in program:
            set_uniform(program, "light_pictures", unit)
            self._texture.use(unit)

    def read(self) -> FloatArray:
        """Return the atlas (height, width, 4), for tests."""
        assert self._texture is not None
        raw = np.frombuffer(self._texture.read(), dtype=np.float16)
        return raw.reshape(self._texture.height, self._texture.width, 4).astype(np.float64)

    def release(self) -> None:
        """Release every GPU object."""
        if self._texture is not None:
            self._texture.release()
        self._texture = None
        self._held.clear()
        self._triangle.release()

    # Within

    def _fill(self, picture: LaidPicture) -> None:
        assert self._texture is not None
        made: list[moderngl.Texture] = []
        atlas = self._ctx.framebuffer(color_attachments=[self._texture])
        try:
            texels = np.ascontiguousarray(picture.frame.texels, dtype=np.float32)
            source = self._ctx.texture(picture.source_size, 4, texels.tobytes(), dtype="f4")
            made.append(source)
            tiles = picture.light.picture is not None and picture.light.picture.fit == "tile"
            source.repeat_x = source.repeat_y = tiles
            source.build_mipmaps()
            self._copy(atlas, source, picture.source, picture.source_size, BORDER, tiles, picture)
            sharp = self._sharp_levels(picture, source, tiles, made)
            blurred = self._blurred_levels(sharp, made)
            for level, corner, size in zip(
                blurred, picture.level_corners(), picture.level_sizes(), strict=True
            ):
                self._copy_level(atlas, level, corner, size)
        finally:
            release_framebuffer(atlas)
            for texture in made:
                texture.release()

    def _sharp_levels(
        self,
        picture: LaidPicture,
        source: moderngl.Texture,
        tiles: bool,
        made: list[moderngl.Texture],
    ) -> list[moderngl.Texture]:
        sizes = picture.level_sizes()
        covered = covered_texels(picture)
        mask = self._ctx.texture(sizes[0], 1, covered.tobytes(), dtype="f4")
        made.append(mask)
        program = self._programs.get(BASE)
        source.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
        set_uniform(program, "border", (LEVEL_BORDER, LEVEL_BORDER))
        set_uniform(program, "size", sizes[0])
        low = [PAD / (1.0 + 2.0 * PAD) * n for n in sizes[0]]
        set_uniform(program, "low", tuple(low))
        set_uniform(program, "high", tuple(n - a for n, a in zip(sizes[0], low, strict=True)))
        set_uniform(program, "tiles", tiles)
        set_uniform(program, "largest", picture.largest)
        write_uniform(program, "picture_from_texel", picture.picture_from_texel())
        levels = [self._draw_level(program, sizes[0], {"source": source, "coverage": mask}, made)]
        program = self._programs.get(DOWN)
        for finer, size in itertools.pairwise(sizes):
            set_uniform(program, "border", (LEVEL_BORDER, LEVEL_BORDER))
            set_uniform(program, "finer_size", finer)
            levels.append(self._draw_level(program, size, {"finer": levels[-1]}, made))
        return levels

    def _blurred_levels(
        self, sharp: Sequence[moderngl.Texture], made: list[moderngl.Texture]
    ) -> list[moderngl.Texture]:
        program = self._programs.get(UP)
        levels: list[moderngl.Texture] = []
        for k in range(len(sharp) - 1, -1, -1):
            size = tuple(n - 2 * LEVEL_BORDER for n in sharp[k].size)
            is_last = k == len(sharp) - 1
            set_uniform(program, "border", (LEVEL_BORDER, LEVEL_BORDER))
            set_uniform(program, "size", size)
            set_uniform(program, "is_last", is_last)
            textures = {
                "sharp": sharp[k],
                "coarser_sharp": sharp[k if is_last else k + 1],
                "coarser": sharp[k] if is_last else levels[-1],
            }
            levels.append(self._draw_level(program, (size[0], size[1]), textures, made))
        return levels[::-1]

    def _draw_level(
        self,
        program: moderngl.Program,
        size: tuple[int, int],
        textures: dict[str, moderngl.Texture],
        made: list[moderngl.Texture],
    ) -> moderngl.Texture:
        bordered = (size[0] + 2 * LEVEL_BORDER, size[1] + 2 * LEVEL_BORDER)
        level = self._ctx.texture(bordered, 4, dtype="f4")
        level.filter = (moderngl.NEAREST, moderngl.NEAREST)
        made.append(level)
        target = self._ctx.framebuffer(color_attachments=[level])
        begin_pass(target, bordered)
        for unit, (name, texture) in enumerate(textures.items()):
            set_uniform(program, name, unit)
            texture.use(unit)
        self._triangle.draw(program)
        release_framebuffer(target)
        return level

    def _copy_level(
        self,
        atlas: moderngl.Framebuffer,
        level: moderngl.Texture,
        corner: tuple[int, int],
        size: tuple[int, int],
    ) -> None:
        self._draw_into(
            atlas, level, corner, size, (corner[0] - LEVEL_BORDER, corner[1] - LEVEL_BORDER),
            (size[0] + 2 * LEVEL_BORDER, size[1] + 2 * LEVEL_BORDER), False, (1.0, 1.0),
        )  # fmt: skip

    def _copy(
        self,
        atlas: moderngl.Framebuffer,
        source: moderngl.Texture,
        corner: tuple[int, int],
        size: tuple[int, int],
        border: int,
        tiles: bool,
        picture: LaidPicture,
    ) -> None:
        source.filter = (moderngl.NEAREST, moderngl.NEAREST)
        start = (corner[0] - border, corner[1] - border)
        around = (size[0] + 2 * border, size[1] + 2 * border)
        one = HALF_SCALE
        self._draw_into(
            atlas, source, start, around, corner, size, tiles, (one / picture.largest, one)
        )

    def _draw_into(
        self,
        atlas: moderngl.Framebuffer,
        source: moderngl.Texture,
        start: tuple[int, int],
        extent: tuple[int, int],
        origin: tuple[int, int],
        size: tuple[int, int],
        tiles: bool,
        factors: tuple[float, float],
    ) -> None:
        program = self._programs.get(COPY)
        begin_pass(atlas, atlas.size)
        atlas.viewport = (*start, *extent)
        set_uniform(program, "source", 0)
        set_uniform(program, "source_size", size)
        set_uniform(program, "corner", origin)
        set_uniform(program, "tiles", tiles)
        set_uniform(program, "factors", factors)
        source.use(0)
        self._triangle.draw(program)


def covered_texels(picture: LaidPicture) -> Image:
    """Return which share of each texel of level 0 the outline covers, (rows, columns)."""
    loops = tuple((loop.shape, loop.tobytes()) for loop in picture.outline_in_levels())
    return _coverages(loops, *picture.level_size)


def _coverage(loops: tuple[tuple[tuple[int, ...], bytes], ...], width: int, height: int) -> Image:
    curves = []
    for shape, data in loops:
        loop = np.frombuffer(data).reshape(shape)
        straight = loop.ndim == 2
        curves.append(line_as_cubic(loop, np.roll(loop, -1, axis=0)) if straight else loop)
    return coverage(np.concatenate(curves), width, height).astype(np.float32)


_coverages = ByteCache(_coverage, lambda mask: mask.nbytes, COVERAGE_BYTES)
