"""The proof on the drive: a model's torque along a plan, refused where it may do harm.

The torque is checked before anything moves: the bodies behind it must be possible, friction must take energy, and the plan
must stay within the speeds and loads that the model was identified at. While it is sent the axes are watched as in every
session, with a limit of the following error drawn from the drive of the same plan without it.
"""

import re
from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from api.position_loop import position_loop
from api.proof import Part, TorqueAhead
from daq.excitation.excitation_plan import ExcitationPlan
from daq.excitation.plan_limits import require_same_joints
from daq.rig import Rig
from daq.torque_offset import torque_offset
from identify.dynamics.inverse_dynamics import InverseDynamics
from identify.dynamics.payload import payload_torque
from identify.effects.catalogue import built_in
from identify.effects.conditions import SHARED_MOTOR
from identify.effects.load_velocity import LoadVelocity
from identify.effects.model import motor_shares
from identify.effects.picture import OVER_SPEED
from identify.export.bodies import feasible_standard
from identify.export.exported_model import ExportedModel, exported_model
from identify.export.planned_torque import PlannedTorque, planned_torque
from identify.export.record_error import Motion
from identify.export.write import motions_of
from identify.identification import Identification
from identify.recording import InputError
from identify.recording.experiment_file import Payload

ROUNDING = 1e-9
"""of the power that flows to and fro, below which a sum of it is none"""
MEANS = 0.01
"""s between the instants of a plan that means over it are taken of; its highest harmonics are some Hz"""
BEYOND = 1.05
"""times the largest speed or load of the record, up to which a model is believed; nor is its torque believed more closely"""


def torque_ahead(
    result: Identification, rig: Rig, plan: ExcitationPlan, payload: Payload, part: Part, share: float
) -> TorqueAhead:
    """A model's torque along a plan, ready to be sent.

    Raises InputError: the model or the plan is of another robot; the model is of the links alone, impossible, or not known at
        the plan's speeds and loads; the rig file lacks what the torque is scaled by; the extra `feasible` is not installed.
    """
    require_same_robot(result, rig)
    require_torque_of_motors(result)
    require_same_joints(plan, rig)
    cycles = int(np.floor(plan.duration / rig.cycle)) + 1
    # a target is reached one cycle after it has taken effect; the torque beside it acts meanwhile
    times = np.maximum((np.arange(cycles) - 0.5) * rig.cycle, 0.0)
    planned = plan.setpoints(times)
    motion = Motion(times, planned.position, planned.velocity, planned.acceleration, None, payload)
    model = exported_model(result).of_the_instant
    torque = planned_torque(model, motion)
    names = model.geometry.names
    recorded = motions_of(result)
    _within_what_is_known(names, torque, motion, [(m, planned_torque(model, m)) for m in recorded])
    _within_positions_and_temperatures(model, motion, recorded)
    _possible(result, _for_means(motion, rig.cycle), np.sqrt(np.mean(torque.whole**2, axis=0)))
    sent = torque.whole if part == "whole" else torque.beside
    offset = torque_offset(rig, sent, share, faded=not rig.held_over_the_bus)
    if not np.any(offset.counts):
        raise InputError(
            f"{'the model' if part == 'whole' else 'the friction of the model'}: nothing would be sent along this plan, at most"
            f" {100 * share:.3g} % of each current limit; take a larger share, or a model with torque of its own"
        )
    remarks = [*model.remarks, *_shared_motors_without_friction(result)]
    if model.lost:
        lost = ", ".join(f"{effect}@{names[joint]}" for effect, joint in model.lost)
        remarks.append(f"not sent, for they have no formula of the state at one instant: {lost}")
    for name, bounded in zip(names, offset.bounded, strict=True):
        if bounded > 0:
            remarks.append(f"{name}: {100 * bounded:.2g} % of the plan asked for more than the bound")
    loop = None
    if rig.held_over_the_bus:
        loop = position_loop(model, rig, motion, share)
        remarks.append(f"both runs are {loop.words}; of those nothing is proved")
        if rig.safety_output is None:
            remarks.append(_NO_OTHER_WAY)
    return TorqueAhead(
        offset,
        sent,
        motion.q,
        motion.dq,
        torque.rigid,
        tuple(remarks),
        loop,
        _of_a_kilogram(model, motion, rig),
        np.maximum(_believed(result), BEYOND - 1.0) * np.sqrt(np.mean(torque.whole**2, axis=0)),
    )


def _of_a_kilogram(model: ExportedModel, motion: Motion, rig: Rig) -> NDArray[np.float64]:
    """(N, n) N m or N that a kilogram adds where the payload is, or the heaviest of the rig where nothing is mounted."""
    mounted = motion.payload
    if mounted.mass == 0.0:
        mounted = max((mounted, *rig.payloads), key=lambda payload: payload.mass)
    kilogram = mounted.model_copy(update={"mass": 1.0, "inertia": (0.0,) * 6})
    return payload_torque(model.geometry, kilogram, motion.q, motion.dq, motion.ddq)


def _believed(result: Identification) -> NDArray[np.float64]:
    """(n,) relative error of a model on its own record."""
    fit = result.fitted.fit
    return fit.residual / np.where(fit.norm > 0, fit.norm, 1.0)


def _shared_motors_without_friction(result: Identification) -> list[str]:
    slots = result.fitted.slots
    friction = _friction_of_a_shared_motor()
    present = {slot.term.joint for slot in slots if slot.term.effect.name in (friction, LoadVelocity.name)}
    names = [joint.name for joint in result.experiment.robot.joints]
    return shared_motor_remarks(names, result.experiment.drive_gain, present)


def _friction_of_a_shared_motor() -> str:
    """The name of the effect: over the speed of a motor, where that is another than the joint's."""
    return next(
        effect.name
        for effect in built_in()
        if SHARED_MOTOR in effect.conditions and effect.picture is OVER_SPEED
    )


def shared_motor_remarks(
    names: Sequence[str], drive_gain: NDArray[np.float64], present: Collection[int]
) -> list[str]:
    """What to add where a motor turns with several joints at once and the model has no friction of that motor.

    drive_gain : (n, n) eq. (4)
    present    : joints whose motor's friction the model has
    """
    remarks: list[str] = []
    for motor, column in enumerate(motor_shares(drive_gain).T):
        others = [names[joint] for joint in np.flatnonzero(np.abs(column) > 1e-9).tolist() if joint != motor]
        if others and motor not in present:
            remarks.append(
                f"{names[motor]}: its motor turns with {', '.join(others)} too, and the model has no friction of that motor; "
                f"these joints may follow no better. Add {_friction_of_a_shared_motor()}@{names[motor]} and fit again"
            )
    return remarks


def require_same_robot(result: Identification, rig: Rig) -> None:
    """Raises InputError: a model is of another robot than a rig, or of other drive gains."""
    experiment = result.experiment
    theirs = [joint.name for joint in experiment.robot.joints]
    ours = [axis.joint for axis in rig.axes]
    if theirs != ours:
        raise InputError(
            f"experiment {experiment.name}: its joints are {', '.join(theirs)}; rig {rig.name} has {', '.join(ours)}"
        )
    if not np.allclose(experiment.drive_gain, rig.drive_gain, rtol=1e-3):
        raise InputError(
            f"experiment {experiment.name}: its drive gains are not those of rig {rig.name}; torque would be scaled wrongly"
        )


def require_torque_of_motors(result: Identification) -> None:
    """Raises InputError: the model was identified from torques behind motor and gear."""
    if not result.fitted.record.body.base.rotors:
        raise InputError(
            f"model {result.model}: it was identified from torques measured on the links' side, so that it has neither rotor"
            " inertia nor the friction of motor and gear; a drive is sent the motor's torque. Identify a model of the motors'"
            " current or torque, e.g. load-velocity"
        )


def _within_what_is_known(
    names: Sequence[str],
    torque: PlannedTorque,
    motion: Motion,
    known: list[tuple[Motion, PlannedTorque]],
) -> None:
    speeds = np.max([np.abs(recorded.dq).max(axis=0) for recorded, _ in known], axis=0)
    loads = np.max([np.abs(at_record.rigid).max(axis=0) for _, at_record in known], axis=0)
    asked = (
        ("speed", np.abs(motion.dq).max(axis=0), speeds),
        ("load", np.abs(torque.rigid).max(axis=0), loads),
    )
    for what, planned, reached in asked:
        for name, here, there in zip(names, planned, reached, strict=True):
            if here > BEYOND * there:
                raise InputError(
                    f"{name}: the plan's largest {what}, {here:.3g}, is beyond what the model was identified at, {there:.3g};"
                    " its friction is not known there"
                )


_NO_OTHER_WAY = (
    "a drive that stops by itself when setpoints stay away cannot do so once its firmware hangs: its last torque then stands"
    " until somebody presses the emergency stop, for the rig file names no safety_output that takes the power without the drive"
)
_OVER_POSITION = re.compile(r"\bq\d*\b")
_OVER_TEMPERATURE = re.compile(r"\btemp\b")
_OVER_TIME = re.compile(r"\bt\b")


def _within_positions_and_temperatures(model: ExportedModel, motion: Motion, known: list[Motion]) -> None:
    """Raises InputError: an effect of the model over position is not known at all of the plan's, or one over temperature or
    over the time since the machine was cold."""
    names = model.geometry.names
    lowest = np.min([each.q.min(axis=0) for each in known], axis=0)
    highest = np.max([each.q.max(axis=0) for each in known], axis=0)
    slack = (BEYOND - 1.0) * (highest - lowest)
    for torque in model.torques:
        if _OVER_TEMPERATURE.search(torque.formula):
            raise InputError(
                f"{names[torque.row]}: the model has {torque.effect}, and the temperature along the plan is not known before it"
                " is driven; send a model without it"
            )
        if _OVER_TIME.search(torque.formula):
            raise InputError(
                f"{names[torque.row]}: the model has {torque.effect}, and how long the machine will have run when the plan is"
                " driven is not known; warm it up, and send a model without it"
            )
        over = _OVER_POSITION.findall(torque.formula)
        looked_at = {torque.motor if each == "q" else int(each[1:]) - 1 for each in over}
        for joint in sorted(looked_at):
            low, high = float(motion.q[:, joint].min()), float(motion.q[:, joint].max())
            if low < lowest[joint] - slack[joint] or high > highest[joint] + slack[joint]:
                raise InputError(
                    f"{names[joint]}: the plan goes from {low:.3g} to {high:.3g}, and {torque.effect} was identified from"
                    f" {lowest[joint]:.3g} to {highest[joint]:.3g}; it is not known beyond"
                )


def _for_means(motion: Motion, cycle: float) -> Motion:
    """As many instants of a motion, one each `cycle` (s), as means over it need; shorter cycles tell them nothing more."""
    few = slice(None, None, max(1, int(MEANS / cycle)))
    return replace(motion, t=motion.t[few], q=motion.q[few], dq=motion.dq[few], ddq=motion.ddq[few])


def _possible(result: Identification, motion: Motion, size: NDArray[np.float64]) -> None:
    """Raises InputError: no bodies give such torque, or friction drives.

    size : (n,) N m or N, root mean square of the torque along the plan
    """
    model = exported_model(result)
    standard, kept = feasible_standard(result, model)
    if not kept:
        identified, near = InverseDynamics(model.geometry, [model.standard, standard]).torques(
            motion.q, motion.dq, motion.ddq
        )
        off = np.sqrt(np.mean((identified - near) ** 2, axis=0))
        for name, here, whole, error in zip(model.geometry.names, off, size, _believed(result), strict=True):
            if here > error * whole:
                raise InputError(
                    f"{name}: no bodies with mass have the identified base parameters; the nearest give a torque that is"
                    f" {100 * here / whole:.1f} % off, more than the model's own error of {100 * error:.1f} %"
                )
    for name, power in zip(model.geometry.names, friction_work(model.of_the_instant, motion), strict=True):
        if power < 0:
            raise InputError(
                f"{name}: along this plan and back the model's friction would drive the joint, which no friction does"
            )


def friction_work(model: ExportedModel, motion: Motion) -> NDArray[np.float64]:
    """(n,) W: mean power that friction takes along a motion and back again, of all torque beside the rigid robot.

    On the way back springs, gravity, cogging and offsets give what they took on the way there: what is left is friction's.
    Friction of a motor that moves several joints stands with that motor's own joint, summed over all that it moves: on one of
    them alone it may well drive, where the motor turns the other way.
    """
    there_and_back = (
        motion,
        replace(motion, q=motion.q[::-1], dq=-motion.dq[::-1], ddq=motion.ddq[::-1]),
    )

    def power(of: ExportedModel) -> NDArray[np.float64]:
        """(2 N, n) W"""
        return np.concatenate([planned_torque(of, each).beside * each.dq for each in there_and_back])

    flowing = power(model)
    work = flowing.mean(axis=0)
    for motor in range(model.joints):
        elsewhere = tuple(
            each for each in model.torques if each.rubs and each.motor == motor and each.row != motor
        )
        if elsewhere:
            on_others = power(replace(model, torques=elsewhere)).mean(axis=0)
            work -= on_others
            work[motor] += on_others.sum()
    return np.where(np.abs(work) > ROUNDING * np.abs(flowing).mean(axis=0), work, 0.0)
