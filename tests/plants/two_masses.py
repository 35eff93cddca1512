"""A joint whose transmission gives: motor and link are two masses with a spring, a gap or both between them.

It shares no line with `identify`, nor with the simulated drives. The motor is under a position controller and holds the
encoder; sessions run side by side in small steps:

    B theta'' = u − FV theta' − FC sign(theta') − offset − s                              the motor
    (ZZ + m L²) q'' = s − (MX + m L) g cos q − LV q' − LC sign(q')                        the link, held at rest up to LC
    s = k (twist beyond the gap) + d (its rate), and no pull across the gap                the transmission
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

Array = NDArray[np.float64]

STEP = 2.5e-4
"""s, of the integration"""
EVERY = 8
"""steps from row to row of the record"""
GRAVITY = 9.81
STILL = 2e-3
"""rad/s: below, dry friction is less than whole"""


@dataclass(frozen=True)
class TwoMasses:
    """SI units, at the joint.

    gap          : rad, from flank to flank
    damping      : N m s/rad, of the transmission
    viscous      : N m s/rad, of the motor's bearings; link_viscous of the link's
    coulomb      : N m, dry friction on the motor; link_coulomb on the link
    """

    stiffness: float = 2.0e4
    damping: float = 5.0
    gap: float = 0.0
    link: float = 8.0
    rotor: float = 4.0
    first_moment: float = 9.0
    viscous: float = 18.0
    coulomb: float = 14.0
    link_viscous: float = 0.0
    link_coulomb: float = 0.0
    gravity: float = GRAVITY
    offset: float = 3.0
    drive_gain: float = 30.0
    reach: float = 0.9
    noise: float = 0.02
    counts_per_turn: int = 400_000
    bandwidth: float = 5.0

    def carried(self, twist: Array, rate: Array) -> Array:
        """N m."""
        beyond = np.sign(twist) * np.maximum(0.0, np.abs(twist) - 0.5 * self.gap)
        if not self.gap:
            return self.stiffness * twist + self.damping * rate
        torque = self.stiffness * beyond + np.where(beyond != 0.0, self.damping * rate, 0.0)
        return np.where(torque * beyond > 0.0, torque, 0.0)

    def accelerations(self, torque: Array, state: tuple[Array, ...], mass: Array) -> tuple[Array, Array]:
        """rad/s², of motor and link; dry friction of the link beside."""
        theta, dtheta, q, dq = state
        carried = self.carried(theta - q, dtheta - dq)
        lost = self.viscous * dtheta + self.coulomb * np.tanh(dtheta / STILL) + self.offset
        pull = self.gravity * (self.first_moment + mass * self.reach) * np.cos(q) + self.link_viscous * dq
        inertia = self.link + mass * self.reach**2
        return (torque - lost - carried) / self.rotor, (carried - pull) / inertia

    def braked(self, dq: Array, mass: Array) -> Array:
        """The link's speed after what its dry friction takes of it in a step: all of it where it holds the link."""
        taken = STEP * self.link_coulomb / (self.link + mass * self.reach**2)
        return np.sign(dq) * np.maximum(0.0, np.abs(dq) - taken)

    def moved(self, torque: Array, state: tuple[Array, ...], mass: Array) -> tuple[Array, ...]:
        """The state a step later."""
        motor, link = self.accelerations(torque, state, mass)
        theta, dtheta, q, dq = state
        dtheta, dq = dtheta + STEP * motor, self.braked(dq + STEP * link, mass)
        return theta + STEP * dtheta, dtheta, q + STEP * dq, dq

    def settled(self, theta: Array, acceleration: Array, mass: Array) -> Array:
        """Where the link hangs without a swing of its own behind a motor that moves with an acceleration, rad/s²."""
        q, inertia = theta.copy(), self.link + mass * self.reach**2
        for _ in range(50):
            load = self.gravity * (self.first_moment + mass * self.reach) * np.cos(q) + inertia * acceleration
            q = theta - load / self.stiffness - np.sign(load) * 0.5 * self.gap
        return q


@dataclass(frozen=True)
class Recorded:
    """Columns (rows, sessions): of the record, and the hidden motion of the link."""

    plant: TwoMasses
    masses: Array
    time: Array
    position: Array
    command: Array
    link: Array
    link_speed: Array


def record(
    plant: TwoMasses, masses: tuple[float, ...], fastest: tuple[float, ...], duration: float, seed: int
) -> Recorded:
    """Sessions on sums of sinusoids, one for each payload mass, up to `fastest` rad/s."""
    random = np.random.default_rng(seed)
    mass = np.array(masses)
    rate = np.outer([0.12, 0.31, 0.57, 0.79, 1.0], fastest) * random.uniform(0.95, 1.05, (5, len(mass)))
    size = np.array([0.45, 0.2, 0.1, 0.06, 0.05])[:, None] * random.uniform(0.8, 1.2, (5, len(mass)))
    phase = random.uniform(0.0, 2 * np.pi, (5, len(mass)))
    asked_rate = 2 * np.pi * plant.bandwidth
    stiff, damped = 12.0 * asked_rate**2, 2 * 12.0 * asked_rate

    def reference(time: float) -> tuple[Array, Array]:
        angle = rate * time + phase
        return (size * np.sin(angle)).sum(0), (size * rate * np.cos(angle)).sum(0)

    theta, dtheta = reference(0.0)
    q = plant.settled(theta, -(size * rate**2 * np.sin(phase)).sum(0), mass)
    state: tuple[Array, ...] = (theta, dtheta, q, dtheta.copy())
    rows = round(duration / (EVERY * STEP))
    kept = np.empty((rows, 4, len(mass)))
    for step in range(rows * EVERY):
        asked, speed = reference(step * STEP)
        torque = stiff * (asked - state[0]) + damped * (speed - state[1])
        if step % EVERY == 0:
            kept[step // EVERY] = state[0], torque, state[2], state[3]
        state = plant.moved(torque, state, mass)
    count = 2 * np.pi / plant.counts_per_turn
    command = kept[:, 1] / plant.drive_gain + plant.noise * random.standard_normal((rows, len(mass)))
    time = EVERY * STEP * np.arange(rows)
    return Recorded(plant, mass, time, np.round(kept[:, 0] / count) * count, command, kept[:, 2], kept[:, 3])


@dataclass(frozen=True)
class Begun:
    """States that windows of one session begin with, (windows,) each; SI units.

    first : rows of the record
    """

    first: NDArray[np.intp]
    position: Array
    speed: Array
    link: Array
    link_speed: Array


def measured_states(recorded: Recorded, session: int, first: NDArray[np.intp]) -> Begun:
    """The motor's smoothed position and speed, and the link where the load of the measured motion twists a spring to, or where
    the measured motion has driven it across a gap until then."""
    plant, period = recorded.plant, EVERY * STEP
    position, mass = recorded.position[:, session], recorded.masses[session]
    smooth, velocity, acceleration = (
        np.asarray(savgol_filter(position, 31, 3, deriv=order, delta=period), float) for order in range(3)
    )
    if not plant.gap and not plant.link_coulomb:
        moment = plant.gravity * (plant.first_moment + mass * plant.reach)
        load = (plant.link + mass * plant.reach**2) * acceleration + moment * np.cos(position)
        twist = load / plant.stiffness
        still = position - twist, velocity - np.gradient(twist, period)
        return Begun(first, position[first], velocity[first], still[0][first], still[1][first])
    link, link_speed = plant.settled(smooth[:1], acceleration[:1], mass), velocity[:1].copy()
    links = np.empty((len(position), 2))
    for row in range(len(position)):
        links[row] = link[0], link_speed[0]
        for part in range(EVERY if row + 1 < len(position) else 0):
            share = part / EVERY
            theta = smooth[row : row + 1] + share * (smooth[row + 1] - smooth[row])
            dtheta = velocity[row : row + 1] + share * (velocity[row + 1] - velocity[row])
            _, faster = plant.accelerations(np.zeros(1), (theta, dtheta, link, link_speed), mass)
            link_speed = plant.braked(link_speed + STEP * faster, mass)
            link = link + STEP * link_speed
    return Begun(first, position[first], velocity[first], *links[first].T)


def one_second_error(recorded: Recorded, session: int, begun: Begun) -> float:
    """rad, root mean square over windows of a second of the true plant, driven by the recorded torque."""
    plant, first = recorded.plant, begun.first
    position, command = recorded.position[:, session], recorded.command[:, session]
    samples = round(1.0 / (EVERY * STEP)) + 1
    state = begun.position, begun.speed, begun.link, begun.link_speed
    mass = np.full(len(first), recorded.masses[session])
    squares = []
    for sample in range(samples):
        squares.append((state[0] - position[first + sample]) ** 2)
        now, then = (
            plant.drive_gain * command[np.minimum(first + sample + late, len(command) - 1)] for late in (0, 1)
        )
        for part in range(EVERY):
            state = plant.moved(now + (then - now) * part / EVERY, state, mass)
    return float(np.sqrt(np.mean(squares)))


def write_experiment(folder: Path, recorded: Recorded) -> Path:
    """The record as an experiment on disk; the last session is kept from the fit."""
    folder.mkdir(parents=True, exist_ok=True)
    plant, last = recorded.plant, len(recorded.masses) - 1
    payloads, sessions = [], []
    for index, mass in enumerate(recorded.masses):
        columns = np.column_stack([recorded.time, recorded.position[:, index], recorded.command[:, index]])
        np.savetxt(
            folder / f"s{index}.csv", columns, fmt="%.8g", delimiter=",", header="t,q1,v1", comments=""
        )
        payloads.append(f"  - {{name: m{index}, mass: {mass}, com: [{plant.reach}, 0.0, 0.0]}}")
        role = ", role: validation" if index == last else ""
        sessions.append(f"  - {{file: s{index}.csv, payload: m{index}{role}}}")
    lines = [
        "format: 1",
        "name: two-masses",
        "robot:",
        f"  gravity: [0.0, {-plant.gravity}, 0.0]",
        "  joints:",
        f"    - {{name: elbow, type: revolute, drive_gain: {plant.drive_gain}}}",
        "payloads:",
        *payloads,
        "sessions:",
        *sessions,
    ]
    (folder / "experiment.yaml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return folder
