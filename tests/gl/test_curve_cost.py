"""What many curves cost, in evaluations of the contour integral, which no load disturbs.

``docs/figures/curve_cost.py`` plots the same scenes.
"""

from __future__ import annotations

import pytest

from tests.gl.cost_scenes import BEHIND, FAR, NEAR, SHARP, evaluations, hearts, lit_floor, waves

FEW, MANY = 54, 504


@pytest.mark.parametrize("outline", [waves, hearts])
def test_cost_grows_no_faster_than_the_number_of_curves(renderer, outline):
    """Seen, both lobes: 4 evaluations a curve fall to 2, in the costliest pixel 11 to 7."""
    few, many = (
        evaluations(renderer, lit_floor(outline(count), NEAR)) / count for count in (FEW, MANY)
    )
    assert few.min() > 0.0
    assert few.mean() < 6.0
    assert few.max() < 15.0
    assert many.mean() < few.mean()
    assert many.max() < few.max()


@pytest.mark.parametrize("outline", [waves, hearts])
def test_curves_that_cannot_matter_cost_next_to_nothing(renderer, outline):
    """Far away, or outside all lobes: seen, 3 to 10 evaluations for 504 curves."""
    shape = outline(MANY)
    near = evaluations(renderer, lit_floor(shape, NEAR)).mean()
    far = evaluations(renderer, lit_floor(shape, FAR))
    assert far.mean() < 0.02 * near
    assert far.max() < 0.5 * near
    outside = evaluations(renderer, lit_floor(shape, BEHIND, SHARP))
    assert outside.mean() < 0.03 * near
    assert outside.max() < 0.1 * MANY
