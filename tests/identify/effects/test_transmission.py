"""Effects of the drive chain: columns against their equations."""

import numpy as np

from identify.effects.transmission import CoupledFriction, Elasticity, MotorInertia
from tests.identify.effects.motions import motion_of

MOTION = motion_of()


def test_a_gear_that_twists_gives_back_the_load_s_second_derivative_and_its_slope():
    time = MOTION.time
    load = 40.0 * np.sin(15.0 * time)
    columns = Elasticity().columns(motion_of(load=load), {})
    inside = slice(5, -5)
    np.testing.assert_allclose(columns[inside, 0], 40.0 * 225.0 * np.sin(15.0 * time[inside]), atol=2.0)
    np.testing.assert_allclose(columns[:, 1], load * 30.0 * np.sin(MOTION.q), rtol=1e-12, atol=1e-12)
    assert all(parameter.lower == 0.0 for parameter in Elasticity().parameters)


def test_a_shared_motor_s_inertia_and_friction_reach_the_joint_by_its_share():
    velocity, acceleration = MOTION.motor_velocity, MOTION.motor_acceleration
    np.testing.assert_allclose(MotorInertia().columns(MOTION, {})[:, 0], acceleration / 2)
    expected = np.column_stack([velocity / 2, np.sign(velocity) / 2, acceleration / 2])
    np.testing.assert_allclose(CoupledFriction().columns(MOTION, {}), expected)
