"""What the editor can do to a scene: pure functions from scene or light to a new one.

Nothing is changed in place; unchanged parts are shared with the input, so a
history of scenes costs little. Vertices are named by (contour, point),
lights and objects by their index. An edit that is not possible raises
`SceneError` with a sentence for the user.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import fields, is_dataclass, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.scene import (
    AreaLight,
    Material,
    Outline,
    Plane,
    PolygonContour,
    Quaternion,
    Scene,
    SceneError,
    SceneObject,
    Transform,
    Vec2,
    Vec3,
)
from app.vectors import (
    add,
    cross,
    dot,
    length,
    mix,
    normalize,
    perpendicular,
    rotate,
    scale,
    subtract,
)

FloatArray = NDArray[np.float64]
_Items: TypeAlias = tuple[Material | SceneObject | AreaLight, ...]

NEW_MATERIAL = Material("new", (0.4, 0.4, 0.4), (0.04, 0.04, 0.04), (0.0625, 0.0625))
"""What a new object is made of: grey, satin."""

# --- planes ---------------------------------------------------------------


def normal_of(plane: Plane) -> Vec3:
    """Return the unit normal u x v / |u x v| of the emitting side."""
    return normalize(cross(plane.u, plane.v))


def point_on(plane: Plane, st: Vec2) -> Vec3:
    """Return the world position of plane coordinates (s, t)."""
    return add(plane.origin, add(scale(plane.u, st[0]), scale(plane.v, st[1])))


def coordinates_on(plane: Plane, point: Vec3) -> Vec2:
    """Return (s, t) of the point of the plane nearest to ``point``."""
    offset = subtract(point, plane.origin)
    normal = cross(plane.u, plane.v)
    area = dot(normal, normal)
    s = dot(cross(offset, plane.v), normal) / area
    t = dot(cross(plane.u, offset), normal) / area
    return (s, t)


def metric_from_plane(plane: Plane) -> FloatArray:
    """Return the (2, 2) matrix from (s, t) to metres in an orthonormal basis of the plane.

    Its first axis points along u. Distances and angles on the light are those
    of the image of this map.
    """
    first = normalize(plane.u)
    second = cross(normal_of(plane), first)
    return np.array(
        [
            [dot(plane.u, first), dot(plane.v, first)],
            [dot(plane.u, second), dot(plane.v, second)],
        ]
    )


def transform_plane(plane: Plane, rigid: FloatArray) -> Plane:
    """Return the plane moved by a (4, 4) world matrix of rotation, scale and translation."""

    def turned(vector: Vec3, w: float) -> Vec3:
        x, y, z = (rigid[:3, :3] @ vector + rigid[:3, 3] * w).tolist()
        return (x, y, z)

    return Plane(turned(plane.origin, 1.0), turned(plane.u, 0.0), turned(plane.v, 0.0))


# --- lights ---------------------------------------------------------------


def vertices_of(light: AreaLight) -> list[tuple[tuple[int, int], Vec2]]:
    """Return ((contour, point), (s, t)) for every vertex of the light."""
    return [
        ((c, p), point)
        for c, contour in enumerate(light.outline.contours)
        for p, point in enumerate(contour.points)
    ]


def extent_of(light: AreaLight) -> tuple[Vec2, Vec2]:
    """Return the lower and upper corner of the outline's bounding box, in (s, t)."""
    points = np.concatenate([np.array(contour.points) for contour in light.outline.contours])
    (s0, t0), (s1, t1) = points.min(0).tolist(), points.max(0).tolist()
    return (s0, t0), (s1, t1)


def centre_of(light: AreaLight) -> Vec3:
    """Return the world position of the centre of the outline's bounding box on the plane."""
    return point_on(light.plane, mix(*extent_of(light), 0.5))


def bounds_of(light: AreaLight) -> tuple[Vec3, float]:
    """Return centre and radius [m] of a sphere around the light, about `centre_of`."""
    middle = np.array(mix(*extent_of(light), 0.5))
    points = np.concatenate([np.array(contour.points) for contour in light.outline.contours])
    away = (points - middle) @ np.array([light.plane.u, light.plane.v])
    return centre_of(light), float(np.linalg.norm(away, axis=-1).max())


def _with_contour(light: AreaLight, contour: int, points: Iterable[Vec2]) -> AreaLight:
    contours = list(light.outline.contours)
    contours[contour] = PolygonContour(tuple(points))
    return replace(light, outline=replace(light.outline, contours=tuple(contours)))


def move_vertex(light: AreaLight, vertex: tuple[int, int], to: Vec2) -> AreaLight:
    """Put one vertex at plane coordinates ``to``."""
    contour, point = vertex
    points = list(light.outline.contours[contour].points)
    points[point] = (float(to[0]), float(to[1]))
    return _with_contour(light, contour, points)


def nearest_edge(light: AreaLight, at: Vec2) -> tuple[int, int, float]:
    """Return (contour, edge, position along it in [0, 1]) of the boundary point nearest to ``at``.

    Edge i leads from point i to the next. Distances are metres on the plane,
    so a skew plane is no obstacle.
    """
    metric = metric_from_plane(light.plane)
    target = metric @ np.asarray(at)
    best = (math.inf, (0, 0, 0.0))
    for c, contour in enumerate(light.outline.contours):
        points = np.asarray(contour.points) @ metric.T
        ways = np.roll(points, -1, axis=0) - points
        squares = (ways**2).sum(-1)
        along = ((target - points) * ways).sum(-1) / np.where(squares > 0.0, squares, 1.0)
        along = np.clip(along, 0.0, 1.0)
        distances = np.linalg.norm(points + along[:, None] * ways - target, axis=-1)
        edge = int(distances.argmin())
        best = min(best, (float(distances[edge]), (c, edge, float(along[edge]))))
    return best[1]


def add_vertex(light: AreaLight, contour: int, edge: int, along: float = 0.5) -> AreaLight:
    """Split an edge at the fraction ``along`` of its way; the new point has index edge + 1."""
    points = list(light.outline.contours[contour].points)
    new = mix(points[edge], points[(edge + 1) % len(points)], along)
    points.insert(edge + 1, new)
    return _with_contour(light, contour, points)


def remove_vertex(light: AreaLight, vertex: tuple[int, int]) -> AreaLight:
    """Remove one vertex. A triangle is removed whole if other contours remain.

    Raises
    ------
    SceneError
        If it is the light's last triangle.
    """
    contour, point = vertex
    points = light.outline.contours[contour].points
    if len(points) > 3:
        return _with_contour(light, contour, points[:point] + points[point + 1 :])
    return remove_contour(light, contour)


def remove_contour(light: AreaLight, contour: int) -> AreaLight:
    """Remove one closed curve, a hole for instance.

    Raises
    ------
    SceneError
        If it is the only one.
    """
    contours = light.outline.contours
    if len(contours) == 1:
        raise SceneError(
            f"light '{light.name}' has only this outline of {len(contours[0].points)} corners; "
            "3 is the fewest a light can have"
        )
    rest = contours[:contour] + contours[contour + 1 :]
    return replace(light, outline=replace(light.outline, contours=rest))


def _winding_and_clearance(
    contours: list[FloatArray], points: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return winding numbers (n,) and distances to the boundary (n,) of points (n, 2)."""
    winding = np.zeros(len(points))
    clearance = np.full(len(points), np.inf)
    for loop in contours:
        a = loop[None] - points[:, None]
        way = np.roll(loop, -1, axis=0) - loop
        b = a + way
        turn = np.arctan2(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0], (a * b).sum(-1))
        winding += np.rint(turn.sum(-1) / (2.0 * np.pi))
        squares = (way**2).sum(-1)
        along = np.clip(-(a * way).sum(-1) / np.where(squares > 0.0, squares, 1.0), 0.0, 1.0)
        gap = np.linalg.norm(a + along[..., None] * way, axis=-1)
        clearance = np.minimum(clearance, gap.min(-1))
    return winding, clearance


def widest_place(light: AreaLight) -> tuple[FloatArray, float, int]:
    """Return the filled point farthest from the outline, its distance, its winding number.

    Returns
    -------
    point : (2,) float64
        In metres, by `metric_from_plane`.
    clearance : float
        [m], to about a hundredth; 0 if nothing is filled.
    winding : int
        How often the contours go around the point, counter-clockwise.

    Notes
    -----
    A grid of 33 x 33 over the bounding box, refined five times about its best
    point: the "pole of inaccessibility" without a cell queue.
    """
    metric = metric_from_plane(light.plane)
    contours = [np.asarray(contour.points) @ metric.T for contour in light.outline.contours]
    corners = np.concatenate(contours)
    low, high = corners.min(0), corners.max(0)
    centre, half = (low + high) / 2.0, (high - low) / 2.0
    best = (centre, 0.0, 0)
    for _ in range(5):
        steps = np.linspace(-1.0, 1.0, 33)
        grid = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
        points = centre + grid * half
        winding, clearance = _winding_and_clearance(contours, points)
        filled = winding % 2 != 0 if light.outline.fill_rule == "evenodd" else winding != 0
        clearance = np.where(filled, clearance, 0.0)
        index = int(clearance.argmax())
        if clearance[index] > best[1]:
            best = (points[index], float(clearance[index]), int(winding[index]))
        centre, half = best[0], half / 8.0
    return best


def add_hole(light: AreaLight) -> AreaLight:
    """Cut a square hole into the widest filled place, half as wide as fits.

    Raises
    ------
    SceneError
        If the outline is empty, or contours overlap there under the nonzero rule.
    """
    place, clearance, winding = widest_place(light)
    if clearance <= 0.0:
        raise SceneError(f"light '{light.name}' has no filled part to cut a hole into")
    if light.outline.fill_rule == "nonzero" and abs(winding) != 1:
        raise SceneError(
            f"light '{light.name}': {abs(winding)} contours overlap where the hole would be; "
            "change the fill rule to even-odd first"
        )
    half = 0.5 * clearance
    square = np.array([(-half, -half), (half, -half), (half, half), (-half, half)])
    if winding > 0:
        square = square[::-1]
    points = (place + square) @ np.linalg.inv(metric_from_plane(light.plane)).T
    hole = PolygonContour(tuple((float(s), float(t)) for s, t in points))
    return replace(light, outline=replace(light.outline, contours=(*light.outline.contours, hole)))


def move_light(light: AreaLight, shift: Vec3) -> AreaLight:
    """Move the light's plane by a vector [m]."""
    return replace(light, plane=replace(light.plane, origin=add(light.plane.origin, shift)))


def rotate_light(light: AreaLight, axis: Vec3, angle: float) -> AreaLight:
    """Turn the light about its centre by ``angle`` [rad] around a world axis."""
    centre, axis = centre_of(light), normalize(axis)
    plane = light.plane
    return replace(
        light,
        plane=Plane(
            add(centre, rotate(subtract(plane.origin, centre), axis, angle)),
            rotate(plane.u, axis, angle),
            rotate(plane.v, axis, angle),
        ),
    )


def aim(light: AreaLight, at: Vec3) -> AreaLight:
    """Turn the light about its centre, by the shortest way, so that it faces a point.

    Raises
    ------
    SceneError
        If the point is the light's centre.
    """
    way = subtract(at, centre_of(light))
    if length(way) < 1e-9:
        raise SceneError(f"light '{light.name}' cannot be aimed at its own centre")
    normal, wanted = normal_of(light.plane), normalize(way)
    axis = cross(normal, wanted)
    angle = math.atan2(length(axis), dot(normal, wanted))
    if length(axis) < 1e-12:
        axis = perpendicular(normal)
    return rotate_light(light, axis, angle)


def flip_light(light: AreaLight) -> AreaLight:
    """Make the light emit to its other side, the shape unchanged in the world."""
    contours = tuple(
        PolygonContour(tuple((-s, t) for s, t in reversed(contour.points)))
        for contour in light.outline.contours
    )
    return replace(
        light,
        plane=replace(light.plane, u=scale(light.plane.u, -1.0)),
        outline=replace(light.outline, contours=contours),
    )


def regular_polygon(corners: int, radius: float = 1.0) -> PolygonContour:
    """Return a regular polygon about the origin, counter-clockwise, standing on an edge."""
    start = -math.pi / 2.0 - math.pi / corners
    angles = [start + 2.0 * math.pi * i / corners for i in range(corners)]
    return PolygonContour(tuple((radius * math.cos(a), radius * math.sin(a)) for a in angles))


# --- scenes ---------------------------------------------------------------


def unique_name(wanted: str, taken: Iterable[str]) -> str:
    """Return ``wanted``, or with the first free number behind it: 'key', 'key 2', ..."""
    names = set(taken)
    if wanted not in names:
        return wanted
    stem, _, tail = wanted.rpartition(" ")
    base = stem if stem and tail.isdigit() else wanted
    number = 2
    while f"{base} {number}" in names:
        number += 1
    return f"{base} {number}"


def replace_light(scene: Scene, index: int, light: AreaLight) -> Scene:
    """Put another light in the place of light ``index``."""
    return replace(scene, lights=(*scene.lights[:index], light, *scene.lights[index + 1 :]))


def replace_object(scene: Scene, index: int, item: SceneObject) -> Scene:
    """Put another object in the place of object ``index``."""
    return replace(scene, objects=(*scene.objects[:index], item, *scene.objects[index + 1 :]))


def replace_material(scene: Scene, name: str, material: Material) -> Scene:
    """Put another material in the place of the one called ``name``; objects follow a new name."""
    materials = tuple(material if m.name == name else m for m in scene.materials)
    objects = scene.objects
    if material.name != name:
        objects = tuple(
            replace(item, material=material.name) if item.material == name else item
            for item in objects
        )
    return replace(scene, materials=materials, objects=objects)


def add_light(scene: Scene) -> tuple[Scene, int]:
    """Add a quad above and behind the camera's target, facing it; return the scene and its index.

    Its size follows the distance at which one looks.
    """
    camera = scene.camera
    up = normalize(camera.up)
    away = subtract(camera.target, camera.eye)
    distance = length(away)
    flat = normalize(subtract(away, scale(up, dot(away, up))))
    origin = add(camera.target, add(scale(up, 0.22 * distance), scale(flat, 0.35 * distance)))
    half = 0.16 * distance
    right = normalize(cross(flat, up))
    normal = normalize(subtract(camera.target, origin))
    across = scale(right, -1.0)
    light = AreaLight(
        name=unique_name("light", (light.name for light in scene.lights)),
        outline=Outline((regular_polygon(4, half * math.sqrt(2.0)),)),
        plane=Plane(origin, across, cross(normal, across)),
        radiance=(5.0, 5.0, 5.0),
    )
    return replace(scene, lights=(*scene.lights, light)), len(scene.lights)


def add_object(
    scene: Scene, mesh: str, name: str, transform: Transform | None = None
) -> tuple[Scene, int]:
    """Add a mesh (built-in name or absolute path) with a material of its own; return its index.

    Without a transform, spheres and boxes are half as large as they come and
    stand on the ground.
    """
    if transform is None:
        transform = Transform()
        if mesh in ("sphere", "box"):
            transform = Transform((0.0, 0.5, 0.0), scale=(0.5, 0.5, 0.5))
    material = replace(NEW_MATERIAL, name=unique_name(name, (m.name for m in scene.materials)))
    item = SceneObject(
        name=unique_name(name, (item.name for item in scene.objects)),
        mesh=mesh,
        material=material.name,
        transform=transform,
    )
    grown = replace(scene, materials=(*scene.materials, material), objects=(*scene.objects, item))
    return grown, len(scene.objects)


def remove_light(scene: Scene, index: int) -> Scene:
    """Remove light ``index``."""
    return replace(scene, lights=scene.lights[:index] + scene.lights[index + 1 :])


def remove_object(scene: Scene, index: int) -> Scene:
    """Remove object ``index``; its material stays."""
    return replace(scene, objects=scene.objects[:index] + scene.objects[index + 1 :])


def duplicate_light(scene: Scene, index: int) -> tuple[Scene, int]:
    """Add a copy of a light, shifted along its plane by its own width; return its index."""
    light = scene.lights[index]
    _, radius = bounds_of(light)
    shift = scale(normalize(light.plane.u), 1.5 * radius)
    name = unique_name(light.name, (other.name for other in scene.lights))
    copy = replace(move_light(light, shift), name=name)
    return replace(scene, lights=(*scene.lights, copy)), len(scene.lights)


def duplicate_object(scene: Scene, index: int) -> tuple[Scene, int]:
    """Add a copy of an object, half a metre to the right; return its index."""
    item = scene.objects[index]
    name = unique_name(item.name, (other.name for other in scene.objects))
    moved = replace(item.transform, translate=add(item.transform.translate, (0.5, 0.0, 0.0)))
    copy = replace(item, name=name, transform=moved)
    return replace(scene, objects=(*scene.objects, copy)), len(scene.objects)


def own_material(scene: Scene, index: int) -> Scene:
    """Give object ``index`` a material of its own, a copy of the one it shares."""
    item = scene.objects[index]
    material = scene.material_of(item)
    name = unique_name(material.name, (other.name for other in scene.materials))
    widened = replace(scene, materials=(*scene.materials, replace(material, name=name)))
    return replace_object(widened, index, replace(item, material=name))


def rename_light(scene: Scene, index: int, name: str) -> Scene:
    """Name a light; an empty name changes nothing, a taken one gets a number."""
    light, name = scene.lights[index], name.strip()
    if not name or name == light.name:
        return scene
    taken = (other.name for other in scene.lights if other is not light)
    return replace_light(scene, index, replace(light, name=unique_name(name, taken)))


def rename_object(scene: Scene, index: int, name: str) -> Scene:
    """Name an object; an empty name changes nothing, a taken one gets a number."""
    item, name = scene.objects[index], name.strip()
    if not name or name == item.name:
        return scene
    taken = (other.name for other in scene.objects if other is not item)
    return replace_object(scene, index, replace(item, name=unique_name(name, taken)))


def rename_material(scene: Scene, material: str, name: str) -> Scene:
    """Name a material; its objects follow. Empty and taken names as `rename_light`."""
    name = name.strip()
    if not name or name == material:
        return scene
    old = next(m for m in scene.materials if m.name == material)
    taken = (other.name for other in scene.materials if other is not old)
    return replace_material(scene, material, replace(old, name=unique_name(name, taken)))


def transform_object(item: SceneObject, rigid: FloatArray) -> SceneObject:
    """Return the object moved by a (4, 4) world matrix of rotation and translation."""
    transform = item.transform
    x, y, z = (rigid[:3, :3] @ transform.translate + rigid[:3, 3]).tolist()
    turn = quaternion_of(rigid[:3, :3])
    product = multiply_quaternions(turn, transform.rotate)
    norm = math.hypot(*product)
    w, i, j, k = (component / norm for component in product)
    return replace(item, transform=replace(transform, translate=(x, y, z), rotate=(w, i, j, k)))


def quaternion_of(rotation: FloatArray) -> Quaternion:
    """Return the unit quaternion (w, x, y, z) of a (3, 3) rotation matrix (Shepperd 1978)."""
    m = rotation
    squares = np.array(
        [
            1.0 + m[0, 0] + m[1, 1] + m[2, 2],
            1.0 + m[0, 0] - m[1, 1] - m[2, 2],
            1.0 - m[0, 0] + m[1, 1] - m[2, 2],
            1.0 - m[0, 0] - m[1, 1] + m[2, 2],
        ]
    )
    products = np.array(
        [
            [0.0, m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]],
            [0.0, 0.0, m[1, 0] + m[0, 1], m[0, 2] + m[2, 0]],
            [0.0, 0.0, 0.0, m[2, 1] + m[1, 2]],
            [0.0, 0.0, 0.0, 0.0],
        ]
    )
    products += products.T + np.diag(squares)
    row = products[int(squares.argmax())]
    w, x, y, z = (row / np.linalg.norm(row)).tolist()
    return (w, x, y, z)


def multiply_quaternions(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return the Hamilton product a b: the turn b, then a."""
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )


# --- names of steps --------------------------------------------------------

_FIELD_NAMES = {
    "alpha": "roughness",
    "f0": "reflectance",
    "diffuse": "diffuse colour",
    "two_sided": "two-sided",
    "visible": "visibility",
    "fov_y": "field of view",
    "tone_map": "tone map",
    "plane": "position",
    "rotate": "rotation",
    "translate": "position",
    "outline": "shape",
}


def describe(before: Scene, after: Scene) -> str:
    """Return a short name for the difference of two scenes: "Change roughness of 'floor'".

    Names the first difference only, which is what one panel makes in a frame.
    """
    for kind, old, new in _lists_of(before, after):
        if len(new) > len(old):
            return f"Add {kind} '{new[-1].name}'"
        if len(new) < len(old):
            gone = {item.name for item in old} - {item.name for item in new}
            return f"Remove {kind} '{min(gone, default='')}'"
        for a, b in zip(old, new, strict=True):
            if a == b:
                continue
            if a.name != b.name:
                return f"Rename {kind} '{a.name}'"
            if isinstance(a, AreaLight) and isinstance(b, AreaLight):
                more = len(b.outline.contours) - len(a.outline.contours)
                if more:
                    return f"{'Add' if more > 0 else 'Remove'} outline of '{a.name}'"
            return f"Change {_first_difference(a, b)} of '{a.name}'"
    if before.display != after.display:
        return f"Change {_first_difference(before.display, after.display)}"
    return "Move camera"


def _lists_of(before: Scene, after: Scene) -> tuple[tuple[str, _Items, _Items], ...]:
    return (
        ("light", before.lights, after.lights),
        ("object", before.objects, after.objects),
        ("material", before.materials, after.materials),
    )


def _first_difference(a: object, b: object) -> str:
    if not is_dataclass(a):
        return ""
    for field in fields(a):
        old, new = getattr(a, field.name), getattr(b, field.name)
        if old != new:
            inner = _first_difference(old, new) if field.name == "transform" else ""
            return inner or _FIELD_NAMES.get(field.name, field.name)
    return "value"
