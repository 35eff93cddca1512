"""What is sent in each cycle, and what took effect in which."""

from types import SimpleNamespace

import numpy as np
import pytest

from daq.samples import Phase
from daq.setpoint_stream import SetpointStream, Trajectory


class Sent:
    """Two drives whose frames are (controlword, target) pairs that can be read."""

    def __init__(self) -> None:
        self.frames: list[tuple[int, int, int]] = []
        drives = [
            SimpleNamespace(
                receive=SimpleNamespace(can_id=0x200 + node),
                packed=lambda word, target: (word, target),
                torque_entry=None,
            )
            for node in (5, 6)
        ]
        self.stream = SetpointStream(drives, lambda can_id, data: self.frames.append((can_id, *data)))

    def cycle(self, cycle: int) -> list[tuple[int, int, int]]:
        self.frames.clear()
        self.stream.on_cycle(cycle)
        return list(self.frames)


@pytest.fixture
def sent() -> Sent:
    return Sent()


def ramp(length: int) -> Trajectory:
    counts = np.column_stack([np.arange(length), -np.arange(length)]).astype(np.int32)
    return Trajectory(counts, np.full(length, Phase.PLAN, np.uint8))


def test_nothing_is_sent_before_there_is_a_target(sent):
    assert sent.cycle(0) == []
    assert sent.stream.cycle == 0
    assert sent.stream.length == 0
    assert not sent.stream.at_end


def test_held_targets_go_to_each_drive_under_its_own_id_and_controlword(sent):
    sent.stream.hold([7, -8])
    sent.stream.command([0x06, 0x0F])
    assert sent.cycle(3) == [(0x205, 0x06, 7), (0x206, 0x0F, -8)]


def test_a_trajectory_is_sent_cycle_by_cycle_and_its_end_held_as_standstill(sent):
    sent.stream.hold([9, 9])
    sent.cycle(9)
    sent.stream.follow(ramp(3))
    targets = [[target for _, _, target in sent.cycle(cycle)] for cycle in range(10, 15)]
    assert targets == [[0, 0], [1, -1], [2, -2], [2, -2], [2, -2]]
    # what was sent in cycle k takes effect in cycle k + 1
    setpoints, phases = sent.stream.told(np.arange(10, 16))
    assert setpoints[:, 0].tolist() == [9, 0, 1, 2, 2, 2]
    assert phases.tolist() == [
        Phase.STANDSTILL,
        Phase.PLAN,
        Phase.PLAN,
        Phase.PLAN,
        Phase.STANDSTILL,
        Phase.STANDSTILL,
    ]


def test_how_far_a_trajectory_was_sent_is_counted_to_its_end(sent):
    sent.stream.follow(ramp(3))
    assert (sent.stream.length, sent.stream.done) == (3, 0)
    progress = []
    for cycle in range(4):
        sent.cycle(cycle)
        progress.append((sent.stream.done, sent.stream.at_end))
    assert progress == [(1, False), (2, False), (3, True), (3, True)]
    sent.stream.follow(ramp(2))
    assert (sent.stream.done, sent.stream.at_end) == (0, False)


def test_a_cycle_that_was_missed_is_not_made_up_for(sent):
    """The target belongs to the time: after a stall the motion goes on where it should be by now."""
    sent.stream.follow(ramp(10))
    sent.cycle(0)
    assert [target for _, _, target in sent.cycle(4)] == [4, -4]


def test_a_stop_holds_the_last_target_and_marks_the_cycles(sent):
    sent.stream.follow(ramp(10))
    sent.cycle(0)
    sent.cycle(1)
    sent.stream.stop()
    assert [target for _, _, target in sent.cycle(2)] == [1, -1]
    assert sent.stream.told(np.array([3]))[1].tolist() == [Phase.STOPPING]
    assert not sent.stream.at_end


def test_a_cut_says_disable_voltage_at_once_and_from_then_on(sent):
    sent.stream.command([0x0F, 0x0F])
    sent.stream.cut()
    assert sent.frames == [(0x205, 0, 0), (0x206, 0, 0)]
    sent.stream.hold([4, 5])
    sent.frames.clear()
    sent.stream.cut()
    assert sent.frames == [(0x205, 0, 4), (0x206, 0, 5)]
    assert sent.cycle(1) == [(0x205, 0, 4), (0x206, 0, 5)]


def test_setpoints_are_remembered_for_thousands_of_cycles(sent):
    for cycle in range(16_000):
        sent.stream.hold([cycle, 0])
        sent.stream.on_cycle(cycle)
    setpoints, _ = sent.stream.told(np.array([1, 8_000, 16_000]))
    assert setpoints[:, 0].tolist() == [0, 7_999, 15_999]
