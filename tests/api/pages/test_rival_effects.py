"""Proposed experiments in words: which are worth running, and with which figures."""

from types import SimpleNamespace

import pytest

from api.pages.error_figures import JointUnits
from api.pages.rival_effects import _worth_running


def proposal(separation, low=-0.5, high=0.5, speed=0.25):
    return SimpleNamespace(separation=separation, position_from=low, position_to=high, speed=speed)


def rows(*proposals, joint_type="revolute"):
    return _worth_running(
        SimpleNamespace(proposals=proposals), JointUnits.of(joint_type), "/apart/plan", "j 1"
    )


@pytest.mark.parametrize(
    ("separations", "shown"),
    [((3.0, 1.0, 0.999, 2.0), 2), ((0.999,), 0), ((None,), 0), ((), 0), ((5.0, 2.0, 1.5), 3)],
)
def test_what_lies_within_the_noise_is_not_worth_running_nor_what_follows_it(separations, shown):
    listed = rows(*(proposal(each) for each in separations))
    assert [row.proposal.separation for row in listed] == list(separations[:shown])
    assert [row.rank for row in listed] == list(range(1, shown + 1))


@pytest.mark.parametrize(
    ("low", "high", "words"),
    [
        (-0.5, 0.4, "−0.500 and 0.400\u202frad"),
        (-0.5, 0.5, "−0.50 and 0.50\u202frad"),
        (-3.0, 4.0, "−3.00 and 4.00\u202frad"),
        (-30.0, 40.0, "−30.0 and 40.0\u202frad"),
        (-300.0, 400.0, "−300 and 400\u202frad"),
        (-3000.0, 4000.0, "−3000 and 4000\u202frad"),
        (0.02, 0.03, "0.0200 and 0.0300\u202frad"),
    ],
)
def test_a_range_has_three_digits_of_its_width(low, high, words):
    (row,) = rows(proposal(2.0, low, high))
    assert row.range_words == words


def test_units_are_the_joint_s_and_the_plan_is_asked_for_by_rank():
    first, second = rows(proposal(2.0), proposal(2.0, speed=1.5), joint_type="prismatic")
    assert (first.speed_words, second.speed_words) == ("0.250\u202fm/s", "1.50\u202fm/s")
    assert first.range_words == "−0.50 and 0.50\u202fm"
    assert [row.plan_link for row in (first, second)] == [
        "/apart/plan?joint=j+1&proposal=1",
        "/apart/plan?joint=j+1&proposal=2",
    ]
