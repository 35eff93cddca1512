"""The process data of a drive that is not asked, against CiA 301's predefined connection set and CiA 402's objects."""

import pytest

from drivers.cia402 import Mode
from drivers.profile import load_profile
from drivers.standard_stream import standard_stream, transmitted_entries

PROFILE = load_profile("generic-cia402")


def objects(entries):
    return [(entry.index, entry.subindex) for entry in entries]


def test_a_drive_sends_position_command_and_statusword_in_that_order():
    listed = objects(transmitted_entries(PROFILE, temperature=False))
    assert listed == [(0x6064, 0), (0x6074, 0), (0x6041, 0)]


@pytest.mark.parametrize(
    ("mode", "target"),
    [
        (Mode.CYCLIC_SYNCHRONOUS_POSITION, (0x607A, 0)),
        (Mode.CYCLIC_SYNCHRONOUS_VELOCITY, (0x60FF, 0)),
        (Mode.CYCLIC_SYNCHRONOUS_TORQUE, (0x6071, 0)),
        (Mode.INTERPOLATED_POSITION, (0x60C1, 1)),
    ],
)
def test_each_mode_is_given_its_own_target_beside_the_controlword(mode, target):
    stream = standard_stream(5, PROFILE, mode)
    assert stream.node == 5
    assert stream.transmit[0].can_id == 0x185
    assert stream.receive.can_id == 0x205
    assert objects(stream.receive.entries) == [(0x6040, 0), target]
