"""The controllers of a robot, where they are known or can be told from the record: a simulation then closes the loop.

Where motors turn with several joints, drives control their motors and not the joints (`coordinates: motors`): a controller
then sees cᵀ q, its motor in units of its own joint, c of `motor_shares`. The law is that of `identify.recording.controller_file`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from identify.effects.model import motor_shares
from identify.recording.controller_file import ControllerFile, JointController
from identify.recording.errors import InputError
from identify.recording.experiment_file import check_settings
from identify.recording.strict_yaml import decode_strict_yaml, read_strict_yaml
from identify.simulation.measured_motion import MeasuredMotion

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

ESTIMATED = "estimate"
"""where the gains are to be told from the record"""

OF_DRIVES = "drives"
"""where the loop is to be closed with the gains that the drives held, or not at all"""

BY_TORQUE = "torque"
"""where the recorded torque drives the model although the recordings hold the drives' gains"""

LEAST_EXPLAINED = 0.5
"""part of the command's variance that a linear law must explain to pass for the controller"""

WORTH_AN_INTEGRAL = 0.5
"""of the variance that is left without an integral part: no more may be left with it"""

FASTEST_LOOP = 3e4
"""rad/s: a loop cannot be faster than the drive's current loop in it, which is closed some 16 000 times a second"""

ROUNDING = 1e-9
"""of eigenvalues beside 1"""

INTEGRAL = 3
"""place of the integral among the columns of the law"""

UNITS = {"position": "rad or m", "velocity": "rad/s or m/s", "integral": "rad s or m s"}
"""what a gain's command is per"""


@dataclass(frozen=True)
class Reference:
    """What the controllers follow, in their coordinates; (N, n).

    position : rad or m
    ahead    : command that does not depend on the motion: feed-forward and constants
    """

    position: Array
    ahead: Array

    def between(self, row: Rows, after: Rows, share: float) -> tuple[Array, Array]:
        """(windows, n) position and command ahead, a share of the way from one row to the next."""
        if share == 0.0:
            return self.position[row], self.ahead[row]
        return (
            self.position[row] + share * (self.position[after] - self.position[row]),
            self.ahead[row] + share * (self.ahead[after] - self.ahead[row]),
        )


@dataclass(frozen=True)
class Controllers:
    """The controllers of all joints.

    turns : (n, n) c of `motor_shares`: the controllers see cᵀ q. The unit matrix where each sees its joint
    """

    listed: tuple[JointController, ...]
    references: tuple[str, ...]
    turns: Array

    def reference(self, motion: MeasuredMotion) -> Reference:
        """The reference motion of a record, and the command that follows from it alone."""
        position = np.column_stack([motion.extra[name] for name in self.references]) @ self.turns
        velocity = np.gradient(position, motion.period, axis=0)
        ahead = (
            self.gain("reference_velocity") * velocity
            + self.gain("reference_travel") * (position - position[0])
            + self.gain("offset")
        )
        if np.any(self.gain("reference_acceleration")):
            ahead += self.gain("reference_acceleration") * np.gradient(velocity, motion.period, axis=0)
        return Reference(position, ahead)

    def gain(self, name: str) -> Array:
        """(n,) one gain of every joint."""
        return self._gains[name]

    @cached_property
    def _gains(self) -> dict[str, Array]:
        names = [name for name in JointController.model_fields if name not in ("joint", "reference", "limit")]
        return {
            name: np.array([float(getattr(controller, name)) for controller in self.listed]) for name in names
        }

    @cached_property
    def limits(self) -> Array:
        """(n,) largest command; infinite where there is no limit."""
        return np.array(
            [np.inf if controller.limit is None else controller.limit for controller in self.listed]
        )

    def error(self, reference: Array, q: Array) -> Array:
        """(windows, n) position error that the controllers see; `reference` in their coordinates, q of the joints."""
        return reference - q @ self.turns

    def command(self, error: Array, integral: Array, ahead: Array, velocity: Array) -> Array:
        """(windows, n) command of the law; `velocity` of the joints."""
        asked = (
            self.gain("position") * error
            + self.gain("integral") * integral
            - self.gain("velocity") * (velocity @ self.turns)
            + ahead
        )
        return np.clip(asked, -self.limits, self.limits)

    def integral_for(self, command: Array, error: Array, ahead: Array, velocity: Array) -> Array:
        """(windows, n) integral with which the law gives the recorded command at the beginning of a window."""
        gain = self.gain("integral")
        without = self.command(error, np.zeros(error.shape), ahead, velocity)
        return np.where(gain == 0.0, 0.0, (command - without) / np.where(gain == 0.0, 1.0, gain))

    def opposing(self, name: str, drive_gain: Array) -> Array:
        """(n, n) torque of the joints per position, speed or integral of the joints that the loops oppose, N m/rad and so on."""
        return drive_gain * self.gain(name) @ self.turns.T

    def opposing_rates(self, slope: Array, drive_gain: Array) -> Loops:
        """What the loops do to joints of an inertia, (windows, n, n) kg m² or kg; drive_gain (n, n) g_f of eq. (4)."""
        position, velocity, integral = (
            np.asarray(np.linalg.solve(slope, np.broadcast_to(torque, slope.shape)), np.float64)
            for torque in (self.opposing(name, drive_gain) for name in ("position", "velocity", "integral"))
        )
        return Loops(self.listed, position, velocity, integral)


@dataclass(frozen=True)
class Loops:
    """Closed loops about a state of the robot: acceleration of the joints per position, speed and integral that they oppose.

    Each (windows, n, n): 1/s², 1/s and 1/s³.
    """

    listed: tuple[JointController, ...]
    position: Array
    velocity: Array
    integral: Array

    def fastest(self) -> float:
        """Rate of the fastest loop in rad/s: the largest eigenvalue of the loops, and of the velocity loops alone.

        Raises InputError: it is faster than a drive's can be; names joint and gain.
        """
        count, n = self.position.shape[:2]
        course = np.zeros((count, 3 * n, 3 * n))  # d/dt of position, speed and integral
        course[:, :n, n : 2 * n] = course[:, 2 * n :, :n] = np.eye(n)
        course[:, n : 2 * n] = self._acceleration()
        rate = float(max(np.abs(np.linalg.eigvals(each)).max() for each in (course, self.velocity)))
        if rate > FASTEST_LOOP:
            joint, name = self._fastest_gain()
            raise InputError(
                f"the controllers' gains make a loop of {rate:.3g} rad/s, and no drive's is beyond {FASTEST_LOOP:g}: joint"
                f" '{joint.joint}': {name} {getattr(joint, name):g} is in units of the recorded command per {UNITS[name]}"
            )
        return rate

    def bears_holding(self, step: float) -> bool:
        """Whether the loops are damped with a torque that is held over two steps of so many seconds.

        The position of a step's beginning lags by half a step, which takes K/2 of the step from the damping: over one step no
        more than half of it, then.
        """
        n, step = self.position.shape[1], 2.0 * step
        acceleration = self._acceleration()
        course = np.zeros((len(acceleration), 3 * n, 3 * n))
        course[:] = np.eye(3 * n)
        course[:, :n, n : 2 * n] = course[:, 2 * n :, :n] = step * np.eye(n)
        course[:, :n] += 0.5 * step**2 * acceleration
        course[:, n : 2 * n] += step * acceleration
        # Integrals that no gain takes drift freely, and are left out.
        used = np.r_[: 2 * n, 2 * n + np.flatnonzero(np.any(self.integral, axis=(0, 1)))]
        largest = np.abs(np.linalg.eigvals(course[:, used][:, :, used])).max()
        return bool(largest < 1.0 + ROUNDING)

    def _acceleration(self) -> Array:
        """(windows, n, 3n) accelerations per position, speed and integral."""
        return np.concatenate([-self.position, -self.velocity, -self.integral], axis=2)

    def _fastest_gain(self) -> tuple[JointController, str]:
        """Joint and gain that alone make the fastest loop."""
        rates = np.array(
            [
                np.abs(np.diagonal(each, axis1=1, axis2=2)).max(axis=0) ** (1.0 / order)
                for each, order in ((self.position, 2), (self.velocity, 1), (self.integral, 3))
            ]
        )
        gain, joint = np.unravel_index(int(np.argmax(rates)), rates.shape)
        return self.listed[int(joint)], ("position", "velocity", "integral")[int(gain)]


def read_controllers(path: Path) -> ControllerFile:
    """A YAML file of controllers: `joints`, a list with `joint`, `position`, `velocity` and so on.

    Raises InputError: the file is wrong; names file, line and field.
    """
    return check_settings(ControllerFile, *read_strict_yaml(path), path)


def decode_controllers(content: bytes, name: str) -> ControllerFile:
    """What a file of this name holds, as `read_controllers` reads it. Raises InputError."""
    return check_settings(ControllerFile, *decode_strict_yaml(content, name), name)


def controllers_of(
    declared: ControllerFile, joint_names: list[str], drive_gain: Array, source: Path | str
) -> Controllers:
    """The controllers that a file or a recording declares, in the order of the joints.

    drive_gain : (n, n) g_f of eq. (4), which says what a motor turns with
    source     : named in messages

    Raises InputError: it names other joints than the robot's.
    """
    by_name = {gains.joint: gains for gains in declared.joints}
    if set(by_name) != set(joint_names) or len(by_name) != len(declared.joints):
        raise InputError(
            f"{source}: joints: give one controller for each joint of the robot: {', '.join(joint_names)};"
            f" there are {', '.join(gains.joint for gains in declared.joints)}"
        )
    listed = tuple(by_name[name] for name in joint_names)
    turns = motor_shares(drive_gain) if declared.coordinates == "motors" else np.eye(len(listed))
    return Controllers(listed, reference_columns(listed), turns)


def require_restoring(controllers: Controllers, drive_gain: Array, source: Path | str) -> None:
    """Raises InputError: a joint's position gain, with the drive gain g_f that turns its command into torque, drives it away from
    its reference. No machine moves so: the sign of one of them is wrong."""
    for joint, gains in enumerate(controllers.listed):
        gain = float(drive_gain[joint, joint])
        if gains.position * gain < 0.0:
            raise InputError(
                f"{source}: joint '{gains.joint}': position {gains.position:g} drives it away from its reference; its drive gain"
                f" is {gain:g}, so that position must be {'positive' if gain > 0 else 'negative'}"
            )


def reference_columns(listed: tuple[JointController, ...]) -> tuple[str, ...]:
    """The columns that hold the joints' reference positions."""
    return tuple(controller.reference or f"qref{index + 1}" for index, controller in enumerate(listed))


def estimated_controllers(
    motions: list[MeasuredMotion], joint_names: list[str], drive_gain: Array
) -> Controllers:
    """Gains that explain the recorded command best: least squares of the law on reference and recorded motion.

    The law of each drive is that of its motor (`coordinates: motors`), whose command it is.
    drive_gain : (n, n) g_f of eq. (4)
    Each stretch of motion has a constant of its own, where its integral begins; an integral part is taken where it leaves half
    of what is unexplained without it, or less.

    Raises InputError: a joint's command is not explained by its error and speeds.
    """
    listed = []
    turns = motor_shares(drive_gain)
    for joint, name in enumerate(joint_names):
        W, Y = _law(motions, joint, turns[:, joint])
        restoring = np.sign(drive_gain[joint, joint])  # of a gain that pushes against the error
        gains, left = _least_squares(np.delete(W, INTEGRAL, axis=1), Y)
        integral = 0.0
        with_integral, left_with = _least_squares(W, Y)
        if left_with <= WORTH_AN_INTEGRAL * left and restoring * with_integral[INTEGRAL] > 0.0:
            gains, left = np.delete(with_integral, INTEGRAL), left_with
            integral = float(with_integral[INTEGRAL])
        explained = 1.0 - left / max(float(np.var(Y)), 1e-300)
        if explained < LEAST_EXPLAINED or restoring * gains[0] <= 0.0:
            raise InputError(
                f"the controller's gains cannot be told from the record: joint '{name}': position error and speeds explain"
                f" {100 * max(0.0, explained):.0f} % of the recorded command with qref{joint + 1}; give the gains in a file"
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
    return Controllers(tuple(listed), reference_columns(tuple(listed)), turns)


def _law(motions: list[MeasuredMotion], joint: int, turns: Array) -> tuple[Array, Array]:
    """(N, 4 + motions) columns of the law for one joint's motor: k_p, k_r, k_v, k_i, a constant of each motion; (N,) its
    command. `turns` (n,) is what the motor turns with each joint.
    """
    rows, commands = [], []
    for number, motion in enumerate(motions):
        reference = np.column_stack([motion.extra[f"qref{each + 1}"] for each in range(len(turns))]) @ turns
        error = reference - motion.q @ turns
        constants = np.zeros((len(error), len(motions)))
        constants[:, number] = 1.0
        speed = np.gradient(reference, motion.period)
        integral = motion.period * np.cumsum(error)
        rows.append(np.column_stack([error, speed, -motion.dq @ turns, integral, constants]))
        commands.append(motion.command[:, joint])
    return np.vstack(rows), np.concatenate(commands)


def _least_squares(W: Array, Y: Array) -> tuple[Array, float]:
    """Gains, and the variance that they leave."""
    size = np.maximum(np.linalg.norm(W, axis=0), 1e-300)
    gains = np.linalg.lstsq(W / size, Y, rcond=1e-9)[0] / size
    return gains, float(np.var(Y - W @ gains))
