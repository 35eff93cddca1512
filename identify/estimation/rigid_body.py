"""The rigid robot as the estimator uses it: base parameter columns, known loads, and their derivatives."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identify.dynamics.base_parameters import BaseParameters, base_parameters
from identify.dynamics.geometry import Geometry
from identify.dynamics.payload import payload_regressor, payload_torque
from identify.dynamics.standard_parameters import PARAMETERS_PER_JOINT
from identify.effects.model import coupled_motors, gear_apart, load_shares, motor_shares
from identify.recording import Experiment
from identify.recording.experiment_file import Payload

Array = NDArray[np.float64]

POSITION_STEP = 1e-5
"""rad or m, of the central differences of the load over position; rounding and curvature both stay below
1e-8.
"""
CENTRE_STEP = 1e-4
"""m, of the central differences of a payload's torque over its centre; the torque is quadratic in it, so
exact.
"""


@dataclass(frozen=True, eq=False)
class AlongParameters:
    """A course that is linear in the base parameters: known + columns @ chi[acts], (N,).

    It depends on the motion alone, so that it is computed once, whatever is fitted.
    """

    acts: NDArray[np.bool_]
    columns: Array
    known: Array

    def at(self, chi: Array) -> Array:
        """(N,) for base parameters chi, (b,)."""
        return self.columns @ chi[self.acts] + self.known


@dataclass(frozen=True, eq=False)
class RigidBody:
    """Geometry, base parameters and payloads of an experiment."""

    base: BaseParameters
    payloads: tuple[Payload, ...]
    drive_gain: Array
    motor_ratios: tuple[float, ...] = ()
    """of each joint the turns of its motor per turn, or per metre; 1 where there are none"""

    @classmethod
    def of(cls, experiment: Experiment, rotors: bool = True) -> "RigidBody":
        """The rigid robot of an experiment; without its rotors where the torque is measured behind them."""
        geometry = Geometry.from_robot(experiment.robot)
        ratios = tuple(float(joint.motor_ratio) or 1.0 for joint in experiment.robot.joints)
        return cls(
            base_parameters(geometry, rotors), tuple(experiment.payloads), experiment.drive_gain, ratios
        )

    @property
    def joints(self) -> int:
        """Number of joints."""
        return len(self.base.acts)

    @cached_property
    def shares(self) -> Array:
        """c[j, m] of `motor_shares`."""
        return motor_shares(self.drive_gain)

    @cached_property
    def load_shares(self) -> Array:
        """c⁻¹[m, j] of `load_shares`."""
        return load_shares(self.drive_gain)

    @cached_property
    def gears_apart(self) -> tuple[bool, ...]:
        """Of each motor `gear_apart`."""
        return tuple(gear_apart(self.drive_gain, motor) for motor in range(self.joints))

    @cached_property
    def shared_motors(self) -> tuple[int, ...]:
        """Motors that turn with several joints; their rotors are no base parameters."""
        return tuple(m for m in range(self.joints) if m in coupled_motors(self.drive_gain, m))

    def pair_turns(self, joint: int, beside: float) -> Array:
        """(n,) how a motor turns with the joints, in units of the joint's own, that the joint and the one before it turn by
        `beside` turn per turn of their motors."""
        turns = np.zeros(self.joints)
        ratios = self.motor_ratios or (1.0,) * self.joints
        turns[joint], turns[joint - 1] = 1.0, beside * ratios[joint - 1] / ratios[joint]
        return turns

    def may_share_undeclared(self, joint: int) -> bool:
        """Whether a joint and the one before it may share a motor that the drive gain matrix does not declare."""
        slides = self.base.geometry.prismatic
        return (
            joint > 0
            and bool(slides[joint] == slides[joint - 1])
            and not np.any((self.shares[joint] != 0) & (self.shares[joint - 1] != 0))
        )

    def gear_parameters(self, motor: int) -> NDArray[np.intp]:
        """(k,) indices of the base parameters that act on what the gear of a motor carries."""
        carried = self.load_shares[motor] != 0
        return np.flatnonzero(np.any(self.base.acts[carried], axis=0)).astype(np.intp)

    def gear_inertial(self, motor: int, columns: Sequence[Array]) -> Array:
        """(N, k): what the gear of a motor carries, for each of `gear_parameters`; columns as `inertial_columns` has them."""
        indices = self.gear_parameters(motor)
        carried = np.zeros((len(columns[0]), len(self.base)))
        for joint, share in enumerate(self.load_shares[motor]):
            if share != 0:
                carried[:, self.base.acts[joint]] += share * columns[joint]
        return carried[:, indices]

    def payload_index(self, payload: Payload) -> int:
        """Position of a payload among those of the experiment."""
        return [declared.name for declared in self.payloads].index(payload.name)

    def inertial_columns(self, q: Array, dq: Array, ddq: Array) -> list[Array]:
        """For each joint the columns of the base parameters that act on it, eq. (10)."""
        return self.base.columns_of_joints(q, dq, ddq)

    def known_load(self, payload: Payload, q: Array, dq: Array, ddq: Array, external: Array | None) -> Array:
        """(N, n): torque of the declared payload less the known external force, the known part of tau_out."""
        if payload.mass > 0 or any(payload.inertia):
            load = payload_torque(self.base.geometry, payload, q, dq, ddq)
        else:
            load = np.zeros(q.shape)
        return load if external is None else load - external

    def load(self, columns: Sequence[Array], chi: Array, known: Array) -> Array:
        """(N, n): tau_out of eq. (6) for base parameters chi, the known part included."""
        load = np.array(known, copy=True)
        for joint, inertial in enumerate(columns):
            load[:, joint] += inertial @ chi[self.base.acts[joint]]
        return load

    def slope_columns(self, joint: int, payload: Payload, q: Array, dq: Array, ddq: Array) -> AlongParameters:
        """Derivative of the load of a joint over its own position, (N,)."""
        ends = []
        for step in (POSITION_STEP, -POSITION_STEP):
            moved = q.copy()
            moved[:, joint] += step
            known = self.known_load(payload, moved, dq, ddq, None)[:, joint]
            ends.append((self.base.joint_columns(joint, moved, dq, ddq), known))
        (columns, known), (columns_before, known_before) = ends
        return AlongParameters(
            self.base.acts[joint],
            (columns - columns_before) / (2 * POSITION_STEP),
            (known - known_before) / (2 * POSITION_STEP),
        )

    def inertia_columns(self, joint: int, q: Array) -> AlongParameters:
        """Torque per acceleration of a joint at some postures q (N, n), without payload."""
        still, moved = np.zeros(q.shape), np.zeros(q.shape)
        moved[:, joint] = 1.0
        columns = self.base.joint_columns(joint, q, still, moved)
        columns = columns - self.base.joint_columns(joint, q, still, still)
        return AlongParameters(self.base.acts[joint], columns, np.zeros(len(q)))

    def axis_along_gravity(self, joint: int) -> bool:
        """Whether gravity, as declared, makes no torque on the joint (a vertical axis at the base, a
        level slide).
        """
        return self._axes_along_gravity[joint]

    @cached_property
    def _axes_along_gravity(self) -> list[bool]:
        """`axis_along_gravity` of every joint."""
        still = np.zeros((7, self.joints))
        q = np.linspace(-2.0, 2.0, 7)[:, None] + np.arange(self.joints)
        return [
            not np.any(np.abs(inertial) > 1e-9) for inertial in self.base.columns_of_joints(q, still, still)
        ]

    def gravity_columns(self, joint: int, payload: Payload, q: Array) -> tuple[AlongParameters, ...]:
        """Torque per m/s² of gravity along two directions across the declared one, (N,) each.

        Where gravity makes no torque on the joint its first moments are not among the base parameters; then a
        tilt shows as an unknown multiple of cos q and sin q.
        """
        nothing = np.zeros(len(self.base), bool)
        none = np.zeros((len(q), 0))
        if self.base.geometry.prismatic[joint] and self.axis_along_gravity(joint):
            # a tilted slide feels a constant force, as the offset does
            return (AlongParameters(nothing, none, np.ones(len(q))),) * 2
        if self.axis_along_gravity(joint):
            waves = np.cos(q[:, joint]), np.sin(q[:, joint])
            return tuple(AlongParameters(nothing, none, wave) for wave in waves)
        still = np.zeros(q.shape)
        further = self.base.independent // PARAMETERS_PER_JOINT >= joint
        columns = []
        for direction in across(self.base.geometry.gravity):
            tilted = replace(self.base.geometry, gravity=direction)
            base = replace(self.base, geometry=tilted, acts=np.tile(further, (self.joints, 1)))
            known = np.zeros(len(q))
            if payload.mass > 0:
                known = payload_torque(tilted, payload, q, still, still)[:, joint]
            columns.append(AlongParameters(further, base.joint_columns(joint, q, still, still), known))
        return tuple(columns)

    def payload_columns(self, joint: int, q: Array, dq: Array, ddq: Array) -> Array:
        """(N, 10): torque of a joint per unit of each link parameter of a body on the last link."""
        return payload_regressor(self.base.geometry, q, dq, ddq, [joint])[:, 0]

    def payload_gradient(self, joint: int, payload: Payload, q: Array, dq: Array, ddq: Array) -> Array:
        """(N, 3): derivative of a payload's torque over its centre of mass, N m per m."""
        slopes = []
        for axis in range(3):
            ends = []
            for step in (CENTRE_STEP, -CENTRE_STEP):
                com = list(payload.com)
                com[axis] += step
                moved = payload.model_copy(update={"com": tuple(com)})
                ends.append(payload_torque(self.base.geometry, moved, q, dq, ddq)[:, joint])
            slopes.append((ends[0] - ends[1]) / (2 * CENTRE_STEP))
        return np.column_stack(slopes)


def across(gravity: Array) -> tuple[Array, Array]:
    """Two unit vectors across a vector; for no gravity the first two axes."""
    length = float(np.linalg.norm(gravity))
    if length == 0:
        return np.array([1.0, 0, 0]), np.array([0, 1.0, 0])
    down = gravity / length
    first = np.asarray(np.cross(down, np.eye(3)[np.argmin(np.abs(down))]), float)
    first /= float(np.linalg.norm(first))
    return first, np.asarray(np.cross(down, first), float)
