"""Arms under a position controller, with the disturbance of torque inside the loop; shares no line with `identify`.

What identification sees of such a machine differs from a plant that moves as planned: the controller answers every
disturbance, so that measured motion and measured torque hold the same noise. The controllers, the motions and the
colours of the disturbance are of several kinds, and many machines are integrated side by side.
"""

from __future__ import annotations

import gzip
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml
from numpy.typing import NDArray
from scipy.signal import lfilter

from tests.plants.session_table import session_text

Array = NDArray[np.float64]

STEP = 1e-3
"""s, of controller and recording"""
GRAVITY = 9.81
RUBBER = 0.4
"""rad beyond which the bumper is touched"""


@dataclass(frozen=True)
class LoopArm:
    """One revolute joint in the vertical plane under a position controller.

    controller : "pd" (with the reference's velocity), "pid", or "cascade" (proportional position, integrating velocity)
    bandwidth  : Hz, of the position loop
    corner     : Hz, of the disturbance: white noise through a first-order low-pass
    amplitude  : of the disturbance, part of the usual torque (root mean square)
    delay      : s by which the recorded command is late
    stiction   : N m, how much more dry friction is at rest (decay over 0.05 rad/s)
    quadratic  : N m s²/rad², friction over the square of the speed
    spring     : N m/rad, pulls towards 0.2 rad
    load_friction : part of the load that rubs
    bumper     : N m/rad^1.5, rubber beyond 0.4 rad
    command_noise : N m, white noise of the recorded command
    drift      : part by which dry friction falls while a session lasts
    limit      : N m at which the drive cuts what the controller asks for; the record has the cut value
    given_at_limit : part of it that the motor gives there
    """

    inertia: float = 12.0
    first_moment: float = 6.0
    viscous: float = 18.0
    coulomb: float = 14.0
    drive_gain: float = 30.0
    counts_per_turn: int = 500_000
    reach: float = 0.9
    controller: str = "pd"
    bandwidth: float = 6.0
    corner: float = 4.0
    amplitude: float = 0.05
    delay: float = 0.0
    stiction: float = 0.0
    payloads: tuple[float, ...] = (0.0, 3.0, 6.0)
    seed: int = 0
    duration: float = 40.0
    motion: str = "fourier"
    period: float | None = None
    """s after which what is asked for comes again; None where it does not"""
    quadratic: float = 0.0
    spring: float = 0.0
    load_friction: float = 0.0
    bumper: float = 0.0
    command_noise: float = 0.0
    drift: float = 0.0
    limit: float = np.inf
    given_at_limit: float = 1.0


def draw_arm(random: np.random.Generator, **fixed: object) -> LoopArm:
    """A machine of its own: every parameter up to twice more or less, any controller, motion and colour."""

    def scale() -> float:
        return float(2.0 ** random.uniform(-1, 1))

    settings: dict[str, object] = {
        "inertia": 12.0 * scale(),
        "first_moment": 6.0 * scale(),
        "viscous": 18.0 * scale(),
        "coulomb": 14.0 * scale(),
        "controller": str(random.choice(["pd", "pid", "cascade"])),
        "bandwidth": float(random.uniform(3.0, 15.0)),
        "corner": float(10.0 ** random.uniform(0.0, 1.3)),
        "amplitude": float(random.uniform(0.02, 0.07)),
        "motion": str(random.choice(["fourier", "ways"])),
        "seed": int(random.integers(1 << 30)),
    }
    return LoopArm(**{**settings, **fixed})  # type: ignore[arg-type]


def reference(arm: LoopArm, random: np.random.Generator, time: Array) -> tuple[Array, Array, Array]:
    """Position, velocity and acceleration asked for, rad."""
    q, dq, ddq = np.zeros_like(time), np.zeros_like(time), np.zeros_like(time)
    if arm.period is not None:
        for harmonic in range(1, 7):
            pulse = 2 * np.pi * harmonic / arm.period
            size, phase = random.uniform(0.1, 0.5) / harmonic, random.uniform(0, 2 * np.pi)
            q += size * np.sin(pulse * time + phase)
            dq += size * pulse * np.cos(pulse * time + phase)
            ddq -= size * pulse**2 * np.sin(pulse * time + phase)
        return q, dq, ddq
    if arm.motion == "fourier":
        for harmonic in range(1, 7):
            pulse = 2 * np.pi * 0.1 * harmonic * random.uniform(0.9, 1.1)
            size, phase = random.uniform(0.1, 0.5) / harmonic, random.uniform(0, 2 * np.pi)
            q += size * np.sin(pulse * time + phase)
            dq += size * pulse * np.cos(pulse * time + phase)
            ddq -= size * pulse**2 * np.sin(pulse * time + phase)
        return q, dq, ddq
    start, here = 0.0, 0.0
    while start < time[-1]:
        there = float(random.uniform(-1.2, 1.2))
        length = max(0.6, abs(there - here) / random.uniform(0.3, 1.5))
        part = (time >= start) & (time < start + length)
        s = (time[part] - start) / length
        way = there - here
        q[part] = here + way * (10 * s**3 - 15 * s**4 + 6 * s**5)
        dq[part] = way * (30 * s**2 - 60 * s**3 + 30 * s**4) / length
        ddq[part] = way * (60 * s - 180 * s**2 + 120 * s**3) / length**2
        start, here = start + length, there
    return q, dq, ddq


def motion_of(arm: LoopArm) -> list[tuple[Array, Array, Array]]:
    """What every session asks for: position, velocity and acceleration."""
    time = np.arange(round(arm.duration / STEP)) * STEP
    return [
        reference(arm, np.random.default_rng([arm.seed, index]), time) for index in range(len(arm.payloads))
    ]


def simulate(
    arms: list[LoopArm], disturbances: list[Array] | None = None
) -> list[list[tuple[Array, Array, Array]]]:
    """Time, recorded position and recorded command of every session of every arm; all arms of one duration.

    disturbances : is given that of every session, one arm after the other, N m
    """
    runs = [(arm, index, mass) for arm in arms for index, mass in enumerate(arm.payloads)]
    time = np.arange(round(arms[0].duration / STEP)) * STEP
    asked = np.array([session for arm in arms for session in motion_of(arm)])  # (runs, 3, N)

    def of(name: str) -> Array:
        return np.array([float(getattr(arm, name)) for arm, *_ in runs])

    mass = np.array([m for *_, m in runs])
    inertia = of("inertia") + mass * of("reach") ** 2
    moment = GRAVITY * (of("first_moment") + mass * of("reach"))
    pulse = 2 * np.pi * of("bandwidth")
    kind = np.array([arm.controller for arm, *_ in runs])
    own = of("inertia") * 1.3  # what the controller was tuned for
    stiff, damped = own * pulse**2, 2 * own * pulse
    integral = np.where(kind == "pd", 0.0, own * pulse**3 * 0.25)
    usual = np.sqrt(np.mean((inertia[:, None] * asked[:, 2]) ** 2 + 0.5 * moment[:, None] ** 2, axis=1))
    loudness = np.hypot(usual, of("coulomb")) * of("amplitude")
    noise = np.array(
        [np.random.default_rng([arm.seed, index, 7]).standard_normal(len(time)) for arm, index, _ in runs]
    )
    keep = np.exp(-2 * np.pi * of("corner") * STEP)
    part = np.sqrt(1 - keep**2) * loudness
    pushed = np.array([lfilter([c], [1.0, -k], row) for c, k, row in zip(part, keep, noise, strict=True)])
    q, dq = asked[:, 0, 0].copy(), asked[:, 1, 0].copy()
    held = np.zeros(len(runs))
    feed = np.where(kind == "cascade", 0.0, 1.0)
    positions, torques = np.empty((len(time), len(runs))), np.empty((len(time), len(runs)))
    viscous, stiction, quadratic = of("viscous"), of("stiction"), of("quadratic")
    spring, rubbing, bumper = of("spring"), of("load_friction"), of("bumper")
    # what no machine of these has is not computed in every step
    sticks, rubs, bends = (bool(effect.any()) for effect in (stiction, rubbing, quadratic))
    springs, bumps = bool(spring.any()), bool(bumper.any())
    limit, given = of("limit"), of("given_at_limit")
    cuts = bool(np.isfinite(limit).any())
    coulomb = of("coulomb") * (1.0 - np.outer(time, of("drift") / time[-1]))
    wanted, speed = asked[:, 0].T.copy(), asked[:, 1].T.copy()
    ahead = (feed * own)[:, None] * asked[:, 2]
    ahead, disturbance = ahead.T.copy(), pushed.T.copy()
    load = moment * np.cos(q)
    for index in range(len(time)):
        off = wanted[index] - q
        held += off * STEP
        # the amplifier follows within the period
        torque = ahead[index] + damped * (speed[index] - dq) + stiff * off + integral * held
        if cuts:
            torque = np.clip(torque, -limit, limit)
        positions[index], torques[index] = q, torque
        if cuts:
            torque = np.where(np.abs(torque) == limit, given * torque, torque)
        driving = torque + disturbance[index]
        for _ in range(2):
            pulled = moment * np.cos(q)
            fast = np.abs(dq) if sticks or bends else dq
            slide = coulomb[index]
            if sticks:
                slide = slide + stiction * np.exp(-fast / 0.05)
            if rubs:
                slide = slide + rubbing * np.abs(load)
            friction = (viscous + quadratic * fast if bends else viscous) * dq + slide * np.tanh(dq / 2e-3)
            if springs:
                friction += spring * (q - 0.2)
            if bumps:
                friction += bumper * np.maximum(0.0, q - RUBBER) ** 1.5
            ddq = (driving - pulled - friction) / inertia
            if rubs:
                load = inertia * ddq + pulled
            dq = dq + 0.5 * STEP * ddq
            q = q + 0.5 * STEP * dq
    positions, torques = positions.T.copy(), torques.T.copy()
    if disturbances is not None:
        disturbances.extend(pushed)
    found: list[list[tuple[Array, Array, Array]]] = [[] for _ in arms]
    place = {id(arm): number for number, arm in enumerate(arms)}
    for row, (arm, *_) in enumerate(runs):
        count = 2 * np.pi / arm.counts_per_turn
        late = round(arm.delay / STEP)
        command = np.roll(torques[row], late)
        command[:late] = torques[row, 0]
        if arm.command_noise:
            random = np.random.default_rng([arm.seed, len(found[place[id(arm)]]), 11])
            command = command + arm.command_noise * random.standard_normal(len(command))
        found[place[id(arm)]].append(
            (time, np.round(positions[row] / count) * count, command / arm.drive_gain)
        )
    return found


def write_arm(folder: Path, arm: LoopArm, sessions: list[tuple[Array, Array, Array]]) -> Path:
    """The arm's record as an experiment on disk."""
    folder.mkdir(parents=True, exist_ok=True)
    listed = []
    for index, columns in enumerate(sessions):
        file = f"session-{index:02d}.csv.gz"
        with gzip.open(folder / file, "wt", compresslevel=1) as handle:
            handle.write(session_text(columns, ["t", "q1", "v1"], ["%.7g"] * 3))
        listed.append({"file": file, "payload": f"m{index}"})
    joint = {"name": "j1", "type": "revolute", "alpha": 0.0, "d": 0.0, "theta": 0.0, "r": 0.0}
    document = {
        "format": 1,
        "name": "loop",
        "robot": {
            "gravity": [0.0, -GRAVITY, 0.0],
            "joints": [joint | {"drive_gain": arm.drive_gain, "motor_ratio": 100.0}],
        },
        "payloads": [
            {"name": f"m{index}", "mass": mass, "com": [arm.reach, 0.0, 0.0]}
            for index, mass in enumerate(arm.payloads)
        ],
        "sessions": listed,
    }
    (folder / "experiment.yaml").write_text(yaml.safe_dump(document))
    return folder
