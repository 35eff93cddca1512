"""The gains of a drive as one linear law, against the loops themselves, stepped in time."""

import math

import numpy as np
import pytest
from pydantic import TypeAdapter, ValidationError

from drivers.profile import load_profile
from drivers.servo_objects import CascadeObjects, PidObjects, ServoLaw, ServoObjects
from drivers.simulated.servo import Servo
from drivers.simulated.settings import ServoSettings, SimulatedAxis

PERIOD = 1e-4
TIME = PERIOD * np.arange(4000)
REFERENCE = 0.3 * np.sin(9.0 * TIME) + 0.1 * TIME
POSITION = REFERENCE - 0.01 * np.sin(23.0 * TIME)


def by_law(law: ServoLaw) -> np.ndarray:
    """Current of the law along the motion, from its beginning on."""
    error = REFERENCE - POSITION
    speed, reference_speed = np.gradient(POSITION, PERIOD), np.gradient(REFERENCE, PERIOD)
    return (
        law.position * error
        + law.integral * PERIOD * np.cumsum(error)
        + law.reference_velocity * reference_speed
        + law.reference_acceleration * np.gradient(reference_speed, PERIOD)
        + law.reference_travel * (REFERENCE - REFERENCE[0])
        - law.velocity * speed
    )


def gain(unit, **changed):
    return {"index": 0x2030, "type": "uint32", "scale": 0.001, "unit": unit, "source": "manual"} | changed


def cascade(feed_forward=1.0, integral="A/rad") -> CascadeObjects:
    return CascadeObjects.model_validate(
        {
            "structure": "cascade",
            "position_gain": gain("1/s"),
            "velocity_gain": gain("A s/rad"),
            "velocity_integral": gain(integral),
            "velocity_feed_forward": feed_forward,
        }
    )


def test_the_law_of_the_simulated_drive_is_what_its_servo_does():
    """The servo itself is stepped along a motion, with an encoder so fine that its counts do not show."""
    settings = ServoSettings(
        position_gain=30.0, velocity_gain=1.8, velocity_integral=60.0, velocity_filter=0.0
    )
    axis = SimulatedAxis(node=1, counts_per_turn=2_000_000_000, servo=settings)
    servo, counts = Servo(axis), axis.counts_per_radian
    currents = []
    speed = np.gradient(REFERENCE, PERIOD)
    for reference, ahead, position in zip(REFERENCE, speed, POSITION, strict=True):
        at = math.floor(position * counts)
        servo.observe(at, PERIOD)
        currents.append(servo.follow_position(reference * counts, ahead * counts, at, 1e9, PERIOD))
    servo_objects = load_profile("simulated").servo
    held = {
        each.index: servo.raw[each.index] * each.scale
        for each in [
            servo_objects.position_gain,
            servo_objects.velocity_gain,
            servo_objects.velocity_integral,
        ]
    }
    law = by_law(servo_objects.law(lambda _, each: held[each.index]))
    rest = np.array(currents)[10:] - law[10:]
    # a constant, where the integral begins, and what a backward difference is late by
    assert np.ptp(rest) < 1e-2 * np.ptp(law)


@pytest.mark.parametrize("share", [0.0, 0.4, 1.0, 1.2])
def test_a_cascade_with_any_share_of_feed_forward_is_its_own_law(share):
    stiffness, damping, integral = 20.0, 1.5, 70.0
    values = {"position_gain": stiffness, "velocity_gain": damping, "velocity_integral": integral}
    law = by_law(cascade(share).law(lambda name, _: values[name]))
    speed, reference_speed = np.gradient(POSITION, PERIOD), np.gradient(REFERENCE, PERIOD)
    wanted = stiffness * (REFERENCE - POSITION) + share * reference_speed - speed
    loop = damping * wanted + integral * PERIOD * np.cumsum(wanted)
    assert np.ptp(loop - law) < 2e-3 * np.ptp(loop)


def test_an_integral_time_is_the_gain_over_it():
    values = {"position_gain": 20.0, "velocity_gain": 2.0, "velocity_integral": 0.04}
    assert cascade(integral="s").law(lambda name, _: values[name]).integral == pytest.approx(20.0 * 50.0)
    values["velocity_integral"] = 0.0  # how drives say that there is none
    assert cascade(integral="s").law(lambda name, _: values[name]).integral == 0.0


def test_the_derivative_of_a_pid_damps_and_leads():
    servo = load_profile("maxon-epos4").servo
    assert isinstance(servo, PidObjects)
    raw = {1: 1_443_132, 2: 32_078_755, 3: 20_733, 4: 908, 5: 108}
    law = servo.law(lambda _, each: raw[each.subindex] * each.scale)
    assert law == ServoLaw(
        position=pytest.approx(1.443132),
        integral=pytest.approx(32.078755),
        velocity=pytest.approx(0.020733),
        reference_velocity=pytest.approx(0.021641),
        reference_acceleration=pytest.approx(1.08e-4),
    )


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"position_gain": gain("A/rad")}, "position_gain: must be in 1/s, not A/rad"),
        ({"velocity_integral": gain("1/s")}, "velocity_integral: must be in A/rad or s"),
        ({"velocity_feed_forward": None}, "velocity_feed_forward"),
        ({"structure": "fuzzy"}, "'cascade', 'pid'"),
    ],
)
def test_gains_in_other_units_are_refused_by_name(change, said):
    with pytest.raises(ValidationError, match=said):
        TypeAdapter(ServoObjects).validate_python(cascade().model_dump() | change)
