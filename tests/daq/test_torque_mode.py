"""The sequence around a plan in cyclic torque mode: who holds the axes at each step, and what is asked of the drives when."""

from __future__ import annotations

import numpy as np
import pytest

from daq.motion_sequence import MotionSequence, Step
from daq.rig import Rig
from daq.safety import StopCause
from daq.samples import POSITION_CAME, Phase, sample_dtype
from daq.setpoint_stream import Trajectory
from daq.torque_mode import TorqueMode
from drivers.cia402 import Mode, State
from drivers.errors import DriveError

ENABLED, DISABLED = State.OPERATION_ENABLED.value[1], State.SWITCH_ON_DISABLED.value[1]


class Drives:
    """Takes modes, unless it is told to refuse one."""

    def __init__(self, story: list[object]) -> None:
        self.story = story
        self.refused: Mode | None = None

    def set_mode(self, mode: Mode | None) -> None:
        if mode is not None and mode is self.refused:
            raise DriveError(3, "switching the mode", received="8 came")
        self.story.append("own mode" if mode is None else int(mode))

    def end_setpoint_watch(self) -> None:
        self.story.append("no watch")


class Setpoints:
    """Follows each trajectory at once, and tells what was asked of it."""

    def __init__(self, story: list[object]) -> None:
        self.story = story
        self.at_end = True

    def engage(self, torques: list[float]) -> None:
        self.story.append(("engage", [round(each) for each in torques]))

    def release(self) -> None:
        self.story.append("release")

    def hold(self, targets: list[int]) -> None:
        if self.story[-1:] != [("hold", targets)]:
            self.story.append(("hold", targets))

    def follow(self, trajectory: Trajectory) -> None:
        self.story.append(
            ("follow", [int(phase) for phase in trajectory.phase], trajectory.torque_offset is not None)
        )

    def command(self, words: list[int]) -> None:
        if self.story[-1:] != [("command", words[0])]:
            self.story.append(("command", words[0]))

    def stop(self, phase: Phase | None = None) -> None:
        self.story.append(("stop", phase))


class Driven:
    """A sequence with one axis that stands where it is told."""

    def __init__(self) -> None:
        self.rig = Rig.load("rx130l-joint3-simulated")
        self.story: list[object] = []
        self.drives = Drives(self.story)
        setpoints = Setpoints(self.story)
        mode = TorqueMode(self.rig, self.drives, setpoints)  # type: ignore[arg-type]
        self.sequence = MotionSequence(self.rig, setpoints, self.trajectory, mode)  # type: ignore[arg-type]
        self.sequence.begin()
        self.position = 5000
        self.cycle = 0

    def trajectory(self, held: np.ndarray) -> Trajectory:
        counts = held + np.arange(4, dtype=np.int32)[:, None]
        phase = np.array([Phase.APPROACH, Phase.APPROACH, Phase.PLAN, Phase.PLAN], np.uint8)
        return Trajectory(counts, phase, np.ones((4, 1), np.int16))

    def run(self, cycles: int, status: int = ENABLED, speed: int = 0) -> None:
        for _ in range(cycles):
            row = np.zeros(1, sample_dtype(1))
            row["cycle"], row["valid"], row["status"] = self.cycle, POSITION_CAME, status
            row["position"], row["command"] = self.position, 1234
            self.position += speed
            self.cycle += 1
            self.sequence.remember(row)
            self.sequence.take(row)

    def until(self, step: Step) -> None:
        for _ in range(400):
            self.run(1)
            if self.sequence.step is step:
                return
        raise AssertionError(f"{step} was not reached; it is {self.sequence.step}")

    def told(self) -> list[object]:
        said, self.story[:] = list(self.story), []
        return said


@pytest.fixture
def driven() -> Driven:
    return Driven()


def test_torque_mode_lasts_from_rest_at_the_plan_s_begin_to_rest_after_it(driven):
    driven.until(Step.HOLDING)
    driven.told()
    driven.until(Step.MOVING)
    assert driven.told() == [("follow", [Phase.APPROACH] * 3, False)]
    driven.until(Step.TAKING_OVER)
    # the loop begins with the torque that holds the axis now, the target being where it is; and only then the mode
    assert driven.told() == [("hold", [5000]), ("engage", [1234])]
    driven.until(Step.SETTLING)
    assert driven.told() == [10]
    driven.until(Step.MOVING)
    assert driven.told() == [("follow", [Phase.PLAN] * 2, True)]
    driven.until(Step.HANDING_BACK)
    assert driven.told() == [("hold", [5000])]
    driven.until(Step.SETTLING)
    assert driven.told() == ["own mode", "release", "no watch"]
    driven.until(Step.POWERING_OFF)
    assert driven.sequence.reason.cause is StopCause.PLAN_DONE


def test_the_mode_is_not_changed_while_an_axis_moves(driven):
    driven.run(160)
    driven.told()
    driven.run(1000, speed=400)
    assert driven.told() == []
    driven.run(200)
    assert ("engage", [1234]) in driven.told()


def test_an_axis_that_never_rests_is_stopped_in_position_mode(driven):
    driven.run(160)
    driven.told()
    driven.run(2700, speed=400)
    assert driven.sequence.reason.cause is StopCause.DRIVE_FAULT
    assert "do not rest" in driven.sequence.reason.words
    assert 10 not in driven.told()


def test_a_drive_that_does_not_take_the_mode_is_stopped_before_the_plan(driven):
    driven.drives.refused = Mode.CYCLIC_SYNCHRONOUS_TORQUE
    driven.run(340)
    assert driven.sequence.step is Step.STOPPING
    assert driven.sequence.reason.words.endswith("8 came")
    assert not [each for each in driven.told() if each == ("follow", [Phase.PLAN] * 2, True)]
