"""A dead time in the loop: against the method of steps, and against a machine whose drive acts late."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from identify.identification import identify
from identify.recording.controller_file import ControllerFile, JointController
from identify.recording.experiment_file import ExperimentFile
from identify.recording.samples import RawSamples
from identify.recording.session import SessionEntry
from identify.simulation.controller import Controllers
from identify.simulation.course import State, simulate_from
from identify.simulation.dead_time import DeadTime, dead_times, parts_for
from identify.simulation.simulate import simulate
from identify.simulation.torque_model import Windows
from tests.identify.estimation.simulated_arm import MemoryExperiment
from tests.identify.simulation.one_body import INERTIA, Body, recorded

PERIOD, ROWS, LATE = 1e-3, 80, 0.02


def still(torque):
    """A measured motion whose recorded torque was that before it began."""
    return recorded(PERIOD, ROWS, torque, extra={"qref1": np.zeros(ROWS)})


def loop(velocity):
    return Controllers((JointController(joint="j", position=0.0, velocity=velocity),), ("qref1",), np.eye(1))


@pytest.mark.parametrize("gain", [10.0, 60.0])
def test_a_velocity_loop_with_a_dead_time_is_the_method_of_steps(gain):
    """M v' = -V v(t - d): a straight line while the torque before acts, which is that of the start; then a degree more in each
    interval.

    v = 1 + a t;  v(d) - k (s + a s²/2);  the next with s = t - 2d by the integral of that; k = V/M.
    """
    before = -gain * INERTIA
    motion, first = still(before), np.array([0])
    state = State(
        Windows(motion.time[first], np.zeros((1, 1)), np.ones((1, 1)), np.ones((1, 1))),
        np.zeros((1, 1)),
        np.zeros((1, 1)),
    )
    course = simulate_from(Body(-LATE), motion, first, 61, state, loop(gain * INERTIA))
    k, a = gain, before / INERTIA
    time = PERIOD * np.arange(61)
    s, u = time - LATE, time - 2 * LATE
    end = 1.0 + a * LATE
    second = end - k * (s + 0.5 * a * s**2)
    at = end - k * (LATE + 0.5 * a * LATE**2)
    third = at - k * (end * u - k * (0.5 * u**2 + a * u**3 / 6))
    exact = np.where(time <= LATE, 1.0 + a * time, np.where(time <= 2 * LATE, second, third))
    # second order in the step of 1 ms
    tolerance = (gain * PERIOD) ** 2
    np.testing.assert_allclose(course.dq[:, 0, 0], exact, rtol=0.0, atol=tolerance)
    at_once = simulate_from(Body(0.0), motion, first, 61, state, loop(gain * INERTIA))
    assert np.abs(at_once.dq[:, 0, 0] - exact).max() > 10 * tolerance


def test_what_is_recorded_late_has_no_part_and_fractions_of_a_part_are_shared():
    motion = still(0.0)
    assert dead_times(Body(LATE)).tolist() == [0.0]
    assert parts_for(dead_times(Body(LATE)), PERIOD) == 1
    assert parts_for(np.array([0.0, 2e-4]), 4e-3) == 10
    assert parts_for(np.array([1e-6]), 4e-3) == 16
    sent = DeadTime(Body(-2.25 * PERIOD), motion, np.array([3]), PERIOD, 0.0)
    acted = [float(sent.acting(np.array([[value]]))[0, 0]) for value in (4.0, 0.0, 0.0, 0.0, 0.0)]
    assert acted == pytest.approx([0.0, 0.0, 3.0, 1.0, 0.0])
    # half a part of it is what holding a command makes
    sent = DeadTime(Body(-1.5 * PERIOD), motion, np.array([3]), PERIOD, 0.5)
    assert [float(sent.acting(np.array([[value]]))[0, 0]) for value in (4.0, 0.0, 0.0)] == [0.0, 4.0, 0.0]


DEAD, STEP = 12e-3, 1e-4
"""s"""
POSITION, VELOCITY = 1200.0, 70.0
"""N m/rad and N m s/rad"""


def late_drive():
    """A joint with an upright axis under position control whose torque acts 12 ms after its command; Euler's rule at 0.1 ms."""
    time = np.arange(0.0, 16.0, STEP)
    omega = 2 * np.pi * np.array([0.3, 0.8, 1.7])
    angle = omega * time[:, None] + np.array([0.3, 1.9, 4.0])
    size = np.array([0.5, 0.25, 0.1])
    reference = np.sin(angle) @ size
    q, dq = reference[0], float(np.cos(angle[0]) @ (size * omega))
    late = round(DEAD / STEP)
    positions, commands = np.empty(len(time)), np.empty(len(time))
    for row in range(len(time)):
        positions[row] = q
        commands[row] = POSITION * (reference[row] - q) - VELOCITY * dq
        torque = commands[row - late] if row >= late else 0.0
        dq += STEP * (torque - 6.0 * dq - 2.0 * np.tanh(dq / 1e-3)) / INERTIA
        q += STEP * dq
    rows = slice(20000, None, 10)
    return RawSamples(
        time[rows] - time[20000],
        positions[rows, None],
        commands[rows, None],
        extra={"qref1": reference[rows]},
    )


@pytest.fixture(scope="module")
def machine():
    declared = ExperimentFile.model_validate(
        {
            "format": 1,
            "name": "late drive",
            "robot": {
                "gravity": [0.0, 0.0, -9.81],
                "joints": [{"name": "j1", "type": "revolute", "drive_gain": 1.0}],
            },
            "payloads": [{"name": "none", "mass": 0.0}],
            "sessions": [{"file": "s0.csv", "payload": "none"}],
        }
    )
    entry = SessionEntry("s0.csv", Path("memory/s0.csv"), declared.payloads[0], "identification")
    return MemoryExperiment(
        declared.name,
        Path("memory/experiment.yaml"),
        declared.robot,
        (entry,),
        declared.payloads,
        declared.signals,
        (),
        raw={"s0.csv": late_drive()},
    )


def test_the_dead_time_that_a_record_shows_is_in_its_loop(machine):
    """Found from torque and motion alone; in closed loop the error of motion falls to what is left of the numbers."""
    result = identify(machine, "usual", ["delay"])
    fitted = result.fitted
    (delay,) = (
        float(fitted.fit.chi[columns][0])
        for slot, columns in zip(fitted.slots, fitted.observation.slot_columns, strict=True)
        if slot.term.effect.name == "delay"
    )
    assert delay == pytest.approx(-DEAD, rel=0.05)
    gains = ControllerFile(joints=[JointController(joint="j1", position=POSITION, velocity=VELOCITY)])
    late = simulate(machine, "usual", ["delay"], [1.0], gains)
    at_once = simulate(machine, "usual", [], [1.0], gains)
    assert [each.formed for each in late.formed if each.effect == "delay"] == ["state"]
    assert not any("left out in closed loop" in remark for remark in late.remarks)
    for with_it, without in zip(late.horizons, at_once.horizons, strict=True):
        assert with_it.joints[0].left_record_at is None
        assert with_it.joints[0].position_rms < 0.2 * without.joints[0].position_rms
