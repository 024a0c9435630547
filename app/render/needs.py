"""What the renderer compiles, allocates and runs for a scene, derived in one place.

`needs_of` is what the renderer carries out; `app.render.plan` adds sizes and reasons for
people. Neither touches GL.
"""

from __future__ import annotations

from dataclasses import dataclass

from app.errors import InputError
from app.render import gbuffer
from app.render.everything import everything_on
from app.render.features import LightingFeatures, Limits
from app.render.gbuffer import objects_spec
from app.render.light_shapes import curve_texels, has_triangles
from app.render.lighting import lighting_spec
from app.render.pictures import PICTURE_PROGRAMS
from app.render.programs import ProgramSpec
from app.render.techniques import DEFAULT_TECHNIQUE
from app.scene import PixelView, Scene

ATTACHMENTS = {
    "gbuffer": "RGBA32F",
    "tangents": "RG32F",
    "depth": "DEPTH24",
    "radiance": "RGBA32F",
    "radiance 2": "RGBA32F",
    "noise": "RGBA32F",
    "noise 2": "RGBA32F",
    "display": "RGBA8",
}
"""Every attachment's format."""

FORMAT_BYTES = {"RGBA32F": 16, "RG32F": 8, "RGBA8": 4, "DEPTH24": 4}
"""Bytes of a pixel; 24 bits of depth are stored in 32."""


@dataclass(frozen=True)
class Needs:
    """What the renderer compiles, allocates and runs for a scene.

    ``programs`` are compiled by the G-buffer and lighting passes (the display
    program comes with the first picture that is shown); ``attachments`` are
    (name, format) pairs.
    """

    lighting: LightingFeatures
    programs: tuple[ProgramSpec, ...]
    attachments: tuple[tuple[str, str], ...]

    @property
    def accumulates(self) -> bool:
        """Whether each sample reads the mean of those before it."""
        return any(name == "radiance 2" for name, _ in self.attachments)


def needs_of(
    scene: Scene,
    samples: int,
    limits: Limits,
    technique: str = DEFAULT_TECHNIQUE,
    view: PixelView = "radiance",
    culls: bool = False,
    everything: bool = False,
) -> Needs:
    """Return what a scene needs with ``samples`` per pixel.

    ``culls``: whether faint lights are to be skipped. With ``everything`` nothing is left
    out (`app.render.everything`).

    Raises
    ------
    InputError
        If lights or objects are more than the machine can hold.
    """
    lighting = LightingFeatures.of(scene, samples, limits, technique, view, culls)
    if everything:
        lighting = everything_on(lighting)
    outlines = curve_texels(scene.lights)
    if outlines > limits.storage_texels:
        raise InputError(
            f"lights: the curves of visible lights need {outlines} records, "
            f"expected at most {limits.storage_texels} on this machine"
        )
    programs: list[ProgramSpec] = []
    attachments: list[str] = []
    if lighting.lit:
        attachments += ["gbuffer", *(["tangents"] if lighting.tangents else []), "depth"]
        if everything or scene.objects:
            programs.append(objects_spec(lighting.tangents))
        if everything or has_triangles(scene.lights):
            programs.append(gbuffer.LIGHTS)
        if everything or outlines:
            programs.append(gbuffer.CURVED_LIGHTS)
        if lighting.lights.pictures:
            programs.extend(PICTURE_PROGRAMS)
        programs.append(lighting_spec(lighting))
    attachments.append("radiance")
    if lighting.lit and lighting.accumulates:
        attachments.append("radiance 2")
        if lighting.estimates_noise:
            attachments += ["noise", "noise 2"]
    attachments.append("display")
    return Needs(
        lighting, tuple(programs), tuple((name, ATTACHMENTS[name]) for name in attachments)
    )
