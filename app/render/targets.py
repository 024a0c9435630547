"""The attachments of one picture size."""

from __future__ import annotations

import moderngl

from app.errors import InputError
from app.render.needs import ATTACHMENTS, FORMAT_BYTES
from app.render.state import release_framebuffer


class Targets:
    """The attachments of one size: made when first asked for, released together."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self.size = (0, 0)
        self._textures: dict[str, moderngl.Texture] = {}
        self._depth: moderngl.Renderbuffer | None = None
        self._framebuffers: dict[tuple[str, ...], moderngl.Framebuffer] = {}

    def resize(self, size: tuple[int, int]) -> None:
        """Release everything if the size is another one."""
        if size != self.size:
            self.release()
            self.size = size

    def texture(self, name: str) -> moderngl.Texture:
        """Return an attachment; raise `InputError` if the driver cannot hold it."""
        if name not in self._textures:
            try:
                if name == "display":
                    texture = self._ctx.texture(self.size, 4)
                else:
                    channels = 2 if name == "tangents" else 4
                    texture = self._ctx.texture(self.size, channels, dtype="f4")
            except moderngl.Error as error:
                raise self._too_large(error) from error
            texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
            self._textures[name] = texture
        return self._textures[name]

    def framebuffer(self, *names: str, depth: bool = False) -> moderngl.Framebuffer:
        """Return what draws into these attachments; raises as `texture`."""
        if names not in self._framebuffers:
            textures = [self.texture(name) for name in names]
            try:
                if depth and self._depth is None:
                    self._depth = self._ctx.depth_renderbuffer(self.size)
                self._framebuffers[names] = self._ctx.framebuffer(
                    color_attachments=textures, depth_attachment=self._depth if depth else None
                )
            except moderngl.Error as error:
                raise self._too_large(error) from error
        return self._framebuffers[names]

    def _too_large(self, error: moderngl.Error) -> InputError:
        return InputError(
            f"size: the graphics driver cannot hold a picture of {self.size[0]}x{self.size[1]} "
            f"({error}), expected a smaller one"
        )

    def keep_only(self, names: set[str]) -> None:
        """Release attachments of other names, and depth unless the G-buffer stays."""
        for name in [n for n in self._textures if n not in names]:
            for used in [u for u in self._framebuffers if name in u]:
                release_framebuffer(self._framebuffers.pop(used))
            self._textures.pop(name).release()
        if "gbuffer" not in names and self._depth is not None:
            self._depth.release()
            self._depth = None

    def allocated(self) -> dict[str, int]:
        """Return the bytes of everything held, by name."""
        pixels = self.size[0] * self.size[1]
        held = {name: pixels * FORMAT_BYTES[ATTACHMENTS[name]] for name in self._textures}
        if self._depth is not None:
            held["depth"] = pixels * FORMAT_BYTES[ATTACHMENTS["depth"]]
        return held

    def release(self) -> None:
        """Release every GPU object."""
        for framebuffer in self._framebuffers.values():
            release_framebuffer(framebuffer)
        for texture in self._textures.values():
            texture.release()
        if self._depth is not None:
            self._depth.release()
        self._framebuffers.clear()
        self._textures.clear()
        self._depth = None
        self.size = (0, 0)
