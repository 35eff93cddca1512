"""An arm whose transmission twists: two inertias on a spring against closed forms, and against SciPy's integrator."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from drivers.simulated.elastic_arm import ElasticArm
from drivers.simulated.plant_settings import ArmSettings

ROTOR, LINK, MOMENT, STIFFNESS = 12.0, 18.0, 20.0, 2.0e4


def arm(*, gravity=(0.0, 0.0, 0.0), gap=None, damping=0.0, stiffness=STIFFNESS, **friction) -> ElasticArm:
    effects = [{"effect": "elasticity", "stiffness": stiffness, "damping": damping}]
    if gap is not None:
        effects.append({"effect": "backlash", "gap": gap})
    section = {
        "kind": "arm",
        "gravity": gravity,
        "link": {"inertia": LINK, "first_moment": [MOMENT, 0.0]},
        "axis": {
            "motor": {"gear_ratio": 100.0, "torque_constant": 0.5, "rotor_inertia": ROTOR * 1e-4},
            "friction": friction,
        },
        "hidden_effects": effects,
    }
    return ElasticArm(ArmSettings.model_validate(section))


def course(made: ElasticArm, seconds: float, current: float = 0.0, cycle: float = 1e-3) -> np.ndarray:
    """(N, 4): angle and speed of motor and link at each cycle."""
    rows = []
    for _ in range(round(seconds / cycle)):
        made.step(np.array([current]), cycle)
        rows.append((made._q, made._v, made._link_q, made._link_v))
    return np.array(rows)


def test_the_two_inertias_swing_against_each_other_at_the_spring_s_frequency():
    made = arm()
    made._link_q, made._link_v = made._q + 0.01, 0.0
    twist = np.subtract(*course(made, 1.0).T[[0, 2]])
    pulsation = math.sqrt(STIFFNESS * (1 / ROTOR + 1 / LINK))
    np.testing.assert_allclose(twist, -0.01 * np.cos(pulsation * 1e-3 * np.arange(1, 1001)), atol=2e-4)


def test_a_torque_of_the_motor_moves_both_and_twists_the_spring_by_the_link_s_share():
    made = arm(damping=60.0)
    rows = course(made, 2.0, current=0.2)
    torque = 0.2 * 100 * 0.5
    acceleration = torque / (ROTOR + LINK)
    np.testing.assert_allclose(rows[-1, [1, 3]], acceleration * 2.0, rtol=5e-3)
    assert rows[-1, 0] - rows[-1, 2] == pytest.approx(LINK * acceleration / STIFFNESS, rel=1e-2)


def test_the_motion_is_that_of_the_equations_in_the_head_of_the_module():
    made = arm(gravity=(0.0, -9.81, 0.0), damping=15.0, viscous=30.0)
    made.set_state(0.2, 0.5)
    start = np.array([made._q, made._v, made._link_q, made._link_v])

    def rates(_, state):
        q, v, link_q, link_v = state
        spring = STIFFNESS * (q - link_q) + 15.0 * (v - link_v)
        return (
            v,
            (3.0 * 50.0 - 30.0 * v - spring) / ROTOR,
            link_v,
            (spring - 9.81 * MOMENT * math.cos(link_q)) / LINK,
        )

    expected = solve_ivp(rates, (0.0, 0.4), start, rtol=1e-10, atol=1e-12).y[:, -1]
    np.testing.assert_allclose(course(made, 0.4, current=3.0)[-1], expected, atol=2e-5)


def test_at_rest_the_link_hangs_where_the_spring_carries_it_and_play_adds_half_its_gap():
    for gap in (None, 0.004):
        made = arm(gravity=(0.0, -9.81, 0.0), gap=gap)
        made.set_state(0.0)
        assert made.joint_velocity == 0.0
        load = 9.81 * MOMENT * math.cos(made.joint_position)
        assert made.joint_position == pytest.approx(-load / STIFFNESS - (gap or 0.0) / 2, abs=1e-9)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_within_the_gap_nothing_is_passed_on_and_flanks_push_and_do_not_pull(side):
    made = arm(gap=0.01, damping=1e4)
    assert made._spring(side * 0.0049, 0.0) == 0.0
    assert made._spring(side * 0.006, 0.0) == pytest.approx(side * STIFFNESS * 0.001)
    assert made._spring(side * 0.006, -side * 10.0) == 0.0


def test_dry_friction_holds_the_motor_up_to_its_torque_while_the_link_swings():
    # 50 N m per ampere
    for current, moves in ((0.35, False), (0.45, True)):
        made = arm(dry_driving=20.0, dry_backdriving=20.0)
        made.set_state(0.0)
        rows = course(made, 0.2, current=current)
        assert (abs(rows[-1, 0]) > 1e-6) == moves
    held = arm(dry_driving=20.0, dry_backdriving=20.0)
    held._link_q += 0.0005
    rows = course(held, 0.3)
    assert np.ptp(rows[:, 0]) == 0.0
    # the link alone on its spring
    expected = 0.0005 * np.cos(math.sqrt(STIFFNESS / LINK) * 1e-3 * np.arange(1, 301))
    np.testing.assert_allclose(rows[:, 2] - rows[:, 0], expected, atol=1e-5)


def test_friction_warms_the_gear_while_the_motor_turns_and_no_more_once_it_sticks():
    made = arm(dry_driving=30.0, dry_backdriving=30.0)
    made._v = made._link_v = 0.5
    made.step(np.array([0.0]), 1e-3)
    assert made._heat_flow == pytest.approx(30.0 * 0.5, rel=0.1)  # W
    course(made, 2.0)
    assert made._v == 0.0
    assert made._heat_flow == 0.0
