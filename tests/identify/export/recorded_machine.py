"""A robot of known links with viscous and dry friction, recorded in memory: a session without payload and one with a lump."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from identify.dynamics.geometry import Geometry
from identify.dynamics.inverse_dynamics import InverseDynamics
from identify.dynamics.payload import payload_torque
from identify.recording.experiment_file import ExperimentFile
from identify.recording.samples import RawSamples
from identify.recording.session import SessionEntry
from tests.identify.estimation.simulated_arm import MemoryExperiment

RATE = 200.0
LINK = [0.3, 0.01, 0.02, 0.4, 0.01, 0.35, 0.2, 0.1, 0.3, 3.0, 0.3]
"""XX … M, Ia of each link"""


def recorded_machine(name, joints, drive_gain, *, seconds, swing, seed, effects=()):
    """The experiment.

    joints     : as an experiment file declares them
    drive_gain : (n, n)
    swing      : rad or m of each of three sines
    effects    : files of the user's own
    """
    described = ExperimentFile.model_validate(
        {
            "format": 1,
            "name": name,
            "robot": {
                "gravity": [0.0, 0.0, -9.81],
                "joints": joints,
                "drive_gain_matrix": np.asarray(drive_gain).tolist(),
            },
            "payloads": [
                {"name": "none", "mass": 0.0},
                {"name": "lump", "mass": 1.5, "com": [0.05, 0.02, 0.1]},
            ],
            "sessions": [{"file": "s0.csv", "payload": "none"}, {"file": "s1.csv", "payload": "lump"}],
        }
    )
    geometry, n = Geometry.from_robot(described.robot), len(joints)
    random = np.random.default_rng(seed)
    raw, entries = {}, []
    for session, payload in zip(described.sessions, described.payloads, strict=True):
        time = np.arange(round(seconds * RATE)) / RATE
        omega = 2 * np.pi * np.array([0.3, 0.7, 1.1])
        angle = omega * time[:, None, None] + random.uniform(0, 2 * np.pi, (n, 3))
        q = swing * np.sin(angle).sum(-1)
        dq, ddq = swing * (omega * np.cos(angle)).sum(-1), -swing * (omega**2 * np.sin(angle)).sum(-1)
        (torque,) = InverseDynamics(geometry, [np.array(LINK * n)]).torques(q, dq, ddq)
        torque = torque + payload_torque(geometry, payload, q, dq, ddq) + 2.0 * dq + 1.5 * np.sign(dq)
        raw[session.file] = RawSamples(time, q, torque @ np.linalg.inv(drive_gain).T)
        entries.append(SessionEntry(session.file, Path("memory") / session.file, payload, "identification"))
    return MemoryExperiment(
        described.name,
        Path("memory/experiment.yaml"),
        described.robot,
        tuple(entries),
        described.payloads,
        described.signals,
        tuple(effects),
        raw=raw,
    )
