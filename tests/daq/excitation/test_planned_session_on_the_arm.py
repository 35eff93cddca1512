"""A planned session as the simulated arm really moves: what the plan promises shows in the motion itself."""

import itertools

import numpy as np
import pytest

from daq.excitation import ExcitationPlan, standard_plan
from daq.rig import Rig
from drivers.simulated.arm import Arm
from drivers.simulated.plant import build_mechanism


class Servo:
    """Position loop around a velocity loop with integral action, at one kilohertz, for these tests."""

    def __init__(self, arm: Arm, plan: ExcitationPlan, period: float = 1e-3) -> None:
        self.arm, self.period = arm, period
        self.time = np.arange(0.0, plan.duration, period)
        self.setpoints = plan.setpoints(self.time)
        arm.set_state(float(plan.start[0]))

    def run(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(N,) position, velocity and current of the session."""
        arm, period = self.arm, self.period
        integral, rows = 6.0, []
        for goal, speed in zip(self.setpoints.position[:, 0], self.setpoints.velocity[:, 0], strict=True):
            q, v = arm.joint_position, arm.joint_velocity
            error = 30.0 * (goal - q) + speed - v
            integral += 2000.0 * error * period
            current = 150.0 * error + integral
            rows.append((q, v, current))
            arm.step(np.array([current]), period)
        q, v, current = np.array(rows).T
        return q, v, current


@pytest.fixture(scope="module")
def rig() -> Rig:
    return Rig.load("rx130l-joint3-simulated")


@pytest.fixture(scope="module")
def moved(rig):
    assert rig.simulated is not None
    plan = standard_plan(rig, 60.0)
    arm = build_mechanism(rig.simulated["plant"], rig.payload("disk-7").model_dump())
    assert isinstance(arm, Arm)
    servo = Servo(arm, plan)
    q, v, current = servo.run()
    load = arm.inertia * np.gradient(v, servo.period) + arm.first_moment[0] * 9.81 * np.cos(q)
    return plan, servo, q, v, current, load


def test_the_arm_follows_within_the_following_error_and_the_current_limit(rig, moved):
    _, servo, q, _, current, _ = moved
    limits = rig.axes[0].limits
    assert np.abs(q - servo.setpoints.position[:, 0]).max() < limits.following_error
    assert np.abs(current).max() < limits.current


def test_all_four_quadrants_are_driven(moved):
    *_, v, _, load = moved
    moving = np.abs(v) > 1e-3
    for direction in (1.0, -1.0):
        for side in (1.0, -1.0):
            share = np.mean((v[moving] * direction > 0.0) & (load[moving] * side > 0.0))
            assert share > 0.04, (direction, side)


def test_one_percent_of_the_highest_speed_is_held_both_ways(rig, moved):
    """The plateau at 1 % is reached in spite of stick-slip: the mean speed over it is the planned one."""
    plan, servo, q, *_ = moved
    slowest = 0.01 * 0.98 * rig.axes[0].limits.velocity
    edges = plan.boundaries
    directions = set()
    planned_speed = servo.setpoints.velocity[:, 0]
    for begin, end in itertools.pairwise(edges):
        rows = (servo.time >= begin) & (servo.time < end) & (np.abs(np.abs(planned_speed) - slowest) < 1e-9)
        if np.count_nonzero(rows) > 200:
            mean = np.polyfit(servo.time[rows], q[rows], 1)[0]
            assert mean == pytest.approx(planned_speed[rows][0], rel=0.35)
            directions.add(np.sign(mean))
    assert directions == {1.0, -1.0}


def test_the_repeated_stretch_repeats_in_the_motion_too(moved):
    plan, servo, q, *_ = moved
    ((begin, _, period),) = plan.repeated
    time = np.linspace(begin + period, begin + 2 * period, 200)
    second, third = (np.interp(time + k * period, servo.time, q) for k in (0, 1))
    assert np.abs(second - third).max() < 5e-4
