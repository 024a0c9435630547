"""DDS and KTX2: images of floats with one, two or four channels, flat or as volumes.

Only what tables need: one mip level, no compression, no array layers, 16 or 32 bits.
Written after the public descriptions: "DDS_HEADER" and "DDS_HEADER_DXT10" in Microsoft's
Direct3D documentation; the KTX File Format Specification, version 2.0, and the Khronos
Data Format Specification 1.3, section 5, for its descriptor. Rows run from the first
array index, as GPUs number them; nothing is flipped.
"""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

Image = NDArray[Any]
"""(height, width, channels) or (depth, height, width, channels), float16 or float32."""

_DDS_MAGIC = b"DDS "
_KTX2_MAGIC = b"\xabKTX 20\xbb\r\n\x1a\n"

# (bytes per channel, channels) -> number in DXGI_FORMAT and in VkFormat
_DXGI = {(2, 1): 54, (2, 2): 34, (2, 4): 10, (4, 1): 41, (4, 2): 16, (4, 4): 2}
_VULKAN = {(2, 1): 76, (2, 2): 83, (2, 4): 97, (4, 1): 100, (4, 2): 103, (4, 4): 109}
# Direct3D 9 wrote the same formats as a number in place of the four characters.
_FOUR_CC = {111: (2, 1), 112: (2, 2), 113: (2, 4), 114: (4, 1), 115: (4, 2), 116: (4, 4)}

_CAPS, _HEIGHT, _WIDTH, _PITCH, _PIXEL_FORMAT, _DEPTH = 0x1, 0x2, 0x4, 0x8, 0x1000, 0x800000
_CAPS_COMPLEX, _CAPS_TEXTURE, _CAPS2_VOLUME = 0x8, 0x1000, 0x200000
_FOURCC_FLAG = 0x4
_LARGEST = 1 << 28  # bytes of one image; tables are thousands of times smaller


def _described(image: Image) -> tuple[int, int, int, int, int]:
    """Return (depth or 0, height, width, channels, bytes per channel) of an image."""
    if image.ndim not in (3, 4) or image.shape[-1] not in (1, 2, 4) or 0 in image.shape:
        raise ValueError(
            f"image has shape {image.shape}, expected (height, width, channels) or"
            " (depth, height, width, channels) with 1, 2 or 4 channels"
        )
    if image.dtype not in (np.float16, np.float32):
        raise ValueError(f"image is {image.dtype}, expected float16 or float32")
    depth = image.shape[0] if image.ndim == 4 else 0
    height, width, channels = image.shape[-3:]
    return depth, height, width, channels, image.dtype.itemsize


def _texels(image: Image) -> bytes:
    return np.ascontiguousarray(image).astype(image.dtype.newbyteorder("<")).tobytes()


def dds_bytes(image: Image) -> bytes:
    """Return a DDS file with the extended ("DX10") header.

    Raises
    ------
    ValueError
        If the image's shape or type is none that `Image` allows.
    """
    depth, height, width, channels, size = _described(image)
    flags = _CAPS | _HEIGHT | _WIDTH | _PITCH | _PIXEL_FORMAT | (_DEPTH if depth else 0)
    caps = _CAPS_TEXTURE | (_CAPS_COMPLEX if depth else 0)
    head = struct.pack("<7I44x", 124, flags, height, width, width * channels * size, depth, 1)
    head += struct.pack("<2I4s20x", 32, _FOURCC_FLAG, b"DX10")
    head += struct.pack("<2I12x", caps, _CAPS2_VOLUME if depth else 0)
    head += struct.pack("<5I", _DXGI[size, channels], 4 if depth else 3, 0, 1, 0)
    return _DDS_MAGIC + head + _texels(image)


def read_dds(data: bytes) -> Image:
    """Return the image of a DDS file, with either header.

    Raises
    ------
    ValueError
        If it is damaged or holds something else; one sentence without the file's name.
    """
    if len(data) < 128 or data[:4] != _DDS_MAGIC:
        raise ValueError(f"not a DDS file ({len(data)} bytes), expected 'DDS ' and a header")
    size, flags, height, width, _, depth, _ = struct.unpack_from("<7I", data, 4)
    code = data[84:88]
    if size != 124:
        raise ValueError(f"header of {size} bytes, expected 124")
    offset = 128
    if code == b"DX10":
        if len(data) < 148:
            raise ValueError(f"{len(data)} bytes, expected a header of 148")
        number, dimension, _, layers, _ = struct.unpack_from("<5I", data, 128)
        formats = {v: k for k, v in _DXGI.items()}
        if dimension not in (3, 4) or layers != 1:
            raise ValueError(f"dimension {dimension} with {layers} layers, expected one image")
        offset = 148
    else:
        number, formats = struct.unpack("<I", code)[0], _FOUR_CC
    if number not in formats:
        raise ValueError(f"pixel format {number}, expected floats of 16 or 32 bits")
    volume = bool(flags & _DEPTH) and depth > 1
    return _image(data, offset, (depth if volume else 0, height, width), formats[number])


def _image(data: bytes, offset: int, extent: tuple[int, int, int], kind: tuple[int, int]) -> Image:
    """Return the texels at an offset; extent is (depth or 0, height, width)."""
    size, channels = kind
    depth, height, width = extent
    wanted = max(depth, 1) * height * width * channels * size
    if not 0 < wanted <= _LARGEST:
        raise ValueError(f"an image of {width} x {height} x {max(depth, 1)}, which is no table")
    if len(data) < offset + wanted:
        raise ValueError(f"{len(data)} bytes, expected {offset + wanted}")
    kind_ = np.dtype("<f2" if size == 2 else "<f4")
    flat = np.frombuffer(data, dtype=kind_, count=wanted // size, offset=offset)
    shape = ((depth,) if depth else ()) + (height, width, channels)
    return flat.astype(kind_.newbyteorder("=")).reshape(shape)


def ktx2_bytes(image: Image, notes: dict[str, str] | None = None) -> bytes:
    """Return a KTX2 file of one level.

    Parameters
    ----------
    image : Image
    notes : dict, optional
        Written as key and value beside ``KTXorientation`` and ``KTXwriter``.

    Raises
    ------
    ValueError
        If the image's shape or type is none that `Image` allows.
    """
    depth, height, width, channels, size = _described(image)
    texel = channels * size
    descriptor = _descriptor(channels, size)
    pairs = {
        **(notes or {}),
        "KTXorientation": "rdi" if depth else "rd",
        "KTXwriter": "ltc-viewer",
    }
    values = b""
    for key in sorted(pairs):
        pair = key.encode() + b"\0" + pairs[key].encode() + b"\0"
        values += struct.pack("<I", len(pair)) + pair + b"\0" * (-len(pair) % 4)
    at = 80 + 24
    values_at = at + len(descriptor)
    level_at = values_at + len(values)
    level_at += -level_at % max(texel, 4)
    texels = _texels(image)
    head = struct.pack(
        "<9I", _VULKAN[size, channels], size, width, height, depth, 0, 1, 1, 0
    ) + struct.pack("<4I2Q", at, len(descriptor), values_at, len(values), 0, 0)
    head += struct.pack("<3Q", level_at, len(texels), len(texels))
    body = _KTX2_MAGIC + head + descriptor + values
    return body + b"\0" * (level_at - len(body)) + texels


def _descriptor(channels: int, size: int) -> bytes:
    """Return the data format descriptor of signed floats, linear, unspecified primaries."""
    block = 24 + 16 * channels
    result = struct.pack("<3I", 4 + block, 0, 2 | block << 16)
    result += struct.pack("<4B4B8B", 1, 0, 1, 0, 0, 0, 0, 0, channels * size, *[0] * 7)
    for i in range(channels):
        channel = (0, 1, 2, 15)[i] | 0xC0  # signed float
        result += struct.pack("<H2B4B", 8 * size * i, 8 * size - 1, channel, 0, 0, 0, 0)
        result += struct.pack("<2f", -1.0, 1.0)
    return result


def read_ktx2(data: bytes) -> tuple[Image, dict[str, str]]:
    """Return the image of a KTX2 file and its keys with their values.

    Raises
    ------
    ValueError
        If it is damaged or holds something else; one sentence without the file's name.
    """
    if len(data) < 104 or data[:12] != _KTX2_MAGIC:
        raise ValueError(f"not a KTX2 file ({len(data)} bytes)")
    number, _, width, height, depth, layers, faces, levels, packing = struct.unpack_from(
        "<9I", data, 12
    )
    _, _, values_at, values_length, _, _ = struct.unpack_from("<4I2Q", data, 48)
    formats = {v: k for k, v in _VULKAN.items()}
    if number not in formats:
        raise ValueError(f"VkFormat {number}, expected floats of 16 or 32 bits")
    if layers > 0 or faces != 1 or levels != 1 or packing != 0:
        raise ValueError("layers, faces, levels or compression, expected one plain image")
    level_at, length, _ = struct.unpack_from("<3Q", data, 80)
    image = _image(data, level_at, (depth, height, width), formats[number])
    if length != image.nbytes:
        raise ValueError(f"a level of {length} bytes, expected {image.nbytes}")
    notes, at = {}, values_at
    while at + 4 <= min(values_at + values_length, len(data)):
        size = struct.unpack_from("<I", data, at)[0]
        key, _, value = data[at + 4 : at + 4 + size].partition(b"\0")
        notes[key.decode()] = value.rstrip(b"\0").decode()
        at += 4 + size + -size % 4
    return image, notes
