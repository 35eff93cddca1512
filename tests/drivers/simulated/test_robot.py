"""The simulated six-axis robot against Pinocchio, conservation laws and static balance."""

import math

import numpy as np
import pinocchio as pin
import pytest

from daq.rig import Rig
from drivers.simulated.arm import Arm
from drivers.simulated.plant import PlantSettingsError, build_mechanism, read_plant_settings
from drivers.simulated.plant_settings import ArmSettings, LinkSettings, MountedPayload, RobotSettings
from drivers.simulated.rigid_bodies import RigidBodies, pseudo_inertia
from drivers.simulated.robot import Robot

SECTION = (Rig.load("tx40-simulated").simulated or {})["plant"]
FRICTIONLESS = {
    **SECTION,
    "axes": [{**axis, "friction": {"rotor_in_load": False}} for axis in SECTION["axes"]],
}
PAYLOAD = MountedPayload(mass=2.0, com=(0.01, -0.02, 0.1), inertia=(0.002, 1e-4, 0.0, 0.003, -1e-4, 0.001))


def settings(section=SECTION, **changes) -> RobotSettings:
    return RobotSettings.model_validate({**section, **changes})


def oracle(
    links: tuple[LinkSettings, ...], gravity, payload: MountedPayload | None = None, rotor=None
) -> pin.Model:
    model = pin.Model()
    model.gravity.linear = np.array(gravity)
    parent = 0
    for j, link in enumerate(links):
        ca, sa = math.cos(link.alpha), math.sin(link.alpha)
        ct, st = math.cos(link.theta), math.sin(link.theta)
        turn = np.array([[1, 0, 0], [0, ca, -sa], [0, sa, ca]]) @ np.array(
            [[ct, -st, 0], [st, ct, 0], [0, 0, 1]]
        )
        place = pin.SE3(turn, np.array([link.d, -link.r * sa, link.r * ca]))
        parent = model.addJoint(parent, pin.JointModelRZ(), place, f"j{j + 1}")
        bodies = [(link.mass, link.com, link.inertia)]
        if payload is not None and j == len(links) - 1:
            bodies.append((payload.mass, payload.com, payload.inertia))
        for mass, com, (xx, xy, xz, yy, yz, zz) in bodies:
            tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
            model.appendBodyToJoint(parent, pin.Inertia(mass, np.array(com), tensor), pin.SE3.Identity())
    if rotor is not None:
        model.armature = rotor
    return model


@pytest.mark.parametrize("seed", range(20))
def test_mass_matrix_and_bias_torques_are_those_of_pinocchio(seed):
    random = np.random.default_rng(seed)
    links = tuple(
        LinkSettings(
            alpha=random.uniform(-2, 2),
            d=random.uniform(-0.5, 0.5),
            theta=random.uniform(-2, 2),
            r=random.uniform(-0.5, 0.5),
            mass=random.uniform(0.5, 9),
            com=tuple(random.uniform(-0.3, 0.3, 3)),
            inertia=tuple(np.array([1.0, 0.1, 0.2, 1.5, 0.15, 1.2]) * random.uniform(0.05, 0.3)),
        )
        for _ in range(1 + seed % 7)
    )
    gravity = random.uniform(-10, 10, 3)
    model = oracle(links, gravity, PAYLOAD)
    data = model.createData()
    n = len(links)
    q, v = random.uniform(-3, 3, n), random.uniform(-5, 5, n)
    bodies = RigidBodies(links, tuple(gravity), pseudo_inertia(PAYLOAD.mass, PAYLOAD.com, PAYLOAD.inertia))
    mass, bias = bodies.dynamics(q.tolist(), v)
    pin.crba(model, data, q)
    expected = np.triu(data.M) + np.triu(data.M, 1).T
    np.testing.assert_allclose(mass, expected, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(bias, pin.nonLinearEffects(model, data, q, v), rtol=1e-9, atol=1e-10)


@pytest.mark.parametrize("seed", range(5))
def test_without_friction_the_acceleration_is_that_of_the_articulated_body_algorithm(seed):
    """Forward dynamics against Pinocchio's ABA, rotors as armature; the wrist is uncoupled here."""
    random = np.random.default_rng(seed)
    free = settings(FRICTIONLESS, coupling=None)
    robot = Robot(free, PAYLOAD)
    rotor = np.array([axis.motor.gear_ratio**2 * axis.motor.rotor_inertia for axis in free.axes])
    model = oracle(free.links, free.gravity, PAYLOAD, rotor)
    q, v = random.uniform(-2, 2, 6), random.uniform(-2, 2, 6)
    current = random.uniform(-3, 3, 6)
    torque = np.array([axis.motor.gear_ratio * axis.motor.torque_constant for axis in free.axes]) * current
    expected = pin.aba(model, model.createData(), q, v, torque)
    robot.set_state(q, v)
    robot.step(current, 1e-6)
    np.testing.assert_allclose(
        (robot.joint_velocity - v) / 1e-6, expected, rtol=1e-4, atol=1e-3 * abs(expected).max()
    )


def test_without_friction_the_coupled_robot_keeps_its_energy():
    """Links and rotors; the last rotor turns with q5 + q6."""
    robot = Robot(settings(FRICTIONLESS), PAYLOAD)
    rotor = np.array([a["motor"]["gear_ratio"] ** 2 * a["motor"]["rotor_inertia"] for a in SECTION["axes"]])

    def energy() -> float:
        turning = robot.motor_velocity / robot._ratio
        return (
            robot.bodies.energy(robot.joint_position.tolist(), robot.joint_velocity)
            + 0.5 * rotor @ turning**2
        )

    robot.set_state(np.array([0.0, -0.4, 1.2, 0.5, 0.3, 0.2]), np.array([0.5, 0.3, -0.4, 1.0, 0.5, -1.0]))
    start = energy()
    robot_energies, swing = [], []
    for _ in range(3000):
        robot.step(np.zeros(6), 1e-3)
        robot_energies.append(energy())
        swing.append(0.5 * rotor @ (robot.motor_velocity / robot._ratio) ** 2)
    assert max(swing) > 20.0
    assert np.abs(np.array(robot_energies) - start).max() < 2e-3 * max(swing)


def test_halving_the_stride_quarters_the_error():
    """Second order, as the integrator claims: against a run with a stride 32 times shorter."""
    start = np.array([0.0, -0.4, 1.2, 0.5, 0.3, 0.2]), np.array([0.5, 0.3, -0.4, 1.0, 0.5, -1.0])
    ends = {}
    for stride in (4e-3, 2e-3, 1.25e-4):
        robot = Robot(settings(FRICTIONLESS, longest_substep=stride), PAYLOAD)
        robot.set_state(*start)
        robot.step(np.zeros(6), 0.4)
        ends[stride] = robot.joint_position
    coarse = np.abs(ends[4e-3] - ends[1.25e-4]).max()
    fine = np.abs(ends[2e-3] - ends[1.25e-4]).max()
    assert 3.0 < coarse / fine < 5.0


def test_a_robot_of_one_axis_moves_like_the_arm():
    """Two mechanisms written apart, the same joint with friction, reversals and sticking."""
    friction = {
        "viscous": 40.0, "offset": 5.0, "dry_driving": 20.0, "dry_driving_stribeck": 5.0, "dry_backdriving": 15.0,
        "dry_backdriving_stribeck": 5.0, "load_driving": 0.05, "load_driving_stribeck": 0.1, "load_backdriving": 0.05,
        "load_backdriving_stribeck": 0.1, "stribeck_velocity": 0.05, "rotor_in_load": False,
    }  # fmt: skip
    axis = {
        "motor": {"gear_ratio": 100.0, "torque_constant": 0.5, "rotor_inertia": 1e-3},
        "friction": friction,
    }
    gravity = [0.0, -9.81, 0.0]
    arm = Arm(
        ArmSettings.model_validate(
            {
                "gravity": gravity,
                "link": {"inertia": 15.0 + 20 * 0.5**2, "first_moment": [20 * 0.5, 0.0]},
                "axis": axis,
            }
        )
    )
    link = {"mass": 20.0, "com": [0.5, 0.0, 0.0], "inertia": [1.0, 0.0, 0.0, 15.0, 0.0, 15.0]}
    robot = Robot(
        RobotSettings.model_validate(
            {"gravity": gravity, "links": [link], "axes": [axis], "longest_substep": 2.5e-4}
        )
    )
    apart = 0.0
    sticking = 0
    for k in range(4000):
        current = np.array([2.1 + 1.6 * math.sin(2e-3 * k)])
        arm.step(current, 1e-3)
        robot.step(current, 1e-3)
        apart = max(apart, abs(arm.joint_position - robot.joint_position[0]))
        sticking += arm.joint_velocity == 0.0
        assert (arm.joint_velocity == 0.0) == (robot.joint_velocity[0] == 0.0) or abs(
            arm.joint_velocity
        ) < 0.01
    assert sticking > 50
    assert apart < 2e-4


def test_with_brakes_on_the_robot_stands_for_a_minute():
    """Stiction above gravity in every joint: no axis creeps."""
    braked = [
        {**axis, "friction": {"dry_driving": 90.0, "dry_backdriving": 90.0}} for axis in SECTION["axes"]
    ]
    robot = Robot(settings({**SECTION, "axes": braked}, longest_substep=0.01), PAYLOAD)
    robot.set_state(np.array([0.3, -0.5, 1.0, 0.4, 0.6, 0.2]), np.zeros(6))
    angle = robot.motor_angle.copy()
    for _ in range(600):
        robot.step(np.zeros(6), 0.1)
    np.testing.assert_array_equal(robot.motor_angle, angle)


def test_motor_six_feels_the_wrist_as_power_balance_demands():
    """A current in motor 6 alone accelerates joints 5 and 6 by Nᵀ times its torque."""
    free = settings(FRICTIONLESS, gravity=[0.0, 0.0, 0.0])
    robot = Robot(free)
    robot.set_state(np.array([0.0, -1.5, 1.5, 0.0, 0.5, 0.0]), np.zeros(6))
    coupling = np.array(SECTION["coupling"])
    rotor = np.diag([a["motor"]["gear_ratio"] ** 2 * a["motor"]["rotor_inertia"] for a in SECTION["axes"]])
    mass, _ = robot.bodies.dynamics(robot.joint_position.tolist(), np.zeros(6))
    torque = coupling.T @ np.array([0, 0, 0, 0, 0, 32.0 * 0.10 * 2.0])
    expected = np.linalg.solve(mass + coupling.T @ rotor @ coupling, torque)
    robot.step(np.array([0, 0, 0, 0, 0, 2.0]), 1e-6)
    np.testing.assert_allclose(robot.joint_velocity / 1e-6, expected, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("rotor_in_load", [True, False])
@pytest.mark.parametrize("seed", range(4))
def test_in_sliding_every_gear_obeys_equation_25(seed, rotor_in_load):
    """Accelerations are consistent: motor torque = gear(load) + rotor, with the load that Pinocchio gives."""
    random = np.random.default_rng(seed)
    axes = [
        {**axis, "friction": {**axis["friction"], "rotor_in_load": rotor_in_load}} for axis in SECTION["axes"]
    ]
    plain = settings({**SECTION, "axes": axes}, coupling=None)
    robot = Robot(plain, PAYLOAD)
    q, v = random.uniform(-2, 2, 6), random.choice([-1, 1], 6) * random.uniform(0.05, 2, 6)
    current = random.uniform(-3, 3, 6)
    robot.set_state(q, v)
    robot.step(current, 1e-7)
    acceleration = (robot.joint_velocity - v) / 1e-7
    model = oracle(plain.links, plain.gravity, PAYLOAD)
    load = pin.rnea(model, model.createData(), q, v, acceleration)
    rotor = (
        np.array([axis.motor.gear_ratio**2 * axis.motor.rotor_inertia for axis in plain.axes]) * acceleration
    )
    if rotor_in_load:
        load, rotor = load + rotor, np.zeros(6)
    for j, axis in enumerate(plain.axes):
        f, s = axis.friction, np.sign(v[j])
        e = math.exp(-abs(v[j]) / f.stribeck_velocity)
        driving = (1 + f.load_driving + f.load_driving_stribeck * e) * load[j]
        driving += s * (f.dry_driving + f.dry_driving_stribeck * e)
        back = (1 - f.load_backdriving - f.load_backdriving_stribeck * e) * load[j]
        back += s * (f.dry_backdriving + f.dry_backdriving_stribeck * e)
        apart = f.viscous * v[j] + f.offset + rotor[j]
        passed = axis.motor.gear_ratio * axis.motor.torque_constant * current[j] - apart
        if abs(load[j]) < 1e-3:  # between the flanks
            assert min(driving, back) - 1e-2 <= passed <= max(driving, back) + 1e-2
        else:
            assert passed == pytest.approx(driving if load[j] * s > 0 else back, abs=2e-3 * (1 + abs(passed)))


def test_the_same_seed_gives_the_same_motion():
    noisy = [{**axis, "motor": {**axis["motor"], "current_noise": 0.1}} for axis in SECTION["axes"]]
    robot = Robot(settings({**SECTION, "axes": noisy}))
    ends = []
    for seed in (3, 3, 4):
        robot.reset(seed)
        for _ in range(100):
            robot.step(np.full(6, 1.0), 1e-3)
        ends.append(robot.motor_angle)
    assert np.array_equal(ends[0], ends[1])
    assert not np.array_equal(ends[0], ends[2])


def test_effects_that_need_one_axis_are_refused_on_a_robot():
    section = {**SECTION, "hidden_effects": [{"effect": "backlash", "gap": 0.001, "joint": 2}]}
    with pytest.raises(PlantSettingsError, match="backlash is there for an arm only"):
        read_plant_settings(section)
    section = {**SECTION, "hidden_effects": [{"effect": "joint-spring", "stiffness": 1.0, "joint": 7}]}
    with pytest.raises(PlantSettingsError, match="joint 7 of 6"):
        read_plant_settings(section)
    assert build_mechanism(SECTION).axes == 6


def test_axes_that_stop_one_after_the_other_go_the_way_that_each_is_braked_over():
    """Two axes that do not feel each other: dry friction brakes each by itself, over w²/2a, and there it stays."""
    inertia = (0.3, 0.2)  # kg m², the same about every axis of a link, whose centre is where the axes meet
    links = [
        {"mass": 1.0, "com": [0.0, 0.0, 0.0], "inertia": [j, 0.0, 0.0, j, 0.0, j], "alpha": alpha}
        for j, alpha in zip(inertia, (0.0, math.pi / 2), strict=True)
    ]
    dry, rotor = (2.0, 3.0), 0.05
    axes = [
        {
            "motor": {"gear_ratio": 1.0, "torque_constant": 1.0, "rotor_inertia": rotor},
            "friction": {"dry_driving": c, "dry_backdriving": c, "rotor_in_load": False},
        }
        for c in dry
    ]
    robot = Robot(RobotSettings.model_validate({"gravity": [0.0, 0.0, 0.0], "links": links, "axes": axes}))
    braking = np.array(dry) / (np.array([sum(inertia), inertia[1]]) + rotor)
    stops = np.array([0.0507, 0.0503])  # s, within one stride of the integrator
    velocity = braking * stops * [1.0, -1.0]
    robot.set_state(np.zeros(2), velocity)
    for cycles in range(1, 40):
        robot.step(np.zeros(2), 0.004)
        time = np.minimum(cycles * 0.004, stops)
        way = np.sign(velocity) * (np.abs(velocity) * time - 0.5 * braking * time**2)
        np.testing.assert_allclose(robot.joint_position, way, atol=1e-9)
    np.testing.assert_array_equal(robot.joint_velocity, np.zeros(2))
