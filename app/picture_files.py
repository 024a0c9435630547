"""Picture files as arrays, with the numbers that are in them.

Pillow reads what eight bits are enough for, and animations; OpenImageIO reads sixteen bits and
floating point. Both are imported when the first picture is met.

Every function takes a file's path, time of change [ns] and size [bytes]: those two tell new
content from old, so that what was read can be kept.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.errors import InputError, os_reason
from app.files import read_file

if TYPE_CHECKING:
    from PIL import Image

Pixels: TypeAlias = NDArray[np.generic]

PICTURE_SUFFIXES = (
    ".png", ".jpg", ".jpeg", ".webp", ".gif", ".tif", ".tiff", ".exr", ".hdr",
)  # fmt: skip

PILLOW_FORMATS = ("PNG", "JPEG", "WEBP", "GIF")
ANIMATED_FORMATS = ("PNG", "WEBP", "GIF")
DEEP_SUFFIXES = (".tif", ".tiff", ".exr", ".hdr")
"""OpenImageIO reads these."""

LARGEST_FILE_SIDE = 8192
MOST_FILE_BYTES = 2**31

SHORTEST_FRAME, USUAL_FRAME = 0.011, 0.1
"""Seconds. Frames that claim to be shorter than the first last the second, as in browsers."""

OPEN_ANIMATIONS = 8
"""Whose decoders are kept, since a frame is made from those before it."""

EXIF_ORIENTATION = 0x0112


@dataclass(frozen=True, eq=False)
class Decoded:
    """A picture as its file has it.

    Attributes
    ----------
    pixels : (rows, columns, 1 to 4), uint8, uint16 or float32
        Grey, grey and alpha, RGB, or RGB and alpha; row 0 is the top.
    is_associated : bool
        Whether colours are multiplied by alpha already.
    """

    pixels: Pixels
    is_associated: bool = False


@lru_cache(maxsize=256)
def read_size(path: str, changed: int, size: int) -> tuple[int, int]:
    """Return width and height in texels, from the head of the file.

    Raises
    ------
    InputError
        If the file cannot be read, is damaged or too large.
    """
    if _is_deep(path):
        with _deep(path, size) as (_, spec):
            width, height = spec.full_width, spec.full_height
            turned = _orientation(spec) >= 5
    else:
        with _shallow(path) as image:
            width, height = image.size
            turned = image.getexif().get(EXIF_ORIENTATION, 1) in (5, 6, 7, 8)
    return (height, width) if turned else (width, height)


@lru_cache(maxsize=256)
def frame_durations(path: str, changed: int, size: int) -> tuple[float, ...]:
    """Return how long each frame is shown [s]; a still has one frame.

    Raises
    ------
    InputError
        If the file cannot be read, is damaged or too large.
    """
    if _is_deep(path) or not _first_and_count(path, changed, size)[1] > 1:
        return (USUAL_FRAME,)
    first, count = _first_and_count(path, changed, size)
    image = _animation(path, changed, size)
    durations = []
    with _damage_told(path):
        for frame in range(first, first + count):
            image.seek(frame)
            image.load()  # WebP's times are known only then
            seconds = float(image.info.get("duration") or 0.0) / 1e3
            durations.append(seconds if seconds >= SHORTEST_FRAME else USUAL_FRAME)
    return tuple(durations)


def read_frame(path: str, changed: int, size: int, frame: int) -> Decoded:
    """Return a frame of a picture file; those of stills are all the same.

    Raises
    ------
    InputError
        If the file cannot be read, is damaged, too large or has no colours.
    """
    if _is_deep(path):
        return _read_deep(path, size)
    first, count = _first_and_count(path, changed, size)
    if count > 1:
        image = _animation(path, changed, size)
        with _damage_told(path):
            image.seek(first + frame % count)
            return Decoded(_pixels(image))
    with _shallow(path) as still, _damage_told(path):
        from PIL.ImageOps import exif_transpose

        return Decoded(_pixels(exif_transpose(still)))


def _checked_side(path: str, width: int, height: int) -> None:
    if max(width, height) > LARGEST_FILE_SIDE:
        raise InputError(
            f"{path}: found {width}x{height} texels, expected at most {LARGEST_FILE_SIDE} a side"
        )


# With Pillow


@contextmanager
def _shallow(path: str) -> Iterator[Image.Image]:
    from PIL import Image

    suffix = Path(path).suffix
    data = read_file(Path(path), "a picture", suffix, MOST_FILE_BYTES)
    with _damage_told(path):
        image = Image.open(io.BytesIO(data), formats=PILLOW_FORMATS)
    with image:
        _checked_side(path, *image.size)
        yield image


@contextmanager
def _damage_told(path: str) -> Iterator[None]:
    """Turn what Pillow's decoders raise about damaged files, which is anything, to `InputError`."""
    from PIL import Image, UnidentifiedImageError

    kind = Path(path).suffix
    try:
        yield
    except InputError:
        raise
    except UnidentifiedImageError:
        raise InputError(f"{path}: this is no picture, expected one ({kind})") from None
    except Image.DecompressionBombError:
        raise InputError(
            f"{path}: the picture is too large, expected at most {LARGEST_FILE_SIDE} texels a side"
        ) from None
    except Exception as error:
        reason = os_reason(error) if isinstance(error, OSError) and error.strerror else str(error)
        raise InputError(
            f"{path}: the file is damaged ({reason or type(error).__name__}), "
            f"expected a picture ({kind})"
        ) from error


@lru_cache(maxsize=256)
def _first_and_count(path: str, changed: int, size: int) -> tuple[int, int]:
    """Return the first frame of an animation and how many there are; a still has one."""
    with _shallow(path) as image, _damage_told(path):
        count = getattr(image, "n_frames", 1) if image.format in ANIMATED_FORMATS else 1
        # A PNG's picture for programs without animation is none of its frames.
        apart = count > 1 and bool(image.info.get("default_image"))
        return int(apart), count - int(apart)


@lru_cache(maxsize=OPEN_ANIMATIONS)
def _animation(path: str, changed: int, size: int) -> Image.Image:
    from PIL import Image

    data = read_file(Path(path), "a picture", Path(path).suffix, MOST_FILE_BYTES)
    with _damage_told(path):
        return Image.open(io.BytesIO(data), formats=PILLOW_FORMATS)


def _pixels(image: Image.Image) -> Pixels:
    """Return a picture's colours, (h, w, 1, 3 or 4) uint8."""
    if "A" in image.getbands() or "transparency" in image.info:
        return np.asarray(image.convert("RGBA"))
    if image.mode in ("1", "L"):
        return np.asarray(image.convert("L"))[..., None]
    return np.asarray(image.convert("RGB"))


# With OpenImageIO


def _is_deep(path: str) -> bool:
    """Tell whether a file is one for OpenImageIO: by its ending, and PNGs by their bits."""
    if Path(path).suffix.lower() in DEEP_SUFFIXES:
        return True
    try:
        with Path(path).open("rb") as file:
            head = file.read(26)
    except OSError:
        return False
    return head.startswith(b"\x89PNG") and head[24:25] == b"\x10"


@contextmanager
def _deep(path: str, size: int) -> Iterator[tuple[Any, Any]]:
    """Open a file; yields reader and description."""
    import OpenImageIO as oiio  # noqa: N813 (its own short name)

    if size > MOST_FILE_BYTES:
        raise InputError(f"{path}: the file has {size} bytes, expected at most {MOST_FILE_BYTES}")
    if Path(path).suffix.lower() == ".png" and b"IEND" not in Path(path).read_bytes()[-64:]:
        # The library beneath would tell so on stderr.
        raise InputError(f"{path}: the file is damaged (it ends early), expected a picture (.png)")
    as_stored = oiio.ImageSpec()
    as_stored["oiio:UnassociatedAlpha"] = 1
    reader = oiio.ImageInput.open(path, as_stored)
    if reader is None:
        raise InputError(_damage(path, oiio.geterror()))
    try:
        spec = reader.spec()
        _checked_side(path, spec.full_width, spec.full_height)
        _checked_side(path, spec.width, spec.height)
        yield reader, spec
    finally:
        reader.close()


def _damage(path: str, reason: str) -> str:
    first = reason.strip().splitlines()[0] if reason.strip() else "it cannot be decoded"
    kind = Path(path).suffix
    return f"{path}: the file is damaged or no picture ({first}), expected a picture ({kind})"


def _read_deep(path: str, size: int) -> Decoded:
    import OpenImageIO as oiio  # noqa: N813

    with _deep(path, size) as (reader, spec):
        is_float = spec.format.basetype in (oiio.HALF, oiio.FLOAT, oiio.DOUBLE)
        wanted = (
            "float" if is_float else "uint8" if spec.format.basetype == oiio.UINT8 else "uint16"
        )
        pixels = reader.read_image(0, 0, 0, spec.nchannels, wanted)
        if pixels is None or reader.has_error:
            raise InputError(_damage(path, reader.geterror()))
        is_associated = not spec.getattribute("oiio:UnassociatedAlpha")
        pixels = pixels[..., _colour_channels(path, spec.channelnames)]
        window = (spec.x - spec.full_x, spec.y - spec.full_y)
        full = (spec.full_height, spec.full_width)
        turned = _turned(_in_window(pixels, window, full), _orientation(spec))
        return Decoded(np.ascontiguousarray(turned), is_associated)


def _colour_channels(path: str, names: tuple[str, ...]) -> list[int]:
    """Return which channels are colours and alpha: the plain ones, or those of the first layer."""
    layers: dict[str, dict[str, int]] = {}
    for index, name in enumerate(names):
        layer, _, channel = name.rpartition(".")
        layers.setdefault(layer, {}).setdefault(channel.upper(), index)
    for layer in sorted(layers, key=bool):
        channels = layers[layer]
        for colours in (("R", "G", "B"), ("Y",)):
            if all(colour in channels for colour in colours):
                wanted = [*colours, *(["A"] if "A" in channels else [])]
                return [channels[channel] for channel in wanted]
    if len(names) == 1:
        return [0]
    raise InputError(f"{path}: found the channels {', '.join(names)}, expected R, G and B, or Y")


def _in_window(pixels: Pixels, at: tuple[int, int], full: tuple[int, int]) -> Pixels:
    """Return a part of a picture at (column, row) in the whole, without light around it."""
    rows, columns = pixels.shape[:2]
    if at == (0, 0) and (rows, columns) == full:
        return pixels
    whole = np.zeros((*full, pixels.shape[2]), pixels.dtype)
    x0, y0 = max(at[0], 0), max(at[1], 0)
    x1, y1 = min(at[0] + columns, full[1]), min(at[1] + rows, full[0])
    if x0 < x1 and y0 < y1:
        whole[y0:y1, x0:x1] = pixels[y0 - at[1] : y1 - at[1], x0 - at[0] : x1 - at[0]]
    return whole


def _orientation(spec: Any) -> int:
    return int(spec.getattribute("Orientation") or 1)


def _turned(pixels: Pixels, orientation: int) -> Pixels:
    """Return a picture upright that was stored in one of Exif's eight orientations."""
    if orientation in (2, 4, 5, 7):
        pixels = pixels[:, ::-1]
    return np.rot90(pixels, {3: 2, 4: 2, 5: 1, 6: 3, 7: 3, 8: 1}.get(orientation, 0))
