"""Motors that several joints turn, as a file of bodies has them: damping, dry friction and a rotor in the motor's own speed."""

from __future__ import annotations

import ast
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from identify.export.exported_model import ExportedModel, Torque
from identify.export.link_files import SharedMotor

Place = Literal["damping", "dry", "rotor"]

HAS_SHARED_MOTORS = ("xml",)
"""formats that have them: fixed tendons of MJCF"""
PLACES: dict[str, Place] = {
    "motor_share * motor_velocity": "damping",
    "motor_share * sign(motor_velocity)": "dry",
    "motor_share * motor_acceleration": "rotor",
}
"""what a column is there, by its formula"""


@dataclass(frozen=True)
class MotorsApart:
    """The motors that a format holds by themselves.

    motors : as they are written
    rest   : the model without their torques
    kept   : (effect, joint) of torques that are there as identified
    near   : (effect, joint) of those whose rotor has an inertia below zero, which is left out
    """

    motors: tuple[SharedMotor, ...]
    rest: ExportedModel
    kept: frozenset[tuple[str, int]]
    near: frozenset[tuple[str, int]]


def motors_apart(model: ExportedModel, kind: str) -> MotorsApart:
    """What of a model the format `kind` (urdf, sdf, xml) holds as motors of their own: none whose friction is below zero."""
    kept: set[tuple[str, int]] = set()
    near: set[tuple[str, int]] = set()
    motors: dict[tuple[str, int], SharedMotor] = {}
    for torque in model.torques if kind in HAS_SHARED_MOTORS else ():
        motor = _motor(model, torque)
        if motor is None or min(motor.damping, motor.dry) < 0:
            continue
        (near if motor.rotor < 0 else kept).add((torque.effect, torque.row))
        motors[torque.effect, torque.motor] = replace(motor, rotor=max(motor.rotor, 0.0))
    left = tuple(each for each in model.torques if (each.effect, each.motor) not in motors)
    return MotorsApart(tuple(motors.values()), replace(model, torques=left), frozenset(kept), frozenset(near))


def shared_motor_remarks(model: ExportedModel) -> list[str]:
    """What becomes of the shared motors of a model in a format that has none, or not these."""
    remarks = []
    for torque in model.torques:
        motor = _motor(model, torque)
        if motor is None:
            continue
        becomes = []
        if torque.rubs:
            becomes.append("each joint's own damping and dry friction stand for its friction")
        if motor.rotor:
            becomes.append("a rotor's inertia in it is lost")
        where = "it acts in the speed of a motor that several joints turn, which the file does not hold"
        remarks.append(f"{torque.effect}: {'; '.join([where, *becomes])}")
    return list(dict.fromkeys(remarks))


def _motor(model: ExportedModel, torque: Torque) -> SharedMotor | None:
    """The motor of a torque that is nothing but its damping, dry friction and rotor; None of any other torque."""
    turns = turns_of(model, torque)
    places = [PLACES.get(_plain(formula)) for formula in torque.formulas]
    if None in places or np.count_nonzero(turns) < 2 or torque.derivative:
        return None
    values = dict(zip(places, torque.values, strict=True))
    return SharedMotor(
        f"{torque.effect} {model.geometry.names[torque.motor]}",
        tuple(turns.tolist()),
        values.get("damping", 0.0),
        values.get("dry", 0.0),
        values.get("rotor", 0.0),
    )


def turns_of(model: ExportedModel, torque: Torque) -> NDArray[np.float64]:
    """(n,) how the motor that owns a torque turns with the joints."""
    listed: Sequence[float] | NDArray[np.float64] = torque.turns or model.shares[:, torque.motor]
    return np.asarray(listed, np.float64)


def _plain(formula: str) -> str:
    """A formula without brackets that change nothing."""
    return ast.unparse(ast.parse(formula, mode="eval"))
