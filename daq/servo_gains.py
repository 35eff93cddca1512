"""The gains of the drives' own position controllers, read before a session and kept with it; nothing is written."""

from contextlib import ExitStack
from dataclasses import dataclass

import numpy as np

from daq.rig import Axis, Rig
from daq.rig_drives import RigDrives, friction_table
from daq.simulated_rig import simulated_rig
from drivers.drive import Drive
from drivers.errors import DriverError
from drivers.servo_objects import GainObject, ServoLaw, ServoObjects
from identify.recording.controller_file import ControllerFile, JointController
from identify.recording.errors import InputError

_DOING = "reading the gains of the position controller"


@dataclass(frozen=True)
class GainsRead:
    """What the drives said.

    controllers : None where the gains of some drive are not known
    remarks     : why
    """

    controllers: ControllerFile | None
    remarks: tuple[str, ...] = ()


def read_servo_gains(drives: RigDrives) -> GainsRead:
    """The drives' position controllers as laws in the units of the record: A per rad or m of the joint (of the motor in units of
    its joint where axes are coupled), A s/rad and so on.

    A drive that refuses, or whose profile does not say where its gains are, is a remark and never an error: a session
    needs no gains.
    """
    rig = drives.rig
    servos = [profile.servo for profile in rig.profiles]
    if not any(servos):
        return GainsRead(None)
    listed: list[JointController] = []
    objects: list[str] = []
    beside: list[str] = []
    for index, (axis, drive, servo) in enumerate(zip(rig.axes, drives.drives, servos, strict=True)):
        if servo is None:
            why = f"the profile {axis.drive} does not say where its gains are; those of the other drives are not kept"
            return GainsRead(None, (f"joint {axis.joint} (node {axis.node}): {why}",))
        try:
            law, said = _law(axis, drive, servo, objects)
            if friction_table(drive) is not None:
                said += ("the current that the drive adds by its own friction table",)
        except DriverError as error:
            return GainsRead(None, (f"joint {axis.joint}: the gains are not kept: {error}",))
        listed.append(_in_joint_units(axis.joint, law, float(rig.motor_gear[index, index])))
        beside += [f"joint {axis.joint}: {each}" for each in said]
    coupled = np.any(rig.motor_gear != np.diag(np.diag(rig.motor_gear)))
    return GainsRead(
        ControllerFile(
            coordinates="motors" if coupled else "joints",
            joints=tuple(listed),
            read_from=tuple(objects),
            left_out=tuple(beside),
        )
    )


def gains_of(rig: Rig) -> ControllerFile:
    """The gains of all drives of a rig, read now; the bus is claimed meanwhile, and nothing is written.

    Raises InputError: no profile of the rig says where gains are, or a drive does not tell them. DriverError where a node does
        not answer or is of another vendor, BusInUse while somebody else has the bus.
    """
    without = [
        axis.drive for axis, profile in zip(rig.axes, rig.profiles, strict=True) if profile.servo is None
    ]
    if without:
        raise InputError(
            f"rig {rig.name}: the profile {without[0]} does not say where its drives keep their gains (section `servo`,"
            " docs/drives.md)"
        )
    with ExitStack() as closing:
        if rig.simulated is not None and rig.bus.interface == "virtual":
            closing.enter_context(simulated_rig(rig, rig.payloads[0]))
        drives = RigDrives(rig, "reading gains")
        closing.callback(drives.close)
        for drive in drives.drives:
            drive.identity()
        read = read_servo_gains(drives)
    if read.controllers is None:
        raise InputError(f"rig {rig.name}: {'; '.join(read.remarks)}")
    return read.controllers


def _law(
    axis: Axis, drive: Drive, servo: ServoObjects, objects: list[str]
) -> tuple[ServoLaw, tuple[str, ...]]:
    """The law of one motor, and what is beside it; each object that was read is added to `objects`."""

    def read(name: str, gain: GainObject) -> float:
        raw = drive.sdo.read(gain.index, gain.subindex, gain.type, _DOING)
        value = float(raw) * gain.scale
        objects.append(
            f"joint {axis.joint} (node {axis.node}): {name} {gain} = {raw:g}, {value:.6g} {gain.unit}"
        )
        return value

    return servo.law(read), servo.beside(read)


def _in_joint_units(joint: str, law: ServoLaw, gear: float) -> JointController:
    """A law per rad of the motor's shaft as one per rad (or m) of its joint.

    gear : motor turns per joint turn, signed. A loop that holds its axis pushes against its error: the command that the record
           has, of which drive gain times it is the joint's torque, goes with the joint's error by the same sign as the gear
    """

    def converted(gain: float) -> float:
        return float(f"{gear * gain:.12g}")

    return JointController(
        joint=joint,
        position=converted(law.position),
        velocity=converted(law.velocity),
        reference_velocity=converted(law.reference_velocity),
        reference_acceleration=converted(law.reference_acceleration),
        reference_travel=converted(law.reference_travel),
        integral=converted(law.integral),
    )
