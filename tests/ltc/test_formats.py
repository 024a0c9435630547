"""Files of published layouts: read as their authors wrote them; damage is named."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ltc.anisotropic import AnisotropicTable, table_coordinates
from ltc.formats import (
    POWERS,
    AnisotropicGrid,
    Grid,
    PublishedGrid,
    closest,
    fold,
    heitz_layout,
    kt_isotropic_layout,
    kt_layout,
    likeness,
    multilinear,
    nodes,
    read,
)
from ltc.resources import resource_path
from ltc.table import closed_form_guess, load_isotropic, sample_textures
from tests.ltc.published import (
    grid,
    heitz_images,
    lobes,
    sound,
    write_dds,
    write_inc,
    write_js,
    write_npy,
)

SMALL, KT = (12, 12), (5, 4, 5, 4)


def unit(M: np.ndarray) -> np.ndarray:
    return M / np.linalg.norm(M[..., 2:], axis=-2, keepdims=True)


def views(rng: np.random.Generator, n: int) -> np.ndarray:
    theta, phi = rng.uniform(0.0, 1.55, n), rng.uniform(-np.pi, np.pi, n)
    s = np.sin(theta)
    return np.stack([s * np.cos(phi), s * np.sin(phi), np.cos(theta)], axis=-1)


@pytest.mark.parametrize(
    ("write", "precision"), [(write_dds, 2e-7), (write_js, 1e-5), (write_inc, 1e-8)]
)
def test_heitz_files_hold_the_lobes_of_their_nodes(tmp_path: Path, write, precision) -> None:  # type: ignore[no-untyped-def]
    table = sound("heitz", SMALL)
    found = read(write(tmp_path, table))
    assert found.shape == SMALL
    assert found.power == 1.0
    samples = found.at(nodes(found))
    # Columns span twelve orders of magnitude: compare each with itself.
    scale = np.linalg.norm(unit(table.matrix), axis=-2, keepdims=True)
    error = np.abs(unit(samples.matrix) - unit(table.matrix)) / scale
    assert np.max(error) < 100.0 * precision  # an inverse of a conditioned matrix
    np.testing.assert_allclose(samples.albedo, table.albedo, rtol=max(precision, 1e-7))
    if write is write_inc:
        assert samples.fresnel is None
    else:
        np.testing.assert_allclose(samples.fresnel, table.fresnel, rtol=2e-5, atol=1e-9)


def test_kt_files(tmp_path: Path, rng: np.random.Generator) -> None:
    table = sound("kt", KT)
    files = write_npy(tmp_path, table)
    found = read(files)
    assert found.axes == ("alpha", "lambda", "theta", "phi")
    assert found.circle_axis is None
    samples = found.at(nodes(found))
    np.testing.assert_allclose(samples.matrix, unit(table.matrix), atol=1e-7)
    np.testing.assert_allclose(samples.albedo, table.albedo, rtol=1e-7)
    assert read(files[:1]).at(nodes(found)).albedo is None
    assert read(files[:2]).at(nodes(found)).fresnel is None


@pytest.mark.parametrize("power", POWERS)
@pytest.mark.parametrize("ratio", [True, False])
@pytest.mark.parametrize("circle", [True, False])
def test_axes_are_told_by_the_lobes(
    tmp_path: Path, power: float, ratio: bool, circle: bool
) -> None:
    layout = kt_layout(power, ratio, circle)
    shape = (5, 5, 5, 9)
    M = unit(lobes(layout, shape))
    np.save(tmp_path / "a.npy", M)
    found = read([tmp_path / "a.npy"])
    assert found.power == power
    assert found.axes == layout.axes
    assert (found.circle_axis is not None) is circle


def test_isotropic_kt_file(tmp_path: Path) -> None:
    layout = kt_isotropic_layout()
    np.save(tmp_path / "a.npy", unit(lobes(layout, (8, 8))))
    found = read([tmp_path / "a.npy"])
    assert found.axes == ("alpha", "theta")
    assert not found.anisotropic


def test_the_documented_reading_wins_in_doubt() -> None:
    alike = np.broadcast_to(np.diag([0.1, 0.1, 1.0]), (4, 4, 3, 3))
    layouts = [heitz_layout(p) for p in POWERS]
    best = closest(layouts, alike)
    assert likeness(best, alike) <= likeness(layouts[0], alike)
    nothing = np.full((4, 4, 3, 3), np.nan)
    assert closest(layouts, nothing) is layouts[0]


@pytest.mark.parametrize(
    "layout", [heitz_layout(), heitz_layout(2.0), kt_layout(), kt_layout(0.5, False, True)]
)
def test_coordinates_are_inverse_to_configurations(
    layout,  # type: ignore[no-untyped-def]
    rng: np.random.Generator,
) -> None:
    u = rng.uniform(0.02, 0.98, (500, len(layout.axes)))
    np.testing.assert_allclose(layout.coordinates(*layout.configuration(u)), u, atol=1e-9)


def test_folding_keeps_lobes(rng: np.random.Generator) -> None:
    wo = views(rng, 400)
    ax, ay = 10.0 ** rng.uniform(-3.0, 0.0, (2, 400))
    direct = closed_form_guess(ax, ay, wo)
    a, b, view, F = fold(ax, ay, wo, True, True)
    assert np.all(a >= b)
    assert np.all(view[:, :2] >= 0.0)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", F, view), wo, atol=1e-15)
    again = F @ closed_form_guess(a, b, view) @ np.swapaxes(F, -1, -2)
    np.testing.assert_allclose(again, direct, atol=1e-12)
    assert np.all(np.linalg.det(again) > 0.0)


def test_lookup_is_interpolation_in_every_quadrant(
    tmp_path: Path, rng: np.random.Generator
) -> None:
    found = read(write_npy(tmp_path, sound("kt", KT)))
    wo = views(rng, 200)
    ax, ay = rng.uniform(0.05, 1.0, (2, 200))
    whole = found.lookup(ax, ay, wo)
    for flip in (np.diag([-1.0, 1.0, 1.0]), np.diag([1.0, -1.0, 1.0])):
        other = found.lookup(ax, ay, wo @ flip)
        np.testing.assert_allclose(other.matrix, flip @ whole.matrix @ flip, atol=1e-12)
        np.testing.assert_allclose(other.albedo, whole.albedo, atol=1e-12)
    swap = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    other = found.lookup(ay, ax, wo[:, [1, 0, 2]])
    np.testing.assert_allclose(other.matrix, swap @ whole.matrix @ swap, atol=1e-12)


def test_multilinear(rng: np.random.Generator) -> None:
    shape = (4, 3, 5)
    u = grid(shape)
    plane = u @ np.array([1.0, -2.0, 0.5]) + u[..., 0] * u[..., 1] * u[..., 2]
    x = rng.uniform(0.0, 1.0, (300, 3))
    x[0], x[1] = 0.0, 1.0
    want = x @ np.array([1.0, -2.0, 0.5]) + np.prod(x, axis=-1)
    np.testing.assert_allclose(multilinear(plane, x), want, atol=1e-14)
    # A bad node does not reach points that give it no weight.
    plane[0, 0, 0] = np.nan
    assert np.all(np.isfinite(multilinear(plane, u[1:])))


def test_the_projects_table(rng: np.random.Generator) -> None:
    found = read([resource_path("luts", "ltc_isotropic.npz")])
    table = load_isotropic()
    alpha, c = rng.uniform(0.001, 1.0, 100), rng.uniform(0.01, 1.0, 100)
    wo = np.stack([np.sqrt(1.0 - c * c), 0.0 * c, c], axis=-1)
    got = found.lookup(alpha, alpha, wo)
    want = sample_textures(table.textures(), alpha, c)
    for a, b in zip(got, want, strict=True):
        np.testing.assert_array_equal(a, b)
    u = nodes(found)
    np.testing.assert_allclose(found.at(u).matrix, found.lookup(*found.configuration(u)).matrix)


def test_the_projects_anisotropic_table(rng: np.random.Generator) -> None:
    shape = (3, 4, 5, 4)
    ones = np.full(shape, 0.5, np.float16)
    found = AnisotropicGrid(AnisotropicTable(np.zeros((*shape, 7), np.float16), ones, 0.0 * ones))
    # The axes are the table's own.
    u = rng.uniform(0.05, 1.0, (400, 4))
    np.testing.assert_allclose(table_coordinates(*found.configuration(u)), u, atol=1e-9)
    wo = views(rng, 100)
    ax, ay = 10.0 ** rng.uniform(-3.0, 0.0, (2, 100))
    got = found.lookup(ax, ay, wo)
    np.testing.assert_allclose(got.matrix, closed_form_guess(ax, ay, wo), atol=1e-12)
    np.testing.assert_allclose(got.albedo, 0.5, rtol=1e-12)
    assert np.all(np.isfinite(found.at(nodes(found)).matrix))


def test_half_floats_round_what_is_stored(tmp_path: Path) -> None:
    found = read(write_dds(tmp_path, sound("heitz", SMALL)))
    assert isinstance(found, PublishedGrid)
    half = found.halved()
    with np.errstate(under="ignore"):
        np.testing.assert_array_equal(half.values, found.values.astype(np.float16))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    table = sound("heitz", SMALL)
    write_dds(tmp_path, table)
    write_js(tmp_path, table)
    write_inc(tmp_path, table)
    write_npy(tmp_path, sound("kt", KT))
    (tmp_path / "text.npz").write_bytes(b"no archive")
    np.savez(tmp_path / "other.npz", provenance=np.frombuffer(b'{"format": "x"}', np.uint8))
    np.save(tmp_path / "whole.npy", np.arange(9))
    np.save(tmp_path / "flat.npy", np.zeros((4, 4)))
    np.save(tmp_path / "object.npy", np.array([{}], dtype=object), allow_pickle=True)
    first, _ = heitz_images(table)
    numbers = ", ".join(f"{x}" for x in first.ravel()[:-1])
    (tmp_path / "short.js").write_text(f"var g_ltc_1 = [{numbers}];")
    (tmp_path / "none.js").write_text("var x = 3;")
    (tmp_path / "none.inc").write_text("static const int size = 64;")
    (tmp_path / "empty.inc").write_text("static const mat33 tabM[1] = { };")
    (tmp_path / "cut.dds").write_bytes((tmp_path / "ltc_1.dds").read_bytes()[:-5])
    return tmp_path


@pytest.mark.parametrize(
    ("names", "message"),
    [
        ("a.txt", "ends in '.txt', expected"),
        ("ltc_1.dds ltc.js", "ends in '.js', expected '.dds' as the first"),
        ("ltc.js ltc.js", "one file too many"),
        ("text.npz", "not an npz archive"),
        ("other.npz", "format is 'x'"),
        ("whole.npy", "not an array of floats"),
        ("flat.npy", r"shape \(4, 4\), expected"),
        ("object.npy", "not an array of numbers"),
        ("matrix.npy flat.npy", r"shape \(4, 4\), expected \(5, 4, 5, 4\)"),
        ("short.js", "575 numbers, expected 4 for every entry"),
        ("none.js", "no array 'g_ltc_1'"),
        ("none.inc", "no array 'tabM'"),
        ("empty.inc", "tabM has 0 numbers"),
        ("cut.dds", "bytes, expected"),
        ("ltc_2.dds cut.dds", "bytes, expected"),
    ],
)
def test_damage_is_named(folder: Path, names: str, message: str) -> None:
    files = [folder / name for name in names.split()]
    with pytest.raises(ValueError, match=message) as caught:
        read(files)
    assert any(str(caught.value).startswith(f"{file}: ") for file in files)


def test_no_file_and_a_missing_one(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="no file"):
        read([])
    with pytest.raises(FileNotFoundError):
        read([tmp_path / "none.npy"])


def test_text_with_fixed_decimals_says_so(tmp_path: Path) -> None:
    def decimals(number: str) -> int | None:
        found: Grid = read(write_inc(tmp_path, sound("heitz", SMALL), number))
        return found.decimals

    assert decimals(".6f") == 6
    assert decimals(".9f") == 9
    assert decimals(".9g") is None
