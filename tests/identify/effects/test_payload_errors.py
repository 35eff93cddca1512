"""Loads that are not as declared: which payload has which columns, and what they hold."""

import numpy as np
import pytest

from identify.effects.payload_errors import (
    GravityTilt,
    PayloadCentre,
    PayloadMass,
    loaded_payloads,
    payload_slots,
)
from tests.identify.effects.motions import motion_of
from tests.identify.effects.summaries import summary_of

SUMMARY = summary_of(
    payloads=("none", "disk", "never", "ring"),
    payload_masses=(0.0, 5.0, 3.0, 2.0),
    payload_of_session=(0, 1, 3),
)
MOTION = motion_of()


def test_payloads_with_a_mass_that_were_carried_have_slots_in_their_order():
    assert loaded_payloads(SUMMARY) == [1, 3]
    assert payload_slots(SUMMARY) == {"payload_1": 0.0, "payload_3": 1.0}
    assert PayloadMass().grid(SUMMARY) == PayloadCentre().grid(SUMMARY) == [payload_slots(SUMMARY)]


def test_parameters_are_named_by_their_payload():
    masses = [each.name for each in PayloadMass().parameters_of(SUMMARY, {})]
    assert masses == ["mass_ratio[disk]", "mass_ratio[ring]"]
    centres = [each.name for each in PayloadCentre().parameters_of(SUMMARY, {})]
    assert centres == [f"com_{axis}[{name}]" for name in ("disk", "ring") for axis in "xyz"]


@pytest.mark.parametrize(("payload", "slot"), [(0, None), (1, 0), (3, 1)])
def test_a_session_fills_the_columns_of_its_own_payload_alone(payload, slot):
    motion, slots = motion_of(payload=payload), payload_slots(SUMMARY)
    mass, centre = PayloadMass().columns(motion, slots), PayloadCentre().columns(motion, slots)
    assert (mass.shape[1], centre.shape[1]) == (2, 6)
    for place in (0, 1):
        here = 1.0 if place == slot else 0.0
        np.testing.assert_array_equal(mass[:, place], here * MOTION.known_load)
        np.testing.assert_array_equal(centre[:, 3 * place : 3 * place + 3], here * MOTION.payload_gradient)


def test_ratios_are_reported_as_such_and_stand_for_the_model_s_own():
    assert PayloadMass().reported_offset({}) == 1.0
    assert PayloadMass().replaces_payload_ratio({})
    assert not PayloadCentre().replaces_payload_ratio({})


def test_a_tilt_is_at_most_all_of_gravity():
    np.testing.assert_array_equal(GravityTilt().columns(MOTION, {}), MOTION.gravity_gradient)
    for parameter in GravityTilt().parameters:
        assert (parameter.lower, parameter.upper) == (-9.80665, 9.80665)
