"""Each condition under which an effect is called missing, on either side of its bound."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import ttest_1samp

from identify.diagnosis.finding import steady
from tests.identify.diagnosis.findings import finding, held_out, instruments

BEFORE = held_out(*[1.0] * 10)


def dropped(part: float, folds: int = 10):
    """Errors after a drop of the (unsquared) error by a part of it, alike in every fold."""
    return held_out(*[(1 - part) ** 2] * folds)


def test_gain_and_drop_are_those_of_the_squared_and_the_plain_error():
    found = finding(BEFORE, dropped(0.2))
    assert found.gain == pytest.approx(10 * (1 - 0.64))
    assert found.drop == pytest.approx(0.2)
    assert found.relative(25.0) == pytest.approx(0.5)
    assert found.relative(-1e-20) == 0.0


def test_what_takes_all_of_the_error_drops_it_whole_and_what_raises_it_drops_less_than_nothing():
    assert finding(BEFORE, held_out(*[0.0] * 10)).drop == pytest.approx(1.0)
    small = held_out(*[1e-3] * 10)
    assert finding(small, held_out(*[2.5e-4] * 10)).drop == pytest.approx(0.5)
    assert finding(BEFORE, held_out(*[4.0] * 10)).drop == pytest.approx(-1.0)


def test_of_what_instruments_were_asked_only_their_part_counts():
    found = finding(BEFORE, dropped(0.2), loop=instruments(1e-4, 0.5))
    assert found.gain == pytest.approx(5 * (1 - 0.64))
    assert found.drop == pytest.approx(1 - np.sqrt(1 - 0.5 * 0.36))


@pytest.mark.parametrize(
    ("figures", "part", "justified"),
    [
        ({}, 0.0151, True),
        ({}, 0.0149, False),
        # every further parameter asks for a quarter of a per cent more
        ({"complexity": 3}, 0.0201, True),
        ({"complexity": 3}, 0.0199, False),
        # the part of the torque that is explained: 2.5e-4
        ({"measured": 0.36 * 10 / 2.5e-4**2 * 0.999}, 0.2, True),
        ({"measured": 0.36 * 10 / 2.5e-4**2 * 1.001}, 0.2, False),
        ({"p_value": 0.0099}, 0.2, True),
        ({"p_value": 0.01}, 0.2, False),
        ({"sessions_agree": False}, 0.2, False),
        ({"loop": instruments(0.0099)}, 0.2, True),
        ({"loop": instruments(0.01)}, 0.2, False),
    ],
)
def test_drop_torque_evidence_sessions_and_instruments_each_have_a_say(figures, part, justified):
    assert finding(BEFORE, dropped(part), **figures).justified is justified


def test_a_drop_must_be_seen_where_most_of_the_effect_s_power_is():
    assert finding(BEFORE, held_out(*[1.01] * 4, *[0.5] * 6)).justified
    assert not finding(BEFORE, held_out(*[1.01] * 5, *[0.1] * 5)).justified
    # where it does not act it is not asked
    silent = (0.01,) * 5 + (1.0,) * 5
    assert finding(BEFORE, held_out(*[1.01] * 5, *[0.1] * 5, power=silent)).justified


def test_what_acts_in_two_folds_or_fewer_is_not_called_missing():
    two, three = ((1.0,) * count + (0.0,) * (10 - count) for count in (2, 3))
    gone = [0.1] * 3 + [1.0] * 7
    assert finding(BEFORE, held_out(*gone, power=three)).justified
    assert not finding(BEFORE, held_out(*gone, power=two)).justified
    assert not finding(BEFORE, held_out(*gone, power=(0.0,) * 10)).justified


def test_what_acts_mostly_in_two_folds_is_asked_there_and_a_little_elsewhere():
    mostly = (1.0, 0.9, 0.05, *[0.01] * 7)
    assert finding(BEFORE, held_out(*[0.1] * 3, *[1.01] * 7, power=mostly)).justified
    assert not finding(BEFORE, held_out(0.1, 1.01, 1.01, *[1.0] * 7, power=mostly)).justified


@pytest.mark.parametrize(("errors", "agree"), [(1.97, True), (1.95, False)])
def test_of_folds_alike_a_small_gain_is_steady_where_its_mean_is_1_96_standard_errors(errors, agree):
    scatter = np.array([-1.0, -1.0, 0.0, 0.5, 1.5, -0.5, 0.5])
    gains = 0.01 * (scatter + errors * scatter.std(ddof=1) / np.sqrt(7))
    assert ttest_1samp(gains, 0.0).statistic == pytest.approx(errors)
    assert steady(held_out(*[1.0] * 7), held_out(*(1.0 - gains))) is agree


@pytest.mark.parametrize(("scatter", "agree"), [(0.0, True), (0.06, True), (0.6, False)])
def test_what_is_gained_is_a_part_of_the_effect_s_power_wherever_it_acts(scatter, agree):
    """A fold with ten times the power gains ten times as much, and that is no scatter."""
    power = np.array([1.0, 0.1, 0.1, 1.0, 0.5, 0.02])
    gains = 0.02 * (power + scatter * np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0]))
    assert steady(held_out(*[1.0] * 6), held_out(*(1.0 - gains), power=tuple(power))) is agree


def test_what_gains_as_much_as_structure_need_not_be_steady():
    gains = np.array([4.0, 0.01, 0.01, 0.01, -0.4, 0.01, 0.0, 0.0, 0.01, 0.01])
    before = held_out(*[4.1] * 10)
    assert not steady(before, held_out(*(4.1 - gains)))  # 9 % of the error's power
    assert steady(before, held_out(*(4.1 - 1.3 * gains)))  # 12 %


def test_what_acts_mostly_in_one_fold_is_asked_of_the_others_as_well():
    """A spring in motion of which one stretch goes where no other does."""
    power = np.array([70.0, 11.0, 9.0, 4.0, 1.3, 0.9, 0.5, 0.8, 1.3, 1.0])
    one = np.array([1.0] + [0.0] * 9)

    def asked(part):
        return steady(held_out(*(power + 1.0)), held_out(*(power * (1 - part) + 1.0), power=tuple(power)))

    assert asked(0.9)
    assert not asked(0.9 * one)  # a disturbance of that stretch
    assert not asked(0.9 * (1 - one) - 0.1 * one)  # which must not speak against it
