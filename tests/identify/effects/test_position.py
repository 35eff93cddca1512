"""Torques over position: columns against their formulas, lines as the record shows them."""

import numpy as np
import pytest

from identify.effects.position import CurrentRipple, JointSpring, TorqueRipple, finer_line
from tests.identify.effects.motions import motion_of
from tests.identify.effects.summaries import summary_of

MOTION = motion_of()


def test_a_spring_is_the_position_and_resists():
    np.testing.assert_array_equal(JointSpring().columns(MOTION, {})[:, 0], MOTION.q)
    assert JointSpring().parameters[0].lower == 0.0


def test_a_ripple_is_a_cosine_and_a_sine_of_each_line():
    columns = TorqueRipple().columns(MOTION, {"wave_number": 40.0, "second_wave_number": 80.0})
    lines = [np.exp(1j * number * MOTION.q) for number in (40.0, 80.0)]
    expected = np.column_stack([part for line in lines for part in (line.real, line.imag)])
    np.testing.assert_allclose(columns, expected, atol=1e-12)
    formulas = TorqueRipple().formulas({"wave_number": 40.0, "second_wave_number": 80.0})
    assert [text.split("(")[0] for text in formulas] == ["cos", "sin", "cos", "sin"]


def test_a_ripple_of_the_current_grows_with_the_torque():
    columns = CurrentRipple().columns(MOTION, {"wave_number": 2.0})
    np.testing.assert_allclose(np.hypot(*columns.T), np.abs(MOTION.model_torque), rtol=1e-12)
    np.testing.assert_allclose(columns[:, 0], MOTION.model_torque * np.cos(2 * MOTION.q))
    assert [each["wave_number"] for each in CurrentRipple().grid(summary_of())] == [2.0]
    assert CurrentRipple().grid(summary_of(load_lines=None)) == []


def test_lines_are_tried_alone_and_the_strongest_with_each_that_is_apart():
    summary = summary_of(position_lines=(40.0, 40.0 + 0.5 * summary_of().line_width, 80.0))
    tried = TorqueRipple().grid(summary)
    alone = [each["wave_number"] for each in tried if len(each) == 1]
    pairs = [(each["wave_number"], each["second_wave_number"]) for each in tried if len(each) == 2]
    assert alone == list(summary.position_lines)
    assert pairs == [(40.0, 80.0)]
    assert TorqueRipple().grid(summary_of(position_lines=())) == []
    assert TorqueRipple().searched(summary) == summary.lines_searched


def test_a_line_is_refined_within_one_cell_of_resolution():
    summary = summary_of()
    fine = np.array([each["wave_number"] for each in finer_line({"wave_number": 40.0}, summary)])
    cell = 2 * np.pi / 2.0  # the positions span from -1 to 1
    np.testing.assert_allclose([fine.min(), fine.max()], [40 - cell / 2, 40 + cell / 2])
    assert 40.0 in fine


@pytest.mark.parametrize("effect", [TorqueRipple(), CurrentRipple()], ids=lambda each: each.name)
def test_without_a_line_in_the_residual_there_is_an_obstacle(effect):
    assert effect.obstacle(summary_of(position_lines=(), load_lines=())) is not None
    assert effect.obstacle(summary_of(position_lines=None, load_lines=None)) is None
