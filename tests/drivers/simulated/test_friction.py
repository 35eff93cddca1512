"""The simulated gear's friction, against eq. (25) written out."""

from math import exp

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.simulated.friction import GearFriction
from drivers.simulated.plant_settings import FrictionSettings

SETTINGS = FrictionSettings(
    dry_driving=21.0,
    dry_driving_stribeck=3.0,
    dry_backdriving=15.0,
    dry_backdriving_stribeck=2.0,
    load_driving=0.044,
    load_driving_stribeck=0.142,
    load_backdriving=0.044,
    load_backdriving_stribeck=0.157,
    stribeck_velocity=0.03,
)
GEAR = GearFriction(SETTINGS)


def torque(load, velocity):
    e = exp(-abs(velocity) / 0.03)
    sign = 1.0 if velocity > 0 else -1.0
    if load * velocity > 0:
        return (1.044 + 0.142 * e) * load + (21.0 + 3.0 * e) * sign
    return (0.956 - 0.157 * e) * load + (15.0 + 2.0 * e) * sign


@pytest.mark.parametrize("load", [100.0, -100.0, 3.0])
@pytest.mark.parametrize("velocity", [0.001, 0.02, 1.0, -0.02, -1.0])
def test_the_torque_is_that_of_the_paper_in_all_quadrants(load, velocity):
    direction = 1.0 if velocity > 0 else -1.0
    assert GEAR.torque(load, abs(velocity), direction) == pytest.approx(torque(load, velocity), rel=1e-12)


@pytest.mark.parametrize("load", [100.0, -100.0])
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_share_factor_and_extra_act_on_dry_friction_alone_and_always_against_the_motion(load, direction):
    whole = GEAR.torque(load, 0.02, direction) - load
    assert whole * direction > 0
    assert GEAR.torque(load, 0.02, direction, factor=1.5) - load == pytest.approx(1.5 * whole)
    assert GEAR.torque(load, 0.02, direction, extra=7.0) - load == pytest.approx(whole + 7.0 * direction)
    assert GEAR.torque(load, 0.02, direction, 0.5, 1.5, 7.0) - load == pytest.approx(
        0.5 * (1.5 * whole + 7.0 * direction)
    )


@given(
    drive=st.floats(-400, 400),
    static=st.floats(-200, 200),
    speed=st.floats(0, 2),
    direction=st.sampled_from([1.0, -1.0]),
    rotor=st.floats(0, 5),
)
def test_acceleration_and_load_balance_the_torque_that_they_were_solved_for(
    drive, static, speed, direction, rotor
):
    acceleration, load = GEAR.acceleration(drive, static, 20.0, rotor, speed, direction)
    assert load == pytest.approx(20.0 * acceleration + static, abs=1e-9)
    if load != 0.0:
        needed = GEAR.torque(load, speed, direction) + rotor * acceleration
        assert needed == pytest.approx(drive, abs=1e-7)


@pytest.mark.parametrize("load", [80.0, -80.0])
def test_a_gear_at_rest_holds_between_the_limits_of_sliding_either_way(load):
    lower, upper = GEAR.stiction_limits(load)
    assert lower == pytest.approx(GEAR.torque(load, 0.0, -1.0))
    assert upper == pytest.approx(GEAR.torque(load, 0.0, 1.0))


def test_without_load_it_holds_as_much_as_it_takes_to_drive():
    assert GEAR.stiction_limits(0.0) == (-24.0, 24.0)
