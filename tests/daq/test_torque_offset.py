"""What goes to the drives in each cycle, feedforward torque with it."""

import struct

import numpy as np
import pytest

from daq.samples import Phase
from daq.setpoint_stream import SetpointStream, Trajectory
from drivers.process_data import TORQUE_OFFSET, DriveStream, MappedEntry, ProcessData, lay_out

SETPOINT = struct.Struct("<Hih")


def stream_of(node):
    entries = lay_out(
        [
            MappedEntry("controlword", 0x6040, 0, "<u2"),
            MappedEntry("target", 0x607A, 0, "<i4"),
            MappedEntry(TORQUE_OFFSET, 0x60B2, 0, "<i2"),
        ]
    )
    return DriveStream(node, (), ProcessData(0x200 + node, 1, entries))


@pytest.fixture
def sent():
    return []


@pytest.fixture
def setpoints(sent):
    return SetpointStream(
        [stream_of(1), stream_of(2)], lambda can_id, data: sent.append((can_id, SETPOINT.unpack(data)))
    )


def test_torque_goes_with_its_target_and_is_nought_before_after_and_from_a_stop_on(setpoints, sent):
    counts = np.array([[10, 20], [11, 21], [12, 22]], np.int32)
    torque = np.array([[1, -1], [2, -2], [3, -3]], np.int16)
    setpoints.command([15, 15])
    setpoints.hold([9, 19])
    setpoints.on_cycle(0)
    setpoints.follow(Trajectory(counts, np.full(3, Phase.PLAN, np.uint8), torque))
    for cycle in (1, 2):
        setpoints.on_cycle(cycle)
    setpoints.stop()
    setpoints.on_cycle(3)
    assert sent == [
        (0x201, (15, 9, 0)),
        (0x202, (15, 19, 0)),
        (0x201, (15, 10, 1)),
        (0x202, (15, 20, -1)),
        (0x201, (15, 11, 2)),
        (0x202, (15, 21, -2)),
        (0x201, (15, 11, 0)),
        (0x202, (15, 21, 0)),
    ]
    told, phases = setpoints.told(np.array([2, 3, 4]))
    assert told.tolist() == [[10, 20], [11, 21], [11, 21]]
    assert phases.tolist() == [Phase.PLAN, Phase.PLAN, Phase.STOPPING]


def test_at_the_end_of_a_trajectory_and_in_a_cut_no_torque_is_left(setpoints, sent):
    counts, torque = np.array([[10, 20]], np.int32), np.array([[5, 6]], np.int16)
    setpoints.follow(Trajectory(counts, np.full(1, Phase.PLAN, np.uint8), torque))
    for cycle in (0, 1):
        setpoints.on_cycle(cycle)
    setpoints.cut()
    assert [values[2] for _, values in sent] == [5, 6, 0, 0, 0, 0]
    assert setpoints.at_end
