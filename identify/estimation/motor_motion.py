"""Motion and load of a motor that shares axes with others, as the friction of its gear sees them.

With c of `motor_shares`, the motors' velocities in units of their own joints are cᵀ q̇ and their gears' loads, power being
what it is, c⁻¹ τ_out. Friction of a gear is a function of these two; its torque acts on joint j as c[j, m] of it. Where c is
the unit matrix all this is the joint's own.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.effects.model import Term
from identify.effects.motion import JointMotion
from identify.estimation.rigid_body import RigidBody

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class GearSignals:
    """The signals of all joints that a gear's are made of; (N, n) each.

    load, known : tau_out of the fitted rigid model, and its known part
    inertial    : for each joint the columns of the base parameters that act on it
    shared      : (N, k) directions of the motors that several joints share; by the sign of their velocity if not given
    """

    q: Array
    dq: Array
    ddq: Array
    direction: Array
    load: Array
    known: Array
    inertial: Sequence[Array]
    shared: Array | None = None


def gear_motion(body: RigidBody, joint: JointMotion, signals: GearSignals, rotor: float) -> JointMotion:
    """The motion of a joint with the position, velocity and load of its motor in the place of its own.

    joint : the motion of the motor's own joint
    rotor : kg m², inertia of the motor's rotor beside the base parameters. A rotor of one joint is among its base parameters
            and so in its load; that of a shared motor is in its load too.
    """
    motor = joint.joint
    turns, carries = body.shares[:, motor], body.load_shares[motor]
    acceleration = signals.ddq @ turns
    inertial = body.gear_inertial(motor, signals.inertial)
    if motor in body.shared_motors:
        inertial = np.column_stack([inertial, acceleration])
    return replace(
        joint,
        q=signals.q @ turns,
        dq=signals.dq @ turns,
        ddq=acceleration,
        direction=_direction(body, motor, signals),
        load=signals.load @ carries + rotor * acceleration,
        known_load=signals.known @ carries,
        inertial=inertial,
        motor_share=1.0,
    )


def pair_motion(
    body: RigidBody, owner: int, beside: float, joint: JointMotion, dq: Array, ddq: Array
) -> JointMotion:
    """The motion of a joint with the motor in it that joint `owner` and the one before it turn (`RigidBody.pair_turns`).

    dq, ddq : (N, n) of all joints
    """
    turns = body.pair_turns(owner, beside)
    return replace(
        joint,
        motor_velocity=dq @ turns,
        motor_acceleration=ddq @ turns,
        motor_share=float(turns[joint.joint]),
    )


def _direction(body: RigidBody, motor: int, signals: GearSignals) -> Array:
    """The sign of a motor's velocity; one that turns with a single joint turns where that joint does."""
    if motor in body.shared_motors:
        if signals.shared is not None:
            return signals.shared[:, body.shared_motors.index(motor)]
        return np.sign(signals.dq @ body.shares[:, motor])
    (joint,) = np.flatnonzero(body.shares[:, motor])
    return np.sign(body.shares[joint, motor]) * signals.direction[:, joint]


def rows_on(body: RigidBody, term: Term) -> list[int]:
    """Joints whose rows carry the columns of a term."""
    if term.effect.rows == "robot":
        return list(range(body.joints))
    if term.effect.rows == "pair":
        return [term.joint - 1, term.joint]
    if term.effect.rows == "joint" or (term.effect.rows == "gear" and not body.gears_apart[term.joint]):
        return [term.joint]
    return [int(joint) for joint in np.flatnonzero(body.shares[:, term.joint])]
