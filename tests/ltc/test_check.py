"""The doctor: sound tables have no fault, and each known fault is named, alone."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ltc import brdf
from ltc.check import Fault, Report, check, fixed_decimals, variation, variation_from_ggx
from ltc.formats import heitz_layout, kt_layout, read
from ltc.resources import resource_path
from ltc.table import closed_form_guess, load_isotropic, npz_bytes
from tests.ltc.published import (
    Table,
    grid,
    lobes,
    sound,
    write_dds,
    write_inc,
    write_js,
    write_npy,
)

HEITZ, KT, CIRCLE = (20, 20), (6, 5, 6, 5), (4, 4, 4, 9)


def doctor(files: list[Path]) -> Report:
    return check(read(files), rectangles=40, albedo_views=40)


def test_the_shipped_table_is_sound() -> None:
    report = doctor([resource_path("luts", "ltc_isotropic.npz")])
    assert report.faults == ()
    assert report.figures["mean"] < 0.0025
    assert len(report.worst) == 5
    errors = [abs(case.got - case.exact) for case in report.worst]
    assert errors == sorted(errors, reverse=True)
    assert errors[0] == pytest.approx(report.figures["max"], rel=1e-3)
    assert not any(finding.warning for finding in report.findings)


def test_the_shipped_anisotropic_table_is_sound() -> None:
    report = check(read([resource_path("luts", "ltc_anisotropic.npz")]), rectangles=600)
    assert report.faults == ()
    assert report.figures["mean"] < 0.0045
    assert any(finding.what == "seam alpha_x = alpha_y" for finding in report.findings)


@pytest.mark.parametrize(
    ("layout", "shape", "write"),
    [
        ("heitz", HEITZ, write_dds),
        ("heitz", HEITZ, write_js),
        ("kt", KT, write_npy),
        ("circle", CIRCLE, write_npy),
    ],
)
def test_sound_published_tables(
    layout: str,
    shape: tuple[int, ...],
    write: Callable[[Path, Table], list[Path]],
    tmp_path: Path,
) -> None:
    assert doctor(write(tmp_path, sound(layout, shape))).faults == ()


def collapse(table: Table) -> None:
    """As the isotropic reference at low roughness: tiny entries, a jumping amplitude."""
    table.matrix[-1, 1:8, 0, 0] *= 1e-8
    table.matrix[-1, 1:8, 1, 1] *= 1e-4
    table.albedo[-1, 1:8] *= np.array([0.3, 1.7, 0.1, 2.0, 0.4, 1.5, 0.2])


def test_last_column_collapsing_at_low_roughness(tmp_path: Path) -> None:
    table = sound("heitz", HEITZ)
    collapse(table)
    report = doctor(write_dds(tmp_path, table))
    assert report.faults == (Fault.COLLAPSED,)
    finding = next(f for f in report.findings if f.fault)
    assert finding.figure == "7 of 400"
    assert "[19, 1]" in finding.note


def test_matrices_made_singular_by_six_decimals(tmp_path: Path) -> None:
    table = sound("heitz", HEITZ)
    whole = doctor(write_inc(tmp_path, table))
    assert whole.faults == (Fault.NO_FRESNEL,)  # the layout has no place for it
    cut = doctor(write_inc(tmp_path, table, ".6f"))
    assert set(cut.faults) == {Fault.DECIMALS, Fault.NO_FRESNEL}
    assert "6 decimals" in next(f.note for f in cut.findings if f.fault is Fault.DECIMALS)


def test_decimals_are_seen_in_numbers_too(tmp_path: Path) -> None:
    table = sound("kt", KT)
    M = table.matrix / np.linalg.norm(table.matrix[..., 2:], axis=-2, keepdims=True)
    report = doctor(write_npy(tmp_path, table._replace(matrix=np.round(M, 6))))
    assert report.faults == (Fault.DECIMALS,)
    assert fixed_decimals(np.round(M, 6).astype(np.float32).astype(float)) == 6
    assert fixed_decimals(M.astype(np.float32).astype(float)) is None


def test_mass_below_the_horizon(tmp_path: Path) -> None:
    table = sound("heitz", HEITZ)
    bare = closed_form_guess(*heitz_layout().configuration(grid(HEITZ)))  # 15 % below
    report = doctor(write_dds(tmp_path, table._replace(matrix=bare)))
    assert report.faults == (Fault.LEAK,)
    assert "14" in next(f.figure for f in report.findings if f.fault)


def test_negative_determinants(tmp_path: Path) -> None:
    table = sound("kt", KT)
    rng = np.random.default_rng(1)
    count = int(np.prod(KT))
    mirrored = np.unravel_index(rng.choice(count, 12, replace=False), KT)
    table.matrix[mirrored] = table.matrix[mirrored] @ np.diag([1.0, -1.0, 1.0])
    report = doctor(write_npy(tmp_path, table))
    assert report.faults == (Fault.NEGATIVE,)
    assert next(f.figure for f in report.findings if f.fault) == f"12 of {count}"


def test_amplitude_over_other_axes_than_it_is_read_by(tmp_path: Path) -> None:
    # Amplitude and Fresnel part of (alpha_x, alpha_y), as another layout has them.
    table = sound("kt", KT)
    ax, ay, wo = kt_layout(ratio=False).configuration(grid(KT))
    A, _ = brdf.directional_albedo(wo, ax, ay, step=0.25)
    report = doctor(write_npy(tmp_path, table._replace(albedo=A)))
    assert report.faults == (Fault.AMPLITUDE_AXES,)
    note = next(f.note for f in report.findings if f.fault)
    assert "over (alpha_x, alpha_y)" in note
    assert "read by (alpha, lambda)" in note
    assert any("exact amplitude" in f.note for f in report.findings)


def test_missing_fresnel(tmp_path: Path) -> None:
    report = doctor(write_npy(tmp_path, sound("kt", KT), fresnel=False))
    assert report.faults == (Fault.NO_FRESNEL,)


def test_missing_amplitude(tmp_path: Path) -> None:
    report = doctor(write_dds(tmp_path, sound("heitz", HEITZ))[:1])
    assert set(report.faults) == {Fault.NO_ALBEDO, Fault.NO_FRESNEL}


@pytest.mark.parametrize("value", [0.0, np.nan])
def test_entry_at_two_pi_not_set(tmp_path: Path, value: float) -> None:
    table = sound("circle", CIRCLE)
    table.matrix[:, :, :, -1] = value
    report = doctor(write_npy(tmp_path, table))
    assert report.faults == (Fault.CIRCLE,)


def test_roughness_taken_for_alpha(tmp_path: Path) -> None:
    for power, layout in ((2.0, heitz_layout(2.0)), (0.5, heitz_layout(0.5))):
        u = grid(HEITZ)
        ax, ay, wo = layout.configuration(u)
        A, B = brdf.directional_albedo(wo, ax, ay, step=0.25)
        report = doctor(write_dds(tmp_path, Table(lobes(layout, HEITZ), A, B)))
        assert report.faults == (Fault.ROUGHNESS,)
        assert report.findings[0].figure == f"alpha^{power:g}"


def test_roughness_taken_for_alpha_anisotropic(tmp_path: Path) -> None:
    layout = kt_layout(2.0)
    ax, ay, wo = layout.configuration(grid(KT))
    A, B = brdf.directional_albedo(wo, ax, ay, step=0.25)
    report = doctor(write_npy(tmp_path, Table(lobes(layout, KT), A, B)))
    assert report.faults == (Fault.ROUGHNESS,)


def test_entries_not_set(tmp_path: Path) -> None:
    table = sound("kt", KT)
    table.matrix[2, 1, 3, 1] = 0.0
    table.matrix[4, 4, 0, 0, 1, 2] = np.inf
    report = doctor(write_npy(tmp_path, table))
    assert report.faults == (Fault.UNSET,)
    assert next(f.figure for f in report.findings if f.fault).startswith("2 of")


def test_a_singular_matrix(tmp_path: Path) -> None:
    table = sound("kt", KT)
    table.matrix[2, 1, 3, 1, :, 0] = table.matrix[2, 1, 3, 1, :, 1]
    assert doctor(write_npy(tmp_path, table)).faults == (Fault.SINGULAR,)


def test_lobes_far_from_ggx(tmp_path: Path) -> None:
    table = sound("heitz", HEITZ)
    table.matrix[3, 10] = np.diag([20.0, 20.0, 1.0])
    table.matrix[9, 10] = np.array([[0.3, 0.0, 0.7], [0.0, 0.3, 0.0], [-0.2, 0.0, 0.7]])
    assert doctor(write_dds(tmp_path, table)).faults == (Fault.FAR,)


def test_a_sign_that_changes_between_neighbours(tmp_path: Path) -> None:
    # Both regular and of positive determinant, but turned by half a circle about z.
    table = sound("kt", KT)
    table.matrix[3, 2, 2, 2] = table.matrix[3, 2, 2, 2] @ np.diag([-1.0, -1.0, 1.0])
    report = doctor(write_npy(tmp_path, table))
    assert report.faults == (Fault.BETWEEN,)


def test_amplitude_and_fresnel_off(tmp_path: Path) -> None:
    table = sound("heitz", HEITZ)
    table.albedo[:] *= 0.9
    assert doctor(write_dds(tmp_path, table)).faults == (Fault.ALBEDO,)
    table = sound("heitz", HEITZ)
    table.fresnel[:] += 0.1
    assert doctor(write_dds(tmp_path, table)).faults == (Fault.FRESNEL,)


def test_seams(tmp_path: Path) -> None:
    # All but the round lobes turned by six degrees: symmetric nowhere.
    table = sound("kt", KT)
    c, s = np.cos(0.1), np.sin(0.1)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    table.matrix[:, :-1] = turn @ table.matrix[:, :-1]
    report = doctor(write_npy(tmp_path, table))
    assert set(report.faults) == {Fault.SEAM}
    seams = {f.what for f in report.findings if f.fault}
    assert {"seam phi = 0, pi, 2 pi", "seam phi = pi/2, 3 pi/2"} <= seams


def test_isotropy(tmp_path: Path) -> None:
    table = sound("kt", KT)
    table.matrix[:, -1] = lobes(kt_layout(), KT, 2.5)[:, -1]
    report = doctor(write_npy(tmp_path, table))
    assert report.faults == (Fault.ISOTROPY,)


@pytest.mark.parametrize("name", ["isotropic", "anisotropic"])
def test_tables_that_their_loader_refuses_are_examined(name: str, tmp_path: Path) -> None:
    source = resource_path("luts", f"ltc_{name}.npz")
    with np.load(source) as file:
        arrays = {key: file[key] for key in file.files}
    residual = arrays["residual"]
    place = (slice(2, 4), slice(2, 4)) if name == "isotropic" else (1, 2, 2, 2)
    if name == "isotropic":
        residual[(*place, 2)] = -1.6  # 1 + X11 below zero
    else:
        residual[(*place, 0)] = residual[(*place, 2)] = 0.0
        residual[(*place, 1)] = 2.0  # (1 + d) (1 - d) below zero
    file_ = tmp_path / "broken.npz"
    file_.write_bytes(npz_bytes(arrays))
    assert check(read([file_], True), 1, 100, 50).faults[0] is Fault.NEGATIVE
    with pytest.raises(ValueError, match="determinant"):
        read([file_])
    arrays["residual"] = residual[..., 0]
    file_.write_bytes(npz_bytes(arrays))
    with pytest.raises(ValueError, match="residual has shape"):
        read([file_], True)


def test_half_floats_are_a_warning(tmp_path: Path) -> None:
    report = doctor(write_npy(tmp_path, sound("kt", KT)))
    half = next(f for f in report.findings if f.what == "half floats")
    assert half.warning  # columns of 5e-8 at grazing views have no half float
    assert "do not survive" in half.note


def test_variation_between_lobes(rng: np.random.Generator) -> None:
    M = closed_form_guess(0.3, 0.3, np.array([0.6, 0.0, 0.8]))[None]
    turned = M @ np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    np.testing.assert_allclose(variation(M, 5.0 * turned, rng), 0.0, atol=1e-12)
    # Two cosines with one common boundary plane, about opposite axes: nothing shared.
    up, down = np.eye(3)[None], np.diag([1.0, -1.0, -1.0])[None]
    np.testing.assert_allclose(variation(up, down, rng), 1.0)
    # diag(a, a, 1) and the cosine cross where their densities agree: by quadrature.
    a = 0.5
    z = (np.arange(200_000) + 0.5) / 200_000
    squeezed = a * a * z / (a * a * z * z + (1.0 - z * z)) ** 2 * 2.0
    expected = 0.5 * np.mean(np.abs(squeezed - 2.0 * z))
    many = np.repeat(np.diag([a, a, 1.0])[None], 2000, axis=0)
    got = variation(many, np.repeat(up, 2000, axis=0), rng)
    np.testing.assert_allclose(np.mean(got), expected, atol=4.0 * np.std(got) / 2000**0.5)


def test_variation_from_ggx_is_small_where_the_lobe_is_ggx(rng: np.random.Generator) -> None:
    n = 200
    alpha, wo = np.full(n, 0.02), np.tile([0.3, 0.0, np.sqrt(0.91)], (n, 1))
    A = brdf.directional_albedo(wo[:1], alpha[:1], alpha[:1])[0].repeat(n)
    M = load_isotropic().matrix(alpha, wo[:, 2])
    close = np.mean(variation_from_ggx(M, alpha, alpha, wo, A, rng))
    assert close < 0.04
    wide = load_isotropic().matrix(2.0 * alpha, wo[:, 2])
    assert np.mean(variation_from_ggx(wide, alpha, alpha, wo, A, rng)) > 0.3


def test_the_same_seed_gives_the_same_report(tmp_path: Path) -> None:
    files = write_npy(tmp_path, sound("kt", KT))
    a, b = doctor(files), doctor(files)
    assert a.findings == b.findings
    assert a.worst == b.worst
    other = check(read(files), seed=2, rectangles=40, albedo_views=40)
    assert other.worst != a.worst
    assert other.faults == a.faults


def test_refuses_counts_out_of_range(tmp_path: Path) -> None:
    table = read([resource_path("luts", "ltc_isotropic.npz")])
    with pytest.raises(ValueError, match="rectangles is 3, expected 10"):
        check(table, rectangles=3)
    with pytest.raises(ValueError, match="albedo_views is 0"):
        check(table, albedo_views=0)
