"""The pixel under the pointer, or where the pinned point is: its numbers, read when they change."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import repeat

import numpy as np

from app.gui.breakdowns import BreakdownWork, refusal
from app.gui.shortcuts import key_of
from app.gui.viewport import Viewport
from app.panels.inspector import Pixel, inspector_panel
from app.panels.parts import PartRow, Parts
from app.render.breakdown import Breakdown
from app.render.difference import LUMINANCE
from app.render.picking import Hit
from app.render.renderer import Renderer
from app.scene import Scene, Shot, Vec3
from app.vectors import dot, length, normalize, subtract


@dataclass(frozen=True, eq=False)
class Key:
    """What a pixel's numbers depend on; shots by identity."""

    place: tuple[float, float]
    shots: tuple[Shot, ...]
    samples: tuple[tuple[int, int], ...]

    def same(self, other: Key) -> bool:
        return (
            (self.place, self.samples) == (other.place, other.samples)
            and len(self.shots) == len(other.shots)
            and all(a is b for a, b in zip(self.shots, other.shots, strict=True))
        )


@dataclass(frozen=True, eq=False)
class Numbers:
    """What was read of a pixel: radiance and evaluations of A, and of B if there is one."""

    key: Key
    hit: Hit | None
    radiance: tuple[Vec3, ...]
    evaluations: tuple[int, ...]


class Inspector:
    """Draws the docked window of one pixel.

    Parameters
    ----------
    viewport : Viewport
    renderer : Renderer
        A's.

    Attributes
    ----------
    numbers : Numbers or None
        What was read last.
    parts : BreakdownWork
        Of the error at the pixel's middle.
    """

    def __init__(self, viewport: Viewport, renderer: Renderer) -> None:
        self.numbers: Numbers | None = None
        self.parts = BreakdownWork(renderer)
        self._viewport, self._renderer = viewport, renderer
        self._parts_at: tuple[float, float] | None = None

    @property
    def is_busy(self) -> bool:
        return self.parts.is_busy

    @property
    def needs_frames(self) -> bool:
        """Whether it goes on with every frame."""
        return self.parts.needs_frames

    def step(self) -> None:
        """Go on with what takes longer than a frame."""
        self.parts.step(self._viewport.picture)

    def draw(self) -> None:
        """Draw the inside of the window, numbers read anew where something changed."""
        self.numbers = self._read()
        pixel = self._pixel(self.numbers) if self.numbers is not None else None
        if inspector_panel(pixel, key_of("pin")) and self.numbers is not None:
            place = self._parts_at = self.numbers.key.place
            self.parts.start(self._viewport.picture, repeat(place, 1), 1)

    def release(self) -> None:
        """Give up what is under way."""
        self.parts.cancel()

    # --- reading ---------------------------------------------------------------------

    def _place(self) -> tuple[float, float] | None:
        """Return the middle of the pixel to look at, in those of A's picture."""
        viewport = self._viewport
        view, shot = viewport.view, viewport.picture.shot
        if shot is None or viewport.picture.has_failed:
            return None
        at = viewport.pointer
        if viewport.pin is not None:
            found = view.project(shot.scene.camera, viewport.pin[0])
            if found is None:
                return None
            at = ((found[0] - view.x) / view.width, (found[1] - view.y) / view.height)
        if at is None or not (0.0 <= at[0] < 1.0 and 0.0 <= at[1] < 1.0):
            return None
        return int(at[0] * shot.width) + 0.5, int(at[1] * shot.height) + 0.5

    def _read(self) -> Numbers | None:
        viewport = self._viewport
        place, a = self._place(), viewport.picture
        if place is None or a.shot is None:
            return None
        sides = [(a, self._renderer)]
        other, renderer = viewport.comparison.picture, viewport.comparison.renderer
        if other is not None and renderer is not None and other.shot and not other.has_failed:
            sides.append((other, renderer))
        shots = tuple(picture.shot for picture, _ in sides if picture.shot is not None)
        key = Key(place, shots, tuple(picture.samples for picture, _ in sides))
        if self.numbers is not None and self.numbers.key.same(key):
            return self.numbers
        radiance, evaluations = [], []
        share = place[0] / a.shot.width, place[1] / a.shot.height
        for shot, (_, renderer) in zip(shots, sides, strict=True):
            # While something moves one may be smaller than the other.
            x, y = share[0] * shot.width, share[1] * shot.height
            radiance.append(renderer.radiance_at(int(x), int(y)))
            evaluations.append(renderer.evaluations_at(x, y))
        hit = self._renderer.pick(*place)
        self._renderer.ctx.screen.use()
        return Numbers(key, hit, tuple(radiance), tuple(evaluations))

    # --- telling ---------------------------------------------------------------------

    def _pixel(self, numbers: Numbers) -> Pixel:
        shot, hit = numbers.key.shots[0], numbers.hit
        x, y = numbers.key.place
        how = "pinned" if self._viewport.pin is not None else "under the pointer"
        note = f"Pixel {int(x)}, {int(y)} of {shot.width} × {shot.height}, {how}"
        names = zip("AB", self._names(), strict=True)
        values = [np.array(side) for side in numbers.radiance]
        sides = tuple(f"{side} {name}".strip() for side, name in names)[: len(values)]
        if len(values) > 1:
            values.append(values[0] - values[1])
            sides = (*sides, "A − B")
        title, facts = _surface(hit, shot.scene)
        counts = [str(count) for count in numbers.evaluations]
        both = zip("AB", counts, strict=False)
        text = ", ".join(f"{side} {count}" for side, count in both) if counts[1:] else counts[0]
        facts.append(("evaluations", text))
        is_surface = hit is not None and hit.kind == "object"
        parts = self._parts(numbers) if is_surface else None
        return Pixel(title, note, sides, _radiance_rows(values), tuple(facts), parts)

    def _names(self) -> tuple[str, ...]:
        comparison = self._viewport.comparison
        return comparison.names if comparison.is_on else ("", "")

    def _parts(self, numbers: Numbers) -> Parts:
        work, picture = self.parts, self._viewport.picture
        found = work.result if self._parts_at == numbers.key.place else None
        return Parts(
            about="Luminance at the pixel's middle, by a single sample. "
            "The parts add up to the whole error.",
            heads=("radiance", "of the exact"),
            rows=pixel_rows(found) if found is not None else (),
            is_current=work.is_of(picture),
            progress=work.progress,
            refusal=refusal(picture),
        )


def pixel_rows(found: Breakdown) -> tuple[PartRow, ...]:
    """Return the parts of the error at a single point, the exact radiance first."""
    weights = np.array(LUMINANCE)
    exact = float(found.exact[0] @ weights)

    def row(name: str, value: float) -> PartRow:
        share = f"{signed(100.0 * value / exact)} %" if exact > 0.0 else ""
        return PartRow(name, (signed(value), share))

    shares = zip(found.parts, found.shares[:, 0] @ weights, strict=True)
    rows = [row(name, float(value)) for name, value in shares]
    whole = row("all", float(found.total[0] @ weights))
    return (PartRow("exact", (f"{exact:.6g}", "")), *rows, whole)


def signed(value: float) -> str:
    """Return a number with its sign, 0 without."""
    return f"{value:+.3g}" if value else "0"


def _radiance_rows(sides: list[np.ndarray]) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Return the rows of a table whose columns are radiances (3,)."""
    table = [[*side.tolist(), float(side @ np.array(LUMINANCE))] for side in sides]
    names = ("red", "green", "blue", "lum.")
    return tuple(
        (name, tuple(f"{side[row]:.6g}" for side in table)) for row, name in enumerate(names)
    )


def _surface(hit: Hit | None, scene: Scene) -> tuple[str, list[tuple[str, str]]]:
    """Return what a pixel shows, and the facts of it."""
    if hit is None:
        return "Nothing", []
    eye, target = scene.camera.eye, scene.camera.target
    away = subtract(hit.position_ws, eye)
    depth = dot(away, normalize(subtract(target, eye)))
    facts = [
        ("position", _triple(hit.position_ws) + " m"),
        ("distance", f"{length(away):.6g} m"),
        ("depth", f"{depth:.6g} m"),
        ("normal", _triple(hit.normal_ws)),
    ]
    cosine = -dot(hit.normal_ws, normalize(away))
    facts.append(("θ of the view", f"{math.degrees(math.acos(min(max(cosine, -1.0), 1.0))):.4g}°"))
    if hit.kind == "light":
        light = scene.lights[hit.index]
        facts.append(("radiance", _triple(light.radiance)))
        return f"Light '{light.name}'", facts
    item, material = scene.objects[hit.index], scene.object_materials()[hit.index]
    facts += [
        ("α x, y", f"{material.alpha[0]:.4g}, {material.alpha[1]:.4g}"),
        ("f0", _triple(material.f0)),
        ("diffuse", _triple(material.diffuse)),
    ]
    return f"Object '{item.name}', material '{material.name}'", facts


def _triple(values: Vec3) -> str:
    return ", ".join(f"{value:.5g}" for value in values)
