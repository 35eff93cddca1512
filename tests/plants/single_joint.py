"""A plant for tests: one revolute joint about a horizontal axis, with effects hidden in it on request.

It shares no line with `identify`. A smooth motion is planned, the torque follows from the equations below,
and what a drive would report (position in counts, current with noise) is written as an experiment folder.
Everything is SI.

The joint, for a session with a payload of mass m at the distance L on the link's x axis:

    tau_out   = (ZZ + m L^2) q'' + (MX + m L) g cos q - MY g sin q                          the load
    tau       = tau_out + Ia q'' + FV q' + FC sign q' + offset + hidden effects              the motor
    v         = tau / drive gain                                                             the command

The hidden effects are in `hidden_effects.py`; `HIDDEN` names them, after the contract. Some of them
(`LEFT_OUT_OF_EVERY_CATALOGUE`) are there to see that a diagnosis admits what it does not know.

    recorded = record({"stribeck": 1.0}, seed=7)
    folder = write_experiment(tmp_path / "bench", recorded)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

from tests.plants.hidden_effects import (
    BENDING,
    GRAVITY,
    HIDDEN,
    LEFT_OUT_OF_EVERY_CATALOGUE,
    ON_THE_COMMAND,
    Array,
    Joint,
    Run,
    payload_torque,
)
from tests.plants.planned_motion import planned_motion
from tests.plants.session_table import session_text

__all__ = [
    "HIDDEN",
    "LEFT_OUT_OF_EVERY_CATALOGUE",
    "Joint",
    "Record",
    "record",
    "record_motion",
    "write_experiment",
    "write_session",
]


@dataclass(frozen=True)
class Record:
    """What one run of the plant gave, and the truth behind it.

    sessions : one dict of columns (t, q1, v1, temp1) per payload
    share    : RMS of what the hidden effects changed in v, as part of the RMS of v
    """

    joint: Joint
    payload_masses: tuple[float, ...]
    sessions: tuple[dict[str, Array], ...]
    share: float


def record(
    effects: Mapping[str, float],
    *,
    seed: int = 0,
    joint: Joint | None = None,
    payload_masses: Sequence[float] = (0.0, 2.0, 4.0),
    duration: float = 60.0,
    rate: float = 500.0,
    repeats: int = 2,
    pace: float = 1.0,
    shape: float = 1.0,
) -> Record:
    """Run the payload sessions.

    effects        : name in `HIDDEN` -> strength; an empty mapping is the plain joint
    payload_masses : kg, as declared, one session each
    duration, rate : s and Hz of each session
    repeats        : how often a session repeats its motion exactly (a noise floor can be read from
                     repetition)
    pace           : factor on all speeds of the motion
    shape          : factor on the constants of the effects (`hidden_effects.py`)
    Raises KeyError for an effect that does not exist.
    """
    unknown = set(effects) - set(HIDDEN)
    if unknown:
        raise KeyError(f"no such effect: {', '.join(sorted(unknown))}")
    joint = joint or Joint()
    sessions: list[dict[str, Array]] = []
    changed = total = 0.0
    for index, mass in enumerate(payload_masses):
        streams = np.random.default_rng([seed, index]).spawn(3)
        plan = streams[0].bit_generator.random_raw(2)
        runs = []
        for hidden in (effects, {}):
            time, q, dq, ddq = planned_motion(np.random.default_rng(plan), duration, rate, repeats, pace)
            run = Run(joint, index, float(mass), time, q, dq, ddq, streams[1], shape)
            _simulate(run, hidden)
            runs.append(run)
        run, plain = runs
        changed += float(np.sum((run.command - plain.command) ** 2))
        total += float(np.sum(run.command**2))
        sessions.append(_reported(run, streams[2]))
    return Record(joint, tuple(map(float, payload_masses)), tuple(sessions), float(np.sqrt(changed / total)))


def record_motion(
    effects: Mapping[str, float],
    motion: tuple[Array, Array, Array, Array],
    *,
    joint: Joint,
    payload_mass: float,
    seed: int,
    index: int,
    shape: float = 1.0,
) -> dict[str, Array]:
    """One session of a motion of its own: its columns (t, q1, v1, temp1).

    motion : time, position, velocity and acceleration, (N,) each
    index  : of the session in its experiment, from 0
    """
    streams = np.random.default_rng([seed, index]).spawn(3)
    run = Run(joint, index, payload_mass, *motion, streams[1], shape)
    _simulate(run, effects)
    return _reported(run, streams[2])


def write_experiment(folder: Path, recorded: Record, name: str = "single-joint") -> Path:
    """Write `experiment.yaml` and a CSV per session into `folder`, and return it."""
    folder.mkdir(parents=True, exist_ok=True)
    joint = recorded.joint
    payloads, sessions = [], []
    for index, (mass, columns) in enumerate(zip(recorded.payload_masses, recorded.sessions, strict=True)):
        file = f"session-{index:02d}.csv"
        write_session(folder / file, columns)
        payloads.append(f"  - {{name: m{index}, mass: {mass}, com: [{joint.reach}, 0.0, 0.0]}}")
        sessions.append(f"  - {{file: {file}, payload: m{index}}}")
    lines = [
        "format: 1",
        f"name: {name}",
        "robot:",
        f"  gravity: [0.0, {-GRAVITY}, 0.0]",
        "  joints:",
        "    - {name: elbow, type: revolute, alpha: 0.0, d: 0.0, theta: 0.0, r: 0.0, "
        f"drive_gain: {joint.drive_gain}}}",
        "payloads:",
        *payloads,
        "sessions:",
        *sessions,
    ]
    (folder / "experiment.yaml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return folder


def write_session(file: Path, columns: Mapping[str, Array]) -> None:
    """Write a session's CSV."""
    rounding = ["%.6f" if column == "t" else "%.9g" for column in columns]
    file.write_text(session_text(list(columns.values()), list(columns), rounding), encoding="ascii")


def _simulate(run: Run, effects: Mapping[str, float]) -> None:
    joint = run.joint
    run.motor_q, run.motor_dq, run.motor_ddq = run.q.copy(), run.dq.copy(), run.ddq.copy()
    gravity = joint.first_moment_x * np.cos(run.q) - joint.first_moment_y * np.sin(run.q)
    run.load = joint.link_inertia * run.ddq + GRAVITY * gravity
    run.load += payload_torque(run, run.payload_mass, joint.reach, 0.0)
    active = [(name, effects[name]) for name in HIDDEN if name in effects]
    for name, strength in active:
        if name in BENDING:
            BENDING[name](run, strength)
    run.torque = run.load + joint.rotor_inertia * run.motor_ddq + joint.viscous * run.motor_dq
    run.torque += joint.coulomb * np.sign(run.motor_dq) + joint.offset
    for name, strength in active:
        if name not in BENDING and name not in ON_THE_COMMAND:
            HIDDEN[name](run, strength)
    run.command = run.torque / joint.drive_gain
    for name, strength in active:
        if name in ON_THE_COMMAND:
            ON_THE_COMMAND[name](run, strength)


def _reported(run: Run, random: np.random.Generator) -> dict[str, Array]:
    """What the drive reports: position in whole counts, command with noise in steps of 1/1000."""
    joint = run.joint
    count = 2 * np.pi / joint.counts_per_turn
    period = run.time[1] - run.time[0]
    memory = np.exp(-period / 0.2)
    slow = np.asarray(
        lfilter([np.sqrt(1 - memory**2)], [1.0, -memory], random.standard_normal(len(run.time)))
    )
    noise = joint.command_noise * random.standard_normal(len(run.time)) + joint.slow_noise * slow
    columns = {
        "t": run.time,
        "q1": np.round(run.motor_q / count) * count,
        "v1": np.round((run.command + noise) * 1000) / 1000,
    }
    if run.temperature is not None:
        columns["temp1"] = np.round(run.temperature, 1)
    return columns
