"""DDS and KTX2: what is written is read back bit for bit, and headers are as specified."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from ltc.containers import dds_bytes, ktx2_bytes, read_dds, read_ktx2

SHAPES = [(5, 3, 4), (2, 7, 2), (3, 3, 1), (4, 3, 2, 4), (6, 2, 3, 2)]


@pytest.mark.parametrize("shape", SHAPES, ids=str)
@pytest.mark.parametrize("kind", [np.float16, np.float32])
def test_round_trips_are_exact(
    shape: tuple[int, ...], kind: type, rng: np.random.Generator
) -> None:
    image = rng.normal(size=shape).astype(kind)
    for back in (read_dds(dds_bytes(image)), read_ktx2(ktx2_bytes(image))[0]):
        assert back.dtype == image.dtype
        np.testing.assert_array_equal(back, image)


def test_dds_header_fields() -> None:
    data = dds_bytes(np.zeros((5, 3, 4), np.float32))
    assert len(data) == 148 + 5 * 3 * 16
    # Offsets of DDS_HEADER: height 12, width 16, pitch 20, four characters 84.
    assert struct.unpack_from("<3I", data, 12) == (5, 3, 48)
    assert data[84:88] == b"DX10"
    assert struct.unpack_from("<5I", data, 128) == (2, 3, 0, 1, 0)


def test_dds_of_direct3d_9_is_read() -> None:
    values = np.arange(24, dtype="<f4").reshape(2, 3, 4)
    head = struct.pack("<7I44x", 124, 0x100F, 2, 3, 48, 1, 1)
    head += struct.pack("<3I20x", 32, 4, 116) + struct.pack("<I16x", 0x1000)
    np.testing.assert_array_equal(read_dds(b"DDS " + head + values.tobytes()), values)


def test_ktx2_alignment_and_notes() -> None:
    for channels in (1, 2, 4):
        image = np.ones((3, 3, channels), np.float32)
        data = ktx2_bytes(image, {"layout": "x" * channels})
        offset, length, whole = struct.unpack_from("<3Q", data, 80)
        assert offset % (4 * channels) == 0
        assert length == whole == image.nbytes
        assert offset + length == len(data)
        dfd_at, dfd_length = struct.unpack_from("<2I", data, 48)
        assert struct.unpack_from("<I", data, dfd_at)[0] == dfd_length == 28 + 16 * channels
        notes = read_ktx2(data)[1]
        assert notes["layout"] == "x" * channels
        assert notes["KTXorientation"] == "rd"
        assert list(notes) == sorted(notes)


@pytest.mark.parametrize(
    ("image", "message"),
    [
        (np.zeros((2, 2, 3), np.float32), "channels"),
        (np.zeros((2, 2), np.float32), "shape"),
        (np.zeros((0, 2, 4), np.float32), "shape"),
        (np.zeros((2, 2, 4)), "float64, expected float16"),
    ],
)
def test_refuses_to_write(image: np.ndarray, message: str) -> None:
    for write in (dds_bytes, ktx2_bytes):
        with pytest.raises(ValueError, match=message):
            write(image)


def test_refuses_to_read() -> None:
    dds = bytearray(dds_bytes(np.zeros((4, 4, 4), np.float32)))
    ktx = bytearray(ktx2_bytes(np.zeros((4, 4, 4), np.float32)))
    for read, whole in ((read_dds, dds), (read_ktx2, ktx)):
        for data in (b"", b"no image", bytes(whole[:-1]), bytes(whole[:90]), bytes(300)):
            with pytest.raises(ValueError, match=r"bytes|expected"):
                read(data)
    dds[128] = 28  # an 8-bit format
    with pytest.raises(ValueError, match="pixel format 28"):
        read_dds(bytes(dds))
    ktx[12] = 37
    with pytest.raises(ValueError, match="VkFormat 37"):
        read_ktx2(bytes(ktx))
    ktx[12], ktx[40] = 109, 2
    with pytest.raises(ValueError, match="one plain image"):
        read_ktx2(bytes(ktx))
