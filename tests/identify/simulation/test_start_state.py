"""The state that windows begin with: of a link in a gap, told from positions of its motor that impacts have moved.

`test_hidden_memory.py` holds it against the hidden motion of a plant that shares no code with the identifier.
"""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from identify import load_experiment
from identify.effects.give import Give
from identify.identification import identify
from identify.simulation.give_fit import GiveFit
from identify.simulation.measured_motion import MeasuredMotion, measured_motions
from identify.simulation.start_state import start_state
from identify.simulation.torque_model import LINK, LINK_SPEED, TorqueModel
from tests.identify.export.derivatives import along_the_record, with_values
from tests.plants.single_joint import record, write_experiment

ROTOR, BODY, GAP, PERIOD, ROWS, STEP = 4.0, 8.0, 4e-3, 4e-3, 200, 1e-5
IMPACT = 0.5
"""s, when the motor meets its link"""
PULL, PUSH = 0.6, 2.0
"""N m on the motor, before and after it leaves the link"""


class Joint(TorqueModel):
    """Two bodies with a gap between them; what the identifier would know of them is given."""

    def __init__(self, gives):
        self.gives, self.joints, self.linear, self.stateful, self.meets = gives, 1, True, [], False
        self.command_lead, self.entry = [], None
        facts = SimpleNamespace(position_rounding=np.array([STEP]))
        self.fitted = SimpleNamespace(
            record=SimpleNamespace(
                facts=lambda _entry: facts,
                settings=SimpleNamespace(decimation_cutoff=10.0),
                rest_speed=np.array([1e-3]),
            ),
            fit=SimpleNamespace(residual=np.array([1.0]), rows=np.array([400])),
        )

    def load(self, windows, acceleration):
        return (ROTOR + BODY) * acceleration

    def torque_and_load(self, windows, acceleration):
        return self.load(windows, acceleration), self.load(windows, acceleration)


def met():
    """The motor draws its link back, then crosses the gap under a push, meets the link, and both go on: momentum is kept.

    Smoothed as the filters of a fit do: over 40 ms to either side.
    """
    time = PERIOD * np.arange(ROWS)
    flight = np.sqrt(2.0 * GAP * ROTOR / PUSH)
    begins = IMPACT - flight
    drawn, crossing = np.minimum(time, begins), np.clip(time - begins, 0.0, flight)
    since = np.maximum(time - IMPACT, 0.0)
    whole, struck = ROTOR + BODY, PUSH * flight / (ROTOR + BODY)
    link_speed = -PULL / whole * drawn + np.where(since > 0.0, struck, 0.0) + PUSH / whole * since
    drift = -PULL / whole * (0.5 * drawn**2 + begins * np.maximum(time - begins, 0.0))
    link = 0.5 * GAP + drift + struck * since + 0.5 * PUSH / whole * since**2
    flying = np.where(since > 0.0, 0.0, crossing)
    motor = link - 0.5 * GAP + 0.5 * PUSH / ROTOR * crossing**2
    speed = link_speed + PUSH / ROTOR * flying
    window = np.ones(21) / 21
    smooth = np.convolve(np.pad(motor, 10, mode="edge"), window, mode="valid")
    rate = np.convolve(np.pad(speed, 10, mode="edge"), window, mode="valid")
    torque = np.where(time >= begins, PUSH, -PULL)
    motion = MeasuredMotion(
        period=PERIOD,
        time=time,
        q=smooth[:, None],
        dq=rate[:, None],
        ddq=np.gradient(rate, PERIOD)[:, None],
        direction=np.ones((ROWS, 1)),
        torque=torque[:, None],
        command=torque[:, None],
        external=None,
        temperature=None,
        resting=np.abs(rate[:, None]) < 1e-3,
        recorded=(np.round(motor / STEP) * STEP)[:, None],
        extra={},
    )
    return motion, motor, speed, link, link_speed


def at(row):
    return start_state(Joint({0: Give(ROTOR, gap=GAP, flank_load=0.01)}), met()[0], np.array([row])).windows


@pytest.mark.parametrize("late", [3, 6])
def test_speeds_just_after_an_impact_are_those_after_it(late):
    """The filters still have the speed before it in them."""
    motion, motor, speed, link, link_speed = met()
    row = round(IMPACT / PERIOD) + late
    jump = PUSH / ROTOR * np.sqrt(2.0 * GAP * ROTOR / PUSH) * BODY / (ROTOR + BODY)
    assert abs(motion.dq[row, 0] - speed[row]) > 0.1 * jump
    windows = at(row)
    assert windows.dq[0, 0] == pytest.approx(speed[row], abs=0.05 * jump)
    assert windows.memory[LINK_SPEED, 0][0] == pytest.approx(link_speed[row], abs=0.05 * jump)
    assert windows.q[0, 0] == pytest.approx(motor[row], abs=2 * STEP)
    assert windows.memory[LINK, 0][0] == pytest.approx(link[row], abs=0.05 * GAP)


def test_a_link_that_the_motor_has_not_met_flies_on():
    _, motor, speed, link, link_speed = met()
    row = round(IMPACT / PERIOD) - 3
    windows = at(row)
    assert windows.dq[0, 0] == pytest.approx(speed[row], rel=0.03)
    assert windows.q[0, 0] == pytest.approx(motor[row], abs=2 * STEP)
    assert windows.memory[LINK, 0][0] == pytest.approx(link[row], abs=0.1 * GAP)
    assert windows.memory[LINK_SPEED, 0][0] == pytest.approx(link_speed[row], abs=0.1 * speed[row])


def test_a_model_that_does_not_give_begins_with_the_filters_of_the_fit():
    motion, *_ = met()
    windows = start_state(Joint({}), motion, np.array([100, 140])).windows
    np.testing.assert_array_equal(windows.q, motion.q[[100, 140]])
    np.testing.assert_array_equal(windows.dq, np.where(motion.resting, 0.0, motion.dq)[[100, 140]])


def test_memories_begin_as_the_fit_has_them_though_a_simulation_sees_fewer_rows(tmp_path):
    """By loops of our own over every row of the record, of which a simulation sees one in two."""
    recorded = record({}, seed=5, duration=8.0, payload_masses=(0.0, 4.0))
    experiment = load_experiment(write_experiment(tmp_path / "bench", recorded))
    result = identify(experiment, "usual", ["presliding", "backlash"])
    constants = {"presliding": {"presliding_distance": 3e-3}, "backlash": {"play": 0.05}}
    result = with_values(result, {}, constants)
    entry = experiment.sessions[-1]
    motion, _, _ = along_the_record(result, entry.file)
    begun = np.sign(motion.dq[0, 0])
    bristle, place = [begun], [-0.5 * begun]
    for travel in np.diff(motion.q[:, 0]):
        heading = np.sign(travel)
        bristle.append(heading + (bristle[-1] - heading) * np.exp(-abs(travel) / 3e-3))
        place.append(min(max(place[-1] - travel / 0.05, -0.5), 0.5))
    (seen,) = measured_motions(result.fitted.record, entry)
    assert seen.rows_in_one == 2
    first = np.arange(0, len(seen), 7)
    model = TorqueModel(result.fitted, entry, GiveFit(result.fitted, {}))
    memory = start_state(model, seen, first).windows.memory
    start = float(result.fitted.record.facts(entry).start)
    rows = np.searchsorted(motion.t, seen.time[first] - start - 1e-6)
    np.testing.assert_allclose(memory["presliding", 0], np.array(bristle)[rows], atol=1e-9)
    np.testing.assert_allclose(memory["backlash", 0], np.array(place)[rows], atol=1e-9)
