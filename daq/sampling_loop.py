"""From the bus into the rings: frames in blocks, aligned on SYNC, checked against the limits.

One object for both pacings. In real time SYNC comes from a thread with absolute deadlines and this loop sleeps,
then drains; in simulated time SYNC goes out as soon as the nodes have answered, a fixed number of cycles per
turn, so that the same session gives the same numbers every time.
"""

import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.alignment import SyncAlignment
from daq.foreign_frames import ForeignFrames, ids_of_ours
from daq.json_object import JsonObject
from daq.position_input import PositionInput
from daq.rig import Rig
from daq.rig_drives import MASTER_NODE
from daq.ring_buffer import RingWriter
from daq.safety import LimitMonitor, StopCause, StopReason
from daq.samples import RowDecoder
from daq.setpoint_stream import SetpointStream
from daq.torque_offset import SentAhead
from daq.torque_stream import Positions, TorqueSetpoints
from drivers.bus import pass_ids
from drivers.frames import BUS_OFF, ERROR, FrameReceiver
from drivers.process_data import DriveStream
from drivers.receive_python_can import PythonCanReceiver
from drivers.receive_socketcan import SocketCanReceiver
from drivers.sync_producer import SYNC_ID, AsAnswered, RealTime, SimulatedClock, SyncProducer
from drivers.virtual_bus import InProcessBus

ROWS_IN_RING = 1 << 16
FRAMES_IN_RING = 1 << 18
_NAP = 0.005
"""s of sleep between two drains in real time. What a turn costs hardly depends on how many frames it takes, so the
share of a core goes with the inverse of this: 28 % at 1 ms, 12 % at 5 ms on a full bus. A limit is seen 5 ms and
two cycles after it was broken; the kernel's buffer holds 1.2 s."""

_HELD_UP = 0.1
"""s without a look at the samples, or without SYNC, that a motion may last"""

_ANSWER_TIMEOUT = 2.0
"""s to wait for the answers of simulated drives in another process: a busy machine may not let it run for so long"""
_AFTER_SILENCE = 0.05
"""s to wait for them once they have failed to come: drives that have gone must not hold up every cycle"""

_DELIVERY_TIMEOUT = 10.0
"""s to wait until drives in this process have heard a SYNC, while other threads or processes have the cores"""

_SHARE_FOR_POSITIONS = 0.6
"""of a cycle: after that, what is made of its positions would not reach the drives before the next SYNC"""

_CYCLES_PER_TURN = 16
"""SYNCs between two looks at the samples in simulated time"""
_CYCLES_PER_CLOSE_TURN = 3
"""likewise while axes get power, or stop"""


def open_receiver(rig: Rig, streams: Sequence[DriveStream]) -> FrameReceiver:
    """The quickest receiver that the rig's bus allows, for SYNC, the drives' TPDOs, and what only we may send.

    Raises BusError when the bus cannot be opened.
    """
    identifiers = [SYNC_ID, *(identifier for stream in streams for identifier in stream.transmit_ids)]
    identifiers += ids_of_ours(streams, MASTER_NODE)
    receiver: FrameReceiver
    if rig.bus.interface == "socketcan":
        receiver = SocketCanReceiver(rig.bus.channel, pass_ids(identifiers), fd=rig.bus.fd)
    else:
        receiver = PythonCanReceiver(rig.bus, pass_ids(identifiers))
    receiver.open()
    return receiver


class SamplingLoop:
    """Turns of the loop: let time pass, drain the bus, align, decode, write the rings, check the limits.

    rows, frames : the rings
    sent : how many frames with an id went out beside the receiver (`CanopenNetwork.sent`)
    positions : of each cycle, where `ahead` has a position loop that is closed here
    ahead : torque that is sent beside the setpoints, with which the axes must follow no worse; none where None
    """

    def __init__(
        self,
        rig: Rig,
        streams: Sequence[DriveStream],
        receiver: Any,
        rows: RingWriter,
        frames: RingWriter,
        sent: Callable[[int], int],
        ahead: SentAhead | None = None,
        positions: Positions | None = None,
    ) -> None:
        self.rig = rig
        self._receiver = receiver
        self._row_ring = rows
        self._frame_ring = frames
        scales = [
            None if not rig.record_temperature or profile.temperature is None else profile.temperature.scale
            for profile in rig.profiles
        ]
        self._decoder = RowDecoder(streams, scales)
        self.alignment = SyncAlignment(self._decoder.columns, rig.cycle)
        self.setpoints = _setpoints(rig, streams, receiver.send, ahead, positions)
        self.monitor = LimitMonitor(rig, ahead)
        self._foreign = ForeignFrames(streams, MASTER_NODE, sent)
        self._foreign_reason: StopReason | None = None
        self._expected = np.zeros(0x800, bool)
        self._expected[list(self._decoder.columns)] = True
        self._producer = SyncProducer(
            receiver.send, rig.cycle, self._pacing(), on_cycle=self.setpoints.on_cycle
        )
        self._simulated = rig.pacing == "as-fast-as-answered"
        self._silence = rig.supervision.silence
        self._received: list[NDArray[Any]] = []
        self._answers = 0
        self._answering = True
        self._bus_off = False
        self._jitter = _Jitter(rig.cycle)
        self._last_row = self._last_turn = time.monotonic()
        self._missed = 0

    def _pacing(self) -> RealTime | AsAnswered:
        if self.rig.pacing == "real-time":
            return RealTime()
        bus = getattr(self._receiver, "bus", None)
        if isinstance(bus, InProcessBus):
            clock = SimulatedClock()
            bus.use_clock(clock)
            return AsAnswered(
                answered=lambda cycle, timeout: bus.delivered(timeout),
                timeout=_DELIVERY_TIMEOUT,
                advance=clock.advance,
            )
        return AsAnswered(answered=self._answered, timeout=_ANSWER_TIMEOUT)

    def _answered(self, cycle: int, timeout: float) -> bool:
        """Wait until as many answers have come as drives in another process owe for one SYNC; False when not.

        They are counted from one SYNC to the next, whoever read them: an answer that comes just as the turn
        drains the bus is not waited for again.
        """
        expected = len(self.alignment.columns)
        end = time.monotonic() + (timeout if self._answering else min(timeout, _AFTER_SILENCE))
        self._read()
        while self._answers < expected and (left := end - time.monotonic()) > 0:
            self._receiver.wait(left)
            self._read()
        self._answering = answered = self._answers >= expected
        self._answers = 0
        return answered

    def _read(self) -> None:
        """Take what has come; it waits for the turn's end."""
        frames = self._receiver.read()
        self._received.append(frames)
        self._answers += int(np.count_nonzero(self._expected[frames["can_id"] & 0x7FF]))

    def start(self) -> None:
        """Let SYNC begin."""
        if not self._simulated:
            self._producer.start()
        self._last_row = self._last_turn = time.monotonic()

    def turn(self, closely: bool = False) -> tuple[NDArray[Any], StopReason | None]:
        """One turn: the rows that became final, and what is wrong with them.

        closely : look after a few SYNCs already where time is simulated, as in real time: a stop must not be seen late

        Raises BusError when the bus fails.
        """
        if self._simulated:
            self._wait_for_recorder()
            self._producer.run(_CYCLES_PER_CLOSE_TURN if closely else _CYCLES_PER_TURN)
        else:
            time.sleep(_NAP)
            if not self._producer.running:
                self._producer.stop()  # raises what SYNC's thread raised
        rows = self._decode(self.alignment.feed(self._receive()))
        reason = self.monitor.check(rows)
        trouble = self._foreign_reason or self._held_up() or self.setpoints.trouble
        return rows, trouble or reason or self._bus_trouble(rows)

    def _held_up(self) -> StopReason | None:
        """Whether this computer let a deadline pass that matters: no SYNC, or nobody looked at the samples."""
        now, missed = time.monotonic(), self._producer.statistics.missed
        blind, late = now - self._last_turn, (missed - self._missed) * self.rig.cycle
        self._last_turn, self._missed = now, missed
        if self._simulated or max(blind, late) <= max(self._silence, 5 * self.rig.cycle, _HELD_UP):
            return None
        sentence = (
            f"this computer was held up for {max(blind, late):.2g} s: {missed} SYNCs did not go out and nobody watched the "
            "samples meanwhile; close what else runs here, and allow real-time priority (docs/install.md)"
        )
        return StopReason(StopCause.HELD_UP, sentence)

    def _receive(self) -> NDArray[Any]:
        """All frames since the last turn; they go into the ring of frames."""
        self._read()
        frames, foreign = self._foreign.take(np.concatenate(self._received))
        self._foreign_reason = self._foreign_reason or foreign
        self._received.clear()
        if len(frames):
            self._frame_ring.write(frames)
            errors = (frames["flags"] & ERROR) != 0
            if errors.any():
                self._bus_off |= bool((frames["can_id"][errors] & BUS_OFF).any())
        return frames

    def _decode(self, aligned: Any) -> NDArray[Any]:
        rows = self._decoder.rows(aligned, *self.setpoints.told(aligned.cycle))
        if len(rows):
            self._row_ring.write(rows)
            self._jitter.take(rows["sync_time"])
        return rows

    def _bus_trouble(self, rows: NDArray[Any]) -> StopReason | None:
        if self._bus_off:
            sentence = (
                "the CAN controller went bus off: it could not send without errors; look at wiring, termination and bit "
                "rate, then `ip link set … down` and `up`"
            )
            return StopReason(StopCause.BUS, sentence)
        if self._receiver.dropped:
            sentence = (
                f"{self._receiver.dropped} frames were lost because this machine was too slow to receive"
            )
            return StopReason(StopCause.LOST_FRAMES, sentence)
        now = time.monotonic()
        if len(rows):
            self._last_row = now
        elif not self._simulated and now - self._last_row > max(self._silence, 5 * self.rig.cycle):
            sentence = (
                f"SYNC goes out, but none came back from the bus for {now - self._last_row:.2g} s: is the adapter connected, "
                "and is a node on the bus that acknowledges?"
            )
            return StopReason(StopCause.LOST_SYNC, sentence)
        return None

    def _wait_for_recorder(self) -> None:
        """In simulated time nothing is gained by overtaking the recorder."""
        patience = time.monotonic() + 5.0
        rings = (self._row_ring, self._frame_ring)
        while any(ring.room < ring.capacity // 2 for ring in rings) and time.monotonic() < patience:
            time.sleep(_NAP)

    def end(self) -> None:
        """No more SYNC; the rows that waited for one go out. Raises BusError when SYNC's thread met one."""
        try:
            self._producer.stop()
        finally:
            final = self.alignment.feed(self._receive())
            for aligned in (final, self.alignment.flush()):
                self._decode(aligned)
            self._row_ring.finish()
            self._frame_ring.finish()

    def counters(self) -> JsonObject:
        """What was counted so far, for the recording."""
        statistics = self._producer.statistics
        return {
            "alignment": self.alignment.counters.to_json(),
            "frames_dropped": self._receiver.dropped,
            "foreign_frames": self._foreign.count,
            **({"late_torques": self.setpoints.late} if isinstance(self.setpoints, TorqueSetpoints) else {}),
            "sync": {
                "sent": statistics.sent,
                "missed_deadlines": statistics.missed,
                "slow_callbacks": statistics.slow_callbacks,
                "worst_lateness": statistics.worst_lateness,
                "mean_lateness": statistics.mean_lateness,
                "lateness_histogram": statistics.lateness_histogram,
                **self._jitter.to_json(),
            },
        }


def open_positions(rig: Rig, streams: Sequence[DriveStream]) -> PositionInput:
    """The positions of each cycle, received beside everything else, for a loop that is closed here. Raises BusError."""
    receiver = open_receiver(rig, streams)
    patience = _SHARE_FOR_POSITIONS * rig.cycle if rig.pacing == "real-time" else _ANSWER_TIMEOUT
    return PositionInput(receiver, streams, patience)


def _setpoints(
    rig: Rig,
    streams: Sequence[DriveStream],
    send: Callable[[int, bytes], None],
    ahead: SentAhead | None,
    positions: Positions | None,
) -> SetpointStream:
    if ahead is None or ahead.loop is None or positions is None:
        return SetpointStream(streams, send)
    late = max(1, round(rig.supervision.torque_timeout / rig.cycle))
    return TorqueSetpoints(streams, send, ahead.loop, positions, rig.cycle, late)


class _Jitter:
    """Running statistics of the time from SYNC to SYNC, s."""

    def __init__(self, period: float) -> None:
        self._period = period
        self._count = 0
        self._sum = self._squares = self._worst = 0.0
        self._last: int | None = None

    def take(self, sync_time: NDArray[np.int64]) -> None:
        """Take the stamps (M,) ns of the next SYNCs."""
        stamps = sync_time if self._last is None else np.concatenate([[self._last], sync_time])
        self._last = int(sync_time[-1])
        deviation = np.diff(stamps) * 1e-9 - self._period
        self._count += len(deviation)
        self._sum += float(deviation.sum())
        self._squares += float(deviation @ deviation)
        self._worst = max(self._worst, float(np.abs(deviation).max(initial=0.0)))

    def to_json(self) -> dict[str, float]:
        """Mean period, standard deviation and largest deviation from the nominal period, s."""
        if not self._count:
            return {}
        mean = self._sum / self._count
        return {
            "period_mean": self._period + mean,
            "period_std": max(0.0, self._squares / self._count - mean * mean) ** 0.5,
            "period_worst_deviation": self._worst,
        }
