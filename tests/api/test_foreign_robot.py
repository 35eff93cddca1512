"""The robot of an import, typed joint by joint."""

import pytest

from api.foreign_robot import each_joint, gain_values, parse_number, parse_three, typed_robot
from identify.recording import InputError


def never(option: str, what: str) -> str:
    raise AssertionError(f"asked for {option}")


def robot_of(**changes):
    given = {
        "scalars": {"kt": 2.5},
        "types": ["revolute", "prismatic"],
        "gains": ["kt", "-3"],
        "names": None,
        "dh": ["0,0,0,0.3", "-1.5,0.2,0.1,0"],
        "gravity": "0,0,-9.81",
        "ask": never,
    }
    return typed_robot(**(given | changes))


def test_joints_have_the_frames_types_names_and_gains_that_were_typed():
    robot = robot_of()
    assert robot.gravity == (0.0, 0.0, -9.81)
    assert [(j.name, j.type, j.alpha, j.d, j.theta, j.r, j.drive_gain) for j in robot.joints] == [
        ("j1", "revolute", 0.0, 0.0, 0.0, 0.3, 2.5),
        ("j2", "prismatic", -1.5, 0.2, 0.1, 0.0, -3.0),
    ]
    assert [joint.name for joint in robot_of(names=["base", "slide"]).joints] == ["base", "slide"]
    (only,) = robot_of(types=["revolute"], gains=["4"], dh=None).joints
    assert (only.alpha, only.d, only.theta, only.r, only.drive_gain) == (0.0, 0.0, 0.0, 0.0, 4.0)


def test_gravity_is_asked_for_where_it_was_not_given():
    asked = []
    robot = robot_of(gravity=None, ask=lambda option, what: asked.append(option) or "1,2,3")
    assert robot.gravity == (1.0, 2.0, 3.0)
    assert asked == ["--gravity"]


def test_one_value_stands_for_all_joints():
    assert each_joint(["kt"], 3, "--gain") == ["kt"] * 3
    assert each_joint(["a", "b"], 2, "--gain") == ["a", "b"]
    assert gain_values({"kt": 2.5}, ["kt"], 2) == [2.5, 2.5]
    assert parse_three("1,2.5,-3", "--gravity") == (1.0, 2.5, -3.0)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: each_joint(["1", "2"], 3, "--gain"), "--gain: 2 given for 3 joints; give one, or 3"),
        (lambda: each_joint([], 1, "--gain"), "--gain: 0 given for 1 joint; give one, or 1"),
        (lambda: parse_number("1,5", "--gain"), "--gain: '1,5' is not a number"),
        (lambda: parse_three("1,2", "--gravity"), "--gravity: '1,2' has 2 numbers; 3 are needed"),
        (lambda: robot_of(names=["one"]), "--joint: 1 names for 2 joints"),
        (lambda: robot_of(dh=["0,0,0,0"]), "--dh: 1 frames for 2 joints"),
        (lambda: robot_of(dh=None), "--dh: 0 frames for 2 joints"),
        (lambda: robot_of(gains=["0"]), "drive_gain: is 0"),
    ],
)
def test_what_is_wrong_is_named_with_its_option_and_what_would_be_right(call, words):
    with pytest.raises(InputError) as refused:
        call()
    assert words in str(refused.value)
