"""A part of the matrix of `make faults`: the cells in which an earlier version failed, and one of each kind."""

import pytest

from tests.faults.matrix import FAULTS, Fault, cell

BY_NAME = {fault.name: fault for fault in FAULTS}
CELLS = [
    ("EMCY 0x4310", "enabled"),
    ("EMCY 0x8611", "stopping"),
    ("feedback flips its sign", "stopping"),
    ("drive runs away, ignores controlwords", "stopping"),
    ("node freezes", "slow"),
    ("node in NMT STOPPED", "enabled"),
    ("all TPDOs lost", "fast"),
    ("50 SYNCs of another master", "slow"),
    ("setpoints of another master", "stopping"),
    ("NMT reset of another master", "fast"),
    ("node in NMT STOPPED", "before"),
    ("parent dies", "fast"),
    ("recorder dies", "checked"),
    ("operator stops and the parent dies", "slow"),
    ("wall clock steps a day back", "fast"),
]


@pytest.mark.parametrize(("fault", "phase"), CELLS)
def test_the_axis_is_safe_or_a_person_is_told(fault, phase):
    assert cell(BY_NAME[fault], phase).failures == []


def test_a_cell_that_does_not_hold_is_seen():
    """The judge itself: a fault that is said to stop the motion and is none."""
    assert cell(Fault("none", (("keep-mode", 1),)), "fast").failures == ["the plan went on"]
