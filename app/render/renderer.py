"""The renderer: a `Shot` in, radiance and display colours out.

It takes a context and knows neither window nor files, so the same shot gives the
same bytes wherever it is drawn. What a shot needs is decided in one place
(`app.render.needs`); here it is carried out, and a part of the scene is uploaded
again only when it `is not` the object that was uploaded last.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import Any

import moderngl
import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from app.errors import InputError
from app.pictures import load_frame
from app.render.camera import CameraFrame
from app.render.features import LightingFeatures, LightNeeds, Limits
from app.render.gbuffer import GBufferPass
from app.render.lighting import LightingPass
from app.render.needs import Needs, needs_of
from app.render.noise import Noise, NoisePass
from app.render.pack import CurveForm
from app.render.picking import Hit, Picker
from app.render.picture_layout import NO_PICTURES, lay_pictures
from app.render.plan import Plan, make_plan
from app.render.post import DisplayPass
from app.render.programs import Programs
from app.render.sampling import pixel_offset
from app.render.state import begin_pass
from app.render.surfaces import NO_SURFACES, Surfaces, surfaces_of
from app.render.targets import Targets
from app.render.techniques import (
    find_technique,
    parse_technique,
    suited_technique,
    technique_of,
)
from app.render.timers import Clock, PassTimers
from app.scene import Display, PixelView, RenderSettings, Scene, Shot, Vec3


@dataclass(frozen=True)
class _Seen:
    """What a G-buffer and its radiance depend on, with parts compared by identity first."""

    shot: Shot

    def same_radiance(self, other: Shot) -> bool:
        mine = self.shot
        if mine is other:
            return True
        a, b = mine.scene, other.scene
        return (
            (mine.width, mine.height) == (other.width, other.height)
            and mine.settings.technique == other.settings.technique
            and mine.settings.view == other.settings.view
            and mine.settings.positions == other.settings.positions
            and mine.settings.cull == other.settings.cull
            and (not mine.settings.cull or a.display.exposure == b.display.exposure)
            and all(
                getattr(a, part) is getattr(b, part) or getattr(a, part) == getattr(b, part)
                for part in ("camera", "materials", "objects", "lights")
            )
        )


_NOISE_OF = {"radiance": "noise", "radiance 2": "noise 2"}
"""Attachments that are written and read together."""


class Renderer:
    """Renders shots with one OpenGL context.

    Parameters
    ----------
    ctx : moderngl.Context
        OpenGL 4.1 or later; must be current whenever a method is called.
    everything : bool
        Leave nothing out, to measure what that costs (`app.render.everything`).

    Notes
    -----
    Every method that renders may raise `InputError` (the scene asks for more
    than the machine has, a mesh cannot be loaded, the technique is unknown) and
    `ShaderError` (a changed shader does not compile).
    """

    def __init__(self, ctx: moderngl.Context, everything: bool = False) -> None:
        self.ctx = ctx
        self.everything = everything
        self._pictures = NO_PICTURES
        self.limits = Limits.of(ctx)
        self.programs = Programs(ctx)
        self.lighting_passes = 0
        self._gbuffer = GBufferPass(ctx, self.programs)
        self._lighting = LightingPass(ctx, self.programs)
        self._display = DisplayPass(ctx, self.programs)
        self._noise = NoisePass(ctx, self.programs)
        self._targets = Targets(ctx)
        self._picker = Picker(ctx)
        self._timers = PassTimers(ctx)
        self._cpu_ms = 0.0
        self._held: Scene | None = None
        self._held_lights: tuple[object, tuple[CurveForm, bool, int]] | None = None
        self._held_materials: tuple[object, object, int] | None = None
        self._needs: Needs | None = None
        self._needs_key: tuple[str, bool, PixelView, bool] | None = None
        self._seen: _Seen | None = None
        self._stale = False
        self._samples = 0
        self._newest = ""
        self._displayed: Display | None = None

    # Rendering

    def render(self, shot: Shot) -> None:
        """Render all samples of ``shot`` from scratch."""
        self._begin(shot, shot.settings.samples)
        for _ in range(shot.settings.samples):
            self._add_sample()

    def accumulate(self, shot: Shot, max_samples: int) -> int:
        """Add one sample if ``shot`` shows what the last call showed, else start again.

        Exposure and tone map do not count as a change. Nothing is drawn once
        ``max_samples`` are there.

        Returns
        -------
        int
            Samples so far; ``max_samples`` means idle.
        """
        limit = max(1, max_samples)
        restart = (
            self._seen is None
            or self._stale
            or not self._seen.same_radiance(shot)
            or self._has_new_frames(shot.settings.time)
            or (limit > 1 and self._needs is not None and not self._needs.lighting.accumulates)
        )
        if restart:
            self._begin(shot, limit)
        else:
            self._seen = _Seen(shot)
        if self._samples < limit:
            self._add_sample()
        return self._samples

    def present(self, shot: Shot, framebuffer: moderngl.Framebuffer) -> None:
        """Tone-map the radiance rendered last to ``framebuffer``, as ``shot`` wants it displayed.

        The picture goes to the lower left corner, pixel by pixel.

        Raises
        ------
        RuntimeError
            If nothing was rendered yet.
        """
        radiance = self.radiance_texture
        with self._timers.measure("display"):
            self._display.draw(framebuffer, radiance, shot.scene.display, self._view)

    def radiance(self) -> NDArray[np.float32]:
        """Return the mean linear radiance (h, w, 3) float32, row 0 at the top.

        Raises
        ------
        RuntimeError
            If nothing was rendered yet.
        """
        return _top_down(self.radiance_texture, np.float32)

    def display(self) -> NDArray[np.uint8]:
        """Return the display colours (h, w, 3) uint8 sRGB, row 0 at the top.

        Raises
        ------
        RuntimeError
            If nothing was rendered yet.
        """
        return _top_down(self.texture, np.uint8)

    @property
    def texture(self) -> moderngl.Texture:
        """The display colours as an RGBA8 texture, row 0 at the bottom, up to date.

        Raises
        ------
        RuntimeError
            If nothing was rendered yet.
        """
        radiance = self.radiance_texture
        assert self._seen is not None
        wanted = self._seen.shot.scene.display
        if self._displayed != wanted:
            target = self._targets.framebuffer("display")
            with self._timers.measure("display"):
                self._display.draw(target, radiance, wanted, self._view)
            self._displayed = wanted
        return self._targets.texture("display")

    @property
    def radiance_texture(self) -> moderngl.Texture:
        """The mean linear radiance as an RGBA32F texture, row 0 at the bottom; alpha is coverage.

        Raises
        ------
        RuntimeError
            If nothing was rendered yet.
        """
        if self._seen is None or not self._newest:
            raise RuntimeError("nothing was rendered yet")
        return self._targets.texture(self._newest)

    # Questions

    def noise(self) -> Noise | None:
        """Return the estimated error of the picture; None unless it is made of random samples.

        Raises
        ------
        RuntimeError
            If the number of samples is odd: halves are compared.
        """
        if self._needs is None or not self._needs.lighting.estimates_noise or not self._newest:
            return None
        if self._samples % 2:
            raise RuntimeError(f"there are {self._samples} samples, expected an even number")
        texture = self._targets.texture
        return self._noise.measure(
            texture("gbuffer"), texture(self._newest), texture(_NOISE_OF[self._newest]),
            self._samples,
        )  # fmt: skip

    def radiance_at(self, column: int, row: int) -> Vec3:
        """Return the mean linear radiance of one pixel, counted from the top left.

        Raises
        ------
        RuntimeError
            If nothing was rendered yet.
        ValueError
            If there is no such pixel.
        """
        width, height = self.radiance_texture.size
        if not (0 <= column < width and 0 <= row < height):
            raise ValueError(f"pixel ({column}, {row}) is not in a picture of {width}x{height}")
        place = (column, height - 1 - row, 1, 1)
        raw = self._targets.framebuffer(self._newest).read(place, components=3, dtype="f4")
        red, green, blue = np.frombuffer(raw, dtype=np.float32).tolist()
        return red, green, blue

    def evaluations_at(self, x: float, y: float) -> int:
        """Return how often the contour integral is evaluated for one point of the last shot.

        Pixel coordinates are those of `pick`. A technique that samples counts one sample. The
        program that counts is compiled the first time.

        Raises
        ------
        RuntimeError
            If nothing was rendered yet.
        """
        return round(self._shade(x, y, counts=True)[0])

    def shade_at(self, x: float, y: float) -> Vec3:
        """Return the radiance of one point of the last shot by a single sample.

        Pixel coordinates are those of `pick`.

        Raises
        ------
        RuntimeError
            If nothing was rendered yet.
        """
        return self._shade(x, y, counts=False)

    def _shade(self, x: float, y: float, counts: bool) -> Vec3:
        if self._seen is None or self._needs is None:
            raise RuntimeError("nothing was rendered yet")
        shot = self._seen.shot
        lighting = replace(self._needs.lighting, counts=counts, accumulates=False)
        if not lighting.lit:
            return 0.0, 0.0, 0.0
        self._hold_geometry(shot.scene, self._gbuffer.has_tangents)
        frame = CameraFrame.of(shot.scene.camera, shot.width / shot.height)
        size = (shot.width, shot.height)
        self._hold_shading(shot.scene, lighting, shot.settings.time)
        return self._picker.shade(
            self._gbuffer, self._lighting, lighting, frame, size, x, y, _faint_radiance(shot)
        )

    def pick(self, x: float, y: float) -> Hit | None:
        """Return what the last shot shows at pixel coordinates from the top left, or None.

        The middle of the top left pixel is (0.5, 0.5). The one point is drawn
        again, so the answer does not depend on the samples' jitter.

        Raises
        ------
        RuntimeError
            If nothing was rendered yet.
        """
        if self._seen is None:
            raise RuntimeError("nothing was rendered yet")
        shot = self._seen.shot
        if not (0.0 <= x < shot.width and 0.0 <= y < shot.height):
            return None
        self._hold_geometry(shot.scene, self._gbuffer.has_tangents)
        frame = CameraFrame.of(shot.scene.camera, shot.width / shot.height)
        return self._picker.pick(self._gbuffer, frame, (shot.width, shot.height), x, y)

    def surfaces(self) -> Surfaces:
        """Return the surface points of the sample rendered last, if that was a pixel's centre.

        Raises
        ------
        RuntimeError
            If nothing was rendered yet.
        """
        if self._seen is None or self._needs is None:
            raise RuntimeError("nothing was rendered yet")
        shot = self._seen.shot
        if not self._needs.lighting.lit:
            return NO_SURFACES
        tangents = self._targets.texture("tangents") if self._needs.lighting.tangents else None
        return surfaces_of(shot, self._targets.texture("gbuffer"), tangents)

    def probe(
        self,
        scene: Scene,
        settings: RenderSettings,
        position: ArrayLike,
        normal: ArrayLike,
        tangent: ArrayLike,
        view: ArrayLike,
        alpha: ArrayLike,
        anisotropic: bool | None = None,
    ) -> dict[str, NDArray[np.float32]]:
        """Return what points of a white material send to their viewers, by lobe.

        Parameters
        ----------
        position, normal, tangent, view : (n, 3) float
            World space; ``normal`` and ``view`` (to the viewer) unit.
        alpha : (n, 2) float
            GGX parameters along tangent and bitangent.
        anisotropic : bool, optional
            Whether lobes are looked up in the anisotropic table; by default where some
            point's alphas differ.

        Returns
        -------
        dict
            ``"specular"`` and ``"diffuse"``, (n, 3) float32 radiance: F = 1 and
            albedo 1, summed over the scene's lights. Of a technique that samples, the
            mean of ``settings.samples``.

        Raises
        ------
        ValueError
            If a shape is wrong.
        """
        arrays = point_arrays(
            position=position, normal=normal, tangent=tangent, view=view, alpha=alpha
        )
        count = len(arrays["position"])
        alphas = arrays["alpha"]
        if anisotropic is None:
            anisotropic = bool(np.any(alphas[:, 0] != alphas[:, 1]))
        technique = suited_technique(settings.technique, anisotropic)
        anisotropic = anisotropic and find_technique(technique).anisotropic
        needs = LightNeeds.of(scene.lights, self.limits, technique)
        if not (needs.one_sided or needs.two_sided) or not count:
            zero = np.zeros((count, 3), dtype=np.float32)
            return {"specular": zero, "diffuse": zero.copy()}
        self._hold_lights(scene, needs, settings.time)
        if find_technique(technique).has_tables:
            residual = parse_technique(technique).changes.residual
            self._lighting.load_tables(anisotropic, residual)
        samples = settings.samples if find_technique(technique).is_sampled else 1
        specular, diffuse = self._lighting.probe(
            needs, technique, anisotropic, **arrays, samples=samples
        )
        return {"specular": specular, "diffuse": diffuse}

    def forget_pictures(self) -> None:
        """Filter the lights' pictures again with the next sample, to measure what that takes."""
        self._lighting.forget_pictures()

    def timings(self, *, wait: bool = True) -> dict[str, float]:
        """Return the last time of each pass [ms]: gbuffer, lighting, display, and cpu.

        Parameters
        ----------
        wait : bool
            Whether to wait for the GPU. Without, a frame in flight is not held
            up, and the figures are those of the sample before.

        Notes
        -----
        ``cpu`` is what submitting the last sample took here. `timing_source`
        says where the others come from; passes that did not run are missing.
        Where timer queries return nothing the renderer changes to the wall clock
        from then on, and draws the last shot's first sample again for its figures.
        """
        figures = self._timers.milliseconds(wait=wait)
        untrusted = self._timers.source == "timer queries" and not any(figures.values())
        if figures and untrusted and self._seen is not None:
            shot = self._seen.shot
            self._timers.use_clock("wall clock")
            self.render(replace(shot, settings=replace(shot.settings, samples=1)))
            _ = self.texture
            figures = self._timers.milliseconds()
        return {**figures, "cpu": self._cpu_ms}

    @property
    def timing_source(self) -> str:
        """``"timer queries"``, ``"wall clock"`` or ``"processor time"``."""
        return self._timers.source

    def use_clock(self, clock: Clock) -> None:
        """Time passes by the wall clock or by this process's own time, each with a glFinish."""
        self._timers.use_clock(clock)

    def plan(self, shot: Shot) -> Plan:
        """Return what rendering ``shot`` compiles, allocates and loads, and why."""
        return make_plan(shot, self.limits, self.programs.roots, self.everything)

    def allocated(self) -> dict[str, int]:
        """Return the bytes of every buffer, table and attachment held now, by name."""
        return {
            **self._targets.allocated(),
            **self._gbuffer.allocated(),
            **self._lighting.allocated(),
        }

    @property
    def uploads(self) -> dict[str, int]:
        """How often each part of a scene was sent to the GPU since the renderer was made."""
        return {**self._gbuffer.uploads, **self._lighting.uploads}

    # Housekeeping

    def reload_shaders(self) -> bool:
        """Read the shader files again; True if a program changed.

        Raises
        ------
        ShaderError
            If one does not compile: file, line and message. The last good
            programs stay in use.
        """
        try:
            changed = self.programs.reload()
        finally:
            self._stale = True
            self._displayed = None
        return changed

    def begin_again(self) -> None:
        """Start afresh with the next sample: a picture that the scene names has changed."""
        self._stale = True

    def release(self) -> None:
        """Release every GPU object. The renderer cannot be used afterwards."""
        self._targets.release()
        self._gbuffer.release()
        self._lighting.release()
        self._display.release()
        self._noise.release()
        self._timers.release()
        self.programs.release()
        self._picker.release()

    # Within

    def _begin(self, shot: Shot, samples: int) -> None:
        """Hold what ``shot`` needs and forget earlier samples.

        If that fails, the last picture stays, and the next call starts again.
        """
        start = time.perf_counter()
        side = max(shot.width, shot.height)
        if side > self.limits.texture_side:
            raise InputError(
                f"size: {shot.width}x{shot.height} is too large for this machine, "
                f"expected at most {self.limits.texture_side} pixels a side"
            )
        scene = shot.scene
        technique = technique_of(scene, shot.settings.technique)
        needs = self._needs_of(shot, samples, technique)
        features = needs.lighting
        self._stale = True
        for spec in needs.programs:
            self.programs.get(spec)
        if features.lit:
            self._hold_geometry(scene, features.tangents)
            self._hold_shading(scene, features, shot.settings.time)
        if features.shades:
            self._hold_materials(scene, features.uniform_materials)
        self._lighting.drop(
            lights=not features.lit,
            materials=not features.shades,
            tables=not features.reads_tables,
        )
        if not features.lit:
            self._gbuffer.release()
            self._held = self._held_lights = None
            self._timers.forget("gbuffer")
            self._timers.forget("lighting")
        if not features.shades:
            self._held_materials = None
        self._targets.resize((shot.width, shot.height))
        self._targets.keep_only({name for name, _ in needs.attachments} - {"depth"})
        if needs.accumulates:
            self._targets.texture("radiance 2")
        if features.estimates_noise:
            self._targets.texture("noise 2")
        self._needs = needs
        self._seen = _Seen(shot)
        self._stale = False
        self._samples = 0
        self._newest = ""
        self._displayed = None
        self._cpu_ms = 1e3 * (time.perf_counter() - start)

    def _needs_of(self, shot: Shot, samples: int, technique: str) -> Needs:
        """Return `needs_of`, from the last time if nothing that it depends on is new."""
        scene, view, culls = shot.scene, shot.settings.view, shot.settings.cull > 0.0
        key = (technique, samples > 1, view, culls)
        if self._needs is not None and self._seen is not None and not self._stale:
            seen = self._seen.shot.scene
            same = self._needs_key == key and all(
                getattr(seen, part) is getattr(scene, part)
                for part in ("materials", "objects", "lights")
            )
            if same:
                return self._needs
        self._needs_key = key
        return needs_of(scene, samples, self.limits, technique, view, culls, self.everything)

    def _add_sample(self) -> None:
        assert self._seen is not None
        assert self._needs is not None
        start = time.perf_counter()
        shot, needs = self._seen.shot, self._needs
        older = self._newest
        newest = "radiance 2" if older == "radiance" and needs.accumulates else "radiance"
        written = [newest]
        if needs.lighting.estimates_noise:
            written.append(_NOISE_OF[newest])
        target = self._targets.framebuffer(*written)
        if needs.lighting.lit:
            frame = CameraFrame.of(shot.scene.camera, shot.width / shot.height)
            positions = shot.settings.positions
            offset = pixel_offset(self._samples % positions if positions else self._samples)
            window = (1.0, 1.0, -2.0 * offset[0] / shot.width, -2.0 * offset[1] / shot.height)
            names = ("gbuffer", "tangents") if needs.lighting.tangents else ("gbuffer",)
            surfaces = self._targets.framebuffer(*names, depth=True)
            self._hold_shading(shot.scene, needs.lighting, shot.settings.time)
            with self._timers.measure("gbuffer"):
                self._gbuffer.draw(surfaces, frame, window)
            with self._timers.measure("lighting"):
                self._lighting.draw(
                    target,
                    self._targets.texture("gbuffer"),
                    self._targets.texture("tangents") if needs.lighting.tangents else None,
                    needs.lighting,
                    frame,
                    offset,
                    self._targets.texture(older) if older else None,
                    self._samples,
                    _faint_radiance(shot),
                    self._targets.texture(_NOISE_OF[older])
                    if older and needs.lighting.estimates_noise
                    else None,
                )
            self.lighting_passes += 1
        else:
            begin_pass(target, target.size)
            target.clear()
        self._newest = newest
        self._samples += 1
        self._displayed = None
        self._cpu_ms = 1e3 * (time.perf_counter() - start)

    def _hold_geometry(self, scene: Scene, tangents: bool) -> None:
        held = self._held
        if (
            held is None
            or held.objects is not scene.objects
            or self._gbuffer.has_tangents != tangents
        ):
            self._gbuffer.set_objects(scene.objects, tangents)
        if held is None or held.lights is not scene.lights:
            self._gbuffer.set_lights(scene.lights)
        self._held = scene

    def _hold_shading(self, scene: Scene, features: LightingFeatures, time: float) -> None:
        """Hold lights and tables, which a probe may have changed in between."""
        self._hold_lights(scene, features.lights, time)
        if features.reads_tables:
            self._lighting.load_tables(features.anisotropic, features.residual_size)

    def _hold_lights(self, scene: Scene, needs: LightNeeds, time: float) -> None:
        held = self._held_lights
        layout = (needs.curves, needs.bounded, needs.uniform_texels)
        pictures = NO_PICTURES
        if needs.pictures:
            same = held is not None and held[0] is scene.lights and self._pictures.pictures
            if same and not self._has_new_frames(time):
                pictures = self._pictures
            else:
                pictures = lay_pictures(scene.lights, time, self.limits.texture_side)
        changed = not self._lighting.has_pictures(pictures)
        if changed:
            with self._timers.measure("pictures"):
                self._lighting.set_pictures(pictures)
        if held is None or held[0] is not scene.lights or held[1] != layout or changed:
            self._lighting.set_lights(scene.lights, needs, pictures)
            self._held_lights = (scene.lights, layout)
        self._pictures = pictures

    def _has_new_frames(self, time: float) -> bool:
        """Return whether a picture would be another one now: it plays, or its file changed."""
        return any(
            picture.light.picture is not None
            and load_frame(picture.light.picture, time) is not picture.frame
            for picture in self._pictures.pictures.values()
        )

    def _hold_materials(self, scene: Scene, uniform_texels: int) -> None:
        held = self._held_materials
        if (
            held is None
            or held[0] is not scene.materials
            or held[1] is not scene.objects
            or held[2] != uniform_texels
        ):
            self._lighting.set_materials(scene.object_materials(), uniform_texels)
            self._held_materials = (scene.materials, scene.objects, uniform_texels)

    @property
    def _view(self) -> PixelView:
        return "radiance" if self._seen is None else self._seen.shot.settings.view


def _faint_radiance(shot: Shot) -> float:
    """Return the radiance that all that is skipped may add up to: a share of display white."""
    return float(shot.settings.cull * 2.0**-shot.scene.display.exposure)


def point_arrays(**given: ArrayLike) -> dict[str, NDArray[np.float32]]:
    """Return the inputs of a probe as float32 arrays; raise `ValueError` if shapes are wrong."""
    arrays = {}
    for name, values in given.items():
        width = 2 if name == "alpha" else 3
        array = np.ascontiguousarray(values, dtype=np.float32)
        if array.ndim != 2 or array.shape[1] != width:
            raise ValueError(f"{name} has shape {array.shape}, expected (n, {width})")
        arrays[name] = array
    count = len(arrays["position"])
    for name, array in arrays.items():
        if len(array) != count:
            raise ValueError(f"{name} has {len(array)} rows, expected {count} as in position")
    return arrays


def _top_down(texture: moderngl.Texture, dtype: DTypeLike) -> NDArray[Any]:
    width, height = texture.size
    pixels: NDArray[Any] = np.frombuffer(texture.read(alignment=4), dtype=dtype)
    return np.ascontiguousarray(pixels.reshape(height, width, 4)[::-1, :, :3])
