"""Edits of one contour: what they keep, and what they change."""

from __future__ import annotations

import contextlib
import math
from dataclasses import replace

import numpy as np
import pytest

from app import contours, curves, lights, planes, presets
from app.editor import Editor, Selection
from app.edits import replace_light
from app.scene import (
    AnchorKind,
    AreaLight,
    BezierContour,
    Contour,
    Outline,
    Plane,
    PolygonContour,
    Scene,
    SceneError,
    TextSource,
)

SQUARE = PolygonContour(((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)))
SKEW = planes.metric_from_plane(Plane(u=(2.0, 0.5, 0.0), v=(0.3, 1.0, -0.4)))
HEART = presets.heart().contours[0]
ROUNDED = presets.rounded_rectangle().contours[0]
DISK = presets.disk().contours[0]
RNG_SEED = 4
ROUNDING = 1e-12
"""Coordinates are of the order of 1, and an edit is a few dozen roundings of 1e-16."""


def random_chain(rng: np.random.Generator, count: int) -> BezierContour:
    """Return a chain of curves and lines with all kinds of anchors, handles as the kinds say."""
    points = rng.uniform(-1.0, 1.0, (count, 2))
    ends = np.roll(points, -1, axis=0)
    loop = curves.line_as_cubic(points, ends)
    bent = rng.random(count) < 0.7
    loop[bent, 1:3] += rng.normal(0.0, 0.4, (int(bent.sum()), 2, 2))
    chain: Contour = contours._chain(loop, ())
    for i in range(count):
        if bent[i] and bent[i - 1]:
            kind: AnchorKind = ("corner", "smooth", "symmetric")[int(rng.integers(3))]  # type: ignore[assignment]
            chain = contours.set_kind(chain, i, kind)
    assert isinstance(chain, BezierContour)
    return chain


def chains(seed: int = RNG_SEED, number: int = 25) -> list[BezierContour]:
    rng = np.random.default_rng(seed)
    return [random_chain(rng, int(rng.integers(2, 9))) for _ in range(number)]


def dense(contour: Contour, steps: int = 400) -> np.ndarray:
    along = np.linspace(0.0, 1.0, steps, endpoint=False)
    return curves.evaluate(contours.curves_of(contour)[:, None], along).reshape(-1, 2)


def distance_between(a: Contour, b: Contour, steps: int = 60) -> float:
    """Return how far places of the one are from the other, at most, and the other way round."""
    return max(
        max(contours.nearest(second, (s, t))[0] for s, t in dense(first, steps))
        for first, second in ((a, b), (b, a))
    )


def bend_at(chain: Contour, index: int, metric: np.ndarray = contours.UNIT) -> float:
    """Return the angle [rad] by which the handles at an anchor are out of line."""
    loop = contours.curves_of(chain) @ metric.T
    into, out = loop[index, 0] - loop[index - 1, 2], loop[index, 1] - loop[index, 0]
    return abs(math.atan2(into[0] * out[1] - into[1] * out[0], into @ out))


def reach(chain: Contour, segment: int, which: int, metric: np.ndarray = contours.UNIT) -> float:
    """Return the length of a handle."""
    loop = contours.curves_of(chain) @ metric.T
    return float(np.linalg.norm(loop[segment, which] - loop[segment, 0 if which == 1 else 3]))


# --- reading ----------------------------------------------------------------


@pytest.mark.parametrize("chain", [*chains(), HEART, ROUNDED, DISK, SQUARE])
def test_bounds_are_those_of_the_curve_not_of_its_handles(chain: Contour) -> None:
    low, high = np.array(contours.bounds(Outline((chain,))))
    sampled = dense(chain)
    assert (sampled >= low - ROUNDING).all()
    assert (sampled <= high + ROUNDING).all()
    # Between samples 1/400 apart a curve with handles below 3 rises by less than 3 / 400^2 x 3.
    assert np.allclose([sampled.min(0), sampled.max(0)], [low, high], atol=6e-5, rtol=0.0)


def test_a_curve_is_as_near_as_its_densest_samples() -> None:
    rng = np.random.default_rng(7)
    for chain in chains(8, 12):
        samples = dense(chain, 2000) @ SKEW.T
        for s, t in rng.uniform(-1.5, 1.5, (12, 2)):
            distance, segment, along = contours.nearest(chain, (s, t), SKEW)
            target = SKEW @ np.array([s, t])
            brute = float(np.linalg.norm(samples - target, axis=-1).min())
            found = np.array(contours.point_at(chain, segment, along))
            assert np.linalg.norm(SKEW @ found - target) == pytest.approx(distance, abs=ROUNDING)
            assert distance <= brute + ROUNDING
            assert distance == pytest.approx(brute, abs=5e-3)


@pytest.mark.parametrize("tolerance", [1e-1, 1e-2, 1e-3])
def test_a_flattened_curve_is_within_the_tolerance_and_keeps_its_anchors(tolerance: float) -> None:
    for chain in (*chains(9, 6), HEART, DISK):
        flat = contours.to_polygon(chain, tolerance, SKEW)
        assert set(contours.points_of(chain)) <= set(flat.points)
        worst = max(contours.nearest(flat, (s, t), SKEW)[0] for s, t in dense(chain, 50))
        assert worst <= tolerance
    assert len(contours.to_polygon(DISK, 1e-4).points) > len(contours.to_polygon(DISK, 1e-2).points)


# --- points and handles -----------------------------------------------------


def test_an_anchor_takes_its_handles_along_and_lines_stay_straight() -> None:
    for chain in chains():
        for i in range(contours.size_of(chain)):
            s, t = chain.anchors[i]
            moved = contours.move_point(chain, i, (s + 0.25, t - 0.5))
            assert moved.anchors[i] == (s + 0.25, t - 0.5)
            straight = contours.straight_segments(chain)
            assert (contours.straight_segments(moved) == straight).all()
            if not straight[i]:
                assert np.subtract(moved.curves[i][1], chain.curves[i][1]) == pytest.approx(
                    (0.25, -0.5), abs=ROUNDING
                )
            back = contours.move_point(moved, i, (s, t))
            assert np.allclose(back.curves, chain.curves, atol=ROUNDING, rtol=0.0)


def test_beside_a_line_smooth_anchors_stay_in_line_with_it() -> None:
    moved = contours.move_point(ROUNDED, 0, (1.3, 0.5))
    kinds = contours.kinds_of(ROUNDED)
    assert contours.kinds_of(moved) == kinds
    straight = contours.straight_segments(ROUNDED)
    for i, kind in enumerate(kinds):
        if kind != "corner" and (straight[i] or straight[i - 1]):
            assert bend_at(moved, i) < 1e-9
    assert bend_at(moved, 0) < 1e-9
    # A handle beside a line can only be lengthened.
    segment = next(i for i in range(len(straight)) if straight[i - 1] and not straight[i])
    pulled = contours.move_handle(ROUNDED, segment, 1, (5.0, 5.0))
    assert bend_at(pulled, segment) < 1e-9
    assert reach(pulled, segment, 1) > reach(ROUNDED, segment, 1)
    assert pulled.curves[segment - 1] == ROUNDED.curves[segment - 1]


@pytest.mark.parametrize("metric", [contours.UNIT, SKEW])
@pytest.mark.parametrize("which", [1, 2])
def test_a_dragged_handle_keeps_the_kind_of_its_anchor(metric: np.ndarray, which: int) -> None:
    rng = np.random.default_rng(11)
    for kind in ("corner", "smooth", "symmetric"):
        chain = contours.set_kind(HEART, 1, kind, metric)
        segment, other = (1, (0, 2)) if which == 1 else (0, (1, 1))
        before = reach(chain, *other, metric)
        to = tuple(rng.uniform(-1.0, 1.0, 2).tolist())
        moved = contours.move_handle(chain, segment, which, to, metric=metric)
        assert contours.handle_of(moved, segment, which) == to
        assert moved.kinds == chain.kinds
        if kind == "corner":
            assert contours.handle_of(moved, *other) == contours.handle_of(chain, *other)
        else:
            assert bend_at(moved, 1, metric) < 1e-9
            wanted = before if kind == "smooth" else reach(moved, segment, which, metric)
            assert reach(moved, *other, metric) == pytest.approx(wanted, abs=ROUNDING)
        free = contours.move_handle(chain, segment, which, to, free=True, metric=metric)
        assert contours.kinds_of(free)[1] == "corner"
        assert contours.handle_of(free, *other) == contours.handle_of(chain, *other)


@pytest.mark.parametrize("metric", [contours.UNIT, SKEW])
def test_choosing_a_kind_puts_handles_in_line_at_once(metric: np.ndarray) -> None:
    for chain in (*chains(13), SQUARE, ROUNDED):
        for i in range(contours.size_of(chain)):
            smooth = contours.set_kind(chain, i, "smooth", metric)
            assert contours.kinds_of(smooth)[i] == "smooth"
            assert bend_at(smooth, i, metric) < 1e-9
            symmetric = contours.set_kind(chain, i, "symmetric", metric)
            before = (i - 1) % contours.size_of(chain)
            assert bend_at(symmetric, i, metric) < 1e-9
            assert reach(symmetric, i, 1, metric) == pytest.approx(
                reach(symmetric, before, 2, metric), abs=ROUNDING
            )
            corner = contours.set_kind(symmetric, i, "corner", metric)
            assert contours.kinds_of(corner)[i] == "corner"
            assert corner.curves == symmetric.curves


def test_a_smooth_corner_of_a_square_is_parallel_to_its_neighbours() -> None:
    rounded = contours.set_kind(SQUARE, 0, "smooth")
    out = np.subtract(rounded.curves[0][1], rounded.curves[0][0])
    assert out == pytest.approx(np.array([1.0, -1.0]) * (2.0 / 3.0) / math.sqrt(2.0))
    assert contours.straight_segments(rounded).tolist() == [False, True, True, False]


def test_handles_that_lie_on_their_anchor_are_pulled_out() -> None:
    flat = contours.retract_handle(HEART, 1, 1)
    flat = contours.retract_handle(flat, 0, 2)
    assert flat.curves[1][1] == flat.anchors[1] == flat.curves[0][2]
    assert contours.kinds_of(flat)[1] == "corner"
    pulled = contours.set_kind(flat, 1, "smooth")
    assert reach(pulled, 1, 1) > 0.1
    assert bend_at(pulled, 1) < 1e-9


def test_a_handle_that_is_not_seen_can_be_pulled() -> None:
    assert contours.handle_to_pull(SQUARE, 0) is None
    assert contours.handle_to_pull(HEART, 0) is None
    assert contours.handle_to_pull(contours.retract_handle(HEART, 1, 1), 1) == (1, 1)
    assert contours.handle_to_pull(contours.retract_handle(HEART, 0, 2), 1) == (0, 2)
    assert contours.handle_to_pull(contours.straighten(HEART, 0), 1) == (0, 2)
    assert contours.handle_to_pull(contours.to_bezier(SQUARE), 0) == (0, 1)


# --- adding and removing ----------------------------------------------------


@pytest.mark.parametrize("along", [0.03, 0.3, 0.5, 0.9])
def test_inserting_does_not_change_the_curve(along: float) -> None:
    places = np.linspace(0.0, 1.0, 41)
    for chain in (*chains(17, 12), HEART, ROUNDED, contours.to_bezier(SQUARE)):
        for k in range(contours.size_of(chain)):
            grown = contours.insert(chain, k, along)
            assert contours.size_of(grown) == contours.size_of(chain) + 1
            whole = curves.evaluate(chain.curves[k], places)
            first = curves.evaluate(grown.curves[k], places)
            second = curves.evaluate(grown.curves[k + 1], places)
            assert np.abs(curves.evaluate(chain.curves[k], along * places) - first).max() < ROUNDING
            later = curves.evaluate(chain.curves[k], along + (1.0 - along) * places)
            assert np.abs(later - second).max() < ROUNDING
            assert whole[0] == pytest.approx(first[0], abs=0.0)
            straight = contours.straight_segments(chain)[k]
            kinds = contours.kinds_of(grown)
            assert kinds[k + 1] == ("corner" if straight else "smooth")
            assert (contours.straight_segments(grown)[[k, k + 1]] == straight).all()
            for i, kind in enumerate(kinds):
                if kind == "symmetric":
                    before = (i - 1) % len(kinds)
                    assert reach(grown, i, 1) == pytest.approx(reach(grown, before, 2), rel=1e-3)


def test_removing_what_was_inserted_gives_the_curve_back() -> None:
    for chain in (*chains(19, 12), HEART):
        for k in range(contours.size_of(chain)):
            for along in (0.2, 0.5, 0.7):
                back = contours.remove(contours.insert(chain, k, along), k + 1)
                assert back is not None
                assert np.allclose(back.curves, chain.curves, atol=1e-9, rtol=0.0)


def test_removing_a_point_keeps_what_is_around_it() -> None:
    for chain in (*chains(23), ROUNDED):
        count = contours.size_of(chain)
        for i in range(count):
            rest = contours.remove(chain, i)
            if rest is None:
                assert count <= 3
                continue
            kept = [p for j, p in enumerate(chain.anchors) if j != i]
            assert list(contours.points_of(rest)) == kept
            new = (i - 1) % (count - 1)
            old = [c for j, c in enumerate(chain.curves) if j not in (i, (i - 1) % count)]
            others = [c for j, c in enumerate(rest.curves) if j != new]
            assert sorted(others) == sorted(old)
            straight = contours.straight_segments(chain)
            if straight[i] and straight[i - 1]:
                assert contours.straight_segments(rest)[new]


def test_a_circle_stays_nearly_round_without_one_of_its_anchors() -> None:
    # An arc of 60 degrees by one cubic misses the circle by 2.4e-5 (Goldapp 1991).
    rest = contours.remove(DISK, 3)
    assert rest is not None
    assert np.linalg.norm(dense(rest), axis=-1) == pytest.approx(1.0, abs=6e-5)
    assert bend_at(rest, 2) < 1e-9


def test_nothing_remains_of_a_triangle_or_a_lens() -> None:
    triangle = PolygonContour(((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)))
    assert contours.remove(triangle, 0) is None
    assert contours.remove(contours.to_bezier(triangle), 0) is None
    lens = contours.bend(contours.to_bezier(triangle), 0)
    lens = contours.move_handle(lens, 0, 1, (0.3, -0.5))
    rest = contours.remove(lens, 2)
    assert rest is not None
    assert contours.size_of(rest) == 2
    assert contours.remove(rest, 0) is None


# --- segments ---------------------------------------------------------------


def test_a_segment_made_straight_leaves_the_others() -> None:
    for chain in chains(29):
        for k in range(contours.size_of(chain)):
            line = contours.straighten(chain, k)
            assert contours.straight_segments(line)[k]
            assert all(
                a == b
                for j, (a, b) in enumerate(zip(line.curves, chain.curves, strict=True))
                if j != k
            )
            for i, kind in enumerate(contours.kinds_of(line)):
                if kind != "corner" and i in (k, (k + 1) % contours.size_of(chain)):
                    assert bend_at(line, i) <= contours.KINK + ROUNDING


def test_a_bent_line_has_handles_and_the_same_shape() -> None:
    bent = contours.bend(SQUARE, 1)
    assert contours.straight_segments(bent).tolist() == [True, False, True, True]
    assert distance_between(bent, SQUARE) < ROUNDING
    assert contours.bend(HEART, 0) is HEART
    assert contours.straight_segments(contours.straighten(bent, 1)).all()


# --- whole contours ---------------------------------------------------------


@pytest.mark.parametrize("contour", [*chains(31, 8), HEART, SQUARE])
def test_reversed_twice_it_is_the_same(contour: Contour) -> None:
    turned = contours.reverse(contour)
    assert contours.points_of(turned)[0] == contours.points_of(contour)[0]
    assert contours.reverse(turned) == contour
    area = float(curves.signed_areas(contours.curves_of(contour)).sum())
    assert float(curves.signed_areas(contours.curves_of(turned)).sum()) == pytest.approx(-area)
    for i, kind in enumerate(contours.kinds_of(turned)):
        if kind == "smooth":
            assert bend_at(turned, i) <= contours.KINK


@pytest.mark.parametrize("contour", [*chains(37, 8), HEART, SQUARE])
def test_a_split_divides_the_area_and_closes_both_parts(contour: Contour) -> None:
    count = contours.size_of(contour)
    area = float(curves.signed_areas(contours.curves_of(contour)).sum())
    straight = contours.straight_segments(contour)
    for i in range(count):
        for j in range(i + 1, count):
            if (j - i == 1 and straight[i]) or (j - i == count - 1 and straight[j]):
                with pytest.raises(SceneError, match="cannot be split"):
                    contours.split(contour, i, j)
                continue
            a, b = contours.split(contour, j, i)
            assert contours.size_of(a) + contours.size_of(b) == count + 2
            parts = sum(float(curves.signed_areas(contours.curves_of(c)).sum()) for c in (a, b))
            assert parts == pytest.approx(area, abs=ROUNDING)
            assert contours.straight_segments(a)[-1]
            assert contours.straight_segments(b)[-1]
    with pytest.raises(SceneError, match="cannot be split"):
        contours.split(contour, 1, 1)


def test_a_polygon_becomes_curves_and_comes_back() -> None:
    chain = contours.to_bezier(SQUARE)
    assert contours.straight_segments(chain).all()
    assert contours.to_polygon(chain, 1e-3) == SQUARE
    assert contours.to_bezier(chain) is chain


STIFF: tuple[Contour, ...] = (
    BezierContour((((0.0, 0.0), (1.0, 1.0), (-1.0, 1.0), (0.0, 0.0)),)),  # a teardrop
    BezierContour((((0.0, 0.0), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0)),)),  # a point
    contours.to_bezier(PolygonContour(((0.0, 0.0), (0.0, 0.0), (1.0, 0.0), (1.0, 0.0)))),
    BezierContour(  # handles on their anchors, and collinear ones that turn back
        (
            ((0.0, 0.0), (0.0, 0.0), (1.0, 0.0), (1.0, 0.0)),
            ((1.0, 0.0), (3.0, 0.0), (-2.0, 0.0), (0.5, 0.0)),
            ((0.5, 0.0), (0.5, 1.0), (0.0, 0.0), (0.0, 0.0)),
        ),
        ("symmetric", "smooth", "smooth"),
    ),
)


def random_edit(contour: Contour, rng: np.random.Generator) -> Contour:
    """Do anything that can be done to a contour."""
    count = contours.size_of(contour)
    i, to = int(rng.integers(count)), tuple(rng.normal(0.0, 1.0, 2).tolist())
    kind: AnchorKind = ("corner", "smooth", "symmetric")[int(rng.integers(3))]  # type: ignore[assignment]
    handled = contours.to_bezier(contour)
    edits = (
        lambda: contours.move_point(contour, i, to, SKEW),
        lambda: contours.move_handle(handled, i, 1, to, metric=SKEW),
        lambda: contours.move_handle(handled, i, 2, to, free=True),
        lambda: contours.move_handle(handled, i, 2, handled.anchors[(i + 1) % count]),
        lambda: contours.set_kind(contour, i, kind, SKEW),
        lambda: contours.insert(contour, i, float(rng.random())),
        lambda: contours.remove(contour, i) or contour,
        lambda: contours.straighten(contour, i),
        lambda: contours.bend(contour, i),
        lambda: contours.reverse(contour),
        lambda: contours.mirror(contour),
        lambda: contours.split(contour, i, (i + 2) % count)[0],
        lambda: contours.to_polygon(contour, 0.05),
    )
    return edits[int(rng.integers(len(edits)))]()


@pytest.mark.parametrize("start", [SQUARE, HEART, *STIFF])
def test_any_row_of_edits_leaves_a_contour(start: Contour) -> None:
    """`BezierContour` itself refuses numbers that are not finite, and gaps."""
    rng = np.random.default_rng(41)
    for _ in range(4):
        contour = start
        for _ in range(60):
            with contextlib.suppress(SceneError):
                contour = random_edit(contour, rng)
            if contours.size_of(contour) > 60:
                break
            low, high = np.array(contours.bounds(Outline((contour,))))
            distance, segment, along = contours.nearest(contour, (0.3, -0.2), SKEW)
            assert (low <= high).all()
            assert distance >= 0.0
            assert 0 <= segment < contours.size_of(contour)
            assert 0.0 <= along <= 1.0


# --- in a light -------------------------------------------------------------

LIGHT = AreaLight(
    "key", Outline((SQUARE, HEART)), Plane((1.0, 2.0, 3.0), (2.0, 0.5, 0.0), (0.3, 1.0, -0.4))
)


def test_every_edit_of_the_outline_forgets_the_source_and_no_other_does() -> None:
    light = replace(LIGHT, source=TextSource("a"))
    shape = {
        "vertex": lambda x: lights.move_vertex(x, (1, 0), (0.1, 0.2)),
        "handle": lambda x: lights.move_handle(x, 1, 0, 1, (0.1, 0.2)),
        "retract": lambda x: lights.retract_handle(x, 1, 0, 1),
        "kind": lambda x: lights.set_kind(x, (1, 0), "smooth"),
        "add": lambda x: lights.add_vertex(x, 1, 0),
        "remove": lambda x: lights.remove_vertex(x, (1, 0)),
        "line": lambda x: lights.straighten(x, 1, 0),
        "curve": lambda x: lights.bend(x, 0, 0),
        "reverse": lambda x: lights.reverse_contour(x, 1),
        "split": lambda x: lights.split_contour(x, 1, 0, 3),
        "polygon": lambda x: lights.to_polygon(x, 1e-3),
        "curves": lambda x: lights.to_bezier(x),
        "hole": lambda x: lights.add_hole(x, "round"),
        "contour": lambda x: lights.remove_contour(x, 0),
    }
    editor = Editor(Scene(lights=(light,)))
    for name, change in shape.items():
        changed = change(light)
        assert changed.source is None, name
        assert changed.outline != light.outline, name
        editor.apply(name, replace_light(editor.scene, 0, changed))
        editor.apply("back", replace_light(editor.scene, 0, light))
    for _ in range(2 * len(shape)):
        editor.undo()
    assert editor.scene == Scene(lights=(light,))
    for same in (
        lights.move_light(light, (1.0, 0.0, 0.0)),
        lights.aim(light, (0.0, 0.0, 0.0)),
        lights.flip_light(light),
        lights.to_bezier(light, 1),
        lights.set_kind(light, (0, 0), "corner"),
    ):
        assert same.source == light.source
        assert same.outline is light.outline


def test_curves_count_in_centre_bounds_and_size() -> None:
    disk = AreaLight("disk", presets.disk(2.0), Plane((1.0, 2.0, 3.0)))
    assert np.allclose(lights.extent_of(disk), ((-2.0, -2.0), (2.0, 2.0)), atol=1e-5)
    centre, radius = lights.bounds_of(disk)
    assert centre == pytest.approx((1.0, 2.0, 3.0), abs=1e-6)
    # Never too small, and larger by twice what curves may be missed by.
    assert 2.0 <= radius <= 2.0 + 2.0 * lights.FINE * 8.0
    assert lights.size_of(disk) == pytest.approx(4.0, abs=1e-5)


def test_a_flipped_heart_is_the_same_curve_facing_away() -> None:
    flipped = lights.flip_light(LIGHT)
    for before, after in zip(LIGHT.outline.contours, flipped.outline.contours, strict=True):
        there = [planes.point_on(LIGHT.plane, (s, t)) for s, t in dense(before, 20)]
        back = [planes.coordinates_on(flipped.plane, point) for point in there]
        assert max(contours.nearest(after, at)[0] for at in back) < 1e-9
    assert np.dot(planes.normal_of(LIGHT.plane), planes.normal_of(flipped.plane)) == pytest.approx(
        -1.0
    )


@pytest.mark.parametrize("fill_rule", ["evenodd", "nonzero"])
@pytest.mark.parametrize("reverse", [False, True])
def test_a_round_hole_is_round_in_the_world(fill_rule, reverse: bool) -> None:
    contour = contours.reverse(HEART) if reverse else HEART
    light = replace(LIGHT, outline=Outline((contour,), fill_rule))
    place, clearance, _ = lights.widest_place(light)
    holed = lights.add_hole(light, "round")
    metric = planes.metric_from_plane(light.plane)
    away = np.linalg.norm(dense(holed.outline.contours[1], 20) @ metric.T - place, axis=-1)
    assert away == pytest.approx(0.5 * clearance, rel=1e-5)
    turns, _ = lights._winding_and_clearance(
        lights._loops(holed.outline, holed.plane)[0], place[None]
    )
    assert turns[0] % 2 == 0 if fill_rule == "evenodd" else turns[0] == 0


def test_what_has_no_inside_goes_whole_or_not_at_all() -> None:
    lens = contours.split(DISK, 0, 1)[0]
    assert contours.size_of(lens) == 2
    light = AreaLight("lens", Outline((SQUARE, lens)))
    assert lights.remove_vertex(light, (1, 0)).outline.contours == (SQUARE,)
    with pytest.raises(SceneError, match="2 is the fewest"):
        lights.remove_vertex(AreaLight("lens", Outline((lens,))), (0, 0))
    with pytest.raises(SceneError, match="no handles"):
        lights.move_handle(light, 0, 0, 1, (0.0, 0.0))


def test_a_selected_anchor_never_outlives_it() -> None:
    scene = Scene(lights=(AreaLight("heart", Outline((HEART,))),))
    editor = Editor(scene)
    editor.selection = Selection.light(0, (0, 5))
    editor.remove()
    assert editor.steps[-1] == "Remove anchor of 'heart'"
    assert editor.selection == Selection.light(0)
    assert contours.size_of(editor.scene.lights[0].outline.contours[0]) == 5
