"""Following errors with feedforward torque beside those without it: errors written here, whose growth is known."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from daq.following_watch import CLEARLY, TOLERATED, TURNED, FollowingWatch
from daq.rig import Rig
from daq.samples import COMMAND_CAME, POSITION_CAME, Phase, joint_positions, sample_dtype
from daq.torque_offset import RAMP, SentAhead

CYCLES = 4000
WITHIN = 1e-2
"""rad, beyond every error here"""


@pytest.fixture(scope="module")
def rig():
    return Rig.load("rx130l-joint3-simulated")


@pytest.fixture(scope="module")
def usual(rig):
    """(L, 1) rad: without torque, of a motion to and fro, 0.15 mrad rms."""
    time = np.arange(CYCLES) * rig.cycle
    return (2e-4 * np.sin(2 * np.pi * 0.7 * time) + 8e-5 * np.sin(2 * np.pi * 1.9 * time))[:, None]


def driven(rig, error, before=7):
    """Rows of a plan that was driven with `error` (L, 1), after a few of the approach."""
    counts = np.rint(1e5 * np.sin(np.arange(before + len(error) + 1) * 1e-3)).astype(int)
    rows = np.zeros(len(counts), sample_dtype(1))
    rows["cycle"] = 300 + np.arange(len(rows))
    rows["phase"] = np.where(np.arange(len(rows)) < before, Phase.APPROACH, Phase.PLAN)
    rows["setpoint"][:, 0] = rows["position"][:, 0] = counts
    rows["valid"] = POSITION_CAME | COMMAND_CAME
    behind = np.rint(error[:, 0] / rig.position_matrix[0, 0])
    rows["position"][before + 1 :, 0] = counts[before:-1] - behind
    return rows


def judged(rig, usual, rows, cuts=()):
    """The first row and the words of what the watch says, the rows coming in blocks."""
    watch = FollowingWatch(rig, SentAhead(np.zeros((CYCLES, 1), np.int16), np.array([WITHIN]), usual))
    edges = sorted({0, len(rows), *(cut % (len(rows) + 1) for cut in cuts)})
    for start, end in itertools.pairwise(edges):
        block = rows[start:end]
        position = joint_positions(
            block["position"], block["valid"], rig.position_matrix, rig.position_offset
        )
        for excess in watch.check(block, position):
            return start + excess.row, excess.words
    return None


def by_hand(rig, usual, error):
    """The cycle of the plan in which either sum passes what is tolerated, added up one by one."""
    resolution = rig.position_matrix[0, 0]
    live = range(round(RAMP / rig.cycle), CYCLES - round(RAMP / rig.cycle))
    mean = np.mean(usual[list(live), 0] ** 2) + resolution**2
    excess = turned = 0.0
    for place in live:
        now, then = error[place, 0], usual[place, 0]
        excess = max(0.0, excess + rig.cycle * (now**2 - CLEARLY * then**2 - resolution**2))
        turned = max(0.0, turned + rig.cycle * (now**2 - (now + then) ** 2 - resolution**2))
        if excess > TOLERATED * mean or turned > TURNED * mean:
            return place
    return None


@settings(max_examples=30, deadline=None)
@given(
    factor=st.floats(-3.0, 3.0),
    begin=st.integers(0, CYCLES - 1),
    cuts=st.lists(st.integers(0, 5000), max_size=8),
)
def test_what_is_added_up_does_not_depend_on_how_the_rows_come_in(rig, usual, factor, begin, cuts):
    error = np.where(np.arange(CYCLES)[:, None] < begin, usual, factor * usual)
    resolution = rig.position_matrix[0, 0]
    rounded = np.rint(error / resolution) * resolution
    found = judged(rig, usual, driven(rig, error), cuts)
    expected = by_hand(rig, usual, rounded)
    if found is None or expected is None:
        assert found is expected
    else:
        # the error of a cycle shows in the position of the next
        assert found[0] == 7 + expected + 1


@pytest.mark.parametrize(
    ("wrong", "latest"),
    [
        (lambda usual: 2.0 * usual, 0.8),
        (lambda usual: np.where(usual > 0, 2.0 * usual, 0.2 * usual), 2.5),
        (lambda usual: np.where(usual < 0, -2.0 * usual, 0.2 * usual), 2.5),
        (lambda usual: usual + 3e-4, 0.8),
    ],
    ids=["wrong sign", "wrong forward", "wrong backward", "another payload"],
)
def test_torque_that_makes_an_axis_follow_worse_ends_the_motion_soon(rig, usual, wrong, latest):
    """Seconds after it was faded in; in all of them the error stays below twice the peak without torque, or close to it."""
    row, words = judged(rig, usual, driven(rig, wrong(usual)))
    assert (row - 8) * rig.cycle - RAMP < latest
    # torque of thrice what is needed both turns the error round and doubles it
    assert "follow worse" in words or "turned the following error round" in words
    assert "without the torque" in words


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("share", [0.1, 1.0, 1.2])
def test_torque_that_helps_or_does_little_is_never_stopped_by_noise(rig, usual, seed, share):
    """Measurement noise as large as the error itself, of both drives."""
    random = np.random.default_rng(seed)
    first, second = random.normal(0.0, 1.5e-4, (2, CYCLES, 1))
    assert judged(rig, usual + first, driven(rig, share * usual + second)) is None


@pytest.mark.parametrize("size", [0.8, 1.0, 1.1])
def test_torque_of_about_twice_what_is_needed_turns_the_error_round_and_ends_the_motion(rig, usual, size):
    """No error is larger than without torque."""
    row, words = judged(rig, usual, driven(rig, -size * usual))
    assert (row - 8) * rig.cycle - RAMP < 4.5
    assert "feedforward torque is too large: it turned the following error round" in words


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("left", [0.3, 0.0, -0.3])
def test_what_a_right_model_leaves_is_not_taken_for_an_error_turned_round(rig, usual, left, seed):
    """A third of the torque too little or too much, and noise of the size of the error."""
    noise = np.random.default_rng(seed).normal(0.0, 1.5e-4, (CYCLES, 1))
    assert judged(rig, usual, driven(rig, left * usual + noise)) is None


def test_the_fading_a_single_count_and_positions_that_did_not_come_are_no_harm(rig, usual):
    faded = np.arange(CYCLES) < round(RAMP / rig.cycle)
    assert judged(rig, usual, driven(rig, np.where(faded[:, None], 5.0 * usual, 0.5 * usual))) is None
    resting = np.zeros_like(usual)
    count = np.full_like(usual, rig.position_matrix[0, 0])
    assert judged(rig, resting, driven(rig, count)) is None
    assert judged(rig, resting, driven(rig, 5.0 * count)) is not None
    rows = driven(rig, 5.0 * usual)
    rows["valid"][500:] = COMMAND_CAME
    rows["valid"][: 7 + round(RAMP / rig.cycle)] = COMMAND_CAME
    assert judged(rig, usual, rows[:260]) is None
    assert judged(rig, np.full_like(usual, np.nan), rows) is None


def test_the_bound_in_one_cycle_holds_while_the_torque_is_faded_in_too(rig, usual):
    error = 0.5 * usual
    error[20] = 1.1 * WITHIN
    row, words = judged(rig, usual, driven(rig, error))
    assert row == 7 + 20 + 1
    assert "following error grows" in words
