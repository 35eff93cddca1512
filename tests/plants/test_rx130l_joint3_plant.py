"""The simulated RX130L joint 3 is itself checked, with numpy alone, against the equation that it states."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from tests.plants.rx130l_joint3 import (
    GRAVITY,
    LEVER,
    NOMINAL_SPEED,
    PAYLOAD_MASSES,
    Rx130lJoint3,
    joint_spring,
    simulate,
    write_experiment,
)

PLANT = Rx130lJoint3()


@pytest.fixture(scope="module")
def sessions():
    return [simulate(PLANT, mass, seed=index) for index, mass in enumerate(PAYLOAD_MASSES)]


def motion(session, width=0.008):
    """Position, velocity, acceleration from the recorded counts, and the command, smoothed alike."""
    period = session.time[1]
    q = gaussian_filter1d(session.position, width / period)
    dq = np.gradient(q, period)
    return q, dq, np.gradient(dq, period), gaussian_filter1d(session.command, width / period)


def sliding(session, dq, slowest):
    """Samples that moved in one direction, faster than `slowest`, for 60 ms around."""
    moving = np.abs(dq) > slowest
    moving &= session.true_velocity != 0
    moving[:20] = moving[-20:] = False  # where the smoothing lacks samples
    return gaussian_filter1d(moving.astype(float), 20, truncate=3.0) > 0.999


def test_least_squares_on_eq_42_with_the_true_load_returns_the_plants_friction(sessions):
    rows, torques = [], []
    for session in sessions:
        q, dq, ddq, command = motion(session)
        inertia = PLANT.inertia + session.mass * LEVER**2
        moment = PLANT.first_moment_x + session.mass * LEVER
        load = inertia * ddq + moment * GRAVITY * np.cos(q)
        motor = (load * dq > 0).astype(float)
        generator = 1.0 - motor
        decay = np.exp(-np.abs(dq) / PLANT.stribeck_velocity)
        columns = [
            motor * load,
            motor * load * decay,
            generator * load,
            -generator * load * decay,
            motor * np.sign(dq),
            generator * np.sign(dq),
            dq,
            np.ones_like(q),
        ]
        used = sliding(session, dq, 0.01) & (np.abs(load) > 20.0)
        rows.append(np.column_stack(columns)[used])
        torques.append(PLANT.drive_gain * command[used])
    observation, measured = np.concatenate(rows), np.concatenate(torques)
    found = np.linalg.lstsq(observation, measured, rcond=None)[0]
    truth = [PLANT.a_m, PLANT.b_m, PLANT.a_g, PLANT.b_g, PLANT.c_m, PLANT.c_g, PLANT.viscous, PLANT.offset]
    np.testing.assert_allclose(found[[0, 2, 6]], np.array(truth)[[0, 2, 6]], rtol=0.005)
    np.testing.assert_allclose(found, truth, rtol=0.06)
    assert np.linalg.norm(measured - observation @ found) < 0.01 * np.linalg.norm(measured)


def test_the_joint_sticks_at_reversals_and_follows_down_to_some_per_cent_of_nominal_speed(sessions):
    for session in sessions:
        fastest = np.abs(session.true_velocity).max()
        assert 0.9 * NOMINAL_SPEED < fastest < 1.1 * NOMINAL_SPEED
        assert 0.003 < np.mean(session.true_velocity == 0.0) < 0.1
        slow = np.abs(session.true_velocity) < 0.1 * NOMINAL_SPEED
        assert np.mean(slow) > 0.2
    speed = np.abs(np.concatenate([session.true_velocity for session in sessions]))
    assert np.mean(np.abs(speed - 0.03) < 0.002) > 0.03


def test_a_stuck_joint_needs_its_breakaway_torque():
    """At rest the torque lies between the two values of eq. (25) for the velocity going to zero from either
    side.
    """
    session = simulate(Rx130lJoint3(ripple=0.0), 0.0, seed=3, duration=20.0)
    stuck = (session.true_velocity == 0.0) & (np.gradient(session.true_velocity) == 0.0)
    load = PLANT.first_moment_x * GRAVITY * np.cos(session.position[stuck])
    drive = session.true_torque[stuck] - PLANT.offset
    motor, generator = (PLANT.a_m + PLANT.b_m) * load, (PLANT.a_g - PLANT.b_g) * load
    hardest = np.where(load > 0, motor + PLANT.c_m, generator + PLANT.c_g)
    easiest = np.where(load > 0, generator - PLANT.c_g, motor - PLANT.c_m)
    assert np.count_nonzero(stuck) > 50
    assert np.all(drive < hardest + 1e-2)
    assert np.all(drive > easiest - 1e-2)


def test_half_the_step_gives_the_same_torque_within_the_noise():
    quiet = Rx130lJoint3(command_noise=0.0, ripple=0.0)
    coarse, fine = (simulate(quiet, 3.4584, seed=4, duration=20.0, step=step) for step in (0.25e-3, 0.125e-3))
    sliding_on = np.abs(coarse.true_velocity) > 0.02
    difference = gaussian_filter1d(coarse.true_torque - fine.true_torque, 8)[sliding_on]
    noise = PLANT.command_noise * PLANT.drive_gain
    assert np.sqrt(np.mean(difference**2)) < noise


def test_a_hidden_effect_asks_for_its_torque():
    spring = Rx130lJoint3(hidden=(joint_spring(40.0, 0.2),))
    with_spring, without = (simulate(plant, 0.0, seed=5, duration=20.0) for plant in (spring, PLANT))
    used = np.abs(without.true_velocity) > 0.02
    difference = (with_spring.true_torque - without.true_torque)[used]
    expected = 40.0 * (without.position[used] - 0.2)
    assert np.median(np.abs(difference - expected)) < 1.0


def test_the_same_seed_gives_the_same_session():
    first, again, other = (simulate(PLANT, 0.0, seed=seed, duration=5.0) for seed in (1, 1, 2))
    assert np.array_equal(first.command, again.command)
    assert not np.array_equal(first.position, other.position)


def test_the_experiment_folder_declares_the_sessions_and_the_drive_gain(tmp_path):
    plant = Rx130lJoint3(declared_gain_error=-0.06)
    records = write_experiment(tmp_path, plant, duration=3.0, validation_masses=(3.4584,))
    assert [record.mass for record in records] == [*PAYLOAD_MASSES, 3.4584]
    text = (tmp_path / "experiment.yaml").read_text()
    assert f"drive_gain: {35.15 * 0.94!r}" in text
    assert text.count("role: validation") == 1
    written = np.genfromtxt(tmp_path / "session-02.csv", delimiter=",", names=True)
    np.testing.assert_allclose(written["q1"], records[2].position, rtol=1e-9, atol=1e-12)
