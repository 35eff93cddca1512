"""What is looked at before a session: is every drive of the rig there, is it what the rig file says, without fault, at rest?

Nothing here moves anything.
"""

import time
from dataclasses import dataclass
from pathlib import Path

import can
import numpy as np

from daq.bus_load import OtherTraffic, bit_rate, bus_load
from daq.rig import Axis, Rig
from daq.rig_drives import MASTER_NODE, MODES, OUR_HEARTBEAT, POWERED, RigDrives
from daq.stopping_watch import expected_deceleration
from drivers.bus import open_bus
from drivers.cia402 import HOMING_ATTAINED, HOMING_ERROR, Mode, State
from drivers.drive import Drive
from drivers.errors import DriverError
from drivers.profile import DriveProfile
from drivers.standard_stream import standard_stream
from drivers.sync_producer import SYNC_ID

_LISTEN = 0.1
"""s to listen for another master before anything is sent"""
_MOST_HEARD = 5000
"""frames: more than a bus at 1 Mbit/s carries while it is listened to"""
_LOOK_TWICE = 0.02
"""s between two positions that tell whether an axis moves"""
_REST_SHARE = 0.01
"""of the velocity limit: slower than that between those two, it stands"""
_REST_COUNTS = 4
"""counts by which an encoder at rest may flicker"""
_RATED_TOLERANCE = 0.01
"""relative; the drive holds its rated value as a whole number of mN m or mA"""


@dataclass(frozen=True)
class CheckItem:
    """One thing that was looked at before a session."""

    what: str
    ok: bool
    words: str
    advice: bool = False
    """whether there is something to do about it although the session may go on"""


@dataclass(frozen=True)
class RigCheck:
    """Everything that was looked at before a session."""

    items: tuple[CheckItem, ...]

    @property
    def ok(self) -> bool:
        """Whether the session may go on."""
        return all(item.ok for item in self.items)

    @property
    def problems(self) -> str:
        """What is wrong, in one line."""
        return "; ".join(f"{item.what}: {item.words}" for item in self.items if not item.ok)


def check_rig(drives: RigDrives) -> RigCheck:
    """Look at every drive: is it there, is it what the rig file says, without fault, at rest, homed?

    Nothing is written to a drive before it has said that it has no power and does not move.
    """
    heard, seconds = listen(drives.rig)
    traffic = OtherTraffic.of(heard, seconds, [axis.node for axis in drives.rig.axes])
    items = _others(drives.rig, {each.arbitration_id for each in heard}) + _load(drives.rig, traffic)
    if all(item.ok for item in items):
        for axis, drive, profile in zip(drives.rig.axes, drives.drives, drives.rig.profiles, strict=True):
            what = f"joint {axis.joint} (node {axis.node})"
            if drive.passed_over:
                named = Path(profile.object_dictionary).name
                items.append(CheckItem(what, True, f"{named}: passed over {'; '.join(drive.passed_over)}"))
            try:
                items += [
                    CheckItem(what, ok, sentence) for ok, sentence in _look(drives, axis, drive, profile)
                ]
            except DriverError as error:
                items.append(CheckItem(what, False, str(error)))
    if all(item.ok for item in items):
        items += _within_limits(drives)
    return RigCheck(tuple(items))


def listen(rig: Rig) -> tuple[list[can.Message], float]:
    """All frames on the bus before anything is sent, and for how many seconds they were listened to."""
    heard: list[can.Message] = []
    with open_bus(rig.bus) as bus:
        begin = time.monotonic()
        end = begin + max(_LISTEN, 3 * rig.cycle)
        while (left := end - time.monotonic()) > 0 and len(heard) < _MOST_HEARD:
            message = bus.recv(left)
            if message is not None:
                heard.append(message)
        return heard, time.monotonic() - begin


def _others(rig: Rig, on_the_bus: set[int]) -> list[CheckItem]:
    """Whether somebody else sends SYNC or setpoints: then the bus is not ours, and nothing is sent."""
    heard = on_the_bus & {SYNC_ID, OUR_HEARTBEAT, *(0x200 + axis.node for axis in rig.axes)}
    if not heard:
        return []
    if heard == {OUR_HEARTBEAT}:
        sentence = (
            f"a node with id {MASTER_NODE} is on {rig.bus}, the id of our own heartbeat: give it another"
        )
        return [CheckItem("bus", False, sentence)]
    heard.discard(OUR_HEARTBEAT)
    named = ", ".join("SYNC" if each == SYNC_ID else f"setpoints 0x{each:03X}" for each in sorted(heard))
    sentence = (
        f"another master is active on {rig.bus}: it sends {named}; nothing was sent. "
        "End it, or take it off the bus"
    )
    return [CheckItem("bus", False, sentence)]


def _load(rig: Rig, others: OtherTraffic) -> list[CheckItem]:
    """Whether what the drives are to send goes into the cycle; nothing where the bus has no bit rate."""
    rate = bit_rate(rig.bus)
    if rate is None:
        return []
    streams = [
        standard_stream(axis.node, profile, MODES[axis.mode], rig.record_temperature)
        for axis, profile in zip(rig.axes, rig.profiles, strict=True)
    ]
    load = bus_load(rig, streams, rate, others)
    return [CheckItem("bus", load.ok, load.words)]


def _look(drives: RigDrives, axis: Axis, drive: Drive, profile: DriveProfile) -> list[tuple[bool, str]]:
    state = drives.state_before_writing(drive)
    if state in POWERED:
        sentence = (
            f"has power (it is in {state.words}): somebody else commands it, or a session left it so; nothing was written "
            f"to it. If nobody does, `coulomb reset {drives.rig.name}` takes its power"
        )
        return [(False, sentence)]
    if _moves(drives.rig, drive, axis):
        sentence = (
            "moves although it has no power: it was let go, or something pushes it; wait until it rests"
        )
        return [(False, sentence)]
    if drive.sdo.answered_twice():
        sentence = (
            f"two nodes answer under node id {drive.node}: two drives have the same id, or a device that is none of"
            " ours has it; nothing was written. Unplug one, give it another id, and look again by `coulomb scan`"
        )
        return [(False, sentence)]
    # A drive that an earlier session left streaming must not answer SDOs between its PDOs.
    drive.produce_heartbeat(drives.rig.supervision.heartbeat_period)
    drive.set_nmt_state("PRE-OPERATIONAL")
    identity = drive.identity()
    items = [
        (
            identity.profile == 402,
            f"vendor 0x{identity.vendor:X}, product 0x{identity.product:X}, "
            f"device profile {identity.profile}{'' if identity.profile == 402 else ', not a drive (402)'}",
        )
    ]
    state = drive.state()
    if state is State.FAULT:
        sentence = (
            f"in FAULT: {drive.error_in_words()}; when the cause is gone, `coulomb reset {drives.rig.name}` resets it, or "
            "the button on the rig's page; its zero stays as it is"
        )
        return [*items, (False, sentence)]
    items.append((True, f"state {state.words}"))
    items += [(True, sentence) for sentence in drive.oddities()]
    rig = drives.rig
    in_advance = drive.set_up_in_advance(
        MODES[axis.mode],
        rig.cycle,
        temperature=rig.record_temperature,
        watches_us=rig.bus.interface != "virtual",
    )
    items += [(True, sentence) for sentence in in_advance]
    items += _rated(axis, drive)
    items += [(True, sentence) for sentence in _braking(drives.rig, axis, drive)]
    if axis.homing == "drive":
        items.append(_homed(drives.rig, drive))
    return items


def _rated(axis: Axis, drive: Drive) -> list[tuple[bool, str]]:
    """Whether the drive's rated value, which its current reference is a fraction of, is that of the rig file."""
    unit = drive.profile.current_reference.unit
    if unit == "rated current":
        field, believed, physical = "rated_current", axis.rated_current, "A"
    elif unit == "rated torque":
        field, believed, physical = "rated_torque", axis.rated_torque, "N m"
    else:
        return []
    assert believed is not None  # the rig file was refused otherwise
    rated = drive.rated_value()
    if rated is None:
        taken = f"{field} of the rig file, {believed:g} {physical}, is taken unchecked"
        return [(True, f"does not tell what its current reference is a fraction of: {taken}")]
    ok = abs(rated / believed - 1) <= _RATED_TOLERANCE
    wrong = "" if ok else f"; the rig file says {believed:g}: one of them is wrong"
    return [(ok, f"rated {rated:g} {physical}{wrong}")]


def _braking(rig: Rig, axis: Axis, drive: Drive) -> list[str]:
    """What is to be said about the drive's quick stop beside what a stop must show (`daq.stopping_watch`)."""
    index = rig.axes.index(axis)
    stated, expected = axis.limits.quick_stop_deceleration, expected_deceleration(axis.limits)
    unit = "m" if rig.robot.joints[index].type == "prismatic" else "rad"
    counts = drive.quick_stop_deceleration()
    must = f"a stop must brake with {expected:.3g} {unit}/s², else power is cut"
    if counts is None:
        if stated is not None:
            return []
        return [
            f"limits.quick_stop_deceleration is not stated, and the drive does not tell it (0x6085): {must}; state what "
            "it does"
        ]
    braking = counts * float(np.abs(rig.position_matrix[:, index]).max())
    if braking >= expected:
        return []
    return [
        f"its quick stop (0x6085) is {counts}, {braking:.3g} {unit}/s² if that is in counts: weaker than expected, for "
        f"{must}; state what it does as limits.quick_stop_deceleration"
    ]


def _moves(rig: Rig, drive: Drive, axis: Axis) -> bool:
    begun, first = time.monotonic(), drive.position()
    time.sleep(_LOOK_TWICE)
    way, passed = abs(drive.position() - first), time.monotonic() - begun
    motor_speed = axis.limits.velocity * float(np.abs(rig.motor_gear).max())
    slow = _REST_SHARE * motor_speed * passed * axis.encoder_counts / (2 * np.pi)
    return bool(way > slow + _REST_COUNTS)


def _homed(rig: Rig, drive: Drive) -> tuple[bool, str]:
    bit = drive.profile.homed_bit
    if bit is not None:
        homed = bool(drive.statusword() >> bit & 1)
    else:
        drive.set_mode(Mode.HOMING)
        word = drive.statusword()
        homed = bool(word & HOMING_ATTAINED) and not word & HOMING_ERROR
    return homed, "homed" if homed else f"is not homed; `coulomb home {rig.name}` homes it"


def _within_limits(drives: RigDrives) -> list[CheckItem]:
    try:
        position = drives.positions()
    except DriverError as error:
        return [CheckItem("positions", False, str(error))]
    items: list[CheckItem] = []
    for axis, value in zip(drives.rig.axes, position, strict=True):
        lowest, highest = axis.limits.position
        slack = axis.limits.following_error
        ok = bool(lowest - slack <= value <= highest + slack)
        sentence = f"is at {value:.4g}" + ("" if ok else f", outside its limits {lowest:g} to {highest:g}")
        items.append(CheckItem(f"joint {axis.joint}", ok, sentence))
    return items
