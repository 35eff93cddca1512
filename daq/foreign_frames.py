"""Frames that only we may send, sent by somebody else: a second master on the bus.

Ours are SYNC, the drives' setpoints, NMT, our heartbeat, and SDO requests to our drives. SYNC and setpoints go out by the
receiver itself, which marks its own (`OWN`); the others go out by canopen's connection, which counts them, so that one
more than were sent is somebody else's.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from daq.safety import StopCause, StopReason
from drivers.frames import ERROR, EXTENDED, OWN, FrameBlock
from drivers.process_data import DriveStream
from drivers.sync_producer import SYNC_ID

NMT = 0x000
SDO_REQUEST = 0x600
HEARTBEAT = 0x700

_OUR_ID = "or a node on the bus has this id, as many have that were never given one: give it another; else "
_WAY_OUT = "find it and take it off the bus, then `coulomb scan` shows who is there"


def ids_of_ours(streams: Sequence[DriveStream], master: int) -> list[int]:
    """What a receiver must pass, beside SYNC and the drives' TPDOs, so that another master is seen."""
    setpoints = [stream.receive.can_id for stream in streams]
    requests = [SDO_REQUEST + stream.node for stream in streams]
    return [NMT, HEARTBEAT + master, *setpoints, *requests]


class ForeignFrames:
    """Looks at every block of frames for what is not ours.

    sent : how many frames with an id canopen's connection has sent so far
    """

    def __init__(self, streams: Sequence[DriveStream], master: int, sent: Callable[[int], int]) -> None:
        self._sent = sent
        self._setpoints = {stream.receive.can_id: stream.node for stream in streams}
        counted = {
            NMT: "an NMT command",
            HEARTBEAT + master: f"a heartbeat under our node id {master}",
            **{SDO_REQUEST + stream.node: f"an SDO request to node {stream.node}" for stream in streams},
        }
        self._counted = counted
        self._before = {can_id: sent(can_id) for can_id in counted}
        # The drives answered every request and command before this begins; the last heartbeat nobody answers, and a slow adapter
        # may still have it to send.
        self._before[HEARTBEAT + master] = max(0, sent(HEARTBEAT + master) - 1)
        self._seen = dict.fromkeys(counted, 0)
        self._watched = np.zeros(0x800, bool)
        self._watched[[SYNC_ID, *self._setpoints, *counted]] = True
        self._recorded = np.ones(0x800, bool)
        self._recorded[list(self._setpoints)] = False
        self.count = 0
        """foreign frames so far"""

    def take(self, frames: FrameBlock) -> tuple[FrameBlock, StopReason | None]:
        """The frames without foreign SYNCs and without the echo of our own setpoints, and who else is there."""
        identifier = frames["can_id"]
        plain = (frames["flags"] & (EXTENDED | ERROR)) == 0
        column = np.where(plain, identifier & 0x7FF, 0x7FF)
        echo = (frames["flags"] & OWN) != 0
        watched = plain & self._watched[column] & ~echo
        reason = self._look(identifier[watched], frames["data"][watched]) if watched.any() else None
        keep = ~(watched & (identifier == SYNC_ID)) & (self._recorded[column] | ~plain | ~echo)
        return frames[keep], reason

    def _look(self, identifiers: NDArray[np.uint32], data: NDArray[np.uint8]) -> StopReason | None:
        for can_id, content in zip(identifiers.tolist(), data, strict=True):
            frame = ""
            if can_id == SYNC_ID:
                frame = "a SYNC (0x080) that is not ours"
            elif can_id in self._setpoints:
                frame = f"setpoints (0x{can_id:03X}) for node {self._setpoints[can_id]} that are not ours"
            else:
                self._seen[can_id] += 1
                if self._seen[can_id] > self._sent(can_id) - self._before[can_id]:
                    frame = f"{self._counted[can_id]} (0x{can_id:03X}) that is not ours"
            if frame:
                self.count += 1
                data = content.tobytes().hex(" ").upper()
                described = frame if can_id == SYNC_ID else f"{frame} (data {data})"
                way_out = (_OUR_ID if can_id & ~0x7F == HEARTBEAT else "") + _WAY_OUT
                return StopReason(
                    StopCause.FOREIGN_MASTER,
                    f"another master commands this rig: on the bus came {described}; {way_out}",
                )
        return None
