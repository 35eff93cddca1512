"""A proof on the drive in the terminal: errors in thousandths, and by how much they changed."""

from __future__ import annotations

import pytest

from api.compensation_text import compensation_text
from identify.results.compensation import CompensationDocument, FollowingPart, JointFollowing


def part(where, without, with_):
    return FollowingPart(where=where, samples=5, rms_without=without, rms_with=with_)


JOINT = JointFollowing(
    joint="j3",
    unit="rad",
    rms_without=8e-5,
    rms_with=2e-5,
    peak_without=3e-4,
    peak_with=4.5e-4,
    largest_offset=10.5,
    bounded=0.0,
    speeds=(part("below 10 % of the top speed", 1e-4, None), part("above", 0.0, 1e-6)),
    quadrants=(part("driven by its load", None, 1e-4),),
)


def lines(**changes):
    fields = {
        "experiment": "arm",
        "rig": "bench",
        "payload": "disk",
        "model": "usual",
        "part": "whole",
        "share": 0.6,
        "recording_without": "a.h5",
        "recording_with": "b.h5",
        "completed": True,
        "reason": "",
        "following_limits": (1e-3,),
        "joints": (JOINT,),
        "folder": "compensation/00",
        "remarks": (),
        **changes,
    }
    return [" ".join(line.split()) for line in compensation_text(CompensationDocument(**fields)).splitlines()]


def test_every_error_is_shown_without_and_with_and_by_how_much_it_changed():
    assert lines() == [
        "bench, payload disk: torque of usual (model) from arm as feedforward, at most 60 % of the current limit",
        "",
        "j3: following error, root mean square (largest 10.5 A sent)",
        "without with",
        "all of the plan 0.0800 mrad 0.0200 mrad -75 %",
        "below 10 % of the top speed 0.1000 mrad –",
        "above 0.0000 mrad 0.0010 mrad",
        "driven by its load – 0.1000 mrad",
        "peak 0.3000 mrad 0.4500 mrad +50 %",
        "",
        "stored with the experiment in compensation/00",
    ]


@pytest.mark.parametrize("completed", [True, False])
def test_a_drive_of_the_plan_that_was_stopped_says_why(completed):
    said = "stopped: the following error was too large" in lines(
        completed=completed, reason="the following error was too large"
    )
    assert said is not completed


def test_what_was_added_and_what_of_it_was_sent_is_said():
    shown = lines(add=("stribeck@j3",), part="friction", share=0.25)[0]
    assert "torque of usual + stribeck@j3 (friction alone) from arm" in shown
    assert "at most 25 % of" in shown
