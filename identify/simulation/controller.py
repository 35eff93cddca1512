"""The controller of a joint, where it is known or can be told from the record: a simulation then closes the loop.

v = k_p (q_ref − q) + k_i ∫(q_ref − q) dt + k_r q̇_ref − k_v q̇ + v_0, within ± limit
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from identify.recording.errors import InputError
from identify.recording.experiment_file import check_settings
from identify.recording.strict_yaml import read_strict_yaml
from identify.simulation.measured_motion import MeasuredMotion

Array = NDArray[np.float64]

ESTIMATED = "estimate"
"""what `--controller` is where the gains are to be told from the record"""

LEAST_EXPLAINED = 0.5
"""part of the command's variance that a linear law must explain to pass for the controller"""

WORTH_AN_INTEGRAL = 0.5
"""of the variance that is left without an integral part: no more may be left with it"""

INTEGRAL = 3
"""place of the integral among the columns of the law"""


class JointController(BaseModel):
    """Gains of one joint; the command's unit is that of the recorded command."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    joint: str
    """name of the joint"""
    reference: str | None = None
    """column of the reference position, rad or m; `qref` and the joint's number if not said"""
    position: float
    """k_p, command per rad or m"""
    velocity: float
    """k_v, command per rad/s or m/s"""
    reference_velocity: float = 0.0
    """k_r, command per rad/s or m/s of the reference's velocity"""
    integral: float = 0.0
    """k_i, command per rad s or m s"""
    offset: float = 0.0
    """v_0, command"""
    limit: Annotated[float, Field(gt=0)] | None = None
    """largest command, either way"""


class ControllerFile(BaseModel):
    """A file of controllers, one for each joint."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    joints: Annotated[tuple[JointController, ...], Field(min_length=1)]


@dataclass(frozen=True)
class Controllers:
    """The controllers of all joints; arrays are (joints,)."""

    listed: tuple[JointController, ...]
    references: tuple[str, ...]

    def reference(self, motion: MeasuredMotion) -> tuple[Array, Array]:
        """(N, n) reference position and its velocity."""
        position = np.column_stack([motion.extra[name] for name in self.references])
        return position, np.gradient(position, motion.period, axis=0)

    def gain(self, name: str) -> Array:
        """(n,) one gain of every joint."""
        return np.array([float(getattr(controller, name)) for controller in self.listed])

    @property
    def limits(self) -> Array:
        """(n,) largest command; infinite where there is no limit."""
        return np.array(
            [np.inf if controller.limit is None else controller.limit for controller in self.listed]
        )

    def command(self, error: Array, integral: Array, reference_velocity: Array, velocity: Array) -> Array:
        """(windows, n) command of the law above."""
        asked = (
            self.gain("position") * error
            + self.gain("integral") * integral
            + self.gain("reference_velocity") * reference_velocity
            - self.gain("velocity") * velocity
            + self.gain("offset")
        )
        return np.clip(asked, -self.limits, self.limits)

    def integral_for(self, command: Array, error: Array, reference_velocity: Array, velocity: Array) -> Array:
        """(windows, n) integral with which the law gives the recorded command at the beginning of a window."""
        gain = self.gain("integral")
        without = self.command(error, np.zeros(error.shape), reference_velocity, velocity)
        return np.where(gain == 0.0, 0.0, (command - without) / np.where(gain == 0.0, 1.0, gain))


def read_controllers(path: Path, joint_names: list[str]) -> Controllers:
    """Controllers from a YAML file: `joints`, a list with `joint`, `position`, `velocity` and so on.

    Raises InputError: the file is wrong, or names other joints than the robot's; names file, line and field.
    """
    content, lines = read_strict_yaml(path)
    declared = check_settings(ControllerFile, content, lines, path)
    by_name = {gains.joint: gains for gains in declared.joints}
    if set(by_name) != set(joint_names) or len(by_name) != len(declared.joints):
        raise InputError(
            f"{path}: joints: one controller for each joint of the robot is wanted: {', '.join(joint_names)};"
            f" there are {', '.join(gains.joint for gains in declared.joints)}"
        )
    listed = tuple(by_name[name] for name in joint_names)
    return Controllers(listed, reference_columns(listed))


def reference_columns(listed: tuple[JointController, ...]) -> tuple[str, ...]:
    """The columns that hold the joints' reference positions."""
    return tuple(controller.reference or f"qref{index + 1}" for index, controller in enumerate(listed))


def estimated_controllers(motions: list[MeasuredMotion], joint_names: list[str]) -> Controllers:
    """Gains that explain the recorded command best: least squares of the law on reference and recorded motion.

    Each stretch of motion has a constant of its own, where its integral begins; an integral part is taken where it leaves half
    of what is unexplained without it, or less.

    Raises InputError: a joint's command is not explained by its error and speeds.
    """
    listed = []
    for joint, name in enumerate(joint_names):
        W, Y = _law(motions, joint)
        gains, left = _least_squares(np.delete(W, INTEGRAL, axis=1), Y)
        integral = 0.0
        with_integral, left_with = _least_squares(W, Y)
        if left_with <= WORTH_AN_INTEGRAL * left and with_integral[INTEGRAL] > 0.0:
            gains, left = np.delete(with_integral, INTEGRAL), left_with
            integral = float(with_integral[INTEGRAL])
        explained = 1.0 - left / max(float(np.var(Y)), 1e-300)
        if explained < LEAST_EXPLAINED or gains[0] <= 0.0:
            raise InputError(
                f"--controller {ESTIMATED}: joint '{name}': position error and speeds explain {100 * max(0.0, explained):.0f} %"
                f" of the recorded command with qref{joint + 1}; give the gains in a file"
            )
        listed.append(
            JointController(
                joint=name,
                position=float(gains[0]),
                reference_velocity=float(gains[1]),
                velocity=float(gains[2]),
                integral=integral,
                offset=float(np.mean(gains[3:])),
                limit=float(np.max(np.abs(Y))) * 1.2,
            )
        )
    return Controllers(tuple(listed), tuple(f"qref{joint + 1}" for joint in range(len(joint_names))))


def _law(motions: list[MeasuredMotion], joint: int) -> tuple[Array, Array]:
    """(N, 4 + motions) columns of the law for one joint: k_p, k_r, k_v, k_i, a constant of each motion; (N,) its command."""
    rows, commands = [], []
    for number, motion in enumerate(motions):
        reference = motion.extra[f"qref{joint + 1}"]
        error = reference - motion.q[:, joint]
        constants = np.zeros((len(error), len(motions)))
        constants[:, number] = 1.0
        speed = np.gradient(reference, motion.period)
        integral = motion.period * np.cumsum(error)
        rows.append(np.column_stack([error, speed, -motion.dq[:, joint], integral, constants]))
        commands.append(motion.command[:, joint])
    return np.vstack(rows), np.concatenate(commands)


def _least_squares(W: Array, Y: Array) -> tuple[Array, float]:
    """Gains, and the variance that they leave."""
    size = np.maximum(np.linalg.norm(W, axis=0), 1e-300)
    gains = np.linalg.lstsq(W / size, Y, rcond=1e-9)[0] / size
    return gains, float(np.var(Y - W @ gains))
