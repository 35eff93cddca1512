"""Whether a closed loop is stable, against the criterion of Routh and Hurwitz for one joint.

With inertia M, viscous friction F_V and gains k_p, k_v, k_i the deviations follow s³ + d s² + k s + i, d = (g k_v + F_V)/M,
k = g k_p/M, i = g k_i/M, gravity being small beside g k_p: they grow where i > d k.
"""

from __future__ import annotations

import numpy as np
import pytest

from identify.identification import identify
from identify.recording.controller_file import JointController
from identify.simulation.controller import Controllers
from identify.simulation.loop_stability import growth, unstable_loop
from identify.simulation.measured_motion import measured_motions
from identify.simulation.torque_model import TorqueModel
from tests.identify.estimation.simulated_arm import Arm, Motion, experiment, record

KP, KV = 4000.0, 50.0
PLANT = Arm(first_moment=(0.02, 0.0))


@pytest.fixture(scope="module")
def joint():
    raw = record(Motion(), PLANT, np.random.default_rng(2), duration=10.0, torque_noise=0.05)
    result = identify(experiment({"a": (raw, "none")}), "usual")
    (entry,) = result.experiment.sessions
    return result, entry, measured_motions(result.fitted.record, entry)[0]


def loop(name, **gains):
    return Controllers((JointController(joint=name, **gains),), ("qref1",), np.eye(1))


def limit(gain):
    """k_i beyond which deviations grow."""
    return KP * (gain * KV + PLANT.viscous) / PLANT.inertia


@pytest.mark.parametrize(("part", "stable"), [(0.5, True), (0.95, True), (1.3, False), (100.0, False)])
def test_an_integral_beyond_the_limit_of_routh_and_hurwitz_grows(joint, part, stable):
    result, entry, motion = joint
    gain = float(result.experiment.drive_gain[0, 0])
    controllers = loop("j3", position=KP, velocity=KV, integral=part * limit(gain))
    growing = growth(TorqueModel(result.fitted, entry), motion, controllers)
    assert (growing is None) is stable
    if growing:
        M = PLANT.inertia
        roots = np.roots([1.0, (gain * KV + PLANT.viscous) / M, gain * KP / M, gain * part * limit(gain) / M])
        assert growing.rate == pytest.approx(roots.real.max(), rel=0.05)


def test_it_is_said_by_joint_and_gains(joint):
    result, entry, motion = joint
    gain = float(result.experiment.drive_gain[0, 0])
    said = unstable_loop(
        result.fitted, [(entry, motion)], loop("j3", position=KP, velocity=KV, integral=100.0 * limit(gain))
    )
    assert said
    assert said.startswith("the loop with these gains is unstable: a deviation grows to e times itself in ")
    assert "of joint 'j3' (position 4000, velocity 50, integral " in said
    held = loop("j3", position=KP, velocity=KV)
    assert unstable_loop(result.fitted, [(entry, motion)], held) is None


def test_a_speed_gain_of_the_wrong_sign_grows(joint):
    result, entry, motion = joint
    assert unstable_loop(result.fitted, [(entry, motion)], loop("j3", position=KP, velocity=-KV))
