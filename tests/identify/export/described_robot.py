"""Torques of a robot that is to be written to a file, from what is to stand in it."""

from __future__ import annotations

import numpy as np

from identify.dynamics.inverse_dynamics import InverseDynamics
from identify.dynamics.payload import payload_parameters
from identify.dynamics.standard_parameters import PARAMETERS_PER_JOINT


def parameters_of(body):
    """(10,) XX … M about the frame's origin."""
    origin = body.inertia + body.mass * (
        body.centre @ body.centre * np.eye(3) - np.outer(body.centre, body.centre)
    )
    return np.concatenate(
        [origin[[0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2]], body.mass * body.centre, [body.mass]]
    )


def torque_of_robot(robot):
    """Torque of a motion, friction by the formats' own rule at speed; a payload is a body on the last link."""
    listed = zip(robot.bodies, robot.friction, strict=True)
    links = np.concatenate([np.append(parameters_of(body), friction.rotor) for body, friction in listed])

    def torque_of(motion):
        standard = links.copy()
        standard[-PARAMETERS_PER_JOINT:-1] += payload_parameters(motion.payload)
        (torque,) = InverseDynamics(robot.geometry, [standard]).torques(motion.q, motion.dq, motion.ddq)
        joints = zip(robot.friction, motion.q.T, motion.dq.T, strict=True)
        return torque + np.array([friction.torque(q, dq) for friction, q, dq in joints]).T

    return torque_of
