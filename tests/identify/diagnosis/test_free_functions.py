"""Hat functions make any piecewise linear course, as `numpy.interp` does."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from identify.diagnosis.deciding_constants import DROP_PER_PARAMETER
from identify.diagnosis.free_functions import FREE_FUNCTIONS, LOAD_KNOTS, SPEED_KNOTS, FreeFunction, hats
from tests.identify.effects.motions import motion_of
from tests.identify.effects.summaries import summary_of

KNOTS = np.array([-2.0, -0.5, 0.0, 0.25, 3.0])
HEIGHTS = np.array([1.0, -2.0, 0.5, 4.0, -1.0])


@given(st.lists(st.floats(-5.0, 5.0), min_size=1, max_size=20))
def test_hats_times_heights_are_the_course_through_the_knots_and_level_beyond(values):
    at = np.array(values)
    shapes = hats(at, KNOTS)
    np.testing.assert_allclose(shapes @ HEIGHTS, np.interp(at, KNOTS, HEIGHTS), atol=1e-12)
    np.testing.assert_allclose(shapes.sum(axis=1), 1.0, rtol=1e-12)


def test_each_hat_is_one_at_its_own_knot_and_nothing_at_the_others():
    np.testing.assert_array_equal(hats(KNOTS, KNOTS), np.eye(len(KNOTS)))


@pytest.mark.parametrize("effect", FREE_FUNCTIONS, ids=lambda effect: effect.name)
def test_a_free_function_makes_any_course_over_its_variable_in_either_direction(effect):
    motion, summary = motion_of(), summary_of()
    (constants,) = effect.grid(summary)
    columns = effect.columns(motion, constants)
    over = {"q": motion.q, "dq": motion.dq, "load": motion.load}[effect.name]
    knots = {
        "q": np.linspace(-1.0, 1.0, 17),
        "dq": 2.0 * np.array([*(-np.array(SPEED_KNOTS[:0:-1])), *SPEED_KNOTS]),
        "load": np.linspace(-80.0, 80.0, LOAD_KNOTS),
    }[effect.name]
    course = np.interp(over, knots, np.random.default_rng(1).normal(size=len(knots)))
    wanted = course + (0.7 * np.sign(motion.dq) if effect.name == "dq" else course * np.sign(motion.dq))
    fitted = np.linalg.lstsq(columns, wanted, rcond=None)[0]
    np.testing.assert_allclose(columns @ fitted, wanted, atol=1e-9)
    assert columns.shape[1] == (len(knots) + 1 if effect.name == "dq" else 2 * len(knots))
    assert effect.uses_load == (effect.name == "load")


def test_a_record_without_load_or_motion_has_knots_all_the_same():
    still = summary_of(load_range=(3.0, 3.0), maximum_speed=0.0, position_quantiles=np.zeros(17))
    position, speed, load = (effect.grid(still)[0] for effect in FREE_FUNCTIONS)
    assert position == {"knot_00": 0.0}
    assert speed["top"] > 0.0
    assert load["to"] > load["from"] == 3.0


def test_a_free_function_must_lead_by_a_part_of_the_error_for_each_parameter_that_it_has_more():
    function = FreeFunction("dq", 0.01, 0.02, 18)
    drop = 15 * DROP_PER_PARAMETER
    assert function.lead_over(3) == pytest.approx(0.02**2 - ((1 - drop) * 0.02) ** 2)
    assert function.lead_over(18) == function.lead_over(20) == 0.0
