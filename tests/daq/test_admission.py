"""Which recordings may serve identification although they were cut off."""

from dataclasses import replace

import pytest

from daq.admission import Measured
from daq.safety import StopCause

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
