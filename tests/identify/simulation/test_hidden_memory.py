"""Hidden gives between motor and link: the right effect predicts motion as the true parameters do from the same measured start.

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
from identify.simulation.give_fit import give_fit
from identify.simulation.measured_motion import measured_motions
from identify.simulation.rollout import energy_drift, roll_out
from identify.simulation.start_state import start_state
from identify.simulation.torque_model import LINK, LINK_SPEED, TorqueModel
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


def test_with_the_hidden_elasticity_motion_is_predicted_as_with_the_true_parameters(elastic):
    recorded, usual, right = elastic
    before, after = unseen_motion(usual.fitted), unseen_motion(right.fitted)
    assert before is not None
    assert after is not None
    true = two_masses.one_second_error(
        recorded, 4, two_masses.measured_states(recorded, 4, np.arange(100, 3900, 500))
    )
    assert after.rms[0] < 2.0 * true < 0.5 * before.rms[0]
    assert before.worse_than(after)[0]


def test_of_the_record_a_simulation_knows_nothing_but_what_was_until_its_start_and_what_drives_it(rollout):
    """Filters without phase see rows to either side, but only where the model begins to follow the motor, long before."""
    model, motion = rollout
    course = roll_out(model, motion, [500], 80)
    altered = {name: getattr(motion, name).copy() for name in ("q", "dq", "ddq", "direction", "recorded")}
    for name, values in altered.items():
        values[501 if name == "recorded" else 430 : 590] *= 1.01
    again = roll_out(model, replace(motion, **altered), [500], 80)
    for name in ("q", "dq"):
        np.testing.assert_allclose(getattr(course, name), getattr(again, name), atol=1e-13)


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
    """Too soft where noise of the encoder makes the link ring behind its motor, which is taken for damping."""
    _, _, right = elastic
    give = give_fit(right.fitted).gives[0]
    assert give.compliance == pytest.approx(1 / 4e4, rel=0.25)
    assert give.rotor == pytest.approx(4.0, rel=0.35)
    assert give.link_dry == 0.0
    assert right.fitted.fit.chi[0] == pytest.approx(12.0, rel=0.02)


@pytest.fixture(scope="module")
def gapped(tmp_path_factory):
    """A quiet joint with a hidden gap, identified without and with it."""
    plant = TwoMasses(stiffness=3e5, damping=800.0, gap=4e-3, coulomb=5.0, first_moment=2.0, noise=0.005)
    masses, paces = (0.0, 4.0, 4.0, 0.0, 2.0), (4.0, 11.0, 6.0, 9.0, 8.0)
    recorded = two_masses.record(plant, masses, paces, 9.0, 3)
    experiment = load_experiment(
        two_masses.write_experiment(tmp_path_factory.mktemp("gap") / "bench", recorded)
    )
    usual, right = identify(experiment, "usual"), identify(experiment, "usual", ["backlash"])
    return recorded, usual, right


def motion_errors(result):
    """Motion of the validation session, where windows begin each 0.2 s, and their errors a second ahead."""
    entry = result.experiment.sessions[4]
    (motion,) = measured_motions(result.fitted.record, entry)
    samples, every = round(1.0 / motion.period) + 1, round(0.2 / motion.period)
    first = np.arange(2 * every, len(motion) - samples, every)
    course = roll_out(TorqueModel(result.fitted, entry), motion, first.tolist(), samples)
    rows = first[None, :] + np.arange(samples)[:, None]
    return motion, first, float(np.sqrt(np.mean((course.q - motion.q[rows]) ** 2)))


def test_with_the_hidden_gap_motion_is_predicted_within_twice_of_the_true_parameters(gapped):
    """True parameters begin at measured states of the plant's own making, which see rows after the start; and at ours."""
    recorded, usual, right = gapped
    gap = recorded.plant.gap
    assert give_fit(right.fitted).gives[0].gap == pytest.approx(gap, rel=0.1)
    assert give_fit(right.fitted).gives[0].rotor == pytest.approx(4.0, rel=0.1)
    assert give_fit(right.fitted).gives[0].link_dry == 0.0
    motion, first, after = motion_errors(right)
    _, _, before = motion_errors(usual)
    rows = np.round(motion.time[first] / (recorded.time[1] - recorded.time[0])).astype(int)
    model = TorqueModel(right.fitted, right.experiment.sessions[4])
    windows = start_state(model, motion, first).windows
    begun = two_masses.Begun(
        rows, windows.q[:, 0], windows.dq[:, 0], windows.memory[LINK, 0], windows.memory[LINK_SPEED, 0]
    )
    for states in (two_masses.measured_states(recorded, 4, rows), begun):
        assert after < 2.0 * two_masses.one_second_error(recorded, 4, states)
    assert after < 0.5 * before
    # links are where they are, to a tenth of the gap: that of the plant is nobody's measurement
    assert np.median(np.abs(begun.link - recorded.link[rows, 4])) < 0.1 * gap
    assert np.median(np.abs(begun.link_speed - recorded.link_speed[rows, 4])) < 2e-3


@pytest.fixture(
    scope="module",
    params=[
        (
            "backlash",
            TwoMasses(stiffness=3e5, damping=800.0, gap=15e-3, gravity=0.0, coulomb=4.0, link_coulomb=20.0),
        ),
        ("elasticity", TwoMasses(damping=40.0, coulomb=9.6, link_coulomb=14.4)),
    ],
    ids=["behind-a-gap", "on-a-spring"],
)
def rubbing(request, tmp_path_factory):
    """A link with dry friction of its own, identified without and with what gives."""
    effect, plant = request.param
    masses, paces = (0.0, 4.0, 4.0, 0.0, 2.0), (4.0, 11.0, 6.0, 9.0, 8.0)
    recorded = two_masses.record(replace(plant, noise=0.005), masses, paces, 9.0, 3)
    experiment = load_experiment(
        two_masses.write_experiment(tmp_path_factory.mktemp("rubbing") / "bench", recorded)
    )
    return recorded, identify(experiment, "usual"), identify(experiment, "usual", [effect])


def test_with_dry_friction_on_the_link_motion_is_predicted_as_with_the_true_parameters(rubbing):
    recorded, usual, right = rubbing
    plant = recorded.plant
    given = give_fit(right.fitted)
    give = given.gives[0]
    assert give.link_dry == pytest.approx(plant.link_coulomb, rel=0.1)
    assert give.rotor == pytest.approx(plant.rotor, rel=0.25)
    (on_motor,) = (
        given.fitted.fit.chi[columns[0]]
        for slot, columns in zip(given.fitted.slots, given.fitted.observation.slot_columns, strict=True)
        if slot.term.effect.name == "coulomb"
    )
    assert on_motor == pytest.approx(plant.coulomb, abs=0.05 * (plant.coulomb + plant.link_coulomb))
    motion, first, after = motion_errors(right)
    _, _, before = motion_errors(usual)
    rows = np.round(motion.time[first] / (recorded.time[1] - recorded.time[0])).astype(int)
    true = two_masses.one_second_error(recorded, 4, two_masses.measured_states(recorded, 4, rows))
    assert after < 2.0 * true
    assert after < 0.2 * before


def test_the_energy_that_the_links_friction_takes_is_counted(rubbing):
    _, _, right = rubbing
    entry = right.experiment.sessions[4]
    (motion,) = measured_motions(right.fitted.record, entry)
    model = TorqueModel(right.fitted, entry)
    drift = energy_drift(model, motion, roll_out(model, motion, [100, 900], 150))
    assert drift is not None
    assert drift < 2e-2
