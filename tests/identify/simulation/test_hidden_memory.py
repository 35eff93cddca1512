"""Hidden gives between motor and link: the right effect predicts motion better, if not as the true parameters do.

The plants share no code with the identifier; each session of them has a pace of its own, so that the rigid parameters
cannot stand for the give.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identify import load_experiment
from identify.identification import identify
from identify.recording.controller_file import JointController
from identify.simulation.controller import Controllers
from identify.simulation.measured_motion import measured_motions
from identify.simulation.rollout import energy_drift, roll_out
from identify.simulation.torque_model import LINK, TorqueModel
from identify.simulation.unseen_motion import unseen_motion
from tests.plants import two_masses
from tests.plants.two_masses import TwoMasses


@pytest.fixture(scope="module")
def elastic(tmp_path_factory):
    plant = TwoMasses(stiffness=4e4, damping=40.0, coulomb=0.5, first_moment=20.0, noise=0.005)
    masses, paces = (0.0, 4.0, 4.0, 0.0, 2.0), (4.0, 11.0, 6.0, 9.0, 8.0)
    recorded = two_masses.record(plant, masses, paces, 9.0, 3)
    experiment = load_experiment(
        two_masses.write_experiment(tmp_path_factory.mktemp("elastic") / "bench", recorded)
    )
    return recorded, identify(experiment, "usual"), identify(experiment, "usual", ["elasticity"])


@pytest.fixture(scope="module")
def rollout(elastic):
    """The identified arm in its validation session."""
    _, _, right = elastic
    entry = right.experiment.sessions[4]
    (motion,) = measured_motions(right.fitted.record, entry)
    return TorqueModel(right.fitted, entry), motion


def test_with_the_hidden_elasticity_motion_is_predicted_better_than_any_rigid_transmission_can(elastic):
    """Not as well as with the true parameters, in the plant's own code, which leave a third of the error."""
    recorded, usual, right = elastic
    before, after = unseen_motion(usual.fitted), unseen_motion(right.fitted)
    assert before is not None
    assert after is not None
    true = two_masses.one_second_error(recorded, 4)
    assert after.rms[0] < 0.5 * before.rms[0]
    assert after.rms[0] < 4.0 * true < before.rms[0]
    assert not after.worse_than(before)[0]


def test_of_the_record_a_simulation_knows_nothing_but_where_it_starts_and_what_drives_it(rollout):
    """The twist at the start is that of a parabola through the rows around it, less than a tenth of a second. Its speed is
    filtered without phase before, from rows to either side too."""
    model, motion = rollout
    first, samples = [300, 700], 80
    course = roll_out(model, motion, first, samples)
    altered = {name: getattr(motion, name).copy() for name in ("q", "dq", "ddq", "direction")}
    for start in first:
        for values in altered.values():
            values[start + 20 : start + samples + 10] *= 1.01
    again = roll_out(model, replace(motion, **altered), first, samples)
    for name in ("q", "dq"):
        np.testing.assert_array_equal(getattr(course, name), getattr(again, name))


def test_the_energy_of_both_masses_and_the_spring_is_the_work_done_on_them(rollout):
    model, motion = rollout
    drift = energy_drift(model, motion, roll_out(model, motion, [100, 900], 150))
    assert drift is not None
    assert drift < 2e-3


def test_in_a_closed_loop_the_encoder_is_on_the_motor(rollout):
    """The controller's command follows from the motor's motion, whatever the link does."""
    model, motion = rollout
    gains = JointController(joint="elbow", position=400.0, velocity=25.0)
    controllers = Controllers((gains,), ("qref1",), np.eye(1))
    asked = replace(motion, extra={"qref1": motion.q[:, 0]})
    course = roll_out(model, asked, [200], 100, controllers)
    error = motion.q[200:300] - course.q[:, 0]
    np.testing.assert_allclose(
        course.applied[:, 0], 30.0 * (400.0 * error - 25.0 * course.dq[:, 0]), rtol=1e-9
    )
    link = course.memory[LINK, 0][:, 0]
    assert np.max(np.abs(link - course.q[:, 0, 0])) > 1e-3


def test_the_identified_spring_is_the_hidden_one(elastic):
    _, _, right = elastic
    give = TorqueModel(right.fitted, right.experiment.sessions[4]).gives[0]
    assert give.compliance == pytest.approx(1 / 4e4, rel=0.1)
    assert give.rotor == pytest.approx(4.0, rel=0.25)
