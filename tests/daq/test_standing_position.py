"""A position that stands to the count while its setpoint goes on, in blocks of any size."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from daq.rig import Rig
from daq.safety import LimitMonitor, StopCause
from daq.samples import POSITION_CAME, Phase, sample_dtype
from daq.standing_position import FEWEST, SHARE, StandingPosition

SPEED = 40
"""counts in a cycle"""


def rows_of(position, setpoint, axes=1) -> np.ndarray:
    rows = np.zeros(len(position), sample_dtype(axes))
    rows["position"], rows["setpoint"] = np.reshape(position, (-1, axes)), np.reshape(setpoint, (-1, axes))
    rows["cycle"] = np.arange(len(rows))
    rows["phase"] = Phase.PLAN
    rows["valid"] = POSITION_CAME
    return rows


def seen(rig, rows, cuts=(), came=None, following=None):
    """Row of the whole, and what is said; None where nothing is."""
    came = np.ones(rows["position"].shape, bool) if came is None else came
    following = np.ones(len(rows), bool) if following is None else following
    watch = StandingPosition(rig)
    edges = sorted({0, len(rows), *(cut % (len(rows) + 1) for cut in cuts)})
    for start, end in itertools.pairwise(edges):
        part = slice(start, end)
        excess = watch.check(rows[part], came[part], following[part])
        if excess is not None:
            return start + excess.row, excess.axis, excess.words
    return None


@pytest.fixture(scope="module")
def most(rig):
    """Counts that the setpoint may go on."""
    return SHARE * rig.axes[0].limits.following_error / abs(rig.position_matrix[0, 0])


@settings(max_examples=60, deadline=None)
@given(stops=st.integers(1, 200), cuts=st.lists(st.integers(0, 900), max_size=8))
def test_it_is_seen_once_the_setpoint_has_gone_on_by_its_share(rig, most, stops, cuts):
    setpoint = SPEED * np.arange(1000)
    position = np.minimum(setpoint, SPEED * stops) - 7
    row, axis, words = seen(rig, rows_of(position, setpoint), cuts)
    assert row == stops + int(most // SPEED) + 1
    assert axis == 0
    assert f"stands at {SPEED * stops - 7} counts" in words


def test_an_axis_that_moves_by_one_count_now_and_then_is_held_and_seen(rig, most):
    setpoint = SPEED * np.arange(4000)
    every = int(most // SPEED)  # as late as it may
    assert seen(rig, rows_of(np.arange(4000) // every, setpoint)) is None
    assert seen(rig, rows_of(np.arange(4000) // (every + 3), setpoint)) is not None


def test_a_setpoint_that_stands_too_or_comes_back_says_nothing(rig, most):
    still = np.full(3000, 12)
    assert seen(rig, rows_of(still, still)) is None
    there_and_back = 0.9 * most * np.sin(np.arange(3000) / 100.0)
    assert seen(rig, rows_of(still, there_and_back)) is None


def test_what_does_not_follow_or_did_not_come_does_not_stand(rig, most):
    cycles = 3 * int(most // SPEED)
    rows = rows_of(np.zeros(cycles), SPEED * np.arange(cycles))
    assert seen(rig, rows) is not None
    assert seen(rig, rows, following=np.zeros(cycles, bool)) is None
    assert seen(rig, rows, came=np.zeros((cycles, 1), bool)) is None


def test_a_coarse_encoder_may_stand_for_some_counts(rig):
    coarse = rig.model_copy(update={"axes": (rig.axes[0].model_copy(update={"encoder_counts": 4}),)})
    setpoint = np.arange(2 * FEWEST)
    row, _, _ = seen(coarse, rows_of(np.zeros(2 * FEWEST), setpoint))
    assert row == FEWEST + 1


def test_of_motors_that_share_joints_the_drive_that_stands_is_named():
    wrist = Rig.load("tx40-simulated")
    setpoint = 400 * np.arange(2000)[:, None] * np.ones(6, int)
    position = setpoint.copy()
    position[100:, 5] = position[100, 5]
    _, axis, _ = seen(wrist, rows_of(position, setpoint, 6))
    assert axis == 5


def test_a_session_is_stopped_by_it(rig, most):
    """Far below the limit of the following error, and with the joint's name."""
    setpoint = SPEED * np.arange(1000)
    rows = rows_of(np.minimum(setpoint, 400), setpoint)
    rows["status"] = 0x1237
    rows["sync_time"] = np.rint(rows["cycle"] * rig.cycle * 1e9)
    reason = LimitMonitor(rig).check(rows[: int(most // SPEED) + 13])
    assert reason is not None
    assert reason.cause is StopCause.LIMIT
    assert reason.words.startswith("joint j3: its position stands at 400 counts")
