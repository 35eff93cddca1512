"""The sequence of a motion, told by rows made for the purpose what a drive says; no drive moves."""

from __future__ import annotations

import numpy as np
import pytest

from daq.motion_sequence import MotionSequence, Step
from daq.rig import Rig
from daq.safety import StopCause, StopReason
from daq.samples import POSITION_CAME, Phase, sample_dtype
from drivers.cia402 import State

WORD = {state: state.value[1] for state in State}
"""a statusword of each state"""
ENABLED = State.OPERATION_ENABLED
OPERATOR = StopReason(StopCause.OPERATOR, "stopped")


class Setpoints:
    """Where targets and controlwords go; keeps what was asked."""

    def __init__(self) -> None:
        self.commands: list[list[int]] = []
        self.held: list[int] = []
        self.stops: list[Phase | None] = []
        self.followed: list[object] = []
        self.at_end = False

    def command(self, words: list[int]) -> None:
        self.commands.append(list(words))

    def hold(self, targets: list[int]) -> None:
        self.held = list(targets)

    def stop(self, phase: Phase | None = None) -> None:
        self.stops.append(phase)

    def follow(self, trajectory: object) -> None:
        self.followed.append(trajectory)


class SequenceWithDrive:
    """A sequence and a drive that says what the test has it say."""

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        self.setpoints = Setpoints()
        self.asked_for: list[list[int]] = []
        self.sequence = MotionSequence(rig, self.setpoints, self.trajectory)  # type: ignore[arg-type]
        self.sequence.begin()

    def trajectory(self, targets: np.ndarray) -> str:
        self.asked_for.append(targets.tolist())
        return "the plan"

    def says(
        self,
        state: State | int,
        counts: float = 500,
        count: int = 1,
        phase: Phase = Phase.STANDSTILL,
        came=True,
    ) -> Step:
        rows = np.zeros(count, sample_dtype(1))
        rows["status"] = WORD[state] if isinstance(state, State) else state
        rows["position"][:, 0] = counts
        rows["phase"] = phase
        rows["valid"] = POSITION_CAME if came else 0
        self.sequence.remember(rows)
        self.sequence.take(rows)
        return self.sequence.step

    def rows(self, seconds: float) -> int:
        """How many rows take so long, rounded up."""
        return int(np.ceil(seconds / self.rig.cycle - 1e-9))

    def to(self, step: Step) -> SequenceWithDrive:
        """Go on until a step is reached, all being well."""
        if self.sequence.step is Step.ENABLING and step is not Step.ENABLING:
            assert self.says(ENABLED) is Step.HOLDING
        if self.sequence.step is Step.HOLDING and step is not Step.HOLDING:
            assert self.says(ENABLED, count=self.rows(0.3)) is Step.MOVING
        if self.sequence.step is Step.MOVING and step is not Step.MOVING:
            self.setpoints.at_end = True
            assert self.says(ENABLED) is Step.SETTLING
        assert self.sequence.step is step
        return self


@pytest.fixture
def drive(rig: Rig) -> SequenceWithDrive:
    return SequenceWithDrive(rig)


@pytest.mark.parametrize(
    ("state", "command"),
    [
        (State.SWITCH_ON_DISABLED, 0x06),
        (State.READY_TO_SWITCH_ON, 0x07),
        (State.SWITCHED_ON, 0x0F),
        (State.NOT_READY_TO_SWITCH_ON, 0x0F),
    ],
)
def test_each_state_is_answered_by_the_command_of_the_standard(drive, state, command):
    assert drive.says(state) is Step.ENABLING
    assert drive.setpoints.commands[-1] == [command]


@pytest.mark.parametrize("state", [State.FAULT, State.FAULT_REACTION_ACTIVE])
def test_a_fault_is_not_commanded_away(drive, state):
    assert drive.says(state) is Step.ENABLING
    assert drive.setpoints.commands == []


def test_the_target_goes_with_an_axis_without_power_and_stands_from_the_command_on_that_gives_it_power(drive):
    drive.says(State.READY_TO_SWITCH_ON, 500)
    assert drive.setpoints.held == [500]
    drive.says(State.READY_TO_SWITCH_ON, 480)
    assert drive.setpoints.held == [480]
    drive.says(State.SWITCHED_ON, 470)
    assert drive.setpoints.held == [480]
    assert drive.says(ENABLED, 460) is Step.HOLDING
    assert drive.setpoints.held == [480]
    drive.says(ENABLED, 460, drive.rows(0.3))
    assert drive.asked_for == [[480]]
    assert drive.setpoints.followed == ["the plan"]


def test_nothing_is_commanded_before_the_drive_has_said_anything(drive):
    drive.says(State.SWITCH_ON_DISABLED, came=False)
    assert drive.setpoints.commands == []
    assert drive.setpoints.held == []


def test_power_must_come_within_three_seconds_and_what_lacks_it_is_named(drive):
    assert drive.says(State.SWITCH_ON_DISABLED, count=drive.rows(3.0) - 1) is Step.ENABLING
    assert drive.says(State.SWITCH_ON_DISABLED) is Step.POWERING_OFF
    reason = drive.sequence.reason
    assert reason.cause is StopCause.DRIVE_FAULT
    assert reason.words == "no power within 3 s: joint j3 is in SWITCH ON DISABLED"
    silent = SequenceWithDrive(drive.rig)
    silent.says(State.FAULT, count=silent.rows(3.0), came=False)
    assert silent.sequence.reason.words == "no power within 3 s: joint j3 is silent"
    odd = SequenceWithDrive(drive.rig)
    odd.says(0x0001, count=odd.rows(3.0))
    assert odd.sequence.reason.words == "no power within 3 s: joint j3 is in statusword 0x0001"


def test_an_axis_rests_with_power_for_three_tenths_before_and_after_the_plan(drive):
    drive.to(Step.HOLDING)
    assert drive.says(ENABLED, count=drive.rows(0.3) - 1) is Step.HOLDING
    assert drive.says(ENABLED) is Step.MOVING
    assert drive.sequence.lasted == 0.0
    drive.setpoints.at_end = True
    assert drive.says(ENABLED, phase=Phase.PLAN) is Step.MOVING
    drive.setpoints.at_end = False
    assert drive.says(ENABLED) is Step.MOVING
    drive.to(Step.SETTLING)
    assert drive.says(ENABLED, count=drive.rows(0.3) - 1) is Step.SETTLING
    assert drive.sequence.lasted == pytest.approx((drive.rows(0.3) - 1) * drive.rig.cycle)
    assert drive.says(ENABLED) is Step.POWERING_OFF
    assert drive.sequence.reason.cause is StopCause.PLAN_DONE
    assert drive.setpoints.commands[-1] == [0]
    assert drive.setpoints.stops == [Phase.STANDSTILL]


@pytest.mark.parametrize(
    ("state", "seconds"), [(State.SWITCH_ON_DISABLED, 0.1), (State.FAULT_REACTION_ACTIVE, 0.5)]
)
def test_the_end_waits_for_the_last_controlword_or_for_the_fault_reaction(drive, state, seconds):
    drive.to(Step.SETTLING)
    drive.says(ENABLED, count=drive.rows(0.3))
    assert drive.says(state, count=drive.rows(seconds) - 1) is Step.POWERING_OFF
    assert drive.sequence.moves
    assert drive.says(state) is Step.ENDED
    assert not drive.sequence.moves


def test_after_a_stop_the_end_waits_until_brakes_have_closed(drive):
    drive.to(Step.MOVING)
    drive.sequence.stop(OPERATOR)
    drive.says(State.QUICK_STOP_ACTIVE, count=drive.rows(0.1))
    assert drive.says(State.QUICK_STOP_ACTIVE) is Step.POWERING_OFF
    assert drive.says(State.SWITCH_ON_DISABLED, count=drive.rows(0.5) - 1) is Step.POWERING_OFF
    assert drive.says(State.SWITCH_ON_DISABLED) is Step.ENDED


def test_an_axis_that_nobody_sees_is_cut_and_its_rest_is_not_believed(drive):
    drive.to(Step.MOVING)
    drive.sequence.stop(StopReason(StopCause.LIMIT, "its position stands", unseen="j3"))
    assert drive.sequence.step is Step.CUT
    assert drive.sequence.cut_because == "nobody can see whether joint j3 stops"
    assert drive.setpoints.commands[-1] == [0]
    assert drive.says(State.SWITCH_ON_DISABLED, count=drive.rows(1.0)) is Step.CUT
    assert drive.sequence.rest_seen is None


def test_the_first_reason_counts_and_rest_ends_the_stop(drive):
    drive.to(Step.MOVING)
    drive.sequence.stop(OPERATOR)
    drive.sequence.stop(StopReason(StopCause.BUS, "later"))
    assert drive.sequence.reason is OPERATOR
    assert drive.setpoints.commands[-1] == [0x02]
    assert drive.sequence.step is Step.STOPPING
    # the rows of the same turn came before the stop, and say nothing of it
    window = drive.rows(0.1)
    assert drive.says(State.QUICK_STOP_ACTIVE, count=window) is Step.STOPPING
    assert drive.sequence.rest_seen is None
    assert drive.says(State.QUICK_STOP_ACTIVE) is Step.POWERING_OFF
    assert drive.sequence.rest_seen is True


def test_without_power_a_stop_takes_none(drive):
    drive.says(State.READY_TO_SWITCH_ON)
    drive.sequence.stop(OPERATOR)
    assert drive.sequence.step is Step.POWERING_OFF
    assert drive.setpoints.commands[-1] == [0]
    begun = SequenceWithDrive(drive.rig)
    begun.says(State.QUICK_STOP_ACTIVE)
    begun.sequence.stop(OPERATOR)
    assert begun.sequence.step is Step.STOPPING


def test_a_cut_takes_the_power_once_and_says_whether_rest_was_seen(drive):
    drive.to(Step.MOVING)
    drive.sequence.cut("no deceleration")
    drive.sequence.cut("later")
    assert drive.sequence.cut_because == "no deceleration"
    assert drive.sequence.step is Step.CUT
    assert drive.setpoints.commands[-1] == [0]
    window = drive.rows(0.1)
    drive.says(State.SWITCH_ON_DISABLED, count=window)
    assert drive.says(State.SWITCH_ON_DISABLED) is Step.ENDED
    assert drive.sequence.rest_seen is True


@pytest.mark.parametrize(("came", "seen"), [(True, False), (False, None)])
def test_an_axis_that_coasts_is_waited_for_as_long_as_a_stop_may_take(drive, came, seen):
    drive.to(Step.MOVING)
    drive.sequence.cut("no deceleration")
    drive.says(State.SWITCH_ON_DISABLED)
    timeout = drive.rows(drive.rig.supervision.stop_timeout)
    moving = 1000.0 * np.arange(timeout)
    assert drive.says(State.SWITCH_ON_DISABLED, moving[:-1], timeout - 1, came=came) is Step.CUT
    assert drive.says(State.SWITCH_ON_DISABLED, moving[-1], came=came) is Step.ENDED
    assert drive.sequence.rest_seen is seen


def test_at_standby_there_is_nothing_to_cut_and_a_stop_is_an_end(rig):
    standing = SequenceWithDrive(rig)
    standing.sequence = MotionSequence(rig, standing.setpoints, standing.trajectory)  # type: ignore[arg-type]
    assert not standing.sequence.moves
    standing.sequence.cut("nothing")
    assert standing.sequence.cut_because == ""
    assert standing.says(ENABLED) is Step.STANDBY
    standing.sequence.stop(OPERATOR)
    assert standing.sequence.step is Step.POWERING_OFF
    standing.sequence.begin()
    assert standing.sequence.step is Step.POWERING_OFF
    standing.sequence.give_up()
    assert standing.sequence.step is Step.ENDED


def test_an_axis_is_silent_when_its_newest_samples_hold_no_position(drive):
    few = max(5, round(drive.rig.supervision.silence / drive.rig.cycle))
    drive.says(ENABLED, count=few)
    assert not drive.sequence.silent
    drive.says(ENABLED, count=few - 1, came=False)
    assert not drive.sequence.silent
    drive.says(ENABLED, came=False)
    assert drive.sequence.silent
