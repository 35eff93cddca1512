"""The error of an exported thing on the record: of the arm that made it nothing but its noise, of nothing all of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import identify
from identify.export.record_error import errors_of_model, errors_on_record
from tests.identify.estimation.simulated_arm import GAIN, Arm, Motion, experiment, record

ARM = Arm()
NOISE = 2.0
"""N m"""


@pytest.fixture(scope="module")
def result():
    """Two sessions, the second with a payload of 3 kg, each with a hole in it."""
    made = {}
    for name, mass in (("a", 0.0), ("b", 3.0)):
        raw = record(Motion(), ARM, np.random.default_rng(5), duration=12.0, torque_noise=NOISE, payload=mass)
        there = np.r_[0:2000, 2600 : len(raw.time)]
        holed = replace(raw, time=raw.time[there], position=raw.position[there], command=raw.command[there])
        made[name] = (holed, "disc" if mass else "none")
    return identify.identify(experiment(made, payloads=[("disc", 3.0)]), "usual")


def torque_of_the_arm(motion):
    torque = ARM.torque(motion.q[:, 0], motion.dq[:, 0], motion.ddq[:, 0], motion.payload.mass)
    return torque[:, None]


def errors_of(result, torque_of):
    """Of the only joint: the error of an exported thing, and its difference from the arm that is exported."""
    (error,) = errors_on_record(result, torque_of, torque_of_the_arm)
    return error.relative, error.difference


def test_the_arm_itself_errs_by_the_noise_that_passes_the_filters(result):
    error, difference = errors_of(result, torque_of_the_arm)
    (of_model,) = errors_of_model(result)
    assert 0 < error < 0.02
    assert error == pytest.approx(
        of_model, rel=0.1
    )  # the model was fitted to the same noise, with few parameters
    assert difference == 0.0


@pytest.mark.parametrize(("factor", "missed"), [(0.0, 1.0), (2.0, 1.0), (1.25, 0.25)])
def test_what_predicts_a_part_or_a_multiple_errs_by_what_it_misses(result, factor, missed):
    error, difference = errors_of(result, lambda motion: factor * torque_of_the_arm(motion))
    assert error == pytest.approx(missed, abs=1e-12 if factor == 0 else 0.02)
    assert difference == pytest.approx(missed, rel=1e-9)


def test_the_models_error_is_that_of_the_fit_which_took_out_whatever_it_could(result):
    (error,) = errors_of_model(result)
    assert error == pytest.approx(result.relative_error, rel=1e-6)


def test_time_counts_from_the_beginning_of_each_session_and_rows_follow_each_other(result):
    seen = []

    def torque_of(motion):
        seen.append(motion)
        return np.zeros_like(motion.q)

    errors_on_record(result, torque_of, torque_of_the_arm)
    assert [motion.payload.mass for motion in seen] == [0.0, 0.0, 3.0, 3.0]
    for first, second in (seen[:2], seen[2:]):
        assert 0 <= first.t[0] < 0.5
        assert second.t[-1] == pytest.approx(12.0, abs=0.5)
        assert first.t[-1] <= 4.0 <= 5.2 - 1e-9 <= second.t[0]
        for motion in (first, second):
            assert np.diff(motion.t) == pytest.approx(np.full(len(motion.t) - 1, 0.002), rel=1e-6)
            assert motion.q.shape == motion.dq.shape == motion.ddq.shape == (len(motion.t), 1)


def test_what_remembers_is_given_a_stretch_of_the_record_at_once_however_many_blocks_it_is(monkeypatch):
    """Friction that builds up over half a radian, by a loop of our own: begun anew in each block it errs more."""
    monkeypatch.setattr("identify.signals.motion.LARGEST_BLOCK", 1200)

    def with_presliding(q, dq, ddq):
        state = [np.sign(dq[0])]
        for travel in np.diff(q):
            heading = np.sign(travel)
            state.append(heading + (state[-1] - heading) * np.exp(-abs(travel) / 0.5))
        return ARM.torque(q, dq, ddq) + 35.0 * (np.array(state) - np.sign(dq))

    raw = record(Motion(), ARM, np.random.default_rng(5), duration=16.0)
    command = with_presliding(*Motion().at(raw.time))[:, None] / GAIN
    made = experiment({"a": (replace(raw, command=command), "none")})
    result = identify.identify(made, "usual", ["presliding"])
    lengths = []

    def torque_of(motion):
        lengths.append(len(motion.t))
        return with_presliding(motion.q[:, 0], motion.dq[:, 0], motion.ddq[:, 0])[:, None]

    (error,) = errors_on_record(result, torque_of, torque_of)
    assert len(lengths) == 2
    assert lengths[0] > 4 * 1200
    assert error.relative < 5e-3
    usual = identify.identify(made, "usual")
    lengths.clear()
    (anew,) = errors_on_record(usual, torque_of, torque_of)
    assert len(lengths) > 8
    assert anew.relative > 5 * error.relative
