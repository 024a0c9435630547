"""Pictures as files: PNG of display colours, EXR of linear radiance."""

from __future__ import annotations

import io
import tempfile
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from app.errors import InputError, expected_one_of
from app.files import check_output, read_file, replace_file

IMAGE_SUFFIXES = (".png", ".exr")


class Picture(Protocol):
    """What has been rendered: a `Renderer`, or anything with these two methods."""

    def display(self) -> NDArray[np.uint8]:
        """Return display colours, (h, w, 3), the top row first."""
        ...

    def radiance(self) -> NDArray[np.float32]:
        """Return linear radiance [W m^-2 sr^-1], (h, w, 3), the top row first."""
        ...


def check_image_path(path: Path) -> None:
    """Raise `InputError` unless a picture can be written at ``path``."""
    check_output(path, "a picture", IMAGE_SUFFIXES)


def save_image(picture: Picture, path: Path) -> None:
    """Write a rendered picture as its suffix says, in one step.

    ``.png`` holds the tone-mapped 8-bit sRGB colours, ``.exr`` the linear
    Rec. 709 radiance in float32, channels R, G and B.

    Raises
    ------
    InputError
        If the suffix is another or the place cannot be written.
    """
    check_image_path(path)
    if path.suffix.lower() == ".png":
        data = png_bytes(picture.display())
    else:
        data = exr_bytes(picture.radiance())
    replace_file(path, data, "a picture")


def png_bytes(colours: NDArray[np.uint8]) -> bytes:
    """Return a PNG file of (h, w, 3) uint8 sRGB colours."""
    from PIL import Image

    buffer = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(colours)).save(buffer, "PNG")
    return buffer.getvalue()


def exr_bytes(radiance: NDArray[np.float32]) -> bytes:
    """Return an OpenEXR file of (h, w, 3) float32 linear radiance, losslessly compressed."""
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    channels = {"RGB": np.ascontiguousarray(radiance, dtype=np.float32)}
    # The library writes to files only.
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "picture.exr"
        with OpenEXR.File(header, channels) as file:
            file.write(str(path))
        return path.read_bytes()


MOST_IMAGE_BYTES = 2**30
"""A larger picture file is not read."""


def read_image(path: Path) -> NDArray[np.float32] | NDArray[np.uint8]:
    """Return what a picture file holds, (h, w, 3), the top row first.

    Returns
    -------
    float32 of an ``.exr``, linear radiance; uint8 of a ``.png``, sRGB colours. A channel of
    opacity is left out; grey pictures get three equal channels.

    Raises
    ------
    InputError
        If the file is missing, too large, damaged, has another suffix or no colours.
    """
    suffix = path.suffix.lower()
    if suffix not in IMAGE_SUFFIXES:
        found = f"the suffix '{path.suffix}'" if suffix else "no suffix"
        raise InputError(f"{path}: found {found}, {expected_one_of(suffix, IMAGE_SUFFIXES)}")
    data = read_file(path, "a picture", suffix, MOST_IMAGE_BYTES)
    return _read_png(path, data) if suffix == ".png" else _read_exr(path)


def _read_png(path: Path, data: bytes) -> NDArray[np.uint8]:
    from PIL import Image

    try:
        with Image.open(io.BytesIO(data), formats=("PNG",)) as image:
            if image.mode.startswith("I"):
                raise InputError(f"{path}: found 16 bits a channel, expected 8")
            return np.array(image.convert("RGB"))
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise InputError(f"{path}: the file is damaged or no PNG picture ({error})") from error


def _read_exr(path: Path) -> NDArray[np.float32]:
    import OpenEXR

    try:
        with OpenEXR.File(str(path)) as file:
            channels = {name: np.array(c.pixels) for name, c in file.channels().items()}
    except (OSError, RuntimeError, ValueError, TypeError) as error:
        raise InputError(f"{path}: the file is damaged or no OpenEXR picture") from error
    for name in ("RGB", "RGBA"):
        if name in channels:
            return np.ascontiguousarray(channels[name][..., :3], dtype=np.float32)
    if not {"R", "G", "B"} <= set(channels):
        found = ", ".join(channels) or "none"
        raise InputError(f"{path}: found the channels {found}, expected R, G and B")
    return np.stack([channels[name].astype(np.float32) for name in "RGB"], axis=-1)
