"""Friction over speed: each column against the formula that its equation states, and where its constants are searched."""

import numpy as np
import pytest

from identify.effects.viscous import (
    Stribeck,
    Viscous,
    ViscousAsymmetric,
    ViscousCubic,
    ViscousPower,
    ViscousQuadratic,
    finer_stribeck,
    stribeck_range,
    stribeck_step,
)
from tests.identify.effects.motions import motion_of
from tests.identify.effects.summaries import TOP_SPEED, summary_of

MOTION = motion_of()
V = MOTION.dq


@pytest.mark.parametrize(
    ("effect", "constants", "expected"),
    [
        (Viscous(), {}, V),
        (ViscousAsymmetric(), {}, np.sqrt(V**2)),
        (ViscousQuadratic(), {}, np.copysign(V**2, V)),
        (ViscousCubic(), {}, V * V * V),
        (ViscousPower(), {"exponent": 0.5}, np.copysign(np.sqrt(np.abs(V)), V)),
        (Stribeck(), {"stribeck_velocity": 0.2}, np.copysign(np.exp(-5.0 * np.abs(V)), V)),
    ],
    ids=lambda each: getattr(each, "name", None),
)
def test_the_column_is_that_of_the_equation(effect, constants, expected):
    columns = effect.columns(MOTION, constants)
    assert columns.shape == (len(V), 1)
    np.testing.assert_allclose(columns[:, 0], expected, rtol=1e-12)


@pytest.mark.parametrize("effect", [Viscous(), ViscousPower(), Stribeck()], ids=lambda each: each.name)
def test_friction_that_can_have_one_sign_only_opposes_the_motion(effect):
    assert effect.parameters[0].lower == 0.0
    column = effect.columns(MOTION, {"exponent": 0.35, "stribeck_velocity": 0.1})[:, 0]
    assert (column * V >= 0).all()


def test_a_plan_assumes_the_viscous_friction_that_its_torque_at_top_speed_makes():
    assert Viscous().assumed(friction=12.0, speed=3.0) == (4.0,)


def test_the_faster_and_the_slower_direction_stay_friction():
    plus, minus = ViscousAsymmetric().relations(summary_of(), {})
    assert plus.coefficients == {("viscous", 0): 1.0, ("viscous-asymmetric", 0): 1.0}
    assert minus.coefficients == {("viscous", 0): 1.0, ("viscous-asymmetric", 0): -1.0}


def test_exponents_lie_between_dry_and_viscous_and_are_refined_around_the_choice():
    effect, summary = ViscousPower(), summary_of()
    coarse = [each["exponent"] for each in effect.grid(summary)]
    assert min(coarse) > 0
    assert max(coarse) < 1
    fine = [each["exponent"] for each in effect.refine({"exponent": 0.35}, summary)]
    assert 0.35 in fine
    assert (min(fine), max(fine)) == (0.25, 0.45)
    assert all(each["exponent"] > 0 for each in effect.refine({"exponent": 0.05}, summary))


def test_stribeck_velocities_are_searched_from_what_the_motion_shows_to_a_fifth_of_the_top_speed():
    low, high = stribeck_range(summary_of())
    assert high == pytest.approx(0.2 * TOP_SPEED)
    # half of the speed that two samples in a hundred stay below
    assert low == pytest.approx(0.5 * 0.02 * TOP_SPEED)
    assert stribeck_range(summary_of(speed_resolution=0.05))[0] == pytest.approx(0.1)
    slowest = TOP_SPEED * np.full(9, 1e-6)
    assert stribeck_range(summary_of(speed_quantiles=slowest))[0] == pytest.approx(0.003 * TOP_SPEED)
    # motion that is never slow leaves a range all the same
    fast = stribeck_range(summary_of(speed_quantiles=TOP_SPEED * np.full(9, 0.9)))
    assert fast == pytest.approx((0.5 * high, high))


def test_the_grid_of_stribeck_velocities_is_geometric_and_refined_within_the_range():
    effect, summary = Stribeck(), summary_of()
    values = np.array([each["stribeck_velocity"] for each in effect.grid(summary)])
    low, high = stribeck_range(summary)
    assert len(values) == 9
    np.testing.assert_allclose(values[[0, -1]], [low, high])
    np.testing.assert_allclose(values[1:] / values[:-1], stribeck_step(summary, 9))
    fine = [each["stribeck_velocity"] for each in effect.refine({"stribeck_velocity": values[4]}, summary)]
    assert np.isclose(fine, values[4]).any()
    assert values[3] * 0.999 < min(fine) < values[4] < max(fine) < values[5] * 1.001
    at_the_end = finer_stribeck({"stribeck_velocity": low}, summary, 2.0)
    assert min(each["stribeck_velocity"] for each in at_the_end) == pytest.approx(low)
