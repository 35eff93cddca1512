"""A position that stands to the count while its setpoint goes on, in blocks of any size."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from daq.rig import Rig
from daq.safety import LimitMonitor, StopCause
from daq.samples import COMMAND_CAME, POSITION_CAME, Phase, sample_dtype
from daq.standing_position import ALL_CURRENT, FEWEST, MOMENT, SHARE, StandingPosition

SPEED = 40
"""counts in a cycle"""


def rows_of(position, setpoint, axes=1) -> np.ndarray:
    rows = np.zeros(len(position), sample_dtype(axes))
    rows["position"], rows["setpoint"] = np.reshape(position, (-1, axes)), np.reshape(setpoint, (-1, axes))
    rows["cycle"] = np.arange(len(rows))
    rows["phase"] = Phase.PLAN
    rows["valid"] = POSITION_CAME
    return rows


def seen(rig, rows, cuts=(), came=None, following=None, held=None, current=None):
    """Row of the whole, and what is said; None where nothing is."""
    came = np.ones(rows["position"].shape, bool) if came is None else came
    following = np.ones(len(rows), bool) if following is None else following
    held = np.zeros(len(rows), bool) if held is None else held
    current = np.zeros(rows["position"].shape) if current is None else current
    watch = StandingPosition(rig)
    edges = sorted({0, len(rows), *(cut % (len(rows) + 1) for cut in cuts)})
    for start, end in itertools.pairwise(edges):
        part = slice(start, end)
        excess = watch.check(rows[part], came[part], following[part], held[part], current[part])
        if excess is not None:
            assert excess.unseen
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


@settings(max_examples=60, deadline=None)
@given(stops=st.integers(1, 200), rises=st.integers(1, 200), cuts=st.lists(st.integers(0, 400), max_size=8))
def test_it_is_seen_once_the_drive_gave_all_its_current_for_a_moment(rig, stops, rises, cuts):
    """Held as well as moved: whichever came last, the position that stands or the current, the moment begins there."""
    rows = rows_of(np.minimum(np.arange(400), stops), np.zeros(400))
    current = np.where(np.arange(400) < rises, 0.0, 1.001 * ALL_CURRENT * rig.axes[0].limits.current)
    held = np.arange(400) % 2 == 0
    row, axis, words = seen(rig, rows, cuts, following=~held, held=held, current=current[:, None])
    assert row == max(stops, rises - 1) + round(MOMENT / rig.cycle)
    assert axis == 0
    assert f"stands at {stops} counts while its drive gave" in words


def test_all_its_current_says_nothing_where_the_axis_moves_or_is_not_held_or_has_a_little_less(rig):
    everything = np.full((400, 1), rig.axes[0].limits.current)
    nobody = np.zeros(400, bool)
    still = rows_of(np.zeros(400), np.zeros(400))
    assert seen(rig, still, following=nobody, held=~nobody, current=everything) is not None
    assert seen(rig, still, following=nobody, held=nobody, current=everything) is None
    assert seen(rig, still, following=nobody, held=~nobody, current=0.99 * ALL_CURRENT * everything) is None
    now_and_then = rows_of(np.arange(400) // (round(MOMENT / rig.cycle) - 1), np.zeros(400))
    assert seen(rig, now_and_then, following=nobody, held=~nobody, current=everything) is None


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
    assert reason.unseen == "j3"


def test_an_axis_that_falls_while_its_drive_holds_what_it_sees_is_stopped_before_the_approach(rig):
    rows = rows_of(np.full(100, 7), np.full(100, 7))
    rows["status"], rows["phase"] = 0x1237, Phase.STANDSTILL
    rows["valid"] |= COMMAND_CAME
    rows["sync_time"] = np.rint(rows["cycle"] * rig.cycle * 1e9)
    rows["command"] = -round(rig.axes[0].limits.current / rig.command_scale[0])
    reason = LimitMonitor(rig).check(rows)
    assert reason is not None
    assert "while its drive gave 18 A, all that it may" in reason.words
    rows["status"] = 0x0250
    assert LimitMonitor(rig).check(rows) is None
