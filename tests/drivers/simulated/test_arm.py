"""The simulated arm against closed forms of mechanics."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from drivers.simulated.arm import Arm
from drivers.simulated.elastic_arm import ElasticArm
from drivers.simulated.plant import PlantSettingsError, build_mechanism, read_plant_settings
from drivers.simulated.plant_settings import ArmSettings, MountedPayload

INERTIA, FIRST_MOMENT, G = 30.0, 20.0, 9.81


def settings(friction=None, effects=(), motor=None, **changes) -> ArmSettings:
    section = {
        "kind": "arm",
        "link": {"inertia": 18.0, "first_moment": [FIRST_MOMENT, 0.0]},
        "axis": {
            "motor": {
                "gear_ratio": 100.0,
                "torque_constant": 0.5,
                "rotor_inertia": 12.0e-4,
                **(motor or {}),
            },
            "friction": friction or {},
        },
        "hidden_effects": list(effects),
        **changes,
    }
    return ArmSettings.model_validate(section)


NO_GRAVITY = {"gravity": (0.0, 0.0, 0.0)}


def run(arm: Arm, seconds: float, current: float = 0.0, cycle: float = 1e-3) -> None:
    drive = np.array([current])
    for _ in range(round(seconds / cycle)):
        arm.step(drive, cycle)


def energy(arm: Arm) -> float:
    q, v = arm.joint_position, arm.joint_velocity
    return 0.5 * INERTIA * v * v + FIRST_MOMENT * G * math.sin(q)


def test_without_friction_the_energy_stays_over_a_minute():
    arm = Arm(settings())
    arm.set_state(0.3)
    start = energy(arm)
    run(arm, 60.0)
    assert abs(energy(arm) - start) < 1e-6 * FIRST_MOMENT * G


@pytest.mark.parametrize("amplitude", [0.1, 1.0, 2.5])
def test_the_period_of_the_pendulum_is_the_elliptic_integral(amplitude):
    arm = Arm(settings())
    arm.set_state(-math.pi / 2 + amplitude)
    period = 4.0 * math.sqrt(INERTIA / (FIRST_MOMENT * G)) * ellipk(math.sin(amplitude / 2) ** 2)
    crossings = []
    previous, time = arm.joint_position, 0.0
    while len(crossings) < 3:
        arm.step(np.zeros(1), 1e-3)
        time += 1e-3
        before, after = previous + math.pi / 2, arm.joint_position + math.pi / 2
        if before * after < 0.0:
            crossings.append(time - 1e-3 * after / (after - before))
        previous = arm.joint_position
    assert crossings[2] - crossings[0] == pytest.approx(period, rel=1e-6)


def test_below_stiction_the_arm_hangs_still_for_ten_minutes():
    arm = Arm(settings({"dry_driving": 250.0, "dry_backdriving": 250.0}))
    arm.set_state(0.0)
    run(arm, 600.0, cycle=0.01)
    assert arm.joint_position == 0.0
    assert arm.joint_velocity == 0.0


def test_it_breaks_away_at_the_angle_where_gravity_exceeds_stiction():
    stiction = FIRST_MOMENT * G * math.cos(0.8)
    friction = {"dry_driving": stiction, "dry_backdriving": stiction}
    for angle, sticks in [(0.801, True), (0.799, False)]:
        arm = Arm(settings(friction))
        arm.set_state(angle)
        run(arm, 0.1)
        assert (arm.joint_velocity == 0.0) is sticks


def test_the_terminal_velocity_balances_viscous_and_dry_friction():
    arm = Arm(
        settings({"viscous": 40.0, "dry_driving": 15.0, "dry_backdriving": 15.0, "offset": 5.0}, **NO_GRAVITY)
    )
    run(arm, 20.0, current=1.6)
    assert arm.joint_velocity == pytest.approx((50.0 * 1.6 - 15.0 - 5.0) / 40.0, rel=1e-9)


def test_a_sliding_arm_decelerates_evenly_and_stops_where_the_closed_form_says():
    arm = Arm(settings({"dry_driving": 24.0, "dry_backdriving": 24.0}, **NO_GRAVITY))
    arm.set_state(0.0, 0.8)
    run(arm, 0.4)
    assert arm.joint_velocity == pytest.approx(0.8 - 24.0 / INERTIA * 0.4, rel=1e-9)
    run(arm, 2.0)
    assert arm.joint_velocity == 0.0
    assert arm.joint_position == pytest.approx(INERTIA * 0.8**2 / (2.0 * 24.0), rel=1e-9)


PAPER = {
    "viscous": 48.0,
    "offset": 10.0,
    "dry_driving": 21.0,
    "dry_driving_stribeck": 4.0,
    "dry_backdriving": 15.0,
    "dry_backdriving_stribeck": 6.0,
    "load_driving": 0.05,
    "load_driving_stribeck": 0.14,
    "load_backdriving": 0.06,
    "load_backdriving_stribeck": 0.16,
    "stribeck_velocity": 0.03,
}


@pytest.mark.parametrize("speed", [0.01, 0.05, 0.4])
@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize("angle", [0.4, math.pi - 0.4])
def test_in_each_quadrant_the_torque_of_equation_25_keeps_the_speed(speed, direction, angle):
    load = FIRST_MOMENT * G * math.cos(angle)
    e = math.exp(-speed / 0.03)
    s = direction
    if load * s > 0:
        torque = (1.05 + 0.14 * e) * load + (21.0 + 4.0 * e) * s
    else:
        torque = (1.0 - 0.06 - 0.16 * e) * load + (15.0 + 6.0 * e) * s
    torque += 48.0 * s * speed + 10.0
    arm = Arm(settings(PAPER))
    arm.set_state(angle, s * speed)
    arm.step(np.array([torque / 50.0]), 1e-5)
    assert (arm.joint_velocity - s * speed) / 1e-5 == pytest.approx(0.0, abs=1e-3)
    arm.set_state(angle, s * speed)
    arm.step(np.array([(torque + 30.0) / 50.0]), 1e-6)
    slope = 1.05 + 0.14 * e if load * s > 0 else 1.0 - 0.06 - 0.16 * e
    assert (arm.joint_velocity - s * speed) / 1e-6 == pytest.approx(30.0 / slope / INERTIA, rel=1e-3)


def test_a_payload_loads_the_gear_more_and_is_held_by_its_friction():
    """Held up by friction alone from the torque (a_g − b_g) L − c_g − d_g + offset on: the lower limit of
    eq. (25).
    """
    arm = Arm(settings(PAPER), MountedPayload(mass=7.0, com=(1.3, 0.0, 0.0)))
    load = (FIRST_MOMENT + 7.0 * 1.3) * G
    limit = (1.0 - 0.06 - 0.16) * load - 15.0 - 6.0 + 10.0
    for above, sticks in [(0.1, True), (-0.1, False)]:
        arm.reset(0)
        run(arm, 0.05, current=(limit + above) / 50.0)
        assert (arm.joint_velocity == 0.0) is sticks
        assert arm.joint_velocity <= 0.0


def test_events_leave_the_path_of_an_independent_adaptive_solver():
    """Sliding to and fro under a sinusoidal current, against scipy with its own event location."""
    friction = {"viscous": 10.0, "dry_driving": 20.0, "dry_backdriving": 20.0}
    arm = Arm(settings(friction, **NO_GRAVITY))
    arm.set_state(0.0, 0.5)

    def current(time: float) -> float:
        return 2.5 * math.sin(3.0 * time)

    cycle, seconds = 1e-3, 6.0
    path = []
    for k in range(round(seconds / cycle)):
        arm.step(np.array([current((k + 0.5) * cycle)]), cycle)
        path.append(arm.joint_position)

    time, state, expected_end = 0.0, [0.0, 0.5], None
    while time < seconds:
        direction = math.copysign(1.0, state[1]) if state[1] else math.copysign(1.0, current(time + 1e-9))
        if state[1] == 0.0 and abs(50.0 * current(time)) < 20.0:
            time += 1e-4  # sticking until the torque exceeds stiction
            continue

        def rest(t, y, start=time, s=direction):
            return s * y[1] if t > start + 1e-3 else 1.0

        rest.terminal = True
        solution = solve_ivp(
            lambda t, y, s=direction: [y[1], (50.0 * current(t) - 10.0 * y[1] - 20.0 * s) / INERTIA],
            (time, seconds),
            state,
            events=rest,
            rtol=1e-9,
            atol=1e-10,
        )
        time = solution.t[-1]
        state = [solution.y[0, -1], 0.0 if solution.status == 1 else solution.y[1, -1]]
        expected_end = state[0]
    assert path[-1] == pytest.approx(expected_end, abs=2e-4)
    assert max(path) - min(path) > 0.1


def test_the_same_seed_gives_the_same_motion_and_another_does_not():
    noisy = settings(
        PAPER,
        [{"effect": "brake-drag", "torque": 30.0, "mean_interval": 0.2, "mean_duration": 0.1}],
        motor={"current_noise": 0.05},
    )
    arm = Arm(noisy)
    ends = []
    for seed in (1, 1, 2):
        arm.reset(seed)
        run(arm, 1.0, current=2.0)
        ends.append((arm.joint_position, arm.joint_velocity, float(arm.temperature[0])))
    assert ends[0] == ends[1] != ends[2]


def test_losses_warm_the_gear_towards_loss_over_conductance():
    section = settings({"viscous": 40.0}, motor={"winding_resistance": 0.5}, **NO_GRAVITY).model_dump()
    section["axis"]["thermal"] = {"ambient": 20.0, "heat_capacity": 50.0, "conductance": 5.0}
    arm = Arm(ArmSettings.model_validate(section))
    run(arm, 100.0, current=1.0, cycle=0.01)
    velocity = 50.0 / 40.0
    assert arm.temperature[0] == pytest.approx(20.0 + (40.0 * velocity**2 + 0.5) / 5.0, rel=1e-3)


def test_an_elastic_transmission_rings_at_its_natural_frequency():
    stiffness = 3.0e4
    arm = ElasticArm(settings({}, [{"effect": "elasticity", "stiffness": stiffness}], **NO_GRAVITY))
    motor, link = 12.0, 18.0
    run(arm, 0.01, current=10.0)
    twist, times = [], []
    for k in range(4000):
        arm.step(np.zeros(1), 5e-4)
        twist.append(arm.motor_angle[0] / 100.0 - arm.joint_position)
        times.append(k * 5e-4)
    sign_changes = [k for k in range(1, len(twist)) if twist[k - 1] < 0.0 <= twist[k]]
    period = (times[sign_changes[-1]] - times[sign_changes[0]]) / (len(sign_changes) - 1)
    assert 2 * math.pi / period == pytest.approx(math.sqrt(stiffness * (1 / motor + 1 / link)), rel=2e-3)


def test_backlash_lets_the_motor_turn_by_the_gap_before_the_link_follows():
    gap = 0.004
    arm = ElasticArm(settings({}, [{"effect": "backlash", "gap": gap}], **NO_GRAVITY))
    while arm.joint_velocity == 0.0:
        arm.step(np.array([0.2]), 1e-4)
    assert arm.motor_angle[0] / 100.0 - arm.joint_position == pytest.approx(gap / 2, rel=0.05)


def test_presliding_follows_dahls_curve_there_and_back():
    """Slowly loaded to 10 of 40 N m, F = F_c (1 − exp(−x/δ)); unloaded, F = F_c ((1 + 1/4) exp(−x/δ) − 1)."""
    effect = {"effect": "presliding", "displacement": 5e-4, "damping": 400.0}
    friction = {"dry_driving": 40.0, "dry_backdriving": 40.0, "viscous": 20.0}
    arm = Arm(settings(friction, [effect], **NO_GRAVITY))
    for k in range(10000):
        arm.step(np.array([k / 10000 * 10.0 / 50.0]), 1e-3)
    pushed = arm.joint_position
    assert pushed == pytest.approx(-5e-4 * math.log(1.0 - 10.0 / 40.0), rel=0.02)
    for k in range(10000):
        arm.step(np.array([(1 - k / 10000) * 10.0 / 50.0]), 1e-3)
    assert pushed - arm.joint_position == pytest.approx(5e-4 * math.log(1.0 + 10.0 / 40.0), rel=0.03)


def test_a_delay_makes_the_same_motion_later():
    currents = [4.0 * math.sin(0.01 * k) + 4.0 for k in range(600)]
    late = Arm(settings(PAPER, [{"effect": "delay", "seconds": 0.0035}]))
    prompt, waited = Arm(settings(PAPER)), Arm(settings(PAPER))
    run(waited, 0.0035, cycle=5e-4)
    for current in currents:
        late.step(np.array([current]), 1e-3)
        prompt.step(np.array([current]), 1e-3)
        waited.step(np.array([current]), 1e-3)
    run(late, 0.0035, current=0.0, cycle=5e-4)
    assert late.joint_position == pytest.approx(waited.joint_position, abs=1e-6)
    assert abs(late.joint_position - prompt.joint_position) > 1e-4


def test_wrong_settings_are_refused_with_the_field():
    section = settings(PAPER).model_dump()
    section["axis"]["friction"]["viscous"] = -1.0
    with pytest.raises(PlantSettingsError, match=r"simulated\.plant\.arm\.axis\.friction\.viscous"):
        read_plant_settings(section)
    with pytest.raises(PlantSettingsError, match="locks itself"):
        read_plant_settings(
            settings().model_dump()
            | {
                "axis": {
                    "motor": {"gear_ratio": 1.0, "torque_constant": 1.0},
                    "friction": {"load_backdriving": 1.0},
                }
            }
        )
    with pytest.raises(PlantSettingsError, match=r"hidden_effects\.0"):
        read_plant_settings(settings().model_dump() | {"hidden_effects": [{"effect": "magic"}]})


def test_a_mechanism_is_built_from_a_rig_files_section():
    mechanism = build_mechanism(
        settings(PAPER).model_dump(), {"name": "disk", "mass": 3.0, "com": [1.0, 0, 0]}, seed=4
    )
    assert mechanism.axes == 1
    mechanism.step(np.array([15.0]), 0.1)
    assert mechanism.motor_velocity[0] > 0.0
