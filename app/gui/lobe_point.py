"""The surface point whose lobe is shown, kept in its object's space so that it moves with it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from app import contours
from app.lobe_picture import directions_above
from app.panels.lobe_pictures import LightLine
from app.render.camera import world_from_object
from app.render.picking import Hit, facing_normal, turned_tangent
from app.render.truth import shading_contours, shading_frames, tangent_frames
from app.scene import AreaLight, Camera, Scene
from ltc import transform
from ltc.bezier import evaluate
from ltc.curved_outline import ltc_form_factor
from ltc.curved_reference import curve_specular_integral_batch
from ltc.lobe import THETA_MAX, Case, LobePair

FloatArray = NDArray[np.float64]

SAMPLED = 8
"""Steps along a segment of an outline from which its length in a point's sky is estimated."""
STEP = math.radians(3.0)
"""Length in the sky of the lines that stand for a segment, about."""
LEAST, MOST = 4, 64
"""Lines that stand for a curve; straight segments may have fewer."""


@dataclass(frozen=True, slots=True, eq=False)
class SurfacePoint:
    """A point of an object, its normal (as a covector) and its mesh's tangent, in object space.

    ``tangent`` is None where the picture has no tangents: materials count as isotropic there.
    """

    object: str
    mesh: str
    position: FloatArray
    normal: FloatArray
    tangent: FloatArray | None

    @staticmethod
    def of(hit: Hit, scene: Scene) -> SurfacePoint | None:
        """Return the point that was hit, None if it is a light's or of another scene."""
        if hit.kind != "object" or hit.index >= len(scene.objects):
            return None
        item = scene.objects[hit.index]
        matrix = world_from_object(item.transform)
        linear = matrix[:3, :3]
        inverse = np.asarray(np.linalg.inv(linear), dtype=np.float64)
        position = inverse @ (np.array(hit.position_ws) - matrix[:3, 3])
        tangent = None if hit.tangent_ws is None else inverse @ np.array(hit.tangent_ws)
        normal = linear.T @ np.array(hit.normal_ws)
        return SurfacePoint(item.name, item.mesh, position, normal, tangent)


@dataclass(frozen=True, slots=True, eq=False)
class Subject:
    """A point as it is seen now.

    Attributes
    ----------
    title, note : of what the point is on, and what to say about it
    case : its material and its view
    position : (3,) world space [m]
    frame : (3, 3), rows x, y, z of the shading frame; x the material's tangent, or the
        view's side where the material is isotropic
    """

    title: str
    note: str
    case: Case
    position: FloatArray
    frame: FloatArray


def subject_of(point: SurfacePoint, scene: Scene, camera: Camera) -> Subject | None:
    """Return a point as ``camera`` sees it in ``scene``, None if its object is gone."""
    item = next((o for o in scene.objects if (o.name, o.mesh) == (point.object, point.mesh)), None)
    if item is None:
        return None
    material = scene.material_of(item)
    matrix = world_from_object(item.transform)
    linear = matrix[:3, :3]
    position = linear @ point.position + matrix[:3, 3]
    wo = np.array(camera.eye) - position
    wo = wo / np.linalg.norm(wo)
    normal = np.asarray(np.linalg.solve(linear.T, point.normal), dtype=np.float64)
    normal /= np.linalg.norm(normal)
    normal = facing_normal((normal if normal @ wo >= 0.0 else -normal)[None], wo[None])[0]
    ax, ay = material.alpha
    note = ""
    frame = shading_frames(normal[None], wo[None])[0]
    if ax != ay and point.tangent is None:
        ax = ay = math.sqrt(ax * ay)
        note = "This technique shades it as isotropic."
    elif ax != ay and point.tangent is not None:
        # Unit, as the G-buffer holds it: a short one would count as a pole of the tangents.
        way = linear @ point.tangent
        turned = turned_tangent(
            (way / np.linalg.norm(way))[None], normal[None], np.array([material.rotation])
        )
        frame = tangent_frames(normal[None], turned)[0]
    x, y, z = (frame @ wo).tolist()
    theta = min(math.atan2(math.hypot(x, y), z), float(THETA_MAX))
    phi = math.atan2(y, x) if ax != ay else 0.0
    return Subject(
        f"On '{item.name}', material '{material.name}'",
        note,
        Case(ax, ay, theta, phi),
        position,
        frame,
    )


def light_lines(
    lights: Sequence[AreaLight], chosen: int | None, subject: Subject
) -> tuple[LightLine, ...]:
    """Return the outlines of lights as a point sees them, of the one ``chosen`` last."""
    lines = []
    for index, light in enumerate(lights):
        origin, u, v = (np.array(a) for a in (light.plane.origin, light.plane.u, light.plane.v))
        shines = _shines(light, subject.position)
        segments = contours.segments_of(light.outline)
        world = origin + segments.curves @ np.stack([u, v])
        points = _subdivided(world, segments.straight, subject.position)
        for first, last in pairwise(segments.starts):
            line = np.concatenate([*points[first:last], points[first][:1]])
            lines += [
                LightLine(run, shines, index == chosen)
                for run in directions_above(line, subject.position, subject.frame)
            ]
    return tuple(sorted(lines, key=lambda line: (line.chosen, line.shines)))


def light_share(light: AreaLight, subject: Subject, pair: LobePair) -> tuple[float, float]:
    """Return what a light of radiance 1 adds to a point for F = 1: by GGX, by its LTC.

    Both to rounding, along the light's own curves.
    """
    if not _shines(light, subject.position):
        return 0.0, 0.0
    sees = shading_contours(light, subject.position[None], subject.frame[None])
    front = _is_in_front(light, subject.position)
    ax, ay = np.array([[pair.case.alpha_x], [pair.case.alpha_y]])
    ggx, _ = curve_specular_integral_batch(sees, pair.case.wo[None], ax, ay)
    gain = pair.albedo / (1.0 - pair.leak)
    ltc = gain * ltc_form_factor(transform.invert(pair.M)[None], sees).value
    sign = 1.0 if front else -1.0
    return max(sign * float(ggx[0]), 0.0), max(sign * float(ltc[0]), 0.0)


def _is_in_front(light: AreaLight, position: FloatArray) -> bool:
    away = np.cross(light.plane.u, light.plane.v)
    return float(away @ (position - np.array(light.plane.origin))) > 0.0


def _shines(light: AreaLight, position: FloatArray) -> bool:
    return any(light.radiance) and (light.two_sided or _is_in_front(light, position))


def _subdivided(
    curves: FloatArray, straight: NDArray[np.bool_], position: FloatArray
) -> list[FloatArray]:
    """Return points of curves (n, 4, 3), (k, 3) each without their ends, dense in the sky."""
    t = np.linspace(0.0, 1.0, SAMPLED + 1)
    ways = evaluate(curves[:, None], t) - position
    ways /= np.maximum(np.linalg.norm(ways, axis=-1, keepdims=True), 1e-300)
    steps = np.maximum(np.linalg.norm(np.diff(ways, axis=1), axis=-1), 1e-12)
    along = np.concatenate([np.zeros((len(curves), 1)), np.cumsum(steps, axis=1)], axis=1)
    wanted = np.maximum(along[:, -1] / STEP, np.where(straight, 1.0, LEAST))
    counts = 2 ** np.ceil(np.log2(np.minimum(wanted, MOST))).astype(int)
    points: list[FloatArray] = [np.zeros((0, 3))] * len(curves)
    for count in np.unique(counts).tolist():
        which = np.flatnonzero(counts == count)
        # At places that are evenly spread in the sky, as far as the samples tell.
        shares = np.arange(count) / count
        places = np.stack([np.interp(shares * along[i, -1], along[i], t) for i in which])
        found = evaluate(curves[which, None], places)
        for i, line in zip(which.tolist(), found, strict=True):
            points[i] = line
    return points
