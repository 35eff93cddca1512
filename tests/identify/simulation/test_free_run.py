"""A free run in closed loop: the stretches that are simulated side by side are one motion, also in a stiff loop."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identify import load_experiment
from identify.identification import identify
from identify.recording.controller_file import JointController
from identify.simulation import free_run as free_runs
from identify.simulation.controller import Controllers
from identify.simulation.free_run import free_run
from identify.simulation.measured_motion import measured_motions
from identify.simulation.rollout import roll_out
from identify.simulation.torque_model import TorqueModel
from tests.plants.single_joint import record, write_experiment


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    """A joint whose friction follows its load, and its record, the measured position in the place of a reference."""
    folder = tmp_path_factory.mktemp("plant") / "bench"
    recorded = record({"load-friction": 1.5}, seed=5, duration=6.0, payload_masses=(2.0,), repeats=1)
    result = identify(load_experiment(write_experiment(folder, recorded)), "usual", ["load-friction"])
    entry = result.fitted.entries[0]
    (motion,) = measured_motions(result.fitted.record, entry)
    motion = replace(motion, extra={"qref1": motion.q[:, 0]}).rows(slice(0, 900))
    model = TorqueModel(result.fitted, entry)
    inertia = float(
        model.with_slope(roll_out(model, motion, [0], 1).end.windows, np.zeros((1, 1)))[1][0, 0, 0]
    )
    return model, motion, inertia / float(result.experiment.drive_gain[0, 0])


def cascade(inertia, bandwidth):
    """Gains of a velocity loop of some rad/s, position and integral slower: command per rad and so on."""
    damping = bandwidth * inertia
    return Controllers(
        (
            JointController(
                joint="elbow",
                position=damping * bandwidth / 5,
                velocity=damping,
                reference_velocity=damping,
                integral=damping * bandwidth**2 / 80,
            ),
        ),
        ("qref1",),
        np.eye(1),
    )


def test_stretches_side_by_side_are_the_motion_that_is_simulated_step_by_step(arm):
    model, motion, inertia = arm
    loop = cascade(inertia, 150.0)
    course = free_run(model, motion, loop)
    exact = roll_out(model, motion, [0], len(motion), loop)
    assert course.q.shape == exact.q.shape == (len(motion), 1, 1)
    for name in ("q", "dq", "ddq", "applied", "direction"):
        size = np.ptp(getattr(exact, name))
        np.testing.assert_allclose(getattr(course, name), getattr(exact, name), rtol=0, atol=1e-6 * size)
    assert np.max(np.abs(course.q - exact.q)) < 1e-9
    assert np.max(np.abs(course.q[:, 0] - motion.q)) < 1e-2 * np.ptp(motion.q)


def test_a_loop_that_does_not_forget_is_simulated_step_by_step(arm, monkeypatch):
    model, whole, inertia = arm
    motion, begun = whole.rows(slice(0, 300)), []

    def counted(model, motion, starts, *rest, **further):
        begun.append(len(starts))
        return roll_out(model, motion, starts, *rest, **further)

    monkeypatch.setattr(free_runs, "roll_out", counted)
    monkeypatch.setattr(free_runs, "STRETCH", 0.2)
    monkeypatch.setattr(free_runs, "MOST_ROUNDS", 2)
    slack = cascade(inertia, 0.3)
    course = free_run(model, motion, slack)
    assert begun == [5, 4, 3, 1]
    exact = roll_out(model, motion, [0], 300, slack, stop_when_lost=True)
    np.testing.assert_array_equal(course.q, exact.q)


def test_a_loop_faster_than_the_record_is_stepped_finely_enough(arm):
    """900 rad/s at 4 ms: with one step a row its damping would be 3.6 times what a step may have, and the motion would grow."""
    model, motion, inertia = arm
    course = roll_out(model, motion.rows(slice(0, 150)), [0], 150, cascade(inertia, 900.0))
    assert np.max(np.abs(course.q[:, 0] - motion.q[:150])) < 1e-3 * np.ptp(motion.q)


@pytest.mark.parametrize("damped", [1.0, 0.0])
def test_a_loop_much_too_stiff_for_its_damping_follows_nevertheless(arm, damped):
    """Held over a step, the position would take more damping than the velocity loop gives, and the motion would grow."""
    model, motion, inertia = arm
    gains = JointController(joint="elbow", position=inertia * 1200.0**2, velocity=damped * inertia * 30.0)
    loop = Controllers((gains,), ("qref1",), np.eye(1))
    course = roll_out(model, motion.rows(slice(0, 150)), [0], 150, loop)
    assert np.max(np.abs(course.q[:, 0] - motion.q[:150])) < 1e-3 * np.ptp(motion.q)
