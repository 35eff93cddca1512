"""The torque that goes out in each cycle, by positions that the test hands in."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from daq.safety import StopCause
from daq.samples import Phase
from daq.setpoint_stream import Trajectory
from daq.torque_loop import TorqueLoop
from daq.torque_stream import TorqueSetpoints
from drivers.cia402 import Command
from drivers.process_data import TARGET_TORQUE, DriveStream, MappedEntry, ProcessData, lay_out

SETPOINT = struct.Struct("<Hih")
LATE = 3


class Axis:
    """One drive whose positions are told by the test; what it was sent last."""

    def __init__(self) -> None:
        entries = lay_out(
            [
                MappedEntry("controlword", 0x6040, 0, "<u2"),
                MappedEntry("target", 0x607A, 0, "<i4"),
                MappedEntry(TARGET_TORQUE, 0x6071, 0, "<i2"),
            ]
        )
        stream = DriveStream(5, (), ProcessData(0x205, 1, entries))
        one = np.array([1.0])
        loop = TorqueLoop(2.0 * one, 0.0 * one, 0.0 * one, np.array([900]), one)
        self.position: list[int] | None = [0]
        self.sent: list[tuple[int, int, int]] = []
        self.setpoints = TorqueSetpoints(
            [stream], lambda _, data: self.sent.append(SETPOINT.unpack(data)), loop, self, 0.002, LATE
        )
        self.setpoints.command([Command.ENABLE_OPERATION])
        self.count = 0

    def take(self) -> list[int] | None:
        return self.position

    def cycle(self, position: int | None = None) -> tuple[int, int, int]:
        self.position = None if position is None else [position]
        self.setpoints.on_cycle(self.count)
        self.count += 1
        return self.sent[-1]


@pytest.fixture
def axis():
    return Axis()


def test_no_torque_is_sent_until_the_loop_is_engaged_which_begins_with_what_holds_the_axis(axis):
    axis.setpoints.hold([100])
    assert axis.cycle(90) == (0x0F, 100, 0)
    axis.setpoints.engage([37.0])
    assert axis.cycle(100) == (0x0F, 100, 37)
    assert axis.cycle(99) == (0x0F, 100, 39)
    axis.setpoints.release()
    assert axis.cycle(50) == (0x0F, 100, 0)


def test_a_position_is_held_against_the_target_that_was_to_be_reached_by_then_and_torque_is_added(axis):
    axis.setpoints.hold([0])
    axis.setpoints.engage([0.0])
    axis.cycle(0)
    counts = np.array([[10], [20], [30], [40]], np.int32)
    ahead = np.array([[1], [2], [3], [4]], np.int16)
    axis.setpoints.follow(Trajectory(counts, np.full(4, Phase.PLAN, np.uint8), ahead))
    # target 10 goes out in the first cycle, takes effect at the next SYNC, is reached at the one after; the first torque is
    # given by the integral, which held the axis before
    assert [axis.cycle(0)[2], axis.cycle(0)[2], axis.cycle(0)[2]] == [0, 1, 2 * 10 + 2]
    assert axis.cycle(20) == (0x0F, 40, 3)
    # and at the end it takes the torque over
    assert axis.cycle(30) == (0x0F, 40, 3)


def test_targets_for_the_drives_to_hold_again_are_no_jump_for_the_loop_that_still_holds_the_axis(axis):
    axis.setpoints.hold([0])
    axis.setpoints.engage([50.0])
    axis.setpoints.follow(Trajectory(np.full((2, 1), 100, np.int32), np.full(2, Phase.PLAN, np.uint8)))
    for _ in range(5):
        axis.cycle(70)
    before = axis.cycle(70)
    assert before == (0x0F, 100, 50 + 2 * 30)
    axis.setpoints.hold([70])  # where the axis is: the drives' own loops begin there
    assert [axis.cycle(70) for _ in range(3)] == [(0x0F, 70, 110)] * 3


def test_from_a_stop_on_an_axis_is_braked_where_it_is_and_a_cut_leaves_no_torque(axis):
    axis.setpoints.hold([0])
    axis.setpoints.engage([50.0])
    axis.cycle(0)
    axis.setpoints.follow(Trajectory(np.full((9, 1), 1000, np.int32), np.full(9, Phase.PLAN, np.uint8)))
    axis.cycle(0), axis.cycle(0)
    axis.setpoints.stop()
    axis.setpoints.command([Command.QUICK_STOP])
    assert axis.cycle(300) == (0x02, 1000, 50)
    assert axis.cycle(310)[2] == 50 - 2 * 10
    axis.setpoints.cut()
    assert axis.sent[-1] == (0, 1000, 0)
    assert axis.cycle(400)[2] == 0


def test_positions_that_stay_away_stop_the_axis_from_here_after_a_stated_number_of_cycles(axis):
    axis.setpoints.hold([100])
    axis.setpoints.engage([5.0])
    axis.cycle(98)
    for _ in range(LATE):
        assert axis.cycle(None)[0] == Command.ENABLE_OPERATION
    assert axis.cycle(98)[0] == Command.ENABLE_OPERATION  # it came again: counted anew
    assert axis.setpoints.trouble is None
    for _ in range(LATE + 1):
        axis.cycle(None)
    assert axis.setpoints.trouble is not None
    assert axis.setpoints.trouble.cause is StopCause.LOST_FRAMES
    assert axis.cycle(None)[0] == Command.QUICK_STOP
    assert axis.setpoints.late == 2 * LATE + 2
