"""What of the selected light can be grabbed in the picture, and where it is on the screen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app import contours
from app.curves import evaluate
from app.gui.overlays import Sight, on_plane
from app.scene import AnchorKind, AreaLight, BezierContour, Contour

Place: TypeAlias = tuple[float, float]

CROWD = 16
"""Corners and anchors from which on they are drawn smaller, and handles only where selected."""
MOST_VERTICES = 400
"""Corners and anchors in the picture beyond which none is shown: they would hide the light."""
SHORTEST_EDGE = 56.0
"""Length in points from which on a segment offers a point to add a vertex."""
APART = 2.0
"""Points from its anchor from which on a handle is shown; nearer it counts as lying on it."""


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
    found: list[Grip] = []
    crowded = is_crowded(light)
    for number, contour in enumerate(light.outline.contours):
        curves = contours.curves_of(contour)
        screen = _places(sight, light, curves)
        middles = _places(sight, light, evaluate(curves, 0.5))
        near = selected[1] if selected is not None and selected[0] == number else None
        kinds = contours.kinds_of(contour)
        if isinstance(contour, BezierContour):
            found += _handles(number, contour, screen, near, crowded, sight.unit, held)
        for index, kind in enumerate(kinds):
            x, y = screen[index, 0].tolist()
            found.append(Grip("vertex", number, index, (x, y), kind=kind))
            middle = Grip("edge", number, index, _pair(middles[index]))
            if _length(screen[index]) >= SHORTEST_EDGE or middle.name == held:
                found.append(middle)
    before_eye = (grip for grip in found if np.isfinite(grip.at).all())
    seen = [grip for grip in before_eye if grip.name == held or sight.view.contains(*grip.at)]
    if sum(grip.what == "vertex" for grip in seen) > MOST_VERTICES:
        chosen = f"vertex {selected[0]}.{selected[1]}" if selected is not None else ""
        return [grip for grip in seen if grip.name in (held, chosen)]
    return seen


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


def _handles(
    number: int,
    contour: Contour,
    screen: NDArray[np.float64],
    near: int | None,
    crowded: bool,
    unit: float,
    held: str,
) -> list[Grip]:
    """Return the handles of a contour's curves; straight segments have none to show."""
    found = []
    straight, kinds = contours.straight_segments(contour), contours.kinds_of(contour)
    count = len(kinds)
    beside = set() if near is None else {near, (near - 1) % count}
    for segment in range(count):
        for which in (1, 2):
            owner = segment if which == 1 else (segment + 1) % count
            anchor = _pair(screen[segment, 0 if which == 1 else 3])
            grip = Grip(
                "handle",
                number,
                segment,
                _pair(screen[segment, which]),
                which,
                kinds[owner],
                anchor,
            )
            apart = np.hypot(grip.at[0] - anchor[0], grip.at[1] - anchor[1]) >= APART * unit
            shown = (segment in beside or not crowded) and not straight[segment] and apart
            if shown or grip.name == held:
                found.append(grip)
    return found


def _places(sight: Sight, light: AreaLight, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return screen coordinates (..., 2) of plane coordinates; NaN behind the eye."""
    found: NDArray[np.float64] = sight.view.project_all(
        sight.camera, on_plane(light.plane, points)
    )[..., :2]
    return found


def _pair(point: NDArray[np.float64]) -> Place:
    return (float(point[0]), float(point[1]))


def _length(points: NDArray[np.float64]) -> float:
    """Return about the length of a curve (4, 2): the mean of its chord and its control polygon."""
    ways = np.diff(points, axis=0)
    around = np.hypot(ways[:, 0], ways[:, 1]).sum()
    chord = np.hypot(*(points[3] - points[0]))
    return float(0.5 * (around + chord))
