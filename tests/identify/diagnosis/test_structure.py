"""How much of a residual is predictable, of residuals of which the closed form is known."""

from __future__ import annotations

import numpy as np
import pytest

from identify.diagnosis.disturbance import least_remembered
from identify.diagnosis.structure import (
    Structure,
    _from_history,
    _line_over_time,
    _predictable,
    _spectrum,
    bounded,
    leftover_structure,
    leftover_structures,
    travel_since_reversal,
    variable,
)
from identify.estimation.prediction import Prediction

STEP = 0.02


def prediction(residual, velocity=None, position=None, acceleration=None, moving=None, **more) -> Prediction:
    """A joint, at a constant speed where nothing is said."""
    count = len(residual)
    time = 5.0 + STEP * np.arange(count)
    values = {
        "file": "s.csv",
        "joint": "j1",
        "time": time,
        "position": 0.1 * (time - 5.0) if position is None else position,
        "velocity": np.full(count, 0.1) if velocity is None else velocity,
        "acceleration": np.zeros(count) if acceleration is None else acceleration,
        "load": np.zeros(count),
        "measured": residual,
        "predicted": np.zeros(count),
        "moving": np.ones(count, bool) if moving is None else moving,
        "temperature": None,
    }
    return Prediction(**(values | more))


def share(parts, view) -> Structure:
    """The answer to one of the questions; asking all of them takes ten times as long."""
    ask = {("history",): _from_history, ("frequency",): _line_over_time}
    return ask[view](parts) if view in ask else _predictable(parts, view)


@pytest.mark.parametrize(
    ("share", "deviation", "found"),
    [
        (0.101, 0.032, True),
        (0.1, 0.0, False),
        (0.3, 0.0962, True),
        (0.3, 0.0964, False),
        (0.0, np.inf, False),
    ],
)
def test_structure_is_more_than_its_least_and_certain(share, deviation, found):
    """One chance in a hundred in any of eleven questions: 3.117 standard errors of the normal distribution."""
    assert Structure(("q",), share, deviation).found is found
    assert Structure(("q",), 0.15, 0.01, least=0.2).found is False


def test_the_way_since_a_reversal_begins_anew_at_every_change_of_sign():
    position = np.array([1.0, 2.0, 4.0, 3.5, 3.0, 3.2, 3.6])
    velocity = np.array([1.0, 1.0, 1.0, -1.0, -1.0, 1.0, 1.0])
    np.testing.assert_allclose(travel_since_reversal(position, velocity), [0, 1, 3, 0, -0.5, 0, 0.4])


def test_variables_are_those_of_the_motion_by_name():
    random = np.random.default_rng(0)
    q, dq, ddq, load, predicted = random.standard_normal((5, 30))
    part = prediction(np.zeros(30), dq, q, ddq, load=load, predicted=predicted, temperature=20 + q)
    for name, values in [
        ("q", q),
        ("dq", dq),
        ("ddq", ddq),
        ("load", load),
        ("torque", predicted),
        ("direction", np.sign(dq)),
        ("time", STEP * np.arange(30)),
        ("travel since reversal", travel_since_reversal(q, dq)),
        ("temperature", 20 + q),
    ]:
        np.testing.assert_allclose(variable(part, name), values, atol=1e-12)
    with pytest.raises(KeyError, match="temperature"):
        variable(prediction(np.zeros(30)), "temperature")
    with pytest.raises(KeyError, match="colour"):
        variable(part, "colour")


def test_residuals_are_cut_at_six_robust_deviations_of_the_samples_in_motion():
    """The median of |±1| is one, so that 6 · 1.4826 is kept; what stands still has no say in it."""
    residual = np.tile([1.0, -1.0], 20)
    residual[[3, 8]] = 8.8, -9.0
    still = np.full(20, 1000.0)
    moving = np.arange(60) < 40
    (cut,) = bounded([prediction(np.concatenate([residual, still]), moving=moving)])
    assert cut.residual[3] == pytest.approx(8.8)
    assert cut.residual[8] == pytest.approx(-6 * 1.4826)
    assert cut.residual[50] == pytest.approx(6 * 1.4826)
    assert bounded([prediction(np.ones(5), moving=np.zeros(5, bool))])[0].residual.tolist() == [0.0] * 5


def test_no_band_of_noise_is_called_a_line_and_few_stand_out_of_their_neighbourhood():
    """What stands out in one record of a hundred by its own scatter does so more often by that of the median beside it."""
    random = np.random.default_rng(17)
    records = [random.standard_normal(600) for _ in range(300)]
    assert sum(bool((_spectrum(each, STEP).share > 0).any()) for each in records) <= 0.1 * len(records)
    assert not any(_line_over_time([prediction(each)]).found for each in records)


def swing(count: int, turns: float = 13.0):
    phase = 2 * np.pi * turns * np.arange(count) / count
    return {"position": np.sin(phase), "velocity": np.cos(phase), "acceleration": -np.sin(phase)}


def test_the_mean_of_sixteen_neighbours_predicts_noise_worse_by_a_sixteenth_and_a_smooth_function_wholly():
    count = 4000
    noise = np.random.default_rng(3).standard_normal(count)
    motion = swing(count)
    of_noise = share([prediction(noise, **motion)], ("q", "direction"))
    assert of_noise.share == pytest.approx(-1 / 16, abs=0.03)
    assert not of_noise.found
    smooth = share([prediction(np.sin(3 * motion["position"]), **motion)], ("q", "direction"))
    assert smooth.share > 0.999
    assert smooth.found
    # half of the power each: what is smooth, less a sixteenth of the noise
    half = np.sin(3 * motion["position"])
    half = half / half.std()
    both = share([prediction(half + noise, **motion)], ("q", "direction"))
    assert both.share == pytest.approx(0.5 - 0.5 / 16, abs=0.03)
    assert 0.0 < both.deviation < 0.05


def test_all_questions_are_asked_and_the_most_telling_answer_is_the_first():
    motion = swing(600, 3.0)
    answers = leftover_structure([prediction(np.sin(3 * motion["position"]), **motion)])
    assert [each.share for each in answers] == sorted((each.share for each in answers), reverse=True)
    assert {each.variables for each in answers} == {
        ("q", "dq", "ddq"),
        ("q", "dq", "load"),
        ("dq", "load"),
        ("q", "direction"),
        ("travel since reversal", "dq"),
        ("time", "dq"),
        ("history",),
        ("frequency",),
        ("time",),
        ("time", "direction"),
        ("moments",),
    }
    assert {each.least for each in answers if each.variables in (("time",), ("time", "direction"))} == {
        least_remembered()
    }


def test_of_variables_of_any_size_each_counts_alike():
    """Position in units of a millionth: neighbours are near by their spread, not by their numbers."""
    count = 3000
    motion = swing(count)
    left = np.sign(motion["velocity"])
    small = motion | {"position": 1e-6 * motion["position"], "velocity": 1e6 * motion["velocity"]}
    for each in (motion, small):
        assert share([prediction(left, **each)], ("q", "dq", "ddq")).share > 0.9


def test_long_records_are_thinned_and_short_ones_say_nothing():
    nothing = share([prediction(np.ones(40))], ("q", "direction"))
    assert (nothing.share, nothing.deviation) == (0.0, np.inf)
    long = swing(45_000, 40.0)
    assert share([prediction(np.sin(3 * long["position"]), **long)], ("q", "direction")).share > 0.999


def test_what_follows_an_acceleration_of_half_a_second_ago_is_seen_in_the_history():
    """Lags are 1.5 s in 24 steps, about 0.065 s apart; of one of these all is predicted, of 2 s ago nothing."""
    random = np.random.default_rng(4)
    count = 6000
    ddq = random.standard_normal(count)
    lags = np.unique(np.round(np.linspace(0, 1.5 / STEP, 24)).astype(int))
    for lag, whole in ((int(lags[8]), True), (100, False)):
        left = np.concatenate([np.zeros(lag), ddq[:-lag]])
        seen = share([prediction(left, acceleration=ddq)], ("history",))
        if whole:
            assert seen.share == pytest.approx(1.0, abs=2e-3)
            assert seen.found
        else:
            assert seen.share < 0.01
            assert not seen.found


def test_the_history_does_not_reach_across_a_hole_nor_over_rest_nor_into_what_is_too_short():
    random = np.random.default_rng(5)
    count, lag = 6000, 75
    ddq = random.standard_normal(count)
    left = np.concatenate([np.zeros(lag), ddq[:-lag]])
    left[3000 : 3000 + lag] = 50.0  # behind the hole: with history from before it this would be a large error
    time = 5.0 + STEP * np.arange(count)
    time[3000:] += 10.0
    assert share([prediction(left, acceleration=ddq, time=time)], ("history",)).share > 0.99
    left[3000 : 3000 + lag] = ddq[3000 - lag : 3000]
    moving = np.ones(count, bool)
    left[4000:4100], moving[4000:4100] = 80.0, False
    assert share([prediction(left, acceleration=ddq, moving=moving)], ("history",)).share > 0.99
    short = share([prediction(np.ones(70), acceleration=ddq[:70])], ("history",))
    assert (short.share, short.deviation) == (0.0, np.inf)
    few = share([prediction(left[:300], acceleration=ddq[:300])], ("history",))
    assert (few.share, few.deviation) == (0.0, np.inf)


@pytest.mark.parametrize("hertz", [3.0, 11.0])
def test_a_line_has_its_share_of_the_power_and_noise_none(hertz):
    """Amplitude √2 in noise of unit power: one half."""
    count = 6000
    time = STEP * np.arange(count)
    noise = np.random.default_rng(6).standard_normal(count)
    line = share([prediction(np.sqrt(2) * np.sin(2 * np.pi * hertz * time) + noise)], ("frequency",))
    assert line.share == pytest.approx(0.5, abs=0.03)
    assert line.found
    assert share([prediction(noise)], ("frequency",)).share == 0.0


def test_a_line_must_be_in_all_halves_of_sessions_and_long_enough_to_be_one():
    count = 2400
    time = STEP * np.arange(count)
    noise = 0.1 * np.random.default_rng(7).standard_normal((4, count))
    line = np.sin(2 * np.pi * 5.0 * time)
    with_line = [prediction(line + noise[0]), prediction(line + noise[1]), prediction(line + noise[2])]
    once = [prediction(line + noise[0]), prediction(noise[1]), prediction(noise[2])]
    assert share(with_line, ("frequency",)).found
    assert share(once, ("frequency",)).share == 0.0
    short = share([prediction(line[:318])], ("frequency",))
    assert (short.share, short.deviation) == (0.0, np.inf)
    assert share([prediction(line[:320])], ("frequency",)).share > 0.5


def test_friction_of_a_motor_that_two_joints_share_is_found_at_both_and_at_no_other():
    """Two belts over three joints, the last of which has a motor of its own: w = v1 + v2 and v1 - v2, friction sign(w)."""
    random = np.random.default_rng(5)
    time = STEP * np.arange(3000)
    speeds = [np.sin(0.9 * time), 0.8 * np.sin(1.37 * time + 1.0), np.sin(1.11 * time + 2.0)]
    one, two = np.sign(speeds[0] + speeds[1]), np.sign(speeds[0] - speeds[1])
    noise = 0.3 * random.standard_normal((3, len(time)))
    residuals = (one + two + noise[0], one - two + noise[1], noise[2])
    joints = [
        [prediction(residual, velocity=speed, joint=f"j{number}")]
        for number, (residual, speed) in enumerate(zip(residuals, speeds, strict=True), start=1)
    ]
    told = [
        next(each for each in answers if each.variables[0] == "dq" and " of " in each.variables[1])
        for answers in leftover_structures(joints)
    ]
    assert [each.found for each in told] == [True, True, False]
    assert [each.variables[1] for each in told[:2]] == ["dq of j2", "dq of j1"]
    # of sign(w1) + sign(w2) the power is 2, of the noise 0.09
    assert told[0].share == pytest.approx(2 / 2.09, abs=0.05)
    # a joint alone has no neighbour to ask
    assert not any(" of " in name for each in leftover_structure(joints[0]) for name in each.variables)
