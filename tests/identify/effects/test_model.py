"""Models named by the user, and how motors that share axes divide torque, velocity and load."""

from __future__ import annotations

import numpy as np
import pytest

from identify.effects.catalogue import effects
from identify.effects.model import (
    USUAL,
    Model,
    Term,
    coupled_motors,
    gear_apart,
    load_shares,
    model_name,
    motor_shares,
    parse_addition,
    parse_model,
)
from identify.recording.errors import InputError

WRIST = np.diag([32.0, 45.0, 45.0, 32.0])
WRIST[2, 3] = 16.0
"""the fourth motor turns the third joint too"""
ROBOT = ["j1", "j2", "j3", "j4"]


def test_shares_are_the_columns_of_the_gain_in_units_of_their_diagonal():
    shares = motor_shares(WRIST)
    expected = np.eye(4)
    expected[2, 3] = 0.5
    np.testing.assert_array_equal(shares, expected)
    # a joint without a motor of its own keeps its column
    assert motor_shares(np.array([[0.0, 2.0], [0.0, 4.0]])).tolist() == [[0.0, 0.5], [0.0, 1.0]]


def test_what_motors_carry_times_their_velocities_is_what_joints_carry_times_theirs():
    random = np.random.default_rng(2)
    gain = np.diag([3.0, 5.0, 2.0]) + 0.3 * random.uniform(-1, 1, (3, 3))
    load, velocity = random.normal(size=(2, 3))
    carried, turned = load_shares(gain) @ load, motor_shares(gain).T @ velocity
    assert carried @ turned == pytest.approx(load @ velocity)


def test_motors_that_cannot_be_told_apart_share_the_load_alike():
    assert load_shares(np.ones((2, 2))) @ [6.0, 6.0] == pytest.approx([3.0, 3.0])


def test_a_gear_stands_apart_where_it_turns_or_carries_other_than_its_own_joint():
    assert [gear_apart(WRIST, motor) for motor in range(4)] == [False, False, True, True]


def test_coupled_are_the_motors_that_act_on_this_joint_and_on_another():
    assert [coupled_motors(WRIST, joint) for joint in range(4)] == [[], [], [3], [3]]


def test_an_effect_of_a_joint_stands_on_every_joint_one_of_a_shared_motor_once_on_its_own():
    gain = WRIST
    everywhere = parse_addition("stribeck", ROBOT, effects(), np.diag(np.diag(WRIST)))
    assert [term.joint for term in everywhere] == [0, 1, 2, 3]
    assert [term.joint for term in parse_addition("stribeck@j2", ROBOT, effects(), gain)] == [1]
    assert [term.key for term in parse_addition("coupled-friction", ROBOT, effects(), gain)] == [
        ("coupled-friction", 3)
    ]
    assert [term.key for term in parse_addition("coupled-friction@j3", ROBOT, effects(), gain)] == [
        ("coupled-friction", 3)
    ]
    assert parse_addition("coupled-friction@j1", ROBOT, effects(), gain) == []
    assert [term.joint for term in parse_addition("payload-mass", ROBOT, effects(), gain)] == [0]


def test_a_model_has_every_term_once_in_the_order_in_which_it_was_named():
    model = parse_model("rigid+ stribeck, coulomb,stribeck", ["j1"], effects(), np.eye(1))
    assert [term.effect.name for term in model.terms] == ["offset", "stribeck", "coulomb"]
    assert model.name == "rigid+stribeck,coulomb"
    assert model_name(" load-velocity ") == "load-velocity"
    assert model.has("stribeck", 0)
    assert not model.has("stribeck", 1)
    assert not model.without(("stribeck", 0)).has("stribeck", 0)
    usual = parse_model("usual", ["j1"], effects(), np.eye(1))
    assert tuple(term.effect.name for term in usual.terms) == USUAL
    again = usual.with_terms(usual.terms)
    assert again == usual
    assert Model("bare", ()).with_terms([Term(effects()["offset"], 0)] * 2).terms == (
        Term(effects()["offset"], 0),
    )


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("usual+stribeck", "a list of effects follows 'rigid+'"),
        ("usal", "did you mean 'usual'?"),
        ("rigid+", "after 'rigid+' a comma-separated list of effects is missing"),
        ("rigid+ ,", "after 'rigid+' a comma"),
        ("rigid+stribek", "there is no effect 'stribek'; did you mean 'stribeck'?"),
        ("rigid+qqqq", "effects are viscous, coulomb"),
        ("rigid+coulomb@j9", "there is no joint 'j9'; joints are j1"),
    ],
)
def test_a_name_that_is_wrong_is_answered_with_what_would_be_right(text, words):
    with pytest.raises(InputError) as refused:
        parse_model(text, ["j1"], effects(), np.eye(1))
    assert words in str(refused.value)


def test_constants_that_are_chosen_are_held_in_the_order_of_their_names():
    chosen = Term(effects()["stribeck"], 2).chosen({"b": 2.0, "a": 1.0})
    assert chosen.constants == (("a", 1.0), ("b", 2.0))
    assert chosen.key == ("stribeck", 2)
