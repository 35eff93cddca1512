"""The drive's watch over its setpoints: event timer of the RPDO (CiA 301, 0x1400:05), and what it does then (0x6007).

In cyclic synchronous torque mode a setpoint that does not come leaves the last torque standing. So a drive in that mode must
notice by itself, and stop: its event timer is written and read back, and so is its reaction. A drive that takes neither is not
driven so.
"""

import math
from dataclasses import dataclass

from drivers.cia402 import ABORT_CONNECTION_OPTION
from drivers.errors import DriveError
from drivers.process_data import ProcessData, is_missing, pdo_objects, read_pdo, was_refused
from drivers.sdo import SdoAccess
from drivers.standard_stream import TPDO_BASE

EVENT_TIMER = 5
"""subindex of an RPDO's communication parameters: ms without it, after which the drive reacts; 0 for never"""
QUICK_STOP = 3
_REACTIONS = {1: "a fault", 2: "no voltage", QUICK_STOP: "a quick stop"}
"""0x6007; 0 is no reaction"""


@dataclass(frozen=True)
class SetpointWatch:
    """A drive's watch over its setpoints, as it was told to.

    words    : what the drive does by itself
    timer    : index of the parameters of the RPDO that is watched
    before   : its event timer (ms) and reaction (0x6007) as they were before
    """

    words: str
    timer: int
    before: tuple[int, int]


def watch_setpoints(sdo: SdoAccess, receive: ProcessData, timeout: float) -> SetpointWatch:
    """Let a drive stop by itself when its RPDO stays away for `timeout` (s).

    Raises DriveError: the drive does not take the timer, or would do nothing.
    """
    what = "watching its torque setpoints by itself"
    milliseconds = max(1, math.ceil(1e3 * timeout - 1e-9))
    communication = _communication(sdo, receive)
    try:
        before = (
            sdo.read(communication, EVENT_TIMER, "uint16", what),
            sdo.read(ABORT_CONNECTION_OPTION, 0, "int16", what),
        )
        sdo.write_verified(communication, EVENT_TIMER, "uint16", milliseconds, what)
        reaction = _reaction(sdo, what)
    except DriveError as refusal:
        if was_refused(refusal):
            raise refusal.with_cause(
                "torque mode is for drives that stop by themselves when no setpoint comes; this one cannot be told to"
            ) from refusal
        raise
    if reaction not in _REACTIONS:
        raise DriveError(
            sdo.node,
            what,
            index=ABORT_CONNECTION_OPTION,
            expected="1 (fault), 2 (no voltage) or 3 (quick stop)",
            received=f"{reaction} came: it would go on with the last torque",
        )
    timer = f"0x{communication:04X}:05"
    return SetpointWatch(
        f"stops by itself after {milliseconds} ms without a torque setpoint ({timer}), with {_REACTIONS[reaction]}",
        communication,
        before,
    )


def end_watch(sdo: SdoAccess, watch: SetpointWatch) -> None:
    """Leave the drive as it was before `watch_setpoints`. Raises DriveError when it does not answer, or keeps what it holds."""
    what = "ending its watch over the torque setpoints"
    timer, reaction = watch.before
    sdo.write_verified(watch.timer, EVENT_TIMER, "uint16", timer, what)
    if sdo.read(ABORT_CONNECTION_OPTION, 0, "int16", what) != reaction:
        sdo.write_verified(ABORT_CONNECTION_OPTION, 0, "int16", reaction, what)


def _reaction(sdo: SdoAccess, what: str) -> int:
    """What 0x6007 holds, a quick stop where it can be written."""
    try:
        sdo.write_verified(ABORT_CONNECTION_OPTION, 0, "int16", QUICK_STOP, what)
    except DriveError as refusal:
        if not was_refused(refusal) or is_missing(refusal):
            raise
    return sdo.read(ABORT_CONNECTION_OPTION, 0, "int16", what)


def _communication(sdo: SdoAccess, receive: ProcessData) -> int:
    """Index of the communication parameters of the RPDO that carries the setpoints."""
    for number in range(1, len(TPDO_BASE) + 1):
        pdo = read_pdo(sdo, "RPDO", number)
        if pdo is not None and pdo.valid and pdo.can_id == receive.can_id:
            return pdo.communication
    return pdo_objects("RPDO", 1)[0]
