"""Masses that are assumed of a robot of which only geometry and drives are known, so that a plan can weigh
loads.

Each link is a slender rod from its own frame to the next one; the last one reaches to where the payloads
hang. All rods have the same mass per length. That mass is such that gravity takes a given share of some
joint's torque in the worst posture within the limits; rotors take their share of the torque at the highest
acceleration.
"""

import numpy as np
from numpy.typing import NDArray

from daq.rig import Rig
from identify.dynamics.base_parameters import BaseParameters
from identify.dynamics.standard_parameters import PARAMETERS_PER_JOINT, standard_names

Array = NDArray[np.float64]

GRAVITY_SHARE = 0.35
"""of the current limit: what gravity is assumed to need in the worst posture of the joint that it loads
most
"""

ROTOR_SHARE = 0.1
"""of the current limit: what rotors are assumed to need at the highest acceleration"""

SHORTEST_ROD = 0.05
"""m: a link whose next frame is at its own origin still has a body"""

POSTURES = 500

SOURCE = (
    "assumed: links as slender rods, of such a mass that gravity takes "
    f"{GRAVITY_SHARE:.0%} of a joint's current limit in the worst posture"
)


def torque_limits(rig: Rig) -> Array:
    """(n,) N m (or N): joint torque at the current limit of its own motor."""
    return np.abs(np.diag(rig.drive_gain)) * np.array([axis.limits.current for axis in rig.axes])


def assumed_base_parameters(rig: Rig, base: BaseParameters) -> Array:
    """(b,) base parameters of the assumed robot."""
    geometry, limits = base.geometry, torque_limits(rig)
    n = len(limits)
    symbols = {name: place for place, name in enumerate(standard_names(geometry))}
    links = np.zeros(PARAMETERS_PER_JOINT * n)
    for j in range(n):
        rod = _rod(rig, j)
        length = np.linalg.norm(rod)
        if length < SHORTEST_ROD:
            rod = np.array([0.0, 0.0, SHORTEST_ROD])
            length = SHORTEST_ROD
        # a rod of unit mass per length from the origin: first moment L/2 · rod, inertia L/3 (|rod|² 1 − rod
        # rodᵀ)
        tensor = length / 3.0 * (rod @ rod * np.eye(3) - np.outer(rod, rod))
        first = 0.5 * length * rod
        terms = {
            "XX": tensor[0, 0],
            "XY": tensor[0, 1],
            "XZ": tensor[0, 2],
            "YY": tensor[1, 1],
            "YZ": tensor[1, 2],
            "ZZ": tensor[2, 2],
            "MX": first[0],
            "MY": first[1],
            "MZ": first[2],
            "M": length,
        }
        for symbol, value in terms.items():
            links[symbols[f"{symbol}{j + 1}"]] = value
    chi = base.from_standard(links)
    random = np.random.default_rng(0)
    low, high = np.array([axis.limits.position for axis in rig.axes]).T
    q = low + (high - low) * random.random((POSTURES, n))
    still = np.zeros_like(q)
    gravity = np.abs(base.columns(q, still, still) @ chi).max(axis=0) / limits
    heaviest = float(gravity.max(initial=0.0))
    if heaviest < 1e-9:  # nothing hangs: let the inertia take the share instead
        fastest = np.array([axis.limits.acceleration for axis in rig.axes])
        ddq = fastest * random.choice([-1.0, 1.0], q.shape)
        heaviest = float((np.abs(base.columns(q, still, ddq) @ chi).max(axis=0) / limits).max())
    rotors = np.zeros(PARAMETERS_PER_JOINT * n)
    for j, axis in enumerate(rig.axes):
        rotors[symbols[f"Ia{j + 1}"]] = ROTOR_SHARE * limits[j] / axis.limits.acceleration
    return chi * (GRAVITY_SHARE / heaviest) + base.from_standard(rotors)


def _rod(rig: Rig, j: int) -> Array:
    """(3,) m: from frame j to the next one, in frame j; for the last link to the payloads' centre."""
    joints = rig.robot.joints
    if j + 1 < len(joints):
        after = joints[j + 1]
        return np.array([after.d, -after.r * np.sin(after.alpha), after.r * np.cos(after.alpha)])
    centres = [np.array(payload.com) for payload in rig.payloads if payload.mass > 0.0]
    return np.mean(centres, axis=0) if centres else np.array([0.3, 0.0, 0.0])
