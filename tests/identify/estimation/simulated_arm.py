"""A one-joint arm whose torque is computed in closed form, eq. (34), from a motion given as a sum of sinusoids.

It shares nothing with the regressor: position, velocity and acceleration are exact, and so is every friction term.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from identify.recording import Experiment
from identify.recording.experiment_file import ExperimentFile
from identify.recording.samples import RawSamples
from identify.recording.sampling import uniform_session
from identify.recording.session import SessionEntry

G = 9.81
GAIN = 35.15  # N m per unit of command


@dataclass(frozen=True)
class Arm:
    """Parameters in the paper's symbols, SI units."""

    inertia: float = 30.9
    first_moment: tuple[float, float] = (21.1, 0.4)
    viscous: float = 29.4
    coulomb: float = 39.9
    offset: float = 9.9

    def torque(self, q, dq, ddq, payload=0.0, arm_length=1.277):
        mx, my = self.first_moment
        load = self.inertia * ddq + G * (mx * np.cos(q) - my * np.sin(q))
        load = load + payload * arm_length * (arm_length * ddq + G * np.cos(q))
        return load + self.viscous * dq + self.coulomb * np.sign(dq) + self.offset


@dataclass(frozen=True)
class Motion:
    """A sum of sinusoids: amplitudes in rad, frequencies in Hz, phases in rad."""

    amplitude: tuple[float, ...] = (0.5, 0.25, 0.12, 0.06)
    frequency: tuple[float, ...] = (0.11, 0.31, 0.73, 1.31)
    phase: tuple[float, ...] = (0.3, 1.2, 2.5, 4.0)

    def at(self, time):
        """q, dq, ddq at instants."""
        omega = 2 * np.pi * np.array(self.frequency)
        angle = omega * time[:, None] + np.array(self.phase)
        a = np.array(self.amplitude)
        return np.sin(angle) @ a, np.cos(angle) @ (a * omega), -np.sin(angle) @ (a * omega**2)


@dataclass(frozen=True)
class MemoryExperiment(Experiment):
    """An experiment whose sessions are at hand instead of on disk."""

    raw: dict[str, RawSamples] = field(default_factory=dict)

    def read(self, entry: SessionEntry):
        return uniform_session(entry, self.raw[entry.file])


def experiment(sessions, payloads=(), signals=None, roles=None):
    """An experiment of one revolute joint that swings in a vertical plane.

    sessions : name -> (RawSamples, payload name); payloads : (name, mass) beside "none"
    """
    declared = ExperimentFile.model_validate(
        {
            "format": 1,
            "name": "simulated arm",
            "robot": {
                "gravity": (0.0, -G, 0.0),
                "joints": ({"name": "j3", "type": "revolute", "drive_gain": GAIN},),
            },
            "payloads": (
                {"name": "none", "mass": 0.0},
                *({"name": name, "mass": mass, "com": (1.277, 0.0, 0.0)} for name, mass in payloads),
            ),
            "sessions": tuple(
                {"file": file, "payload": payload, "role": (roles or {}).get(file, "identification")}
                for file, (_, payload) in sessions.items()
            ),
            "signals": signals or {},
        }
    )
    by_name = {payload.name: payload for payload in declared.payloads}
    folder = Path("memory")
    return MemoryExperiment(
        name=declared.name,
        path=folder / "experiment.yaml",
        robot=declared.robot,
        sessions=tuple(
            SessionEntry(own.file, folder / own.file, by_name[own.payload], own.role)
            for own in declared.sessions
        ),
        payloads=declared.payloads,
        signals=declared.signals,
        effects=(),
        raw={file: raw for file, (raw, _) in sessions.items()},
    )


def record(motion, arm, random, duration=20.0, rate=500.0, torque_noise=0.0, position_noise=0.0, payload=0.0):
    """Samples of one session; noise as white deviations, N m and rad."""
    time = np.arange(round(duration * rate)) / rate
    q, dq, ddq = motion.at(time)
    torque = arm.torque(q, dq, ddq, payload) + torque_noise * random.standard_normal(len(time))
    measured = q + position_noise * random.standard_normal(len(time))
    return RawSamples(time, measured[:, None], torque[:, None] / GAIN)


def with_outliers(raw, random, share, size):
    """The same samples with a part of the commands wrong by up to `size` N m, in bursts of 50 ms."""
    command = raw.command.copy()
    length = 25
    for start in random.integers(0, len(command) - length, round(share * len(command) / length)):
        command[start : start + length] += random.uniform(0.5, 1.0) * size / GAIN
    return replace(raw, command=command)
