"""The plant of the tests is itself checked, with numpy alone: what it writes obeys the equation it states."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from identify.effects.catalogue import effects
from tests.plants.hidden_effects import GRAVITY, HIDDEN, LEFT_OUT_OF_EVERY_CATALOGUE
from tests.plants.single_joint import record, write_experiment


def regression(recorded):
    """Least squares of the plain equation on what a drive reported: parameters and relative error."""
    rows, torques = [], []
    for mass, columns in zip(recorded.payload_masses, recorded.sessions, strict=True):
        period = columns["t"][1]
        width = 0.01 / period
        q = gaussian_filter1d(columns["q1"], width)
        dq = np.gradient(q, period)
        ddq = np.gradient(dq, period)
        reach = recorded.joint.reach
        known = mass * reach * (reach * ddq + GRAVITY * np.cos(q))
        regressor = [ddq, GRAVITY * np.cos(q), -GRAVITY * np.sin(q), dq, np.sign(dq), np.ones_like(q)]
        command = gaussian_filter1d(columns["v1"], width)
        inside = slice(50, -50)
        rows.append(np.column_stack(regressor)[inside])
        torques.append((recorded.joint.drive_gain * command - known)[inside])
    observation, measured = np.concatenate(rows), np.concatenate(torques)
    parameters = np.linalg.lstsq(observation, measured, rcond=None)[0]
    return parameters, np.linalg.norm(measured - observation @ parameters) / np.linalg.norm(measured)


def test_the_plain_joint_obeys_its_equation():
    recorded = record({}, seed=5)
    joint = recorded.joint
    parameters, error = regression(recorded)
    truth = [
        joint.link_inertia + joint.rotor_inertia,
        joint.first_moment_x,
        joint.first_moment_y,
        joint.viscous,
        joint.coulomb,
        joint.offset,
    ]
    np.testing.assert_allclose(parameters, truth, rtol=0.02, atol=0.05)
    assert error < 0.02
    assert recorded.share == 0.0


@pytest.mark.parametrize("name", sorted(HIDDEN))
def test_every_hidden_effect_shows_and_leaves_something_or_bends_a_parameter(name):
    plain, _ = regression(record({}, seed=6))
    recorded = record({name: 1.0}, seed=6)
    parameters, error = regression(recorded)
    assert 0.01 < recorded.share < 0.15
    assert error > 0.02 or np.abs(parameters / plain - 1).max() > 0.02


def test_the_same_seed_gives_the_same_record_and_another_seed_another():
    first, again, other = (record({"stribeck": 1.0}, seed=seed, duration=20.0) for seed in (1, 1, 2))
    assert all(np.array_equal(a["v1"], b["v1"]) for a, b in zip(first.sessions, again.sessions, strict=True))
    assert not np.array_equal(first.sessions[0]["q1"], other.sessions[0]["q1"])


def test_a_session_repeats_its_motion_exactly_within_a_count():
    columns = record({}, seed=2, repeats=2).sessions[0]
    half = len(columns["t"]) // 2
    count = 2 * np.pi / 400_000
    assert np.abs(columns["q1"][:half] - columns["q1"][half:]).max() < 1.01 * count


def test_temperature_is_recorded_where_friction_depends_on_it():
    recorded = record({"friction-temperature": 1.0}, seed=3)
    assert "temp1" in recorded.sessions[0]
    assert "temp1" not in record({}, seed=3).sessions[0]


def test_what_is_left_out_of_every_catalogue_is_in_none():
    assert LEFT_OUT_OF_EVERY_CATALOGUE
    assert not set(LEFT_OUT_OF_EVERY_CATALOGUE) & set(effects())


def test_an_effect_that_does_not_exist_is_refused():
    with pytest.raises(KeyError, match="phlogiston"):
        record({"phlogiston": 1.0})


def test_the_experiment_folder_holds_what_was_recorded(tmp_path):
    recorded = record({}, seed=4, duration=20.0)
    folder = write_experiment(tmp_path / "bench", recorded)
    written = np.genfromtxt(folder / "session-01.csv", delimiter=",", names=True)
    assert written.dtype.names == ("t", "q1", "v1")
    np.testing.assert_allclose(written["q1"], recorded.sessions[1]["q1"], rtol=1e-8, atol=1e-12)
    assert "drive_gain: 30.0" in (folder / "experiment.yaml").read_text()
