"""The power sign of eq. (26)-(28) and the columns that hang on it."""

from types import SimpleNamespace

import numpy as np

from identify.effects.dry_friction import LoadFriction, LoadFrictionAsymmetric, quadrant_directions, quadrants

LOAD = np.array([2.0, -3.0, 2.0, -3.0, 4.0])
DIRECTION = np.array([1.0, -1.0, -1.0, 1.0, 0.5])  # the last is a sample within a reversal


def test_quadrants_1_and_3_drive_and_2_and_4_are_driven():
    driving, driven = quadrants(LOAD, DIRECTION)
    np.testing.assert_array_equal(driving, [1.0, 1.0, 0.0, 0.0, 0.75])
    np.testing.assert_array_equal(driven, [0.0, 0.0, 1.0, 1.0, 0.25])


def test_both_directions_add_to_the_direction_and_differ_by_the_load_s_sign_within_a_reversal_too():
    ahead, back = quadrant_directions(LOAD, DIRECTION)
    np.testing.assert_array_equal(ahead + back, DIRECTION)
    np.testing.assert_array_equal(ahead - back, np.sign(LOAD))


def test_load_friction_is_alpha_times_the_gear_s_load_without_what_turns_the_rotor():
    ddq = np.array([1.0, 2.0, -1.0, 0.0, 3.0])
    motion = SimpleNamespace(
        load=LOAD, direction=DIRECTION, ddq=ddq, gear_load=lambda rotor: LOAD - rotor * ddq
    )
    column = LoadFriction().columns(motion, {"rotor_inertia": 0.5})[:, 0]
    np.testing.assert_allclose(column, np.abs(LOAD - 0.5 * ddq) * DIRECTION)


def test_friction_by_the_power_sign_has_one_column_for_each_pair_of_quadrants():
    motion = SimpleNamespace(
        load=LOAD[:4], direction=DIRECTION[:4], ddq=np.zeros(4), gear_load=lambda rotor: LOAD[:4]
    )
    columns = LoadFrictionAsymmetric().columns(motion, {"rotor_inertia": 0.0})
    np.testing.assert_allclose(columns[:, 0], [2.0, -3.0, 0.0, 0.0])
    np.testing.assert_allclose(columns[:, 1], [0.0, 0.0, -2.0, 3.0])


def test_a_gear_may_lose_any_share_of_its_load_and_gives_none_back():
    (alpha,) = LoadFriction().parameters
    assert alpha.lower == 0.0
    assert alpha.upper > 1.0, "a worm gear that locks itself loses more than it passes on"
