"""Which recordings may serve identification although they were cut off."""

import json
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from daq.admission import Measured, measured
from daq.safety import StopCause
from daq.samples import COMMAND_CAME, POSITION_CAME

GOOD = Measured(lasted=40.0, planned=60.0, moved=35.0, whole=0.99, cause=StopCause.DEAD_PARENT.value)


def test_a_recording_that_the_computer_ended_after_enough_motion_lacks_nothing():
    assert GOOD.lacks == ""
    assert not GOOD.needs_a_person
    assert GOOD.words == "40.0 s of 60.0 s of the plan were measured"


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"moved": 9.9}, "9.9 s of motion are too little, 10.0 s are needed"),
        ({"planned": 12.0, "moved": 5.9}, "5.9 s of motion are too little, 6.0 s are needed"),
        ({"whole": 0.89}, "only 89 % of the rows have an answer of every drive"),
    ],
)
def test_what_a_recording_lacks_is_said_with_what_is_needed(changed, words):
    assert replace(GOOD, **changed).lacks == words


def test_half_of_a_short_plan_is_enough():
    assert replace(GOOD, planned=12.0, moved=6.0, whole=0.9).lacks == ""


COMPUTER = {
    StopCause.DEAD_PARENT,
    StopCause.RECORDER,
    StopCause.FULL_DISK,
    StopCause.INTERNAL,
    StopCause.LOST_FRAMES,
    StopCause.HELD_UP,
}


@pytest.mark.parametrize("cause", sorted(StopCause))
def test_what_the_machine_or_somebody_ended_waits_for_a_person(cause):
    assert replace(GOOD, cause=cause.value).needs_a_person == (cause not in COMPUTER)


def test_a_recording_that_does_not_say_what_ended_it_waits_for_a_person():
    assert replace(GOOD, cause="").needs_a_person


def test_a_recording_is_measured_in_seconds_and_in_whole_rows(tmp_path, short_plan):
    """400 rows at 4 ms: 1.6 s, of which two axes move in turn for 0.4 s; every eighth row lacks an answer."""
    path: Path = tmp_path / "session.h5"
    both = POSITION_CAME | COMMAND_CAME
    setpoint = np.zeros((400, 2), np.int32)
    setpoint[100:150, 0] = np.arange(50)
    setpoint[150:, 0] = 49
    setpoint[250:301, 1] = np.arange(51)
    setpoint[301:, 1] = 50
    valid = np.full((400, 2), both, np.uint8)
    valid[::8, 1] = POSITION_CAME
    with h5py.File(path, "w") as file:
        file.attrs["cycle"] = 0.004
        file.attrs["plan"] = json.dumps(short_plan.model_dump(mode="json"))
        file.attrs["stop_cause"] = "full-disk"
        file["cycle"] = np.arange(400)
        file["setpoint"] = setpoint
        file["valid"] = valid
    found = measured(path)
    assert found.lasted == pytest.approx(1.6)
    assert found.planned == pytest.approx(short_plan.duration)
    assert found.moved == pytest.approx((49 + 50) * 0.004)
    assert found.whole == pytest.approx(7 / 8)
    assert found.cause == "full-disk"
