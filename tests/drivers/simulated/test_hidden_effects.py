"""Every hidden effect does what its equation says: torque read off the acceleration, against the closed
form.
"""

import math
import typing

import numpy as np
import pytest

from drivers.simulated import hidden_effect_settings
from drivers.simulated.arm import Arm
from drivers.simulated.hidden_effects import BrakeBursts
from drivers.simulated.plant import build_mechanism
from drivers.simulated.plant_settings import ArmSettings, MountedPayload
from drivers.simulated.robot import Robot, RobotSettings

INERTIA, FIRST_MOMENT, G, RATIO = 30.0, 20.0, 9.81, 100.0
FRICTION = {"viscous": 40.0, "dry_driving": 12.0, "dry_backdriving": 12.0}


def arm(*effects: dict, payload: MountedPayload | None = None, friction=FRICTION) -> Arm:
    section = {
        "link": {"inertia": 18.0, "first_moment": [FIRST_MOMENT, 0.0]},
        "axis": {
            "motor": {"gear_ratio": RATIO, "torque_constant": 0.5, "rotor_inertia": 12e-4},
            "friction": friction,
        },
        "hidden_effects": list(effects),
    }
    return Arm(ArmSettings.model_validate(section), payload)


def extra_torque(effect: dict, q: float, v: float, current: float = 0.0) -> float:
    """N m that the effect adds at the joint, at one state: inertia times what it adds to the acceleration."""
    accelerations = []
    for mechanism in (arm(effect), arm()):
        mechanism.set_state(q, v)
        mechanism.step(np.array([current]), 1e-6)
        accelerations.append((mechanism.joint_velocity - v) / 1e-6)
    return INERTIA * (accelerations[0] - accelerations[1])


def spring_of_pins(q: float) -> float:
    """Torque of the balancing spring from its energy, by differences."""

    def energy(angle: float) -> float:
        length = math.sqrt(0.09 + 0.25 - 2 * 0.15 * math.cos(angle - math.pi / 2))
        return 0.5 * 5000.0 * (length - 0.1) ** 2

    return -(energy(q + 1e-5) - energy(q - 1e-5)) / 2e-5


CLOSED_FORMS = [
    ({"effect": "joint-spring", "stiffness": 30.0, "rest": 0.2}, lambda q, v, i: -30.0 * (q - 0.2)),
    (
        {"effect": "gravity-spring", "stiffness": 5000.0, "base_radius": 0.3, "link_radius": 0.5, "free_length": 0.1},
        lambda q, v, i: spring_of_pins(q),
    ),
    (
        {"effect": "torque-ripple", "amplitude": 8.0, "order": 40.0, "phase": 0.3},
        lambda q, v, i: 8.0 * math.sin(40.0 * q + 0.3),
    ),
    (
        {"effect": "cogging", "amplitude": 5.0, "order": 6.0, "phase": 0.1},
        lambda q, v, i: 5.0 * math.sin(6.0 * RATIO * q + 0.1),
    ),
    (
        {"effect": "current-ripple", "amplitude": 0.05, "order": 2.0},
        lambda q, v, i: 50.0 * i * 0.05 * math.sin(2.0 * RATIO * q),
    ),
    ({"effect": "gain-saturation", "limit": 10.0}, lambda q, v, i: 50.0 * (10.0 * math.tanh(i / 10.0) - i)),
    ({"effect": "drive-gain", "factor": 0.93}, lambda q, v, i: 50.0 * -0.07 * i),
    (
        {"effect": "amplifier-dead-band", "band": 0.4},
        lambda q, v, i: -50.0 * math.copysign(min(abs(i), 0.4), i),
    ),
    (
        {"effect": "sticky-spot", "extra": 25.0, "centre": 0.5, "width": 0.1},
        lambda q, v, i: -math.copysign(25.0 * math.exp(-(((q - 0.5) / 0.1) ** 2)), v),
    ),
    (
        {"effect": "friction-position", "amplitude": 0.4, "order": 3.0},
        lambda q, v, i: -math.copysign(1.0, v) * 12.0 * 0.4 * math.sin(3.0 * q),
    ),
    (
        {"effect": "stribeck", "extra": 15.0, "velocity": 0.05},
        lambda q, v, i: -math.copysign(15.0 * math.exp(-abs(v) / 0.05), v),
    ),
    ({"effect": "viscous-asymmetric", "difference": 6.0}, lambda q, v, i: -6.0 * abs(v)),
    ({"effect": "viscous-quadratic", "coefficient": 9.0}, lambda q, v, i: -9.0 * v * abs(v)),
    ({"effect": "viscous-cubic", "coefficient": 9.0}, lambda q, v, i: -9.0 * v**3),
    (
        {"effect": "viscous-power", "coefficient": 20.0, "exponent": 0.5},
        lambda q, v, i: -math.copysign(20.0 * math.sqrt(abs(v)), v),
    ),
    (
        {"effect": "cable-snag", "beyond": 0.3, "stiffness": 60.0, "chafing": 30.0},
        lambda q, v, i: -max(q - 0.3, 0.0) * (60.0 + math.copysign(30.0, v)),
    ),
    (
        {"effect": "cable-snag", "beyond": 0.3, "stiffness": 60.0, "upwards": False},
        lambda q, v, i: 60.0 * max(0.3 - q, 0.0),
    ),
    ({"effect": "friction-warmup", "excess": 0.5, "time_constant": 60.0}, lambda q, v, i: -0.5 * 40.0 * v),
    ({"effect": "friction-temperature", "coefficient": 0.02, "reference": 30.0},
     lambda q, v, i: -40.0 * v * (math.exp(0.02 * 8.0) - 1.0)),
    (
        {"effect": "gravity-tilt", "about_z": 0.05},
        lambda q, v, i: -FIRST_MOMENT * G * (math.cos(q - 0.05) - math.cos(q)),
    ),
    (
        {"effect": "gravity-tilt", "about_x": 0.3},
        lambda q, v, i: FIRST_MOMENT * G * math.cos(q) * (1.0 - math.cos(0.3)),
    ),
    (
        {"effect": "loose-clamp", "mass": 5.0, "radius": 1.2, "play": 0.01},
        lambda q, v, i: 5.0 * G * (-1.2 * math.cos(q) - 0.01 * math.sin(q)),
    ),
]  # fmt: skip


@pytest.mark.parametrize(
    ("effect", "torque"), CLOSED_FORMS, ids=lambda x: x["effect"] if isinstance(x, dict) else ""
)
@pytest.mark.parametrize(("q", "v", "current"), [(0.45, 0.6, 4.0), (0.2, -0.03, -9.0), (1.1, 0.02, 0.2)])
def test_the_torque_of_the_effect_is_its_equation(effect, torque, q, v, current):
    assert extra_torque(effect, q, v, current) == pytest.approx(torque(q, v, current), rel=2e-3, abs=5e-3)


def test_every_effect_of_the_settings_is_tested_somewhere():
    union = typing.get_args(typing.get_args(hidden_effect_settings.HiddenEffectSettings)[0])
    names = {typing.get_args(kind.model_fields["effect"].annotation)[0] for kind in union}
    here = {effect["effect"] for effect, _ in CLOSED_FORMS}
    below = {"payload-mass", "payload-com", "brake-drag"}
    in_test_arm = {"elasticity", "backlash", "presliding", "delay"}
    assert names == here | below | in_test_arm


def test_friction_falls_while_the_machine_warms_up():
    """After one time constant the excess is down to 1/e."""
    mechanism = arm({"effect": "friction-warmup", "excess": 0.5, "time_constant": 2.0})
    drag = []
    for _ in range(2):
        mechanism.set_state(math.pi / 2, 0.5)
        mechanism.step(np.zeros(1), 1e-5)
        drag.append(-(mechanism.joint_velocity - 0.5) / 1e-5 * INERTIA - 12.0)
        mechanism.set_state(math.pi / 2, 0.0)
        for _ in range(2000):
            mechanism.step(np.zeros(1), 1e-3)
            mechanism.set_state(math.pi / 2, 0.0)
    assert drag[0] == pytest.approx(20.0 * 1.5, rel=1e-3)
    assert drag[1] == pytest.approx(20.0 * (1.0 + 0.5 / math.e), rel=1e-3)


def test_a_payload_that_weighs_and_sits_otherwise_than_entered_pulls_otherwise():
    entered = MountedPayload(mass=4.0, com=(1.2, 0.0, 0.0), inertia=(0.0, 0.0, 0.0, 0.0, 0.0, 0.1))
    effects = [
        {"effect": "payload-mass", "factor": 1.25},
        {"effect": "payload-com", "shift": (0.1, -0.05, 0.0)},
    ]
    mechanism = arm(*effects, payload=entered)
    assert mechanism.first_moment == pytest.approx((FIRST_MOMENT + 5.0 * 1.3, -5.0 * 0.05))
    assert mechanism.inertia == pytest.approx(INERTIA + 5.0 * (1.3**2 + 0.05**2) + 1.25 * 0.1)


def test_the_brake_drags_the_share_of_time_that_its_means_say():
    effect = hidden_effect_settings.BrakeDrag(
        effect="brake-drag", torque=30.0, mean_interval=3.0, mean_duration=1.0
    )
    bursts = BrakeBursts(effect)
    bursts.reset(7)
    dragging = []
    for k in range(400_000):
        bursts.advance(0.01 * k, 0.01, 0.0)
        dragging.append(bursts.dry_torque(0.0, 0.0))
    assert set(dragging) == {0.0, 30.0}
    assert np.mean(dragging) / 30.0 == pytest.approx(0.25, abs=0.02)


def test_a_dragging_brake_slows_and_can_hold_the_arm():
    free, braked = (
        arm(),
        arm({"effect": "brake-drag", "torque": 300.0, "mean_interval": 1e-9, "mean_duration": 1e9}),
    )
    for mechanism in (free, braked):
        mechanism.set_state(0.0, 0.5)
        for _ in range(500):
            mechanism.step(np.zeros(1), 1e-3)
    assert braked.joint_velocity == 0.0
    assert abs(free.joint_velocity) > 0.5


def test_the_loose_payload_changes_sides_when_gravity_across_it_turns():
    mechanism = arm(
        {"effect": "loose-clamp", "mass": 5.0, "radius": 1.2, "play": 0.02, "time_constant": 0.01}
    )
    weight = []
    for angle in (0.0, math.pi):  # gravity across the link: down its y, then up its y
        for _ in range(50):
            mechanism.set_state(angle, 0.0)
            mechanism.step(np.zeros(1), 1e-3)
        weight.append(mechanism._effects.link_torque[0](math.pi / 2))
    assert weight[0] == pytest.approx(-5.0 * G * 0.02, rel=1e-6)
    assert weight[1] == pytest.approx(5.0 * G * 0.02, rel=1e-6)


ROBOT_EFFECTS = [
    effect for effect, _ in CLOSED_FORMS if effect["effect"] not in ("loose-clamp", "friction-temperature")
]


@pytest.mark.parametrize("effect", ROBOT_EFFECTS, ids=lambda effect: effect["effect"])
def test_on_a_robot_of_one_axis_the_effect_is_the_arms(effect):
    axis = {
        "motor": {"gear_ratio": RATIO, "torque_constant": 0.5, "rotor_inertia": 12e-4},
        "friction": FRICTION,
    }
    link = {"mass": 20.0, "com": [1.0, 0.0, 0.0], "inertia": [0.1, 0.0, 0.0, 1.0, 0.0, 1.0]}
    section = {"gravity": [0.0, -G, 0.0], "axes": [axis], "links": [link], "hidden_effects": [effect]}
    robot = Robot(RobotSettings.model_validate(section))
    same = ArmSettings.model_validate(
        {"link": {"inertia": 21.0, "first_moment": [20.0, 0.0]}, "axis": axis, "hidden_effects": [effect]}
    )
    single = Arm(same)
    for q, v, current in [(0.45, 0.6, 4.0), (0.2, -0.03, -9.0)]:
        single.set_state(q, v)
        robot.set_state(np.array([q]), np.array([v]))
        for _ in range(20):
            single.step(np.array([current]), 1e-4)
            robot.step(np.array([current]), 1e-4)
        assert robot.joint_velocity[0] == pytest.approx(single.joint_velocity, rel=1e-5, abs=1e-6)


def test_a_delayed_axis_of_a_robot_answers_later():
    axis = {"motor": {"gear_ratio": RATIO, "torque_constant": 0.5, "rotor_inertia": 12e-4}}
    link = {"mass": 20.0, "com": [0.0, 0.0, 0.0], "inertia": [0.1, 0.0, 0.0, 1.0, 0.0, 1.0]}
    section = {"axes": [axis], "links": [link], "hidden_effects": [{"effect": "delay", "seconds": 0.005}]}
    robot = build_mechanism({"kind": "robot", "gravity": [0.0, 0.0, 0.0], **section})
    speeds = []
    for _ in range(10):
        robot.step(np.array([1.0]), 1e-3)
        speeds.append(robot.motor_velocity[0])
    assert speeds[4] == 0.0
    acceleration = RATIO * 50.0 / (1.0 + 12.0)
    assert speeds[9] == pytest.approx(acceleration * 5e-3, rel=1e-9)
