"""Pictures on lights: from a file and a moment to linear texels, and where they lie.

`app.picture_files` decodes; here animations and sequences become frames, colours become linear
light, and what cannot shine (NaN, infinite and negative numbers) is taken out and told.
"""

from __future__ import annotations

import math
import re
from bisect import bisect_right
from dataclasses import dataclass
from functools import lru_cache
from itertools import accumulate
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app import contours
from app.caching import ByteCache
from app.errors import InputError, expected_one_of, os_reason, require_file
from app.picture_files import (
    PICTURE_SUFFIXES,
    frame_durations,
    read_frame,
    read_size,
)
from app.scene import AreaLight, ColorSpace, Picture

LARGEST_SIDE = 4096
"""Texels; larger pictures are averaged down to it."""

LARGEST_RADIANCE = 1e15
"""Beyond this squares leave float32; such numbers count as infinite."""

FRAMES_PER_SECOND = 25.0
"""Of sequences, which do not say it themselves."""

CACHED_BYTES = 768 * 2**20
"""Of texels: two pictures of `LARGEST_SIDE`, or 12 seconds of animation of 512 by 512."""

ROWS_AT_ONCE = 256
"""That are made linear together, so that a large picture is never there twice as float32."""

SEQUENCE = re.compile(r"%(?:0(\d))?d")

Affine2: TypeAlias = tuple[tuple[float, float, float], tuple[float, float, float]]
"""Rows (a, b, c): a s + b t + c."""


@dataclass(frozen=True, eq=False)
class PictureTexels:
    """One frame of a picture, ready to be filtered; compared by identity.

    Attributes
    ----------
    texels : (rows, columns, 4) float32, read-only
        Linear Rec. 709 times alpha, and alpha; row 0 is the picture's top. Finite, 0 or more,
        alpha at most 1.
    reports : tuple of str
        What was changed, each a sentence for the user that names the file.
    """

    texels: NDArray[np.float32]
    reports: tuple[str, ...] = ()


def load_frame(picture: Picture, time: float) -> PictureTexels:
    """Return the frame of a picture that is shown at a moment.

    Parameters
    ----------
    picture : Picture
        A still, an animation, or a sequence of files.
    time : float
        Seconds; animations repeat for ever, before 0 too.

    Returns
    -------
    PictureTexels
        The same object for the same frame, until the file changes (its time or size) or has
        given way to others in the cache.

    Raises
    ------
    InputError
        If the file is missing, unreadable, of another kind or damaged, or has a side of more
        than `app.picture_files.LARGEST_FILE_SIDE`.
    """
    path, frame = frame_at(picture, time)
    return _frames(path, *_state(Path(path)), frame, picture.color_space)


def picture_size(picture: Picture) -> tuple[int, int]:
    """Return width and height of a picture's first frame as the file has it, in texels.

    Raises
    ------
    InputError
        As `load_frame`, as far as the head of the file tells.
    """
    path = _files(picture.file)[0]
    return read_size(str(path), *_state(path))


def frame_at(picture: Picture, time: float) -> tuple[str, int]:
    """Return the file that is shown at a moment [s], and which of its frames.

    Raises
    ------
    InputError
        If the file is missing or damaged.
    """
    files = _files(picture.file)
    ends = _frame_ends(picture)
    frame = 0
    if len(ends) > 1:
        # What is a frame's first moment but for rounding is that frame's already.
        moment = math.fmod(time + picture.start + 1e-6, ends[-1])
        moment += ends[-1] if moment < 0.0 else 0.0
        frame = min(bisect_right(ends, moment), len(ends) - 1)
    return (str(files[frame]), 0) if len(files) > 1 else (str(files[0]), frame)


def duration(picture: Picture) -> float:
    """Return the seconds after which a picture begins again, 0 for a still.

    Raises
    ------
    InputError
        If the file is missing or damaged.
    """
    ends = _frame_ends(picture)
    return ends[-1] if len(ends) > 1 else 0.0


def file_state(picture: Picture) -> object:
    """Return what differs once a picture's files have changed; missing ones count too."""
    try:
        return tuple((str(path), *_state(path)) for path in _files(picture.file))
    except InputError as error:
        return str(error)


def is_sequence(file: str) -> bool:
    """Tell whether a path means numbered files: it has ``%d`` or ``%04d`` in its name."""
    return len(SEQUENCE.findall(Path(file).name)) == 1


def sequence_of(file: str) -> str | None:
    """Return the pattern of a numbered file whose number is one of several, else None.

    ``flame_0007.png`` beside ``flame_0008.png`` gives ``flame_%04d.png``. Of several
    numbers in the name the last one counts.
    """
    path = Path(file)
    numbers = list(re.finditer(r"\d+", path.stem))
    if not numbers or is_sequence(file):
        return None
    at = numbers[-1]
    width = f"0{len(at[0])}" if 1 < len(at[0]) < 10 else ""
    pattern = str(path.with_name(f"{path.name[: at.start()]}%{width}d{path.name[at.end() :]}"))
    try:
        return pattern if is_sequence(pattern) and len(_files(pattern)) > 1 else None
    except InputError:
        return None


# Where a picture lies


def picture_map(light: AreaLight) -> Affine2:
    """Return the map from plane coordinates (s, t) to a light's picture.

    Returns
    -------
    2 rows of 3 numbers
        (x, y) = rows @ (s, t, 1), x from 0 at the picture's left edge to 1 at its right, y from
        0 at its top to 1 at its bottom. With the fit ``tile`` the picture repeats beyond;
        otherwise there is nothing outside, black and transparent.

    Raises
    ------
    InputError
        If the picture's size is needed and cannot be read.
    ValueError
        If the light has no picture.
    """
    picture = light.picture
    if picture is None:
        raise ValueError(f"light '{light.name}' has no picture")
    (s0, t0), (s1, t1) = contours.bounds(light.outline)
    unit_s, unit_t = math.hypot(*light.plane.u), math.hypot(*light.plane.v)
    # A light without width shines nowhere; its picture has some width nevertheless.
    least = 1e-30 + 1e-12 * (abs(s0) + abs(s1) + abs(t0) + abs(t1)) * max(unit_s, unit_t)
    box = max((s1 - s0) * unit_s, least), max((t1 - t0) * unit_t, least)
    width, height = _fitted(picture, *box)
    width, height = width * picture.scale[0], height * picture.scale[1]
    # From the plane [m] about the picture's middle, turned back, to shares of the picture.
    cos, sin = math.cos(picture.rotation), math.sin(picture.rotation)
    right = -1.0 if picture.mirror[0] else 1.0
    down = 1.0 if picture.mirror[1] else -1.0
    rows = (
        (right * cos * unit_s / width, right * sin * unit_t / width),
        (-down * sin * unit_s / height, down * cos * unit_t / height),
    )
    middle = (
        0.5 * (s0 + s1) + picture.offset[0] * box[0] / unit_s,
        0.5 * (t0 + t1) + picture.offset[1] * box[1] / unit_t,
    )
    (a, b), (c, d) = rows
    return (
        (a, b, 0.5 - a * middle[0] - b * middle[1]),
        (c, d, 0.5 - c * middle[0] - d * middle[1]),
    )


def _fitted(picture: Picture, width: float, height: float) -> tuple[float, float]:
    """Return the sides [m] of a picture before ``scale`` in a box of the given sides."""
    if picture.fit == "stretch":
        return width, height
    columns, rows = picture_size(picture)
    choose = max if picture.fit == "fill" else min
    texel = choose(width / columns, height / rows)
    return columns * texel, rows * texel


# Which frame


def _frame_ends(picture: Picture) -> tuple[float, ...]:
    """Return when each frame gives way to the next [s]."""
    files = _files(picture.file)
    if len(files) > 1:
        durations = (1.0 / FRAMES_PER_SECOND,) * len(files)
    else:
        durations = frame_durations(str(files[0]), *_state(files[0]))
    return _ends(durations, picture.frames_per_second)


@lru_cache(maxsize=64)
def _ends(durations: tuple[float, ...], frames_per_second: float) -> tuple[float, ...]:
    if frames_per_second > 0.0:
        return tuple((i + 1) / frames_per_second for i in range(len(durations)))
    return tuple(accumulate(durations))


def _files(file: str) -> list[Path]:
    """Return the file, or the files of a sequence in the order of their numbers."""
    path = Path(file)
    suffix = path.suffix.lower()
    kinds = ", ".join(PICTURE_SUFFIXES)
    if suffix not in PICTURE_SUFFIXES and not path.is_dir():
        found = f"the suffix '{path.suffix}'" if suffix else "no suffix"
        raise InputError(
            f"{path}: {found} is not a picture format, {expected_one_of(suffix, PICTURE_SUFFIXES)}"
        )
    if not is_sequence(file) or path.exists():
        require_file(path, f"a picture ({kinds})")
        return [path]
    try:
        changed = path.parent.stat().st_mtime_ns
        return _numbered(path.parent, path.name, changed)
    except OSError as error:
        raise InputError(
            f"{path}: the folder cannot be read ({os_reason(error)}), expected one with pictures"
        ) from error


@lru_cache(maxsize=16)
def _numbered(folder: Path, name: str, _changed: int) -> list[Path]:
    at = SEQUENCE.search(name)
    assert at is not None
    # As printf writes it: %d without leading zeros, %04d with zeros up to four digits.
    width = int(at[1] or 1)
    number = rf"(\d{{{width}}}|[1-9]\d{{{width},}})"
    matches = re.compile(re.escape(name[: at.start()]) + number + re.escape(name[at.end() :]))
    found = [(int(m[1]), path) for path in folder.iterdir() if (m := matches.fullmatch(path.name))]
    if not found:
        raise InputError(
            f"{folder / name}: no file has this name with a number, "
            f"expected pictures such as {name[: at.start()]}{'1'.zfill(width)}{name[at.end() :]}"
        )
    return [path for _, path in sorted(found)]


def _state(path: Path) -> tuple[int, int]:
    """Return the time of change and the size of a file, which tell new content from old."""
    try:
        state = path.stat()
    except OSError as error:
        raise InputError(
            f"{path}: cannot be read ({os_reason(error)}), expected a picture"
        ) from error
    return state.st_mtime_ns, state.st_size


# Texels


def _load(path: str, changed: int, size: int, frame: int, color_space: ColorSpace) -> PictureTexels:
    decoded = read_frame(path, changed, size, frame)
    kind = decoded.pixels.dtype.kind
    is_srgb = color_space == "srgb" or (color_space == "auto" and kind != "f")
    rows, columns = decoded.pixels.shape[:2]
    shrink = min(1.0, LARGEST_SIDE / max(rows, columns))
    shape = max(1, round(rows * shrink)), max(1, round(columns * shrink))
    texels = np.empty((*shape, 4), dtype=np.float32)
    down, across = (np.linspace(0.0, n, m + 1) for n, m in zip((rows, columns), shape, strict=True))
    counts = np.zeros(2, dtype=np.int64)
    counted = 0
    for begin in range(0, shape[0], ROWS_AT_ONCE):
        edges = down[begin : begin + ROWS_AT_ONCE + 1]
        low, high = math.floor(edges[0]), math.ceil(edges[-1])
        linear, faults = _linear(decoded.pixels[low:high], is_srgb, decoded.is_associated)
        counts += faults[:, counted - low :].sum(axis=(1, 2))  # bands may share a row
        counted = high
        band = _averaged(_averaged(linear, across, 1), edges - low, 0)
        texels[begin : begin + len(band)] = band
    endless, negative = counts.tolist()
    texels.flags.writeable = False
    reports = []
    if endless:
        reports.append(
            f"{path}: {_count(endless, 'texel')} with NaN or infinite numbers became black"
        )
    if negative:
        reports.append(f"{path}: negative numbers in {_count(negative, 'texel')} became 0")
    if shape != (rows, columns):
        reports.append(
            f"{path}: {columns}x{rows} texels were averaged down to {shape[1]}x{shape[0]}"
        )
    return PictureTexels(texels, tuple(reports))


_frames = ByteCache(_load, lambda frame: 1024 + frame.texels.nbytes, CACHED_BYTES)


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"


def _linear(
    pixels: NDArray[Any], is_srgb: bool, is_associated: bool
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Return linear texels times alpha (h, w, 4), and which had what cannot shine.

    Parameters
    ----------
    pixels : (h, w, 1 to 4)
        Grey, grey and alpha, RGB, or RGB and alpha.

    Returns
    -------
    faults : (2, h, w) bool
        Not finite, and negative; (2, h, 0) for whole numbers, which are neither.
    """
    channels = pixels.shape[2]
    colours = pixels[..., :3] if channels > 2 else pixels[..., :1]
    texels = np.empty((*pixels.shape[:2], 4), dtype=np.float32)
    has_alpha = channels in (2, 4)
    texels[..., 3] = _to_unit(pixels[..., -1]) if has_alpha else 1.0
    alpha = texels[..., 3:]
    faults = np.zeros((2, len(texels), 0), dtype=np.bool_)
    if pixels.dtype.kind == "f":
        with np.errstate(invalid="ignore"):
            texels[..., :3] = colours
            usable = np.abs(texels) <= LARGEST_RADIANCE  # False for NaN
        endless = ~usable.all(axis=-1)
        texels[endless, :3] = 0.0
        texels[~usable[..., 3], 3] = 1.0
        faults = np.stack((endless, (texels < 0.0).any(axis=-1)))
        np.maximum(texels, 0.0, out=texels)
        np.minimum(alpha, 1.0, out=alpha)
    if is_srgb and has_alpha and is_associated:
        # Encoded after the multiplication: take it back first.
        if pixels.dtype.kind != "f":
            texels[..., :3] = _to_unit(colours)
        solid = np.where(alpha > 0.0, alpha, np.float32(1.0))
        texels[..., :3] = srgb_decoded(texels[..., :3] / solid) * alpha
        return texels, faults
    if pixels.dtype.kind == "f":
        if is_srgb:
            texels[..., :3] = srgb_decoded(texels[..., :3])
    elif is_srgb:
        texels[..., :3] = _decoding_table(pixels.dtype.name)[colours]
    else:
        texels[..., :3] = _to_unit(colours)
    if has_alpha and not is_associated:
        texels[..., :3] *= alpha
    return texels, faults


def _to_unit(values: NDArray[Any]) -> NDArray[np.float32]:
    """Return whole numbers as shares of the largest; those in floating point as they are."""
    scale = 1.0 if values.dtype.kind == "f" else 1.0 / np.iinfo(values.dtype).max
    return values.astype(np.float32) * np.float32(scale)


@lru_cache(maxsize=2)
def _decoding_table(dtype: str) -> NDArray[np.float32]:
    """Return the linear value of every number of uint8 or uint16."""
    return srgb_decoded(np.linspace(0.0, 1.0, np.iinfo(dtype).max + 1)).astype(np.float32)


def srgb_decoded(values: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return linear values of sRGB's encoded ones, 0 or more (IEC 61966-2-1)."""
    return np.where(
        values <= 0.04045, values / 12.92, ((np.maximum(values, 0.04045) + 0.055) / 1.055) ** 2.4
    ).astype(values.dtype)


def _averaged(texels: NDArray[np.float32], edges: NDArray[Any], axis: int) -> NDArray[np.float32]:
    """Return texels averaged along an axis between edges [texels], parts of texels included.

    ``edges`` (n + 1,) ascend by equal steps of at least a texel.
    """
    count, step = texels.shape[axis], float(edges[1] - edges[0])
    if step == 1.0:
        return texels
    first = np.floor(edges[:-1]).astype(np.int64)
    if np.array_equal(edges, np.round(edges)):
        weights: list[Any] = [np.float32(1.0 / step)] * round(step)
    else:
        shape = [-1 if i == axis else 1 for i in range(texels.ndim)]
        weights = []
        for i in range(math.ceil(step) + 1):
            share = np.minimum(first + i + 1, edges[1:]) - np.maximum(first + i, edges[:-1])
            weights.append((np.maximum(share, 0.0) / step).astype(np.float32).reshape(shape))
    total: NDArray[np.float32] = np.take(texels, first, axis=axis) * weights[0]
    for i, weight in enumerate(weights[1:], 1):
        total += np.take(texels, np.minimum(first + i, count - 1), axis=axis) * weight
    return total
