"""The acquisition process: alone with the bus, the rings and the drives.

The process that holds the stop button (the command line or the web service) starts it, talks to it through one
connection and may die, hang or crash: then the motion ends safely and the data are on disk. The recorder is
another process that reads the rings (`daq/recorder.py`).
"""

import signal
import sys
import time
import traceback
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from daq.motion_sequence import MotionSequence, Step
from daq.plan_setpoints import approach_counts
from daq.process_priority import ask_for_real_time
from daq.recorder import Ending
from daq.rig import KnownPayload, Rig
from daq.rig_drives import RigCheck, RigDrives
from daq.ring_buffer import RingWriter
from daq.safety import StopCause, StopReason
from daq.samples import Phase, sample_dtype
from daq.sampling_loop import FRAMES_IN_RING, ROWS_IN_RING, SamplingLoop, open_receiver
from daq.setpoint_stream import Trajectory
from daq.simulated_rig import simulated_rig
from drivers.errors import DriverError
from drivers.frames import FD_FRAME, FRAME
from identify.recording.errors import InputError

_TELL_EVERY = 0.2
"""s between two words about progress"""
_HANDSHAKE = 30.0
"""s for the recorder to say that its files are there"""
_EMERGENCY_WAIT = 1.0
"""s for the EMCY that says why a drive has failed; the axes are at rest by then"""
_WAIT_ENDING = 30.0
"""s for our last word to reach the recorder"""


@dataclass(frozen=True)
class AcquisitionOrder:
    """What the acquisition process is told when it starts.

    counts : (L, n) int32, the plan's targets in every cycle
    rows, frames : names of the rings to create
    seed : tells simulated sessions apart
    """

    rig: Rig
    payload: KnownPayload
    counts: NDArray[np.int32]
    rows: str
    frames: str
    seed: int = 0


@dataclass(frozen=True)
class AcquisitionMessage:
    """A word from the acquisition process.

    what : `checked` (check), `armed`, `moving`, `progress` (cycle, cycles), `ended` (reason, counters)
    """

    what: Literal["checked", "armed", "moving", "progress", "ended"]
    words: str = ""
    check: RigCheck | None = None
    cycle: int = 0
    cycles: int = 0
    reason: StopReason | None = None
    counters: dict[str, Any] = field(default_factory=dict[str, Any])
    remarks: tuple[str, ...] = ()
    clock_source: str = ""


class ParentGone(Exception):
    """The process that holds the stop button is gone, or gives no sign of life."""


class Acquisition:
    """One session on the bus.

    parent : commands come as (word, argument): `beat`, `arm`, `start`, `stop` with a reason; `AcquisitionMessage` goes back
    recorder : takes the `Ending`, tells `ready` or words of trouble
    """

    def __init__(self, order: AcquisitionOrder, parent: Connection, recorder: Connection) -> None:
        self.order = order
        self.rig = order.rig
        self._parent = parent
        self._recorder = recorder
        self._heard = time.monotonic()
        self._told = 0.0
        self._beaten = 0.0
        self._terminated = False
        self._stop_asked: str | None = None
        self._arm_asked = self._start_asked = False
        self._recording = False

    def run(self) -> None:
        """Check, arm, move, end. Returns when everything is closed and said."""
        reason, counters = StopReason(StopCause.INTERNAL, "the acquisition process ended early"), {}
        try:
            with ExitStack() as closing:
                rows = closing.enter_context(
                    RingWriter(sample_dtype(len(self.rig.axes)), ROWS_IN_RING, self.order.rows)
                )
                closing.callback(rows.unlink)
                frame = FD_FRAME if self.rig.bus.fd else FRAME
                frames = closing.enter_context(RingWriter(frame, FRAMES_IN_RING, self.order.frames))
                closing.callback(frames.unlink)
                try:
                    reason, counters = self._session(rows, frames, closing)
                except ParentGone as gone:
                    reason = StopReason(StopCause.DEAD_PARENT, str(gone))
                except DriverError as error:
                    reason = StopReason(StopCause.BUS, str(error))
                except InputError as error:
                    reason = StopReason(StopCause.INTERNAL, str(error))
                except Exception as error:
                    traceback.print_exc()
                    reason = StopReason(StopCause.INTERNAL, f"{type(error).__name__}: {error}")
                finally:
                    rows.finish()
                    frames.finish()
                    self._say_ending(Ending(reason, counters))
        finally:
            # Whatever closing met: how the motion ended is said.
            self._tell(AcquisitionMessage("ended", reason.words, reason=reason, counters=counters))

    def _session(
        self, rows: RingWriter, frames: RingWriter, closing: ExitStack
    ) -> tuple[StopReason, dict[str, Any]]:
        remarks: list[str] = []
        if self.rig.simulated is not None and self.rig.bus.interface == "virtual":
            closing.enter_context(simulated_rig(self.rig, self.order.payload, seed=self.order.seed))
        if self.rig.pacing == "real-time":
            remarks += ask_for_real_time()
        drives = RigDrives(self.rig)
        closing.callback(drives.close)
        check = drives.check()
        if not check.ok:
            self._tell(AcquisitionMessage("checked", check.problems, check=check))
            return StopReason(StopCause.BUS, check.problems), {}
        streams = drives.configure()
        receiver = open_receiver(self.rig, streams)
        closing.callback(receiver.close)
        loop = SamplingLoop(self.rig, streams, receiver, rows, frames)
        self._tell(
            AcquisitionMessage(
                "checked", check=check, remarks=tuple(remarks), clock_source=receiver.clock_source
            )
        )
        asked = self._wait(drives, lambda: self._arm_asked)
        trouble = asked or self._await_recorder(drives)
        if trouble is not None:
            return trouble, {}
        drives.stream()
        self._tell(AcquisitionMessage("armed"))
        sequence = MotionSequence(self.rig, loop.setpoints, self._trajectory)
        sequence_reason = self._move(loop, sequence, drives)
        counters = {**loop.counters(), "remarks": remarks}
        return sequence_reason, counters

    def _await_recorder(self, drives: RigDrives) -> StopReason | None:
        """Wait until the recorder's files are there; a reason to end instead, or None."""
        latest = time.monotonic() + _HANDSHAKE
        reason = self._wait(drives, lambda: self._recording or time.monotonic() > latest)
        if reason is None and not self._recording:
            return StopReason(StopCause.RECORDER, f"the recorder was not ready within {_HANDSHAKE:g} s")
        return reason

    def _trajectory(self, held: NDArray[Any]) -> Trajectory:
        """From the targets (n,) at which the joints are held to the plan's begin, and through the plan."""
        plan = self.order.counts
        position = self.rig.position_matrix @ held + self.rig.position_offset
        begin = self.rig.position_matrix @ plan[0] + self.rig.position_offset
        approach = approach_counts(self.rig, position, begin)
        phase = np.full(len(approach) + len(plan), Phase.PLAN, np.uint8)
        phase[: len(approach)] = Phase.APPROACH
        return Trajectory(np.concatenate([approach, plan]), phase)

    def _wait(self, drives: RigDrives, until: Callable[[], bool]) -> StopReason | None:
        """Wait, without motion, until a command has come; a reason to end instead, or None."""
        while not until():
            reason = self._watch(drives)
            if reason is not None:
                return reason
            self._listen(0.05)
        return None

    def _move(self, loop: SamplingLoop, sequence: MotionSequence, drives: RigDrives) -> StopReason:
        """The loop from armed to rest."""
        simulated = self.rig.pacing == "as-fast-as-answered"
        plan = len(self.order.counts)
        if not simulated:
            loop.start()
        else:
            # In simulated time nothing passes until the operator starts.
            asked = self._wait(drives, lambda: self._start_asked)
            if asked is not None:
                loop.end()
                return asked
        last_row = time.monotonic()
        done = 0
        try:
            while sequence.step is not Step.ENDED:
                rows, reason = loop.turn()
                reason = self._watch(drives) or reason
                if self._start_asked and sequence.step is Step.STANDBY and sequence.reason is None:
                    self._tell(AcquisitionMessage("moving"))
                    sequence.begin()
                if reason is not None:
                    if reason.cause is StopCause.EMERGENCY:
                        sequence.explain(reason)
                    sequence.stop(reason)
                sequence.take(rows)
                now = time.monotonic()
                if len(rows) or sequence.reason is None:
                    last_row = now
                elif now - last_row > self.rig.supervision.stop_timeout:
                    sequence.give_up()
                if now - self._told >= _TELL_EVERY:
                    self._told = now
                    if loop.setpoints.length:
                        done = max(0, loop.setpoints.done - (loop.setpoints.length - plan))
                    self._tell(AcquisitionMessage("progress", cycle=done, cycles=plan))
        finally:
            loop.end()
        assert sequence.reason is not None
        if sequence.reason.cause is StopCause.DRIVE_FAULT:
            emergency = drives.emergency(_EMERGENCY_WAIT)
            if emergency is not None:
                sequence.explain(emergency)
        if not sequence.came_to_rest:
            words = (
                f"{sequence.reason.words}; and the axes did not come to rest within "
                f"{self.rig.supervision.stop_timeout:g} s: power was switched off"
            )
            return StopReason(sequence.reason.cause, words)
        return sequence.reason

    def _watch(self, drives: RigDrives) -> StopReason | None:
        """Everything that ends a motion and does not come with a sample."""
        self._listen(0.0)
        now = time.monotonic()
        if self._terminated:
            return StopReason(StopCause.DEAD_PARENT, "the acquisition process was told to terminate")
        if self._stop_asked is not None:
            return StopReason(StopCause.OPERATOR, self._stop_asked)
        if now - self._heard > self.rig.supervision.parent_timeout:
            silent = now - self._heard
            words = f"the supervising process gave no sign of life for {silent:.1f} s"
            return StopReason(StopCause.DEAD_PARENT, words)
        if now - self._beaten >= self.rig.supervision.heartbeat_period:
            self._beaten = now
            drives.heartbeat()
        return drives.trouble() or self._recorder_trouble()

    def _recorder_trouble(self) -> StopReason | None:
        """Take what the recorder said: `ready` once, whoever waits for it by then; all else is trouble."""
        try:
            if self._arm_asked and self._recorder.poll():
                word = self._recorder.recv()
                if word != "ready":
                    return StopReason(StopCause.FULL_DISK, word)
                self._recording = True
        except (EOFError, OSError):
            flushed = "; what it had flushed is on disk" if self._recording else " before it was ready"
            return StopReason(StopCause.RECORDER, f"the recorder died{flushed}")
        return None

    def _listen(self, timeout: float) -> None:
        """Take what the parent said."""
        try:
            while self._parent.poll(timeout):
                word, argument = self._parent.recv()
                self._heard = time.monotonic()
                if word == "stop":
                    self._stop_asked = argument
                elif word == "arm":
                    self._arm_asked = True
                elif word == "start":
                    self._start_asked = True
                timeout = 0.0
        except (EOFError, OSError):
            # Not an exception here: a motion may be under way and must come to rest first.
            self._heard = -np.inf
            time.sleep(timeout)

    def _tell(self, told: AcquisitionMessage) -> None:
        try:
            self._parent.send(told)
        except OSError:
            self._heard = -np.inf

    def _say_ending(self, ending: Ending) -> None:
        try:
            self._recorder.send(ending)
        except OSError:
            return  # it died, or was never started; its file is for `coulomb recover`

    def terminate(self, *_: object) -> None:
        """Handler of SIGTERM: end the motion as if the parent had died."""
        self._terminated = True


def main() -> None:
    """The process: connections to parent and recorder are the file descriptors in the arguments."""
    # Ctrl-C and the end of the terminal are for the process that holds the stop button, which tells us.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    parent, recorder = Connection(int(sys.argv[1])), Connection(int(sys.argv[2]))
    try:
        order = parent.recv()
    except EOFError:
        return
    acquisition = Acquisition(order, parent, recorder)
    signal.signal(signal.SIGTERM, acquisition.terminate)
    acquisition.run()
