"""Each condition under which an effect is called missing, on either side of its bound."""

from __future__ import annotations

import numpy as np
import pytest

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


def test_a_drop_must_be_seen_in_most_folds_in_which_the_effect_acts():
    assert finding(BEFORE, held_out(*[1.01] * 4, *[0.5] * 6)).justified
    assert not finding(BEFORE, held_out(*[1.01] * 5, *[0.1] * 5)).justified
    # where it does not act it is not asked: less than a tenth of its greatest power
    silent = (0.0999,) * 5 + (1.0,) * 5
    assert finding(BEFORE, held_out(*[1.01] * 5, *[0.1] * 5, power=silent)).justified
    loud = (0.1,) * 5 + (1.0,) * 5
    assert not finding(BEFORE, held_out(*[1.01] * 5, *[0.1] * 5, power=loud)).justified


def test_what_acts_in_fewer_than_three_folds_is_not_called_missing():
    two, three = ((1.0,) * count + (0.0,) * (10 - count) for count in (2, 3))
    gone = [0.1] * 3 + [1.0] * 7
    assert finding(BEFORE, held_out(*gone, power=three)).justified
    assert not finding(BEFORE, held_out(*gone, power=two)).justified
    assert finding(BEFORE, held_out(*gone, power=two)).steadiness == 0.0
    assert finding(BEFORE, held_out(*gone, power=two)).acts.tolist() == [True, True] + [False] * 8


def test_what_acts_mostly_in_two_folds_is_asked_in_the_three_where_it_acts_most():
    mostly = (1.0, 0.9, 0.05, *[0.01] * 7)
    assert (
        finding(BEFORE, held_out(*[0.1] * 3, *[1.0] * 7, power=mostly)).acts.tolist()
        == [True] * 3 + [False] * 7
    )
    assert finding(BEFORE, held_out(*[0.1] * 3, *[1.01] * 7, power=mostly)).justified
    assert not finding(BEFORE, held_out(0.1, 1.01, 1.01, *[0.9] * 7, power=mostly)).justified


def test_steadiness_is_the_mean_gain_in_standard_errors():
    gains = np.array([0.1, 0.3, 0.2, 0.0])
    found = finding(held_out(1, 1, 1, 1), held_out(*(1 - gains)))
    assert found.steadiness == pytest.approx(gains.mean() / (gains.std(ddof=1) / 2))


@pytest.mark.parametrize(("scatter", "justified"), [(0.128, True), (0.131, False)])
def test_a_small_drop_must_be_steady_and_a_plain_one_need_not(scatter, justified):
    """Mean gain 0.06 of ten folds, a drop of 0.03: 1.8 standard errors are asked for."""
    gains = 0.06 + scatter * np.array([-1.0] * 3 + [0.0] * 4 + [1.0] * 3)
    error = gains.std(ddof=1) / np.sqrt(10)
    assert bool(0.06 / error > 1.8) is justified
    found = finding(BEFORE, held_out(*(1 - gains)))
    assert found.drop == pytest.approx(1 - np.sqrt(0.94))
    assert found.justified is justified
    plain = finding(BEFORE, held_out(*(1 - gains - 0.05)))
    assert plain.drop > 0.05
    assert plain.justified
