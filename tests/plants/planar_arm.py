"""A plant for tests: an arm of parallel revolute joints in the vertical plane, with an effect hidden in one joint.

It shares no line with `identify`: the torques are those of the planar recursion of Newton and Euler, written out below, and
effects are those of `hidden_effects.py`, for which each joint is a run of its own. Everything is SI.

    theta_i = q_1 + … + q_i, t_i = (cos theta_i, sin theta_i) along link i, n_i across it
    a_1 = (0, g)                    a_i+1 = a_i + d_i (theta_i'' n_i - theta_i'^2 t_i)          where the joints accelerate to
    f_i = f_i+1 + M_i a_i + MX_i (theta_i'' n_i - theta_i'^2 t_i) - MY_i (theta_i'' t_i + theta_i'^2 n_i)
    tau_i = tau_i+1 + d_i t_i x f_i+1 + ZZ_i theta_i'' + (MX_i t_i + MY_i n_i) x a_i            the load
    motor: + Ia q'' + FV q' + FC sign q' + offset + the hidden effect
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import yaml
from scipy.signal import lfilter

from tests.plants.hidden_effects import BENDING, GRAVITY, ON_THE_COMMAND, ON_THE_TORQUE, Array, Joint, Run
from tests.plants.planned_motion import planned_motion
from tests.plants.session_table import session_text

NEED_MORE = {"payload-mass", "payload-com", "gravity-tilt", "friction-temperature", "drive-gain"}
"""Effects that are of the whole arm, or read what it does not record."""
OF_ONE_JOINT = tuple(name for name in (*ON_THE_TORQUE, *ON_THE_COMMAND) if name not in NEED_MORE)


@dataclass(frozen=True)
class PlanarArm:
    """Joints from the base on.

    joints  : motor and link of each; the first moments and `link_inertia` are about the link's own joint
    masses  : kg, of the links
    lengths : m, from a joint to the next
    The payload hangs at the `reach` of the last joint.
    """

    joints: tuple[Joint, ...]
    masses: tuple[float, ...]
    lengths: tuple[float, ...]

    def loads(self, q: Array, dq: Array, ddq: Array, payload: float) -> Array:
        """(N, n) torque on the link side, of the motion (N, n)."""
        angle, speed, acceleration = (np.cumsum(each, axis=1) for each in (q, dq, ddq))
        along = np.stack([np.cos(angle), np.sin(angle)], axis=2)
        across = np.stack([-along[..., 1], along[..., 0]], axis=2)
        count = len(self.joints)
        base = np.zeros((len(q), 2))
        base[:, 1] = GRAVITY
        carried = [base]
        for link, length in enumerate(self.lengths):
            turned = (
                acceleration[:, link, None] * across[:, link] - speed[:, link, None] ** 2 * along[:, link]
            )
            carried.append(carried[-1] + length * turned)
        torque, force = np.zeros(len(q)), np.zeros((len(q), 2))
        found = np.empty_like(q)
        for link in reversed(range(count)):
            joint, mass = self.joints[link], self.masses[link]
            first, inertia = joint.first_moment_x, joint.link_inertia
            if link == count - 1:
                mass, first = mass + payload, first + payload * joint.reach
                inertia += payload * joint.reach**2
            else:
                torque = torque + self.lengths[link] * _cross(along[:, link], force)
            twist, square = acceleration[:, link, None], speed[:, link, None] ** 2
            t, n, a = along[:, link], across[:, link], carried[link]
            force = force + mass * a + first * (twist * n - square * t)
            force = force - joint.first_moment_y * (twist * t + square * n)
            torque = torque + inertia * acceleration[:, link]
            torque = torque + _cross(first * t + joint.first_moment_y * n, a)
            found[:, link] = torque
        return found


def _cross(a: Array, b: Array) -> Array:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def draw_planar_arm(random: np.random.Generator, count: int) -> PlanarArm:
    """An arm of its own: parameters up to twice more or less, links lighter towards the tip."""

    def around(value: float) -> float:
        return value * float(2.0 ** random.uniform(-1, 1))

    joints, masses, lengths = [], [], []
    for link in range(count):
        smaller = 0.6**link
        length, mass = float(random.uniform(0.3, 0.6)), around(8.0 * smaller)
        first = mass * length * float(random.uniform(0.3, 0.6))
        joints.append(
            Joint(
                link_inertia=first * length * float(random.uniform(0.6, 0.9)),
                rotor_inertia=around(2.0 * smaller),
                first_moment_x=first,
                first_moment_y=float(random.uniform(-0.1, 0.1)) * mass * length,
                viscous=around(12.0 * smaller),
                coulomb=around(9.0 * smaller),
                offset=float(random.uniform(-2.0, 2.0)),
                drive_gain=around(25.0 * smaller),
                reach=length,
                command_noise=0.02 * float(random.uniform(0.5, 2.0)),
                slow_noise=0.003 * float(random.uniform(0.5, 2.0)),
            )
        )
        masses.append(mass)
        lengths.append(length)
    return PlanarArm(tuple(joints), tuple(masses), tuple(lengths[:-1]))


def record_arm(
    folder: Path,
    arm: PlanarArm,
    joint: int,
    effects: Mapping[str, float],
    *,
    seed: int,
    payloads: tuple[float, ...] = (0.0, 3.0),
    duration: float = 30.0,
    rate: float = 250.0,
    repeats: int = 1,
    pace: float = 1.0,
    shape: float = 1.0,
) -> Path:
    """Move the arm's links through its sessions, with effects at a joint (name in `OF_ONE_JOINT` or `BENDING` -> strength), and
    write the experiment."""
    folder.mkdir(parents=True, exist_ok=True)
    count = len(arm.joints)
    sessions = []
    for index, mass in enumerate(payloads):
        time, q, dq, ddq = _motion(seed, index, count, duration, rate, repeats, pace)
        loads = arm.loads(q, dq, ddq, mass)
        columns = {"t": time}
        commands = []
        for place, of in enumerate(arm.joints):
            own = replace(of, reach=0.0)
            random = np.random.default_rng([seed, index, place, 1])
            run = Run(own, index, mass, time, q[:, place], dq[:, place], ddq[:, place], random, shape)
            run.load = loads[:, place]
            commands.append(_command(run, effects if place == joint else {}))
            step = 2 * np.pi / of.counts_per_turn
            columns[f"q{place + 1}"] = np.round(run.motor_q / step) * step
        columns |= {f"v{place + 1}": command for place, command in enumerate(commands)}
        file = f"session-{index:02d}.csv"
        text = session_text(list(columns.values()), list(columns), ["%.9g"] * len(columns))
        (folder / file).write_text(text, encoding="ascii")
        sessions.append({"file": file, "payload": f"m{index}"})
    described = [
        {"name": f"j{place + 1}", "type": "revolute", "alpha": 0.0, "theta": 0.0, "r": 0.0}
        | {"d": arm.lengths[place - 1] if place else 0.0, "drive_gain": of.drive_gain}
        for place, of in enumerate(arm.joints)
    ]
    tip = [arm.joints[-1].reach, 0.0, 0.0]
    document = {
        "format": 1,
        "name": "planar-arm",
        "robot": {"gravity": [0.0, -GRAVITY, 0.0], "joints": described},
        "payloads": [{"name": f"m{index}", "mass": mass, "com": tip} for index, mass in enumerate(payloads)],
        "sessions": sessions,
    }
    (folder / "experiment.yaml").write_text(yaml.safe_dump(document))
    return folder


def _motion(
    seed: int, index: int, count: int, duration: float, rate: float, repeats: int, pace: float
) -> tuple[Array, Array, Array, Array]:
    """Time (N,) and the motion (N, n) of a session: of each joint one of its own."""
    planned = [
        planned_motion(np.random.default_rng([seed, index, place]), duration, rate, repeats, pace, whole=True)
        for place in range(count)
    ]
    q, dq, ddq = (np.column_stack([each[k] for each in planned]) for k in (1, 2, 3))
    return planned[0][0], q, dq, ddq


def _command(run: Run, effects: Mapping[str, float]) -> Array:
    """What the drive of a joint reports, in steps of 1/1000, with its noise."""
    joint = run.joint
    run.motor_q, run.motor_dq, run.motor_ddq = run.q.copy(), run.dq.copy(), run.ddq.copy()
    for name, strength in effects.items():
        if name in BENDING:
            BENDING[name](run, strength)
    run.torque = run.load + joint.rotor_inertia * run.motor_ddq + joint.viscous * run.motor_dq
    run.torque += joint.coulomb * np.sign(run.motor_dq) + joint.offset
    for name, strength in effects.items():
        if name in ON_THE_TORQUE:
            ON_THE_TORQUE[name](run, strength)
    run.command = run.torque / joint.drive_gain
    for name, strength in effects.items():
        if name in ON_THE_COMMAND:
            ON_THE_COMMAND[name](run, strength)
    memory = np.exp(-(run.time[1] - run.time[0]) / 0.2)
    white = run.random.standard_normal((2, len(run.time)))
    slow = np.asarray(lfilter([np.sqrt(1 - memory**2)], [1.0, -memory], white[1]))
    noise = joint.command_noise * white[0] + joint.slow_noise * slow
    return np.asarray(np.round((run.command + noise) * 1000) / 1000)
