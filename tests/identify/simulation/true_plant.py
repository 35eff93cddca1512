"""Forward dynamics of the test joint with its true parameters, written without the identifier: what no model can better.

The joint is that of `tests/plants/single_joint.py`; the equation of motion is solved for q'' at each step, dry friction
holds a joint at rest while it can.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from tests.plants.single_joint import GRAVITY, Joint

Array = NDArray[np.float64]
STEP = 5e-4
"""s"""


def dry_and_smooth(effect: str, strength: float, q: Array, dq: Array) -> tuple[Array, Array]:
    """(dry, smooth) torque of a hidden effect: the one that is multiplied by sign q', and the one that is not."""
    none = np.zeros_like(q)
    if effect == "stribeck":
        return strength * 8.0 * np.exp(-np.abs(dq) / 0.05), none
    if effect == "friction-position":
        return strength * 5.0 * np.cos(q - 0.4), none
    if effect == "viscous-quadratic":
        return none, -strength * 8.0 * np.abs(dq) * dq
    if effect == "viscous-asymmetric":
        return none, strength * 6.0 * np.abs(dq)
    if effect == "joint-spring":
        return none, strength * 12.0 * (q - 0.3)
    if effect in ("nothing", "load-friction"):
        return none, none
    raise KeyError(effect)


def one_second_error(
    columns: dict[str, Array], mass: float, effect: str, strength: float, joint: Joint | None = None
) -> float:
    """rad, root mean square over windows of a second begun at measured states, driven by the recorded torque."""
    joint = joint or Joint()
    time, position = columns["t"], columns["q1"]
    period = float(time[1] - time[0])
    velocity = savgol_filter(position, 31, 3, deriv=1, delta=period)
    samples = round(1.0 / period) + 1
    first = np.arange(50, len(time) - samples - 50, samples - 1)
    torque = joint.drive_gain * columns["v1"]
    q, dq = position[first].copy(), velocity[first].copy()
    inertia = joint.link_inertia + mass * joint.reach**2
    lost = 0.10 * strength if effect == "load-friction" else 0.0
    squares = []
    micro = round(period / STEP)
    for sample in range(samples):
        squares.append((q - position[first + sample]) ** 2)
        if sample == samples - 1:
            break
        for part in range(micro):
            share = (part + 0.5) / micro
            applied = (1 - share) * torque[first + sample] + share * torque[first + sample + 1]
            gravity = (joint.first_moment_x + mass * joint.reach) * np.cos(q) - joint.first_moment_y * np.sin(
                q
            )
            gravity = GRAVITY * gravity
            dry, smooth = dry_and_smooth(effect, strength, q, dq)
            rest = applied - smooth - joint.viscous * dq - joint.offset
            force = rest - gravity
            way = np.where(dq != 0.0, np.sign(dq), np.sign(force))
            limit = joint.coulomb + dry + lost * np.abs(gravity)
            # |load| is linear in q'' once its sign is known: that of the load without friction is tried first
            acceleration = np.zeros_like(q)
            for sign in (1.0, -1.0):
                c = lost * sign * way
                found = (rest - (joint.coulomb + dry) * way - gravity * (1.0 + c)) / (
                    inertia * (1.0 + c) + joint.rotor_inertia
                )
                fits = sign * (inertia * found + gravity) >= 0.0
                acceleration = np.where(fits, found, acceleration)
            held = (dq == 0.0) & (np.abs(force) <= limit)
            acceleration = np.where(held, 0.0, acceleration)
            faster = dq + STEP * acceleration
            faster = np.where(faster * dq < 0.0, 0.0, faster)
            q = q + STEP * 0.5 * (dq + faster)
            dq = faster
    return float(np.sqrt(np.mean(squares)))
