"""A record with nothing to fit is refused in one line, whichever of its sessions are asked for."""

from dataclasses import replace

import numpy as np
import pytest

import identify
from tests.identify.estimation import simulated_arm

CUTOFFS = {"position_cutoff": 48.0, "decimation_cutoff": 19.2}


@pytest.fixture(scope="module")
def measured():
    return simulated_arm.record(
        simulated_arm.Motion(), simulated_arm.Arm(), np.random.default_rng(1), duration=8.0, rate=200.0
    )


def refusal(sessions, payloads=()):
    experiment = simulated_arm.experiment(sessions, payloads=[("brick", 3.0)], signals=CUTOFFS)
    with pytest.raises(identify.InputError) as refused:
        identify.identify(experiment, "usual", payloads=payloads)
    return str(refused.value)


def test_the_sessions_of_the_payload_asked_for_have_no_torque(measured):
    without = replace(measured, command=np.zeros_like(measured.command))
    said = refusal({"a": (measured, "none"), "b": (without, "brick")}, ["brick"])
    assert said == "memory/b: column 'v1' is zero throughout: no torque of joint 'j3' was recorded"


def test_the_joint_is_at_rest_in_the_sessions_of_the_payload_asked_for(measured):
    at_rest = replace(measured, position=np.full_like(measured.position, 0.3))
    said = refusal({"a": (measured, "none"), "b": (at_rest, "brick")}, ["brick"])
    assert said == "memory/b: no joint moves, so there is nothing to identify; record a motion"


def test_a_torque_whose_square_is_zero_is_none(measured):
    """The relative error would be 0/0 though no value is zero."""
    tiny = replace(measured, command=1e-200 * np.sign(measured.command))
    said = refusal({"a": (tiny, "none"), "b": (tiny, "none")})
    assert said.startswith("memory/a and 1 more: column 'v1' is zero wherever a joint moves")
