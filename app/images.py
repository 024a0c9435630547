"""Pictures as files: PNG of display colours, EXR of linear radiance."""

from __future__ import annotations

import io
import tempfile
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from app.files import check_output, replace_file

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
