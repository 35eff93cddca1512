"""A motor that two neighbouring joints share undeclared: what its columns are, and what is said of which joints."""

from __future__ import annotations

import numpy as np
import pytest

from identify.effects.admissible import admissible_values
from identify.effects.catalogue import effects
from identify.effects.expression import parse
from identify.effects.model import Term, parse_addition
from identify.effects.neighbouring_motors import SharedMotorDifference, SharedMotorSum
from tests.identify.effects.motions import motion_of
from tests.identify.effects.summaries import summary_of


@pytest.mark.parametrize(("kind", "side"), [(SharedMotorSum, 1.0), (SharedMotorDifference, -1.0)])
def test_columns_are_friction_of_the_motor_and_its_rotor_where_it_is_asked_for(kind, side):
    effect = kind()
    assert effect.beside == side
    w, rate = np.array([2.0, -0.5, 0.0]), np.array([1.0, 3.0, -4.0])
    motion = motion_of(motor_velocity=w, motor_acceleration=rate, motor_share=-0.5)
    friction = -0.5 * np.column_stack([w, [1.0, -1.0, 0.0]])
    np.testing.assert_array_equal(effect.columns(motion, {"rotor": 0.0}), friction)
    np.testing.assert_array_equal(
        effect.columns(motion, {"rotor": 1.0}), np.column_stack([friction, -0.5 * rate])
    )
    for constants in effect.grid(summary_of()):
        width = effect.columns(motion, constants).shape[1]
        assert len(effect.parameters_of(summary_of(), constants)) == width


@pytest.mark.parametrize("rotor", [0.0, 1.0])
def test_formulas_are_the_columns(rotor):
    rate = {"motor_velocity": np.array([2.0, -0.5]), "motor_acceleration": np.array([1.0, 3.0])}
    columns = SharedMotorSum().columns(motion_of(**rate, motor_share=-0.5), {"rotor": rotor})
    signals = {**rate, "motor_share": np.array(-0.5)}
    formulas = SharedMotorSum().formulas({"rotor": rotor})
    values = [parse(formula, signals)(signals) for formula in formulas]
    np.testing.assert_array_equal(np.column_stack(values), columns)


def test_the_explanation_names_both_joints():
    said = SharedMotorDifference().explained(summary_of(name="j6", joint_before="j5"))
    assert said.startswith(
        "It looks like a shared motor or belt between j5 and j6: friction acts in the difference of"
    )


def test_it_is_the_farther_joint_s_and_the_first_joint_has_none():
    names, gain = ["j1", "j2", "j3"], np.eye(3)
    terms = parse_addition("shared-motor-sum", names, effects(), gain)
    assert [term.key for term in terms] == [("shared-motor-sum", 1), ("shared-motor-sum", 2)]
    assert parse_addition("shared-motor-sum@j1", names, effects(), gain) == []


def test_friction_of_the_shared_motor_takes_none_of_the_joint_s_own():
    """Whatever the shared motor loses, the joint's own friction must by itself not drive it."""
    listed = [
        (Term(effects()[name], 0), {"rotor": 0.0}, count)
        for name, count in (("viscous-asymmetric", 1), ("shared-motor-sum", 2))
    ]
    both = admissible_values(listed, [summary_of()])
    assert both.violation(np.array([0.0, 4.0, 4.0])) == 0.0
    assert both.violation(np.array([0.5, 4.0, 4.0])) > 0.0
    assert both.violation(np.array([0.0, -1.0, 4.0])) > 0.0
