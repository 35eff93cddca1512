"""Two links in a vertical plane whose second motor turns with both joints: closed form, nothing of the identifier.

Motor velocities are (q̇1, r q̇1 + q̇2); by power balance the joints' torques are (u1 + r u2, u2) for motor torques u, and the gears
carry (τ1 − r τ2, τ2) of the joints' loads. Each gear has friction by eq. (25) in its own load and velocity.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from identify.recording.experiment_file import ExperimentFile
from identify.recording.samples import RawSamples
from identify.recording.session import SessionEntry
from tests.identify.estimation.simulated_arm import MemoryExperiment

Array = NDArray[np.float64]

G = 9.81
GAINS = np.array([20.0, 15.0])
"""N m per unit of command of each motor, at its own joint"""


@dataclass(frozen=True)
class Gear:
    """Eq. (25)."""

    a_m: float
    b_m: float
    a_g: float
    b_g: float
    c_m: float
    d_m: float
    c_g: float
    d_g: float
    stribeck_velocity: float
    viscous: float

    def torque(self, load: Array, speed: Array) -> Array:
        e = np.exp(-np.abs(speed) / self.stribeck_velocity)
        driving = load * speed > 0
        passed = np.where(driving, self.a_m + self.b_m * e, self.a_g - self.b_g * e) * load
        dry = np.where(driving, self.c_m + self.d_m * e, self.c_g + self.d_g * e) * np.sign(speed)
        return passed + dry + self.viscous * speed


@dataclass(frozen=True)
class SharedMotorArm:
    """r : turns of the second motor with the first joint; 0 for motors of their own."""

    r: float = 0.8
    length: float = 0.6
    masses: tuple[float, float] = (9.0, 5.0)
    centres: tuple[float, float] = (0.3, 0.25)
    inertias: tuple[float, float] = (0.4, 0.15)
    rotors: tuple[float, float] = (0.9, 0.35)
    reach: float = 0.5
    gears: tuple[Gear, Gear] = field(
        default=(
            Gear(1.06, 0.10, 0.93, 0.12, 8.0, 2.5, 6.0, 2.0, 0.08, 6.0),
            Gear(1.09, 0.12, 0.90, 0.10, 4.0, 1.5, 3.0, 1.2, 0.10, 3.0),
        )
    )

    @property
    def shares(self) -> Array:
        """τ = shares @ u"""
        return np.array([[1.0, self.r], [0.0, 1.0]])

    def load(self, q: Array, dq: Array, ddq: Array, payload: float) -> Array:
        """(N, 2): torque of the links and of a point mass at the tip, the rotors left out."""
        torque = np.zeros(q.shape)
        cos1, cos2, sin2 = np.cos(q[:, 0]), np.cos(q[:, 1]), np.sin(q[:, 1])
        cos12 = np.cos(q[:, 0] + q[:, 1])
        own = self.inertias[0] + self.masses[0] * self.centres[0] ** 2
        torque[:, 0] = own * ddq[:, 0] + self.masses[0] * self.centres[0] * G * cos1
        bodies = ((self.masses[1], self.centres[1], self.inertias[1]), (payload, self.reach, 0.0))
        for mass, out, inertia in bodies:
            far, cross = inertia + mass * out**2, mass * self.length * out
            both = ddq[:, 0] + ddq[:, 1]
            torque[:, 1] += (
                far * both + cross * (cos2 * ddq[:, 0] + sin2 * dq[:, 0] ** 2) + mass * out * G * cos12
            )
            torque[:, 0] += (
                far * both
                + mass * self.length**2 * ddq[:, 0]
                + cross * (cos2 * (ddq[:, 0] + both) - sin2 * dq[:, 1] * (2 * dq[:, 0] + dq[:, 1]))
                + mass * G * (self.length * cos1 + out * cos12)
            )
        return torque

    def torque(self, q: Array, dq: Array, ddq: Array, payload: float) -> Array:
        """(N, 2): what the joints get of the motors."""
        speed, change = dq @ self.shares, ddq @ self.shares
        carried = (
            np.linalg.solve(self.shares, self.load(q, dq, ddq, payload).T).T + np.array(self.rotors) * change
        )
        motors = np.column_stack(
            [gear.torque(carried[:, m], speed[:, m]) for m, gear in enumerate(self.gears)]
        )
        return motors @ self.shares.T


def motion(time: Array) -> tuple[Array, Array, Array]:
    """Sums of sines, slow and fast, that turn the second motor other than its joint."""
    waves = (
        ((0.9, 0.05, 0.0), (0.35, 0.21, 1.0), (0.12, 0.83, 2.0)),
        ((1.0, 0.037, 0.5), (0.4, 0.29, 0.3), (0.15, 0.71, 1.7)),
    )
    joints = [
        [
            sum(
                a * (2 * np.pi * f) ** k * np.sin(2 * np.pi * f * time + p + k * np.pi / 2)
                for a, f, p in joint
            )
            for joint in waves
        ]
        for k in range(3)
    ]
    q, dq, ddq = (np.column_stack(columns) for columns in joints)
    return q, dq, ddq


def experiment(arm: SharedMotorArm, payloads: dict[str, float], seconds: float = 40.0, noise: float = 0.05):
    """Sessions with point masses at the tip; `noise` N m, white."""
    random, time = np.random.default_rng(3), np.arange(round(seconds * 400.0)) / 400.0
    q, dq, ddq = motion(time)
    raw = {}
    for name, mass in payloads.items():
        torque = arm.torque(q, dq, ddq, mass) + noise * random.standard_normal(q.shape)
        command = np.asarray(np.linalg.solve(arm.shares * GAINS, torque.T).T, np.float64)
        raw[f"{name}.csv"] = RawSamples(time, q, command)
    joint = {"type": "revolute", "alpha": 0.0, "theta": 0.0, "r": 0.0}
    declared = ExperimentFile.model_validate(
        {
            "format": 1,
            "name": "shared motor",
            "robot": {
                "gravity": (0.0, -G, 0.0),
                "joints": ({**joint, "name": "j1", "d": 0.0}, {**joint, "name": "j2", "d": arm.length}),
                "drive_gain_matrix": tuple(tuple(row) for row in (arm.shares * GAINS).tolist()),
            },
            "payloads": tuple(
                {"name": name, "mass": mass, "com": (arm.reach, 0.0, 0.0)} for name, mass in payloads.items()
            ),
            "sessions": tuple({"file": f"{name}.csv", "payload": name} for name in payloads),
        }
    )
    folder = Path("memory")
    return MemoryExperiment(
        name=declared.name,
        path=folder / "experiment.yaml",
        robot=declared.robot,
        sessions=tuple(
            SessionEntry(own.file, folder / own.file, payload, own.role)
            for own, payload in zip(declared.sessions, declared.payloads, strict=True)
        ),
        payloads=declared.payloads,
        signals=declared.signals,
        effects=(),
        raw=raw,
    )
