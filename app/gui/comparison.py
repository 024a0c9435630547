"""The picture set beside another technique's: B's picture, and what is made of both.

Nothing of it exists while comparison is off. While it is on, B is rendered by a renderer of
its own in the same context, and like A only while samples are missing; the picture of
differences is drawn when one of the two has changed; numbers and FLIP are computed by
a thread, from copies, once the picture stands still, and again whenever the number of samples
has doubled.
"""

from __future__ import annotations

import time
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace

import moderngl
import numpy as np
from imgui_bundle import ImVec2, imgui

from app.gui import theme
from app.gui.breakdowns import BreakdownWork
from app.gui.legend import draw_legend
from app.gui.live_picture import LivePicture, Reporter, draw_texture
from app.gui.overlays import View
from app.gui.summaries import EarlierMeans, Source, Summary, number_rows
from app.panels import compare as panel
from app.panels.compare import Comparing
from app.render.comparison import Pictures, shared_samples
from app.render.difference import DifferenceView, Scale
from app.render.difference_pass import DifferencePass
from app.render.gathering import random_places
from app.render.renderer import Renderer
from app.render.techniques import find_technique, technique_of
from app.scene import Camera, PixelView, RenderSettings, Scene, Shot

STILL = 0.25
"""Seconds without a change after which numbers are computed."""
DIVIDER = 10.0
"""Width of the strip in which the line of the split view can be grabbed, in points."""

VIEWS: dict[panel.Shown, DifferenceView] = {
    "signed": "signed",
    "absolute": "absolute",
    "relative": "relative",
    "FLIP": "flip",
}
"""What is shown in false colours."""


class _Side:
    """What exists only while something is compared."""

    def __init__(self, a: Renderer, reporter: Reporter) -> None:
        self.renderer = Renderer(a.ctx)
        self.picture = LivePicture(self.renderer, reporter)
        self.differences = DifferencePass(a.ctx)
        self.worker = ThreadPoolExecutor(1, thread_name_prefix="comparison")
        self.drawn: tuple[object, ...] | None = None
        self.colours: moderngl.Texture | None = None

    def release(self) -> None:
        self.worker.shutdown(wait=False, cancel_futures=True)
        self.differences.release()
        self.renderer.release()


class Comparison:
    """Renders B, shows both, and tells how far they are apart.

    Parameters
    ----------
    renderer : Renderer
        A's.
    reporter : Reporter
        Gets the failures of rendering.

    Attributes
    ----------
    form : Comparing
        What the panel edits.
    summary : Summary or None
        The last numbers.
    parts : BreakdownWork
        Of A's error at random pixels.
    """

    def __init__(self, renderer: Renderer, reporter: Reporter) -> None:
        self.form = Comparing()
        self.summary: Summary | None = None
        self.names = ("", "")
        self.sampled = False
        self.parts = BreakdownWork(renderer)
        self._a_renderer = renderer
        self._reporter = reporter
        self._a: LivePicture | None = None
        self._side: _Side | None = None
        self._pending: Future[Summary] | None = None
        self._earlier = EarlierMeans()
        self._scene: Scene | None = None
        self._still_since = 0.0
        self._pixels = (0, 0)

    # --- the outside -----------------------------------------------------------------

    @property
    def is_on(self) -> bool:
        return self.form.is_on

    @property
    def picture(self) -> LivePicture | None:
        """B's picture, None while comparison is off."""
        return self._side.picture if self._side is not None else None

    @property
    def renderer(self) -> Renderer | None:
        """What B's picture can be asked."""
        return self._side.renderer if self._side is not None else None

    @property
    def is_idle(self) -> bool:
        """Whether nothing is left to do: all samples there, and numbers of them."""
        if self.parts.is_busy:
            return False
        if self._side is None:
            return not self.is_on
        if not self._side.picture.is_settled(self._pixels) or self._pending is not None:
            return False
        source = self._source()
        return source is None or self._is_summed(source)

    @property
    def needs_frames(self) -> bool:
        """Whether it goes on with every frame: what is computed aside only gets in their way."""
        side = self._side
        is_settled = side.picture.is_settled(self._pixels) if side is not None else not self.is_on
        return not is_settled or self.parts.needs_frames

    @property
    def is_summed(self) -> bool:
        """Whether the numbers belong to the pictures as they are."""
        source = self._source()
        return source is not None and self._is_summed(source)

    @property
    def scale(self) -> Scale:
        """What the colours mean; of views without, the absolute difference's."""
        form = self.form
        view = VIEWS.get(form.show, "absolute")
        high = 1.0 if view == "flip" else form.high
        if form.automatic and self.summary is not None:
            high = self.summary.highs[view]
        return Scale(view, high, form.measure, form.colours)

    def shows_cost(self, settings: RenderSettings) -> bool:
        """Tell whether the picture shows costs: differences are of radiance only."""
        return settings.view == "cost" and self.form.show not in VIEWS

    def settings(self, scene: Scene, settings: RenderSettings) -> tuple[RenderSettings, ...]:
        """Return with what A, and B if something is compared, are rendered."""
        if not self.is_on:
            return (settings,)
        names = technique_of(scene, settings.technique), technique_of(scene, self.form.against)
        sampled = tuple(find_technique(name).is_sampled for name in names)
        self.names, self.sampled = names, any(sampled)
        *counts, positions = shared_samples(
            settings.samples, (sampled[0], sampled[1]), self.form.estimates
        )
        view: PixelView = "cost" if self.shows_cost(settings) else "radiance"
        a, b = (
            replace(
                settings, technique=name, samples=count, view=view,
                positions=positions if count > positions else 0,
            )
            for name, count in zip(names, counts, strict=True)
        )  # fmt: skip
        # What A skips is part of its error.
        return a, replace(b, cull=0.0)

    def toggle(self) -> None:
        """Switch the comparison off, or on as a split view."""
        self.form = self.form.toggled()

    def begin_again(self) -> None:
        """Render B anew: a file that the scene names has changed."""
        if self._side is not None:
            self._side.picture.begin_again()

    def flip(self) -> None:
        """Show B, or A again."""
        self.form = self.form.flipped()

    def close(self) -> None:
        """End what runs aside, and release everything."""
        self.parts.cancel()
        self.release()

    def release(self) -> None:
        """Give up everything that costs memory or time."""
        side, self._side = self._side, None
        if side is not None:
            side.release()
        self.summary = self._pending = self._scene = None
        self._earlier = EarlierMeans()

    # --- one frame -------------------------------------------------------------------

    def render(
        self,
        scene: Scene,
        camera: Camera,
        settings: tuple[RenderSettings, ...],
        pixels: tuple[int, int],
        a: LivePicture,
    ) -> None:
        """Add a sample to B if one is missing, and see to the numbers.

        ``settings`` are those that `settings` returned; A has been rendered by its own.
        """
        self.parts.step(a)
        if len(settings) < 2:
            if self._side is not None:
                self.release()
            return
        if self._side is None:
            self._side = _Side(self._a_renderer, self._reporter)
        side, self._a, self._pixels = self._side, a, pixels
        side.picture.render(scene, camera, settings[1], pixels)
        if self.sampled:
            self._earlier.watch(0, a, self._a_renderer)
            self._earlier.watch(1, side.picture, side.renderer)
        now = time.monotonic()
        shown = a.shot.scene if a.shot is not None else None
        if shown is not self._scene:
            self._scene, self._still_since = shown, now
        if self._pending is not None and self._pending.done():
            done, self._pending = self._pending, None
            self.summary = done.result()
            if self.summary.flip is not None:
                side.differences.set_values(self.summary.flip)
                side.drawn = None
        source = self._source()
        if (
            source is not None
            and self._pending is None
            and now - self._still_since >= STILL
            and all(_is_milestone(picture) for picture in (a, side.picture))
            and not self._is_summed(source)
        ):
            self._pending = side.worker.submit(Summary.of, source, self._copies(source))

    def _source(self) -> Source | None:
        """Return what numbers would be computed of now, None where there is nothing to."""
        a, side = self._a, self._side
        if a is None or side is None or a.shot is None or side.picture.shot is None:
            return None
        if a.has_failed or side.picture.has_failed:
            return None
        shots = a.shot, side.picture.shot
        sizes = {(shot.width, shot.height) for shot in shots}
        if sizes != {self._pixels} or shots[0].settings.view != "radiance":
            return None
        samples = a.samples[0], side.picture.samples[0]
        return Source(shots, samples, self.form.measure, self.form.show == "FLIP")

    def _is_summed(self, source: Source) -> bool:
        return self.summary is not None and self.summary.source.covers(source)

    def _copies(self, source: Source) -> Pictures:
        assert self._side is not None
        renderers = self._a_renderer, self._side.renderer
        a, b = (renderer.radiance() for renderer in renderers)
        nothing = np.zeros((1, 1, 3), np.uint8)
        shown = [r.display() if source.flips else nothing for r in renderers]
        self._a_renderer.ctx.screen.use()
        lights = source.shots[0].scene.lights
        noise = self._earlier.noise(source, self.names, (a, b))
        return Pictures(self.names, a, b, shown[0], shown[1], lights, noise)

    # --- on the screen -----------------------------------------------------------------

    def divide(self, view: View) -> None:
        """Let the line of the split view be dragged; the pointer shows that it can."""
        if self.form.show != "split":
            return
        middle = view.x + self.form.divider * view.width
        imgui.set_cursor_screen_pos(ImVec2(middle - 0.5 * DIVIDER, view.y))
        imgui.invisible_button("divider", ImVec2(DIVIDER, view.height))
        if imgui.is_item_active():
            place = (imgui.get_io().mouse_pos.x - view.x) / view.width
            self.form = replace(self.form, divider=min(max(place, 0.0), 1.0))
        if imgui.is_item_hovered() or imgui.is_item_active():
            imgui.set_mouse_cursor(imgui.MouseCursor_.resize_ew)

    def draw(self, view: View, a: LivePicture) -> None:
        """Draw what shall be seen into the current Dear ImGui window."""
        side, show = self._side, self.form.show
        if side is None or show == "A":
            a.draw(view)
            self._name(view, 0, view.x + 0.5 * view.width, 0.5)
        elif show == "B":
            side.picture.draw(view)
            self._name(view, 1, view.x + 0.5 * view.width, 0.5)
        elif show == "split":
            self._split(view, a, side)
        else:
            self._differences(view, a, side)

    def _split(self, view: View, a: LivePicture, side: _Side) -> None:
        draw, em = imgui.get_window_draw_list(), imgui.get_font_size()
        middle = view.x + round(self.form.divider * view.width)
        low, high = ImVec2(view.x, view.y), ImVec2(view.x + view.width, view.y + view.height)
        a.draw(view)
        draw.push_clip_rect(ImVec2(middle, low.y), high, True)
        side.picture.draw(view)
        draw.pop_clip_rect()
        line, shade = theme.u32(theme.grey(1.0), 0.9), theme.u32(theme.grey(0.0), 0.5)
        for half, colour in ((1.0, shade), (0.0, line)):
            left, right = ImVec2(middle - half, low.y), ImVec2(middle + 1.0 + half, high.y)
            draw.add_rect_filled(left, right, colour)
        grip = ImVec2(middle, view.y + 0.5 * view.height)
        draw.add_circle_filled(grip, 0.55 * em, theme.u32(theme.grey(0.1), 0.9))
        draw.add_circle(grip, 0.55 * em, line)
        for way in (-1.0, 1.0):
            tip = ImVec2(grip.x + 0.38 * em * way, grip.y)
            ends = [ImVec2(grip.x + 0.15 * em * way, grip.y + 0.2 * em * up) for up in (-1.0, 1.0)]
            draw.add_triangle_filled(tip, ends[0], ends[1], line)
        self._name(view, 0, middle - 0.7 * em, 1.0)
        self._name(view, 1, middle + 0.7 * em, 0.0)

    def _differences(self, view: View, a: LivePicture, side: _Side) -> None:
        scale = self.scale
        colours = self._colours(a, side, scale)
        if colours is None:
            a.draw(view)
            return
        draw_texture(colours, view)
        bad = self.summary is not None and self.summary.numbers.bad > 0
        draw_legend(view, scale.legend(self.names, bad))

    def _colours(self, a: LivePicture, side: _Side, scale: Scale) -> moderngl.Texture | None:
        """Return the picture of differences, drawn again if something in it is new."""
        b, summary = side.picture, self.summary
        if a.shot is None or b.shot is None or a.has_failed or b.has_failed:
            return None
        size = (a.shot.width, a.shot.height)
        if scale.view == "flip":
            if summary is None or summary.flip is None:
                return None
            size = summary.flip.shape[1], summary.flip.shape[0]
        floor = summary.numbers.floor if summary is not None else 1e-3
        state = (a.shot, a.samples, b.shot, b.samples, scale, floor, size)
        if side.colours is None or side.drawn is None or not _same(side.drawn, state):
            if scale.view == "flip":
                side.colours = side.differences.draw_values(scale, size)
            else:
                textures = self._a_renderer.radiance_texture, side.renderer.radiance_texture
                side.colours = side.differences.draw(*textures, scale, floor, size)
            self._a_renderer.ctx.screen.use()
            side.drawn = state
        return side.colours

    def _name(self, view: View, side: int, x: float, align: float) -> None:
        """Write at the top which technique this is, and how far it has got."""
        picture = (self._a, self.picture)[side]
        if picture is None:
            return
        done, wanted = picture.samples
        text = f"{'AB'[side]}  {self.names[side]}"
        if done < wanted:
            text += f"  {done}/{wanted}"
        draw, em = imgui.get_window_draw_list(), imgui.get_font_size()
        size = imgui.calc_text_size(text)
        left, top = x - align * size.x, view.y + 0.85 * em
        pad = 0.4 * em
        draw.push_clip_rect(
            ImVec2(view.x, view.y), ImVec2(view.x + view.width, view.y + view.height), True
        )
        draw.add_rect_filled(
            ImVec2(left - pad, top - 0.5 * pad),
            ImVec2(left + size.x + pad, top + size.y + 0.5 * pad),
            theme.u32(theme.grey(0.05), 0.78),
            0.3 * em,
        )
        draw.add_text(ImVec2(left, top), theme.u32(theme.grey(0.95)), text)
        draw.pop_clip_rect()

    # --- for the panel -------------------------------------------------------------------

    def report(self) -> panel.Comparison | None:
        """Return what the panel shows, None while nothing is compared."""
        if not self.is_on or self._side is None or self._a is None:
            return None
        return panel.Comparison(
            self.names,
            (self._a.samples, self._side.picture.samples),
            number_rows(self.summary) if self.summary is not None else (),
            self.is_summed,
            self.sampled,
            self.scale.high,
            "Computing …" if self._pending is not None else "",
        )

    def ask_parts(self, a: LivePicture) -> None:
        """Find out whose A's error is at random pixels, or give that up."""
        if a.shot is not None:
            places = random_places((a.shot.width, a.shot.height))
            self.parts.start(a, places, self.form.points)


def _is_milestone(picture: LivePicture) -> bool:
    """Tell whether a picture has a number of samples of which numbers are computed."""
    done, wanted = picture.samples
    return done >= wanted or done & (done - 1) == 0


def _same(a: tuple[object, ...], b: tuple[object, ...]) -> bool:
    """Tell whether two states are the same; shots by identity, for comparing them takes long."""
    return all(x is y if isinstance(x, Shot) else x == y for x, y in zip(a, b, strict=True))
