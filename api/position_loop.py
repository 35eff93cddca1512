"""The position loop of a proof in cyclic torque mode: what its axes move by the identified model, and the gains that hold it."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from daq.rig import Rig
from daq.stopping_watch import OUT_OF_CONTROL
from daq.torque_loop import AxisDynamics, TorqueLoop, design, require_loop
from daq.torque_offset import per_mille
from identify.dynamics.payload import payload_parameters
from identify.export.exported_model import ExportedModel
from identify.export.record_error import Motion
from identify.export.write import module_of
from identify.recording import InputError

Array = NDArray[np.float64]
RigidTorque = Callable[[Array, Array], Array]
"""(N, n) N m or N of positions and accelerations (N, n)"""

_POSES = 60
"""along the plan"""
_STEP = 1e-3
"""rad or m, over which gravity's derivative is taken"""


def position_loop(model: ExportedModel, rig: Rig, motion: Motion, share: float) -> TorqueLoop:
    """The loop for a rig whose proofs are driven in cyclic torque mode.

    model  : identified; the inertia and gravity of arm and payload along `motion` are its
    motion : the plan, a row for each cycle
    share  : of each axis's current limit, bound of the torque

    Raises InputError: axes share motors, gravity acts on an axis that nothing is said to hold, the cycle is too long for a joint,
        or a torque that stands for `torque_timeout` could make it too fast.
    """
    gear = rig.motor_gear
    if np.abs(gear - np.diag(np.diag(gear))).max(initial=0.0) > 1e-12:
        raise InputError(
            f"rig {rig.name}: feedforward: cyclic-torque is for axes with a motor each; here one motor moves several joints"
        )
    rows = np.unique(np.linspace(0, len(motion.q) - 1, _POSES).astype(int))
    rigid = _rigid_torque(model, motion)
    inertia = _inertia(rigid, motion.q[rows])
    gravity, stiffness = _gravity(rigid, motion.q[rows])
    least, greatest = _felt(inertia)
    gains = []
    for joint, axis in enumerate(rig.axes):
        if gravity[joint] > 0.01 * _strength(rig)[joint] and axis.held_by is None:
            raise InputError(
                f"rig {rig.name}: axis {axis.joint}: gravity acts on it ({gravity[joint]:.3g} along the plan), and a quick stop"
                " out of torque mode may end without torque: state held_by: brake or balance, if that is so"
            )
        dynamics = AxisDynamics((float(least[joint]), float(greatest[joint])), float(stiffness[joint]))
        gains.append(require_loop(axis.joint, design(dynamics, rig.cycle), rig.cycle))
        _require_slow(rig, joint, share, float(gravity[joint]), float(least[joint]), motion)
    # N m per rad to per mille of the rated torque per count
    scale = np.diag(rig.position_matrix) / np.diag(rig.drive_gain) * per_mille(rig)
    bound = share * np.array([axis.limits.current for axis in rig.axes]) * np.abs(per_mille(rig))
    return TorqueLoop(
        proportional=scale * [each.proportional for each in gains],
        integral=scale * [each.integral for each in gains],
        derivative=scale * [each.derivative for each in gains],
        bound=np.floor(bound).astype(np.int64),
        crossover=np.array([each.crossover for each in gains]),
    )


def _require_slow(rig: Rig, joint: int, share: float, gravity: float, inertia: float, motion: Motion) -> None:
    """Raises InputError: a torque that stands until the drive stops by itself could bring the axis out of control."""
    axis = rig.axes[joint]
    lasting = rig.supervision.torque_timeout + rig.cycle
    gained = (share * _strength(rig)[joint] + gravity) / inertia * lasting
    fastest = float(np.abs(motion.dq[:, joint]).max())
    if fastest + gained > OUT_OF_CONTROL * axis.limits.velocity:
        raise InputError(
            f"{axis.joint}: a torque that stands for {lasting:.2g} s, until the drive stops by itself, could bring it from"
            f" {fastest:.3g} to {fastest + gained:.3g}, beyond {OUT_OF_CONTROL:g} times its limit of velocity; a lower --share, a"
            " slower plan, or a shorter supervision.torque_timeout is needed"
        )


def _strength(rig: Rig) -> Array:
    """(n,) N m or N at the current limits."""
    return np.abs(np.diag(rig.drive_gain)) * np.array([axis.limits.current for axis in rig.axes])


def _rigid_torque(model: ExportedModel, motion: Motion) -> RigidTorque:
    """Of arm, rotors and payload at rest."""
    module, payload = module_of(model), payload_parameters(motion.payload)

    def at_rest(q: Array, ddq: Array) -> Array:
        return np.asarray(module.rigid_torque(q.T, np.zeros_like(q).T, ddq.T, payload)).T

    return at_rest


def _inertia(rigid: RigidTorque, q: Array) -> Array:
    """(N, n, n) kg m², the mass matrix of arm, rotors and payload."""
    still = rigid(q, np.zeros_like(q))
    columns = []
    for joint in range(q.shape[1]):
        unit = np.zeros_like(q)
        unit[:, joint] = 1.0
        columns.append(rigid(q, unit) - still)
    return np.stack(columns, axis=2)


def _gravity(rigid: RigidTorque, q: Array) -> tuple[Array, Array]:
    """(n,) each: the greatest gravity torque along the plan, and its greatest derivative by the joint's own position."""
    still = rigid(q, np.zeros_like(q))
    slopes = []
    for joint in range(q.shape[1]):
        moved = q.copy()
        moved[:, joint] += _STEP
        change = rigid(moved, np.zeros_like(q)) - still
        slopes.append(np.abs(change[:, joint]).max() / _STEP)
    return np.abs(still).max(axis=0), np.array(slopes)


def _felt(inertia: Array) -> tuple[Array, Array]:
    """(n,) each: least and greatest inertia that a joint feels, with the others free, and held."""
    held = np.diagonal(inertia, axis1=1, axis2=2)
    free = 1.0 / np.diagonal(np.linalg.inv(inertia), axis1=1, axis2=2)
    return np.minimum(free, held).min(axis=0), held.max(axis=0)
