"""Pictures on lights: every kind of file against numbers written into it, and where they lie."""

from __future__ import annotations

import math
import os
import shutil
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from numpy.typing import NDArray
from PIL import Image

from app.contours import bounds
from app.errors import InputError
from app.images import exr_bytes
from app.picture_files import PICTURE_SUFFIXES
from app.pictures import (
    LARGEST_SIDE,
    duration,
    file_state,
    is_sequence,
    load_frame,
    picture_map,
    picture_size,
    sequence_of,
)
from app.scene import (
    COLOR_SPACES,
    PICTURE_FITS,
    AreaLight,
    Outline,
    Picture,
    Plane,
    PolygonContour,
    SceneError,
)

RNG = np.random.default_rng(5)


def decoded(code: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return linear light of sRGB codes from 0 to 1, number by number."""
    flat = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in code.ravel()]
    return np.array(flat).reshape(code.shape)


def write(path: Path, pixels: NDArray, kind: str, **attributes: object) -> Path:
    """Write a file with OpenImageIO, alpha as it is."""
    rows, columns, channels = pixels.shape
    spec = oiio.ImageSpec(columns, rows, channels, kind)
    for name, value in {"oiio:UnassociatedAlpha": 1, **attributes}.items():
        if value is not None:
            spec[name] = value
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), spec), output.geterror()
    assert output.write_image(pixels), output.geterror()
    output.close()
    return path


def texels(path: Path | str, time: float = 0.0, **fields: object) -> NDArray[np.float32]:
    return load_frame(Picture(str(path), **fields), time).texels


# Kinds of files


def codes(channels: int, rows: int = 5, columns: int = 7) -> NDArray[np.uint8]:
    return RNG.integers(0, 256, (rows, columns, channels), dtype=np.uint8)


def premultiplied(pixels: NDArray[np.integer]) -> NDArray[np.floating]:
    """Return what 1 to 4 channels of sRGB codes and an alpha mean."""
    unit = pixels / np.iinfo(pixels.dtype).max
    alpha = unit[..., 3:] if pixels.shape[2] == 4 else np.ones((*pixels.shape[:2], 1))
    colours = np.broadcast_to(unit[..., :3], (*pixels.shape[:2], 3))
    return np.concatenate((decoded(colours) * alpha, alpha), -1)


@pytest.mark.parametrize("suffix", [".png", ".webp", ".tif"])
@pytest.mark.parametrize("channels", [3, 4])
def test_eight_bits(tmp_path: Path, suffix: str, channels: int) -> None:
    pixels = codes(channels)
    path = tmp_path / f"a{suffix}"
    # WebP changes colours that nobody sees unless told not to.
    Image.fromarray(pixels).save(path, lossless=True, exact=True)
    got = texels(path)
    assert got.dtype == np.float32
    assert not got.flags.writeable
    np.testing.assert_allclose(got, premultiplied(pixels), atol=2e-7)  # float32's own rounding
    assert picture_size(Picture(str(path))) == (7, 5)
    assert duration(Picture(str(path))) == 0.0


@pytest.mark.parametrize("suffix", [".png", ".tif"])
@pytest.mark.parametrize("channels", [1, 3, 4])
def test_sixteen_bits(tmp_path: Path, suffix: str, channels: int) -> None:
    pixels = RNG.integers(0, 65536, (5, 7, channels), dtype=np.uint16)
    got = texels(write(tmp_path / f"a{suffix}", pixels, "uint16"))
    np.testing.assert_allclose(got, premultiplied(pixels), atol=2e-7)
    linear = texels(tmp_path / f"a{suffix}", color_space="linear")
    alpha = pixels[..., 3:] / 65535 if channels == 4 else 1.0
    np.testing.assert_allclose(
        linear[..., :3],
        np.broadcast_to(pixels[..., :3] / 65535 * alpha, (5, 7, 3)),
        atol=2e-7,
    )


@pytest.mark.parametrize("suffix", [".exr", ".tif"])
@pytest.mark.parametrize("channels", [1, 3, 4])
def test_floating_point_is_linear(tmp_path: Path, suffix: str, channels: int) -> None:
    pixels = np.exp(RNG.uniform(-8, math.log(1e6), (5, 7, channels))).astype(np.float32)
    if channels == 4:
        pixels[..., 3] = RNG.random((5, 7))
    path = write(tmp_path / f"a{suffix}", pixels, "float", **{"oiio:UnassociatedAlpha": None})
    found = load_frame(Picture(str(path)), 0.0)
    assert found.reports == ()
    # Colours that are multiplied by alpha already stay.
    np.testing.assert_array_equal(
        found.texels[..., :3], np.broadcast_to(pixels[..., :3], (5, 7, 3))
    )
    np.testing.assert_array_equal(found.texels[..., 3], pixels[..., 3] if channels == 4 else 1.0)


def test_floating_point_may_be_srgb(tmp_path: Path) -> None:
    pixels = RNG.random((5, 7, 3), dtype=np.float32)
    path = write(tmp_path / "a.exr", pixels, "float")
    np.testing.assert_allclose(
        texels(path, color_space="srgb")[..., :3], decoded(pixels), atol=1e-6
    )


def test_encoded_colours_that_were_multiplied_by_alpha(tmp_path: Path) -> None:
    straight, alpha = RNG.random((5, 7, 3)), RNG.uniform(0.2, 1.0, (5, 7, 1))
    pixels = np.concatenate((straight * alpha, alpha), -1)
    path = tmp_path / "a.tif"
    write(path, np.round(pixels * 65535).astype(np.uint16), "uint16",
          **{"oiio:UnassociatedAlpha": None})  # fmt: skip
    # A step of 1/65535, enlarged by 1 / alpha and the slope 2.27 of the curve.
    np.testing.assert_allclose(texels(path)[..., :3], decoded(straight) * alpha, atol=1e-4)


def test_own_pictures_come_back(tmp_path: Path) -> None:
    radiance = (RNG.random((4, 6, 3)) * 10).astype(np.float32)
    path = tmp_path / "a.exr"
    path.write_bytes(exr_bytes(radiance))
    np.testing.assert_array_equal(texels(path)[..., :3], radiance)


def test_radiance_hdr(tmp_path: Path) -> None:
    pixels = np.exp(RNG.uniform(-4, 9, (6, 9, 1)) + RNG.uniform(-1, 1, (6, 9, 3)))
    path = write(tmp_path / "a.hdr", pixels.astype(np.float32), "float")
    got = texels(path)
    # RGBE: one exponent for three mantissas of eight bits.
    error = np.abs(got[..., :3] - pixels).max(-1) / pixels.max(-1)
    assert error.max() < 1 / 127


@pytest.mark.parametrize("mode", ["1", "L", "LA", "P", "PA", "RGBA"])
def test_modes_of_png(tmp_path: Path, mode: str) -> None:
    image = Image.fromarray(codes(4)).convert("RGB" if mode == "P" else "RGBA")
    image = image.convert("LA" if mode == "PA" else mode)
    image.save(tmp_path / "a.png")
    wanted = np.asarray(image.convert("RGBA"))
    np.testing.assert_allclose(texels(tmp_path / "a.png"), premultiplied(wanted), atol=2e-7)


def test_a_palette_with_a_transparent_colour(tmp_path: Path) -> None:
    image = Image.new("P", (2, 1))
    image.putpalette([255, 0, 0, 0, 255, 0])
    image.putdata([0, 1])
    image.save(tmp_path / "a.png", transparency=1)
    np.testing.assert_array_equal(texels(tmp_path / "a.png")[0], [[1, 0, 0, 1], [0, 0, 0, 0]])


def test_jpeg_in_cmyk(tmp_path: Path) -> None:
    # Cyan ink lets 60 % of red through, black 80 % of all three.
    image = Image.new("CMYK", (16, 16), (102, 0, 0, 51))
    image.save(tmp_path / "a.jpg", quality=98)
    wanted = decoded(np.array([0.6 * 0.8, 0.8, 0.8]))
    # JPEG's own rounding: two codes of 255.
    np.testing.assert_allclose(texels(tmp_path / "a.jpg")[8, 8, :3], wanted, atol=0.02)


@pytest.mark.parametrize("orientation", range(1, 9))
@pytest.mark.parametrize("suffix", [".jpg", ".png", ".tif"])
def test_exif_orientation(tmp_path: Path, orientation: int, suffix: str) -> None:
    upright = np.zeros((16, 32, 3), dtype=np.uint8)
    upright[:8, :16] = 255  # light at the upper left
    # How each orientation stores the upright picture, by its definition: row 0 and column 0
    # of what is stored are the visual top and left, top and right, bottom and right, ...
    stored = {
        1: upright, 2: upright[:, ::-1], 3: upright[::-1, ::-1], 4: upright[::-1],
        5: upright.transpose(1, 0, 2), 6: upright.transpose(1, 0, 2)[::-1],
        7: upright.transpose(1, 0, 2)[::-1, ::-1], 8: upright.transpose(1, 0, 2)[:, ::-1],
    }[orientation]  # fmt: skip
    path = tmp_path / f"a{suffix}"
    exif = Image.Exif()
    exif[0x0112] = orientation
    Image.fromarray(np.ascontiguousarray(stored)).save(path, exif=exif, quality=98)
    got = texels(path)
    assert picture_size(Picture(str(path))) == (32, 16)
    assert got.shape == (16, 32, 4)
    assert (got[:8, :16, :3] > 0.95).all()
    assert (got[8:, :, :3] < 0.05).all()
    assert (got[:, 16:, :3] < 0.05).all()


def test_layers_and_windows_of_exr(tmp_path: Path) -> None:
    spec = oiio.ImageSpec(2, 2, 4, "float")
    spec.channelnames = ("depth.Z", "beauty.B", "beauty.G", "beauty.R")
    spec.x, spec.y, spec.full_width, spec.full_height = 1, -1, 4, 3
    output = oiio.ImageOutput.create(str(tmp_path / "a.exr"))
    assert output.open(str(tmp_path / "a.exr"), spec)
    pixels = np.arange(16, dtype=np.float32).reshape(2, 2, 4)
    assert output.write_image(pixels)
    output.close()
    got = texels(tmp_path / "a.exr")
    assert got.shape == (3, 4, 4)
    # Only the second row lies in the display window, from its second column on.
    np.testing.assert_array_equal(got[0, 1:3, :3], [[11, 10, 9], [15, 14, 13]])
    assert got[1:, :, :3].max() == 0.0
    assert got[:, 3, :3].max() == 0.0


# What cannot shine, and what is too large


def test_texels_without_a_number_become_black(tmp_path: Path) -> None:
    pixels = np.ones((4, 4, 4), dtype=np.float32)
    pixels[0, 0, 1], pixels[0, 1, 2], pixels[1, 1, 0], pixels[2, 2, 3] = (
        math.nan, math.inf, -0.5, math.nan,
    )  # fmt: skip
    path = write(tmp_path / "a.exr", pixels, "float", **{"oiio:UnassociatedAlpha": None})
    frame = load_frame(Picture(str(path)), 0.0)
    wanted = np.ones((4, 4, 4))
    wanted[0, 0, :3] = wanted[0, 1, :3] = wanted[2, 2, :3] = 0.0
    wanted[1, 1, 0] = 0.0
    np.testing.assert_array_equal(frame.texels, wanted)
    assert frame.reports == (
        f"{path}: 3 texels with NaN or infinite numbers became black",
        f"{path}: negative numbers in 1 texel became 0",
    )


@pytest.mark.parametrize("size", [(5000, 3), (3, 5001), (8192, 2), (4500, 300)])
def test_large_pictures_are_averaged_down(tmp_path: Path, size: tuple[int, int]) -> None:
    width, height = size
    ramp = np.linspace(0, 65535, width * height).reshape(height, width, 1).astype(np.uint16)
    path = write(tmp_path / "a.png", ramp, "uint16")
    frame = load_frame(Picture(str(path), color_space="linear"), 0.0)
    rows, columns = frame.texels.shape[:2]
    assert max(rows, columns) == LARGEST_SIDE
    assert (columns, rows) == tuple(max(1, round(side * LARGEST_SIDE / max(size))) for side in size)
    assert frame.reports == (
        f"{path}: {width}x{height} texels were averaged down to {columns}x{rows}",
    )
    assert picture_size(Picture(str(path))) == size
    # Light is neither lost nor won: float32 sums of up to 1 million numbers.
    assert frame.texels[..., 0].mean(dtype=np.float64) == pytest.approx(
        (ramp / 65535).mean(), rel=1e-6
    )


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("count", [4097, 5000, 6144, 8192])
def test_averaging_against_exact_integrals(tmp_path: Path, axis: int, count: int) -> None:
    values = RNG.random(count, dtype=np.float32)
    shape = (-1, 1, 1) if axis == 0 else (1, -1, 1)
    path = write(tmp_path / "a.exr", values.reshape(shape), "float")
    edges = np.linspace(0, count, LARGEST_SIDE + 1)
    sums = np.concatenate(([0], np.cumsum(values, dtype=float)))
    integral = np.interp(edges, np.arange(count + 1), sums)
    wanted = np.diff(integral) / np.diff(edges)
    np.testing.assert_allclose(texels(path)[..., 0].ravel(), wanted, rtol=1e-5)


def test_pictures_beyond_all_bounds_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    Image.new("1", (8193, 1)).save(path)
    with pytest.raises(InputError, match=r"8193x1 texels, expected at most 8192 a side"):
        load_frame(Picture(str(path)), 0.0)


def test_one_texel(tmp_path: Path) -> None:
    Image.new("RGB", (1, 1), (255, 0, 0)).save(tmp_path / "a.gif")
    np.testing.assert_array_equal(texels(tmp_path / "a.gif"), [[[1, 0, 0, 1]]])


# Animations


def animation(path: Path, times: list[int], colours: str = "rgbcmy") -> Path:
    known = {"r": (255, 0, 0), "g": (0, 255, 0), "b": (0, 0, 255),
             "c": (0, 255, 255), "m": (255, 0, 255), "y": (255, 255, 0)}  # fmt: skip
    frames = [Image.new("RGB", (8, 6), known[letter]) for letter in colours[: len(times)]]
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=times, loop=0,
                   lossless=True)  # fmt: skip
    return path


def colour_at(picture: Picture, time: float) -> str:
    red, green, blue, _ = load_frame(picture, time).texels[0, 0] > 0.5
    return {(1, 0, 0): "r", (0, 1, 0): "g", (0, 0, 1): "b", (0, 1, 1): "c",
            (1, 0, 1): "m", (1, 1, 0): "y"}[(red, green, blue)]  # fmt: skip


@pytest.mark.parametrize("suffix", [".gif", ".webp", ".png"])
def test_frames_by_their_own_times(tmp_path: Path, suffix: str) -> None:
    picture = Picture(str(animation(tmp_path / f"a{suffix}", [40, 80, 120])))
    assert duration(picture) == pytest.approx(0.24)
    shown = {0.0: "r", 0.039: "r", 0.04: "g", 0.119: "g", 0.12: "b", 0.2399: "b",
             0.24: "r", 2.4 + 0.13: "b", -0.01: "b", -0.13: "g"}  # fmt: skip
    assert {time: colour_at(picture, time) for time in shown} == shown
    later = Picture(picture.file, start=0.12)
    assert colour_at(later, 0.0) == "b"
    slower = Picture(picture.file, frames_per_second=2.0)
    assert [colour_at(slower, t) for t in (0.0, 0.49, 0.5, 1.0, 1.5)] == list("rrgbr")
    assert duration(slower) == pytest.approx(1.5)


def test_hasty_frames_take_as_long_as_in_browsers(tmp_path: Path) -> None:
    picture = Picture(str(animation(tmp_path / "a.gif", [0, 10, 20])))
    assert duration(picture) == pytest.approx(0.1 + 0.1 + 0.02)


def test_frames_of_gif_build_on_those_before(tmp_path: Path) -> None:
    pixels = codes(3, 24, 32)
    frames = []
    for i in range(6):
        pixels = pixels.copy()
        pixels[4 * i : 4 * i + 4, : 4 * i + 4] = (255 * (i % 2), 0, 40 * i)
        frames.append(Image.fromarray(pixels).quantize(200))
    path = tmp_path / "a.gif"
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=100)
    picture = Picture(str(path))
    wanted = [load_frame(picture, 0.1 * i).texels for i in range(6)]
    fresh = shutil.copy(path, tmp_path / "b.gif")
    for i in (5, 0, 3, 1, 4, 2):  # out of order, by another decoder
        np.testing.assert_array_equal(texels(fresh, 0.1 * i), wanted[i])
        np.testing.assert_allclose(
            wanted[i], premultiplied(np.asarray(frames[i].convert("RGB"))), atol=2e-7
        )


def test_sequences(tmp_path: Path) -> None:
    for number, letter in ((9, "r"), (10, "g"), (11, "b"), (100, "c")):
        animation(tmp_path / f"flame_{number}.png", [40], letter)
    animation(tmp_path / "flame_0001.png", [40], "m")
    animation(tmp_path / "flame_1.jpg.png", [40], "y")
    picture = Picture(str(tmp_path / "flame_%d.png"))
    assert duration(picture) == pytest.approx(4 / 25)
    assert [colour_at(picture, i / 25) for i in range(5)] == list("rgbcr")
    padded = Picture(str(tmp_path / "flame_%02d.png"), frames_per_second=10)
    assert [colour_at(padded, i / 10) for i in range(4)] == list("gbcg")
    with pytest.raises(InputError, match=r"no file has this name with a number, .* x_001\.png"):
        load_frame(Picture(str(tmp_path / "x_%03d.png")), 0.0)
    with pytest.raises(InputError, match="the folder cannot be read"):
        load_frame(Picture(str(tmp_path / "nowhere" / "x_%d.png")), 0.0)
    animation(tmp_path / "flame_12.png", [40], "y")
    assert duration(picture) == pytest.approx(5 / 25)


def test_numbered_files_are_known_as_a_sequence(tmp_path: Path) -> None:
    for name in ("a_007.png", "a_008.png", "b1.png", "c2_3.png", "c2_4.png"):
        animation(tmp_path / name, [40])
    assert sequence_of(str(tmp_path / "a_007.png")) == str(tmp_path / "a_%03d.png")
    assert sequence_of(str(tmp_path / "c2_3.png")) == str(tmp_path / "c2_%d.png")
    assert sequence_of(str(tmp_path / "b1.png")) is None
    assert sequence_of(str(tmp_path / "a_%03d.png")) is None
    assert is_sequence("/a/b_%04d.exr")
    assert not is_sequence("/a%d/b.exr")


# Files that change, are missing, or are none


def test_the_same_until_the_file_changes(tmp_path: Path) -> None:
    path = animation(tmp_path / "a.png", [40], "r")
    picture = Picture(str(path))
    first, state = load_frame(picture, 0.0), file_state(picture)
    assert load_frame(Picture(str(path), fit="tile"), 3.0) is first
    assert file_state(picture) == state
    animation(path, [40], "g")
    os.utime(path, ns=(0, 10**18))
    assert file_state(picture) != state
    assert colour_at(picture, 0.0) == "g"
    path.unlink()
    assert file_state(picture) != state
    with pytest.raises(InputError, match="there is no such file, expected a picture"):
        load_frame(picture, 0.0)


def whole_files(folder: Path) -> list[Path]:
    """Return a picture of every kind that `PICTURE_SUFFIXES` names, and of 16 bits."""
    pixels = codes(3, 40, 40)
    paths = []
    for suffix in PICTURE_SUFFIXES:
        path = folder / f"whole{suffix}"
        if suffix in (".exr", ".hdr"):
            write(path, pixels.astype(np.float32), "float")
        else:
            Image.fromarray(pixels).save(path)
        paths.append(path)
    paths.append(write(folder / "deep.png", pixels.astype(np.uint16), "uint16"))
    paths.append(animation(folder / "moving.gif", [40, 50, 60]))
    return paths


def test_every_kind_whole_and_in_pieces(tmp_path: Path) -> None:
    for path in whole_files(tmp_path):
        assert texels(path).shape[2] == 4
        data = path.read_bytes()
        for share in (0.0, 0.1, 0.4, 0.7):
            broken = tmp_path / f"broken{share}{path.name}"
            broken.write_bytes(data[: int(share * len(data))])
            with pytest.raises(InputError) as caught:
                load_frame(Picture(str(broken)), 0.0)
            assert str(caught.value).startswith(f"{broken}: ")
            assert "\n" not in str(caught.value)


def test_noise_in_files_is_survived(tmp_path: Path) -> None:
    for path in whole_files(tmp_path):
        data = np.frombuffer(path.read_bytes(), np.uint8)
        for i in range(6):
            noisy = data.copy()
            noisy[RNG.integers(0, len(data), 3)] ^= RNG.integers(1, 256, 3, dtype=np.uint8)
            broken = tmp_path / f"noisy{i}{path.name}"
            broken.write_bytes(noisy.tobytes())
            try:
                found = load_frame(Picture(str(broken)), 0.0).texels
            except InputError:
                continue
            assert np.isfinite(found).all()
            assert found.min() >= 0.0


@pytest.mark.parametrize("suffix", PICTURE_SUFFIXES)
def test_texts_are_no_pictures(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    path.write_text("this is no picture\n" * 20)
    with pytest.raises(InputError, match="no picture"):
        load_frame(Picture(str(path)), 0.0)
    with pytest.raises(InputError, match="no picture"):
        picture_size(Picture(str(path)))


def test_what_is_not_a_picture_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="this is a folder, expected a picture"):
        load_frame(Picture(str(tmp_path)), 0.0)
    with pytest.raises(InputError, match=r"suffix '.jpx' is not a picture format.*mean '.jpg'"):
        load_frame(Picture(str(tmp_path / "a.jpx")), 0.0)
    with pytest.raises(InputError, match="no suffix is not a picture format"):
        load_frame(Picture(str(tmp_path / "a")), 0.0)


# Where a picture lies


def light(picture: Picture, u: float = 1.0, v: float = 1.0, shift: float = 0.0) -> AreaLight:
    """Return a light with an outline of 4 by 2 about (shift, 0), in units of u and v metres."""
    corners = tuple((shift + s, t) for s, t in ((-2, -1), (2, -1), (2, 1), (-2, 1)))
    plane = Plane((0, 0, 0), (u, 0, 0), (0, v, 0))
    return AreaLight("a", Outline((PolygonContour(corners),)), plane, picture=picture)


@pytest.fixture
def wide(tmp_path: Path) -> str:
    """A picture of 30 by 10 texels."""
    Image.new("L", (30, 10)).save(tmp_path / "wide.png")
    return str(tmp_path / "wide.png")


def at(placed: AreaLight, s: float, t: float) -> tuple[float, float]:
    (a, b, c), (d, e, f) = picture_map(placed)
    return pytest.approx((a * s + b * t + c, d * s + e * t + f), abs=1e-12)


def test_stretched_to_the_box(wide: str) -> None:
    placed = light(Picture(wide), u=0.3, v=5.0, shift=7.0)
    assert at(placed, 5, 1) == (0, 0)  # the upper left corner, v is up
    assert at(placed, 9, 1) == (1, 0)
    assert at(placed, 5, -1) == (0, 1)


def test_whole_and_without_a_gap(wide: str) -> None:
    # The box is 4 by 2 metres, the picture three times as wide as high: 4 by 4/3, or 6 by 2.
    for fit in ("fit", "tile"):
        assert at(light(Picture(wide, fit=fit)), -2, 2 / 3) == (0, 0)
        assert at(light(Picture(wide, fit=fit)), 2, -2 / 3) == (1, 1)
    assert at(light(Picture(wide, fit="fill")), -3, 1) == (0, 0)
    assert at(light(Picture(wide, fit="fill")), 3, -1) == (1, 1)
    # Twice as long u: the box is 8 by 2 metres, the picture 6 by 2 within, 3 in s.
    assert at(light(Picture(wide, fit="fit"), u=2.0), -1.5, 1) == (0, 0)


def test_turned_moved_scaled_and_mirrored(wide: str) -> None:
    # A quarter turn counter-clockwise: what was right is up, what was up is left.
    turned = light(Picture(wide, fit="fit", rotation=math.pi / 2))
    assert at(turned, 0, 2) == (1, 0.5)
    assert at(turned, -2 / 3, 0) == (0.5, 0)
    # By half the box: 2 to the right, 1 down.
    moved = light(Picture(wide, offset=(0.5, -0.5)))
    assert at(moved, 0, 0) == (0, 0)
    scaled = light(Picture(wide, scale=(0.5, 2.0)))
    assert at(scaled, -1, 2) == (0, 0)
    assert at(scaled, 1, -2) == (1, 1)
    mirrored = light(Picture(wide, mirror=(True, False)))
    assert at(mirrored, 2, 1) == (0, 0)
    assert at(light(Picture(wide, mirror=(False, True))), -2, -1) == (0, 0)
    # Mirrored first, then turned: what was left is right, then up.
    both = light(Picture(wide, fit="fit", mirror=(True, False), rotation=math.pi / 2))
    assert at(both, 0, 2) == (0, 0.5)


def test_random_placements_against_steps(wide: str) -> None:
    """Take a point of the picture onto the light step by step; the map takes it back."""
    for _ in range(200):
        fit = PICTURE_FITS[RNG.integers(4)]
        offset, scale = tuple(RNG.uniform(-2, 2, 2)), tuple(np.exp(RNG.uniform(-2, 2, 2)))
        turn, mirror = RNG.uniform(-7, 7), (bool(RNG.integers(2)), bool(RNG.integers(2)))
        u, v = np.exp(RNG.uniform(-3, 3, 2))
        placed = light(
            Picture(wide, "auto", fit, offset, scale, turn, mirror), u, v, RNG.uniform(-5, 5)
        )
        (s0, t0), (s1, t1) = bounds(placed.outline)
        box = np.array([(s1 - s0) * u, (t1 - t0) * v])
        sides = {"stretch": box, "fill": max(box[0] / 3, box[1]) * np.array([3, 1])}.get(
            fit, min(box[0] / 3, box[1]) * np.array([3, 1])
        )
        x, y = RNG.uniform(-1, 2, 2)
        local = np.array([x - 0.5, 0.5 - y]) * [1 - 2 * mirror[0], 1 - 2 * mirror[1]]
        local *= sides * scale
        here = complex(*local) * complex(math.cos(turn), math.sin(turn))
        metres = np.array([here.real, here.imag]) + np.array(offset) * box
        s, t = metres / [u, v] + [(s0 + s1) / 2, (t0 + t1) / 2]
        (a, b, c), (d, e, f) = picture_map(placed)
        assert (a * s + b * t + c, d * s + e * t + f) == pytest.approx((x, y), abs=1e-9)


def test_a_light_without_width_has_a_map(wide: str) -> None:
    flat = Outline((PolygonContour(((0, 0), (0, 1), (0, 2))),))
    for fit in PICTURE_FITS:
        placed = AreaLight("a", flat, picture=Picture(wide, fit=fit))
        assert np.isfinite(picture_map(placed)).all()
    with pytest.raises(ValueError, match="no picture"):
        picture_map(AreaLight("a", flat))


# What a scene refuses


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"file": " "}, "file is ' ', expected the path of a file"),
        ({"color_space": "rgb"}, f"is 'rgb', expected one of {', '.join(COLOR_SPACES)}"),
        ({"fit": "cover"}, f"fit is 'cover', expected one of {', '.join(PICTURE_FITS)}"),
        ({"offset": (0.0, math.nan)}, "offset is .* expected finite numbers"),
        ({"scale": (1.0, 0.0)}, "scale is .* expected numbers above 0"),
        ({"scale": (1.0,)}, "scale has 1 numbers, expected 2"),
        ({"rotation": math.inf}, "rotation is .* expected finite numbers"),
        ({"mirror": (True,)}, "mirror has 1 values, expected 2"),
        ({"frames_per_second": -1.0}, "frames_per_second is -1, expected between 0 and 1000"),
        ({"start": math.nan}, "start is .* expected finite numbers"),
    ],
)  # fmt: skip
def test_values_that_a_picture_cannot_have(fields: dict, message: str) -> None:
    with pytest.raises(SceneError, match=message):
        Picture(**{"file": "/a.png", **fields})
