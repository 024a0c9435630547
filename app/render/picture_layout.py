"""Where the pictures of lights are in their atlas, and what shaders must know of each.

One RGBA16F texture holds all: every picture as it is, with a border of one texel for the
sampler, and its blurred levels (`ltc.prefilter`). Half floats hold values over the picture's
largest and coverage, both times `ltc.prefilter.HALF_SCALE`.

A light's picture is laid on the plane by `app.pictures.picture_map`; its levels cover the bounding
rectangle of the outline and a quarter of its size around.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.curves import bounds
from app.errors import InputError
from app.pictures import PictureTexels, load_frame, picture_map
from app.render.pack import LightGeometry, light_geometry, plane_basis
from app.scene import AreaLight
from ltc.prefilter import PAD, level_size

FloatArray = NDArray[np.float64]
Place = tuple[int, int]

PICTURE_RECORD = np.dtype(
    [
        ("x_from_plane", "<f4", 3),
        ("tiles", "<f4"),
        ("y_from_plane", "<f4", 3),
        ("largest", "<f4"),
        ("source", "<f4", 4),
        ("levels", "<f4", 4),
        ("level_scale", "<f4", 2),
        ("level_offset", "<f4", 2),
    ]
)
"""Five texels, read by ``shaders/common/light_picture.glsl``."""

LARGEST_LEVEL = 1024
"""Most texels of level 0 on an axis: finer detail is in the picture itself."""

BYTES_PER_TEXEL = 8
BORDER = 1
"""Texels around a picture."""


@dataclass(frozen=True, eq=False)
class LaidPicture:
    """A light's picture: its texels, what its levels cover, and its place in the atlas.

    Attributes
    ----------
    light : AreaLight
    frame : PictureTexels
        Of the moment.
    geometry : LightGeometry
    picture_from_plane : (2, 3) float64
        From the light's own (s, t) [m] to (x, y).
    corner, size : (2,) float64
        The rectangle that levels cover, in (s, t) [m].
    level_size : (int, int)
        Width and height of level 0.
    source, levels : (int, int)
        Corners in the atlas [texels]: of the picture without its border, and of level 0.
    """

    light: AreaLight
    frame: PictureTexels
    geometry: LightGeometry
    picture_from_plane: FloatArray
    corner: FloatArray
    size: FloatArray
    level_size: tuple[int, int]
    source: Place = (0, 0)
    levels: Place = (0, 0)

    @property
    def source_size(self) -> tuple[int, int]:
        """Width and height of the picture."""
        rows, columns = self.frame.texels.shape[:2]
        return columns, rows

    @property
    def largest(self) -> float:
        """The largest value of the picture, more than 0."""
        return max(float(self.frame.texels[..., :3].max()), 1e-30)

    def level_sizes(self) -> list[tuple[int, int]]:
        """Return width and height of all levels, down to 1 by 1."""
        width, height = self.level_size
        sizes = [(width, height)]
        while max(sizes[-1]) > 1:
            w, h = sizes[-1]
            sizes.append((max(w // 2, 1), max(h // 2, 1)))
        return sizes

    def level_corners(self) -> list[Place]:
        """Return the corners of all levels in the atlas: the smaller ones beside level 0."""
        x, y = self.levels
        corners, top = [(x, y)], y
        for _, height in self.level_sizes()[1:]:
            corners.append((x + self.level_size[0], top))
            top += height
        return corners

    def picture_from_texel(self) -> FloatArray:
        """Return the (3, 3) map from texels of level 0 to (x, y, 1)."""
        plane_from_texel = np.eye(3)
        plane_from_texel[(0, 1), (0, 1)] = self.size / self.level_size
        plane_from_texel[:2, 2] = self.corner
        return np.vstack([self.picture_from_plane, [0.0, 0.0, 1.0]]) @ plane_from_texel

    def outline_in_levels(self) -> list[FloatArray]:
        """Return the light's loops, edges or cubics, in [0, 1]^2 of what levels cover."""
        return [(loop - self.corner) / self.size for loop in self.geometry.loops]

    def record(self) -> NDArray[np.void]:
        """Return the `PICTURE_RECORD` (1,)."""
        record = np.zeros(1, dtype=PICTURE_RECORD)
        record["x_from_plane"], record["y_from_plane"] = self.picture_from_plane
        assert self.light.picture is not None
        record["tiles"] = self.light.picture.fit == "tile"
        record["largest"] = self.largest
        record["source"] = (*self.source, *self.source_size)
        record["levels"] = (*self.levels, *self.level_size)
        scale = self.level_size / self.size
        record["level_scale"], record["level_offset"] = scale, -self.corner * scale
        return record


@dataclass(frozen=True, eq=False)
class PictureLayout:
    """All pictures, by the index of their light, and the size of the atlas that holds them."""

    pictures: dict[int, LaidPicture]
    width: int
    height: int

    @property
    def bytes(self) -> int:
        """Of the atlas."""
        return BYTES_PER_TEXEL * self.width * self.height

    def records(self) -> dict[int, NDArray[np.void]]:
        """Return what shaders must know of each picture, by the index of its light."""
        return {index: picture.record() for index, picture in self.pictures.items()}


NO_PICTURES = PictureLayout({}, 0, 0)
"""Of scenes without."""


def has_picture(light: AreaLight) -> bool:
    """Return whether a picture of the light can be seen anywhere."""
    return light.picture is not None and any(light.radiance) and light_geometry(light).parts > 0


def lay_pictures(lights: Sequence[AreaLight], time: float, texture_side: int) -> PictureLayout:
    """Return where the pictures of lights go.

    Raises
    ------
    InputError
        If a picture cannot be loaded, or all together are too large for the machine.
    """
    laid = {i: _laid(light, time) for i, light in enumerate(lights) if has_picture(light)}
    # Shelves: the highest first, each row as high as its first.
    boxes = []
    for i, picture in laid.items():
        width, height = picture.source_size
        boxes.append((height + 2 * BORDER, width + 2 * BORDER, i, "source"))
        (width, height), *smaller = picture.level_sizes()
        stacked = sum(h for _, h in smaller)
        boxes.append((max(height, stacked), width + max(width // 2, 1), i, "levels"))
    boxes.sort(key=lambda box: (-box[0], -box[1]))
    limit = max([width for _, width, _, _ in boxes], default=0)
    limit = max(limit, int(np.sqrt(sum(h * w for h, w, _, _ in boxes))))
    places: dict[tuple[int, str], Place] = {}
    x = y = shelf = used = 0
    for height, width, i, what in boxes:
        if x + width > limit:
            x, y, shelf = 0, y + shelf, 0
        places[i, what] = (x + BORDER, y + BORDER) if what == "source" else (x, y)
        shelf = max(shelf, height)
        x += width
        used = max(used, x)
    total = y + shelf
    if max(used, total) > texture_side:
        raise InputError(
            f"lights: {len(laid)} pictures need an atlas of {used}x{total} texels, expected at "
            f"most {texture_side} a side on this machine"
        )
    return PictureLayout(
        {
            i: LaidPicture(
                p.light, p.frame, p.geometry, p.picture_from_plane, p.corner, p.size,
                p.level_size, places[i, "source"], places[i, "levels"],
            )
            for i, p in laid.items()
        },
        used,
        total,
    )  # fmt: skip


def _laid(light: AreaLight, time: float) -> LaidPicture:
    assert light.picture is not None
    frame = load_frame(light.picture, time)
    geometry = light_geometry(light)
    low, high = _bounds(geometry.loops)
    size = np.maximum(high - low, 1e-30)
    rows, columns = frame.texels.shape[:2]
    # From the light's own (s, t) [m] about its centroid back to the outline's coordinates.
    e1, e2, to_metres = plane_basis(light.plane)
    away = geometry.origin - np.array(light.plane.origin)
    back = np.linalg.inv(to_metres)
    outline_from_plane = np.hstack([back, (back @ [away @ e1, away @ e2])[:, None]])
    linear = np.asarray(picture_map(light), dtype=np.float64)
    picture_from_plane = linear[:, :2] @ outline_from_plane
    picture_from_plane[:, 2] += linear[:, 2]
    return LaidPicture(
        light,
        frame,
        geometry,
        picture_from_plane,
        low - PAD * size,
        (1.0 + 2.0 * PAD) * size,
        (level_size(columns, LARGEST_LEVEL), level_size(rows, LARGEST_LEVEL)),
    )


def _bounds(loops: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Return the least and greatest coordinates of loops, polygons or cubics."""
    found = [bounds(loop) if loop.ndim == 3 else (loop.min(0), loop.max(0)) for loop in loops]
    low = np.min([np.reshape(f[0], (-1, 2)).min(0) for f in found], axis=0)
    high = np.max([np.reshape(f[1], (-1, 2)).max(0) for f in found], axis=0)
    return low, high
