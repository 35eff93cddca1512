"""What the parameters of effects can be, against the physics that asks for it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.effects.admissible import Admissible, admissible_values, named_parameters
from identify.effects.catalogue import effects
from identify.effects.model import Term
from tests.identify.effects.summaries import LARGEST_LOAD, TOP_SPEED, summary_of


def columns_of(names: dict[str, dict[str, float]]) -> list[tuple[Term, dict[str, float], int]]:
    """Terms on joint 0 with as many columns as their effects have parameters."""
    known = effects()
    return [
        (Term(known[name], 0), constants, len(known[name].parameters_of(summary_of(), constants)))
        for name, constants in names.items()
    ]


def admissible(names: dict[str, dict[str, float]]) -> Admissible:
    return admissible_values(columns_of(names), [summary_of()])


USUAL = {"viscous": {}, "coulomb": {}, "offset": {}}
IMPOSSIBLE = {
    "coulomb": [-1.0],
    "viscous": [-1.0],
    "viscous-power": [-1.0],
    "stribeck": [-1.0],
    "load-friction": [-0.01],
    "load-friction-asymmetric": [-0.05, 0.1, 0.0],
    "load-stribeck": [-0.1, 0.1],
    "presliding": [-1.0],
    "backlash": [-0.001, 0.0],
    "joint-spring": [-2.0],
    "gain-saturation": [-1e-4],
    "drive-gain": [-1.5],
    "elasticity": [-1e-3, 1e-4],
    "motor-inertia": [-0.1],
    "coupled-friction": [1.0, -1.0, 0.1],
    "payload-mass": [-1.2],
    "current-ripple": [1.3, 0.0],
    "gravity-tilt": [12.0, 0.0],
    "friction-warmup": [-1.0, 0.0],
}
CONSTANTS = {
    "viscous-power": {"exponent": 0.5},
    "stribeck": {"stribeck_velocity": 0.05},
    "load-friction": {"rotor_inertia": 0.0},
    "load-friction-asymmetric": {"rotor_inertia": 0.0},
    "load-stribeck": {"rotor_inertia": 0.0, "stribeck_velocity": 0.05},
    "friction-position": {"from": -1.0, "to": 1.0, "knots": 3.0},
    "friction-warmup": {"time_constant": 30.0, "across_sessions": 0.0},
    "payload-mass": {"payload_1": 0.0},
}


@pytest.mark.parametrize(("name", "values"), IMPOSSIBLE.items())
def test_what_cannot_be_is_outside_and_its_mirror_or_nothing_is_inside(name, values):
    bounds = admissible({name: CONSTANTS.get(name, {})})
    assert bounds.violation(np.array(values)) > 0
    assert bounds.violation(np.zeros(len(values))) == 0.0


def test_every_effect_of_the_catalogue_bounds_as_many_parameters_as_it_has_columns():
    summary = summary_of()
    for effect in effects().values():
        for constants in effect.grid(summary):
            listed = named_parameters(Term(effect, 0), constants, 4, summary)
            assert len(listed) == len(effect.parameters_of(summary, constants)) or len(listed) == 4
            assert all(each.lower < each.upper for each in listed)
            assert all(each.lower <= 0.0 <= each.upper for each in listed), "an effect of no size is possible"


@settings(max_examples=60, deadline=None)
@given(
    FV=st.floats(-5, 20),
    FC=st.floats(-5, 20),
    quadratic=st.floats(-10, 10),
    difference=st.floats(-40, 40),
    alpha=st.tuples(st.floats(-0.1, 0.3), st.floats(-0.1, 0.3)),
)
def test_friction_inside_the_bounds_never_drives_the_joint(FV, FC, quadratic, difference, alpha):
    """Independent of how the relations are made: the power of eq. (20) and F_V q̇ + F_V2 |q̇| q̇ itself."""
    names = {
        "viscous": {},
        "coulomb": {},
        "viscous-quadratic": {},
        "load-friction-asymmetric": {"rotor_inertia": 0.0},
    }
    values = np.array([FV, FC, quadratic, *alpha, difference])
    inside = admissible_values(columns_of(names), [summary_of(coupled_motors=())]).violation(values) <= 1e-9
    speed = TOP_SPEED * np.array([0.02, 0.1, 0.5, 0.9, 1.0])[:, None, None]
    load = LARGEST_LOAD * np.array([-1.0, -1e-6, 1e-6, 1.0])[None, :, None]
    direction = np.array([-1.0, 1.0])[None, None, :]
    driving = np.sign(load) * direction > 0
    level = np.where(driving, FC + difference / 2, FC - difference / 2)
    level = level + np.where(driving, *alpha) * np.abs(load)
    power = (level + FV * speed + quadratic * speed**2) * speed
    if inside:
        assert power.min() >= -1e-6
    elif min(FV, FC, *alpha) >= 0.0:
        assert power.min() < 1e-3 or (level * np.ones_like(speed)).min() < 1e-3  # standstill is a state too


def test_viscous_friction_is_a_loss_in_either_direction():
    bounds = admissible({**USUAL, "viscous-asymmetric": {}})
    assert bounds.violation(np.array([10.0, 5.0, -3.0, 8.0])) == 0.0
    assert bounds.violation(np.array([10.0, 50.0, -3.0, 12.0])) > 0.0
    assert bounds.violation(np.array([10.0, 50.0, -3.0, -12.0])) > 0.0


def test_friction_over_position_may_fall_to_nothing_and_no_further():
    names = {"coulomb": {}, "friction-position": CONSTANTS["friction-position"]}
    known = effects()
    columns = [
        (Term(known[name], 0), constants, count)
        for (name, constants), count in zip(names.items(), (1, 2), strict=True)
    ]
    bounds = admissible_values(columns, [summary_of()])
    assert bounds.violation(np.array([5.0, -5.0, 3.0])) == pytest.approx(0.0, abs=1e-9)
    assert bounds.violation(np.array([5.0, -6.0, 3.0])) > 0.5


def test_no_more_friction_builds_up_after_a_reversal_than_there_is():
    bounds = admissible(
        {**USUAL, "stribeck": CONSTANTS["stribeck"], "presliding": {"presliding_distance": 0.01}}
    )
    assert bounds.violation(np.array([10.0, 5.0, 0.0, 2.0, 6.5])) == 0.0
    assert bounds.violation(np.array([10.0, 5.0, 0.0, 2.0, 7.5])) == pytest.approx(0.5)


def test_a_payloads_moments_of_inertia_are_those_of_a_body():
    from identify.effects.unknown_payload import UnknownPayload

    bounds = admissible_values([(Term(UnknownPayload(), 0), {"payload_1": 0.0}, 10)], [summary_of()])
    plate = np.array([0.2, 0.0, 0.0, 0.1, 0.0, 0.3, 0.0, -0.5, 0.0, 1.0])
    assert bounds.violation(plate) == pytest.approx(0.0, abs=1e-12)
    assert bounds.violation(plate + np.eye(10)[5]) > 0.9
    assert bounds.violation(plate - 2 * np.eye(10)[9]) > 0.9


def test_a_delay_has_either_sign_and_so_has_an_offset():
    bounds = admissible({"delay": {}, "offset": {}})
    assert bounds.violation(np.array([-0.004, -3.0])) == 0.0
    assert bounds.violation(np.array([0.004, 3.0])) == 0.0


def test_friction_of_a_shared_motor_opposes_that_motor_whatever_the_joint_s_own_friction_is():
    """beta_difference is bounded by the motor's own dry friction, F_CM ± ½ of it, not by the joint's."""
    known = effects()
    shared = summary_of(coupled_motors=(0,))
    names = ("coulomb", "coupled-friction", "load-friction-asymmetric")
    columns = [(Term(known[name], 0), CONSTANTS.get(name, {}), len(known[name].parameters)) for name in names]
    bounds = admissible_values(columns, [shared])
    # coulomb FC; FVM, FCM, IaM; alpha_m, alpha_g, beta_difference
    assert bounds.violation(np.array([0.0, 1.0, 2.0, 0.1, 0.0, 0.0, 3.9])) == 0.0
    assert bounds.violation(np.array([9.0, 1.0, 2.0, 0.1, 0.0, 0.0, 4.1])) > 0.0
    apart = admissible_values(columns, [summary_of(coupled_motors=())])
    assert apart.violation(np.array([9.0, 1.0, 2.0, 0.1, 0.0, 0.0, 4.1])) == 0.0


@pytest.mark.parametrize("span", [0.2, 2.0])
def test_link_and_motor_are_not_further_apart_than_a_twentieth_of_the_motion(span):
    summary = summary_of(position_range=(0.0, span))
    known = effects()
    gap, _ = known["backlash"].parameters_of(summary, {"flank_load": 1.0, "rotor_inertia": 0.0})
    _, compliance = known["elasticity"].parameters_of(summary, {})
    assert gap.upper == pytest.approx(span / 20)
    # wound up under the largest load, to either side
    assert compliance.upper * LARGEST_LOAD == pytest.approx(span / 20)
    widest = max(each.get("play", 0.0) for each in known["backlash"].grid(summary))
    assert widest == pytest.approx(gap.upper)
