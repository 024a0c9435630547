"""What of the selected light can be grabbed in the picture, and where it is on the screen."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app import contours
from app.curves import evaluate
from app.gui.overlays import Sight, on_plane
from app.scene import AnchorKind, AreaLight

Place: TypeAlias = tuple[float, float]

CROWD = 16
"""Corners and anchors from which on they are drawn smaller, and handles only where selected."""
MOST_VERTICES = 400
"""Corners and anchors in the picture beyond which none is shown: they would hide the light."""
DENSE = 18.0
"""Mean length of segments in points below which vertices are shown beside the selected one only.

They would hide the light, as with a word; who looks closer can edit its letters."""
SHORTEST_EDGE = 56.0
"""Length in points from which on a segment offers a point to add a vertex."""
APART, FAR_APART = 2.0, 16.0
"""Points from its anchor from which on a handle is shown, beside the selected vertex and elsewhere.

Nearer ones count as lying on the anchor, and elsewhere would hide it."""


@dataclass(frozen=True, slots=True)
class Grip:
    """A vertex, a handle, or the middle of a segment, and where it is on the screen.

    ``index`` is a vertex's number, else that of the segment; ``which`` tells a
    segment's two handles apart; ``anchor`` is where a handle's anchor is.
    """

    what: Literal["vertex", "handle", "edge"]
    contour: int
    index: int
    at: Place
    which: int = 0
    kind: AnchorKind = "corner"
    anchor: Place | None = None

    @property
    def name(self) -> str:
        """What the item under the pointer is called: "handle 0.3.1"."""
        last = f".{self.which}" if self.what == "handle" else ""
        return f"{self.what} {self.contour}.{self.index}{last}"


def grips_of(
    sight: Sight, light: AreaLight, selected: tuple[int, int] | None, held: str = ""
) -> list[Grip]:
    """Return what can be grabbed of a light, as far as it is in the picture.

    Parameters
    ----------
    selected : (contour, point) or None
        The vertex whose handles are shown even in a crowd, with those across its segments.
    held : str
        The name of a grip that is part of it wherever it is.
    """
    segments = contours.segments_of(light.outline)
    screen = _places(sight, light, segments.curves)
    middles = _places(sight, light, evaluate(segments.curves, 0.5))
    lengths = _lengths(screen)
    roomy, crowded = lengths >= SHORTEST_EDGE * sight.unit, is_crowded(light)
    shown = lengths[np.isfinite(lengths)]
    dense = len(shown) > CROWD and float(shown.mean()) < DENSE * sight.unit
    found: list[Grip] = []
    for number, contour in enumerate(light.outline.contours):
        first, kinds = segments.starts[number], contours.kinds_of(contour)
        near = selected[1] if selected is not None and selected[0] == number else None
        if dense and near is None:
            continue
        beside = set() if near is None else {near, (near - 1) % len(kinds)}
        for index, kind in enumerate(kinds):
            row = screen[first + index]
            found.append(Grip("vertex", number, index, _pair(row[0]), kind=kind))
            middle = Grip("edge", number, index, _pair(middles[first + index]))
            if roomy[first + index] or middle.name == held:
                found.append(middle)
            if segments.straight[first + index]:
                least = math.inf
            else:
                least = APART if index in beside else math.inf if crowded else FAR_APART
            following = kinds[(index + 1) % len(kinds)]
            for which, anchor, owner in ((1, _pair(row[0]), kind), (2, _pair(row[3]), following)):
                at = _pair(row[which])
                handle = Grip("handle", number, index, at, which, owner, anchor)
                if math.dist(at, anchor) >= least * sight.unit or handle.name == held:
                    found.append(handle)
    seen = [grip for grip in found if _is_seen(sight, grip, held)]
    if sum(grip.what == "vertex" for grip in seen) > MOST_VERTICES:
        chosen = f"vertex {selected[0]}.{selected[1]}" if selected is not None else ""
        return [grip for grip in seen if grip.name in (held, chosen)]
    return seen


def _is_seen(sight: Sight, grip: Grip, held: str) -> bool:
    return sight.view.contains(*grip.at) or (grip.name == held and math.isfinite(grip.at[0]))


def is_crowded(light: AreaLight) -> bool:
    """Tell whether a light has so many vertices that they are drawn smaller."""
    return sum(map(contours.size_of, light.outline.contours)) > CROWD


def nearest_grip(grips: list[Grip], x: float, y: float, reach: float) -> Grip | None:
    """Return the grip nearest to a place on the screen, None if none is within reach."""
    within = [g for g in grips if max(abs(g.at[0] - x), abs(g.at[1] - y)) <= reach]
    return min(within, key=lambda grip: _away(grip, x, y), default=None)


def sorted_by_distance(grips: list[Grip], x: float, y: float) -> list[Grip]:
    """Return the grips with those nearest to a place first, which Dear ImGui then prefers."""
    return sorted(grips, key=lambda grip: _away(grip, x, y))


def _away(grip: Grip, x: float, y: float) -> float:
    return (grip.at[0] - x) ** 2 + (grip.at[1] - y) ** 2


def _places(sight: Sight, light: AreaLight, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return screen coordinates (..., 2) of plane coordinates; NaN behind the eye."""
    found: NDArray[np.float64] = sight.view.project_all(
        sight.camera, on_plane(light.plane, points)
    )[..., :2]
    return found


def _pair(point: NDArray[np.float64]) -> Place:
    return (float(point[0]), float(point[1]))


def _lengths(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return about the lengths of curves (n, 4, 2): between chord and control polygon."""
    ways = np.diff(points, axis=1)
    around = np.hypot(ways[..., 0], ways[..., 1]).sum(-1)
    chords = points[:, 3] - points[:, 0]
    return np.asarray(0.5 * (around + np.hypot(chords[:, 0], chords[:, 1])))
