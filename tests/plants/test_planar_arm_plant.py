"""The planar arm is itself checked, with numpy alone: what its joints are fed is what its energy gains."""

from __future__ import annotations

import numpy as np
import pytest

from tests.plants.hidden_effects import GRAVITY
from tests.plants.planar_arm import OF_ONE_JOINT, draw_planar_arm, record_arm


def energy(arm, q, dq, payload):
    """Kinetic and potential energy of the links, from where their masses are and how they move."""
    angle, speed = np.cumsum(q, axis=1), np.cumsum(dq, axis=1)
    place, velocity, total = np.zeros((len(q), 2)), np.zeros((len(q), 2)), np.zeros(len(q))
    for link, joint in enumerate(arm.joints):
        mass, first, inertia = arm.masses[link], joint.first_moment_x, joint.link_inertia
        last = link == len(arm.joints) - 1
        if last:
            mass, first = mass + payload, first + payload * joint.reach
            inertia += payload * joint.reach**2
        along = np.column_stack([np.cos(angle[:, link]), np.sin(angle[:, link])])
        across = np.column_stack([-along[:, 1], along[:, 0]])
        moment = first * along + joint.first_moment_y * across
        turning = speed[:, link, None] * (first * across - joint.first_moment_y * along)
        total += 0.5 * mass * np.sum(velocity**2, axis=1) + np.sum(velocity * turning, axis=1)
        total += 0.5 * inertia * speed[:, link] ** 2 + GRAVITY * (mass * place[:, 1] + moment[:, 1])
        if not last:
            place = place + arm.lengths[link] * along
            velocity = velocity + arm.lengths[link] * speed[:, link, None] * across
    return total


@pytest.mark.parametrize("count", [1, 2, 3])
def test_the_power_of_the_joints_is_the_change_of_energy(count):
    random = np.random.default_rng(count)
    arm = draw_planar_arm(random, count)
    time = np.arange(0.0, 2.0, 1e-3)
    pulse, phase = random.uniform(1.0, 4.0, count), random.uniform(0.0, 6.0, count)
    turn = np.outer(time, pulse) + phase
    q, dq, ddq = np.sin(turn), pulse * np.cos(turn), -(pulse**2) * np.sin(turn)
    power = np.sum(arm.loads(q, dq, ddq, 2.0) * dq, axis=1)
    gained = np.gradient(energy(arm, q, dq, 2.0), time)
    np.testing.assert_allclose(power[2:-2], gained[2:-2], atol=1e-4 * np.abs(power).max())


def test_an_effect_changes_the_command_of_its_joint_only(tmp_path):
    arm = draw_planar_arm(np.random.default_rng(4), 2)

    def recorded(effects):
        folder = tmp_path / "-".join(["arm", *effects])
        record_arm(folder, arm, 1, effects, seed=4, payloads=(2.0,), duration=6.0, repeats=1)
        return np.loadtxt(folder / "session-00.csv", delimiter=",", skiprows=1)

    plain = recorded({})
    for name in OF_ONE_JOINT:
        changed = recorded({name: 1.0}) - plain
        np.testing.assert_array_equal(changed[:, :4], 0.0)
        assert np.abs(changed[:, 4]).max() > 0.005 * np.abs(plain[:, 4]).max(), name
