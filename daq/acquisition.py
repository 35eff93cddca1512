"""The acquisition process: alone with the bus, the rings and the drives.

The process that holds the stop button (the command line or the web service) starts it, talks to it through one
connection and may die, hang or crash: then the motion ends safely and the data are on disk. The recorder is
another process that reads the rings (`daq/recorder.py`).
"""

import contextlib
import signal
import sys
import time
import traceback
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from daq.json_object import JsonObject
from daq.motion import EndStory, Motion
from daq.motion_sequence import MotionSequence
from daq.plan_setpoints import approach_counts
from daq.process_priority import ask_for_real_time
from daq.recorder import Ending
from daq.rig import Rig
from daq.rig_check import CheckItem, RigCheck, check_rig
from daq.rig_drives import RigDrives
from daq.ring_buffer import RingWriter
from daq.safety import StopCause, StopReason
from daq.samples import Phase, sample_dtype
from daq.sampling_loop import FRAMES_IN_RING, ROWS_IN_RING, SamplingLoop, open_positions, open_receiver
from daq.servo_gains import read_servo_gains
from daq.setpoint_stream import Trajectory
from daq.simulated_rig import simulated_rig
from daq.torque_mode import TorqueMode
from daq.torque_offset import SentAhead
from daq.torque_stream import TorqueSetpoints
from drivers.as_found import HeldSettings
from drivers.errors import DriverError
from drivers.frames import FD_FRAME, FRAME
from identify.recording.controller_file import ControllerFile
from identify.recording.errors import InputError
from identify.recording.experiment_file import Payload

_HANDSHAKE = 30.0
"""s for the recorder to say that its files are there"""
_WAIT_ENDING = 30.0
"""s for our last word to reach the recorder"""


@dataclass(frozen=True)
class AcquisitionOrder:
    """What the acquisition process is told when it starts.

    counts : (L, n) int32, the plan's targets in every cycle
    rows, frames : names of the rings to create
    seed : tells simulated sessions apart
    ahead : torque that is sent beside the targets; none where None
    """

    rig: Rig
    payload: Payload
    counts: NDArray[np.int32]
    rows: str
    frames: str
    seed: int = 0
    ahead: SentAhead | None = None


@dataclass(frozen=True)
class AcquisitionMessage:
    """A word from the acquisition process.

    what : `checked` (check), `armed`, `moving`, `progress` (cycle, cycles, first: the SYNC of the plan's first row, None while
        that is not known), `alarm` (what a person must do now), `ended` (reason, counters, alarm; remarks: what of the drives'
        settings could not be put back)
    """

    what: Literal["checked", "armed", "moving", "progress", "alarm", "ended"]
    words: str = ""
    check: RigCheck | None = None
    cycle: int = 0
    cycles: int = 0
    first: int | None = None
    reason: StopReason | None = None
    counters: JsonObject = field(default_factory=JsonObject)
    remarks: tuple[str, ...] = ()
    clock_source: str = ""
    controllers: ControllerFile | None = None
    """of the drives, as they said before the session"""
    held_before: Mapping[int, HeldSettings] = field(default_factory=dict[int, HeldSettings])
    """by node what the drives held before they were set up"""
    alarm: str = ""


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
        self._beaten = 0.0
        self._changed: tuple[str, ...] = ()
        self.alarm = ""
        """what a person must do now, because an axis may have power or move"""
        self._terminated = False
        self._stop_asked: str | None = None
        self._arm_asked = self.start_asked = False
        self._recording = False
        self._recorder_gone = False
        self.recording: Path | None = None
        """the file that the recorder writes, once it is known"""

    @property
    def plan_cycles(self) -> int:
        """Cycles of the plan."""
        return len(self.order.counts)

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
                except DriverError as error:
                    reason = StopReason(StopCause.BUS, str(error))
                except InputError as error:
                    reason = StopReason(StopCause.INTERNAL, str(error))
                except Exception as error:
                    traceback.print_exc()
                    detail = str(error) or "without words"
                    sentence = f"an error of the software ended the session ({type(error).__name__}: {detail}); please report it"
                    reason = StopReason(StopCause.INTERNAL, sentence)
                finally:
                    rows.finish()
                    frames.finish()
                    self._say_ending(Ending(reason, counters))
        finally:
            # Whatever closing met: how the motion ended is said.
            self.tell(
                AcquisitionMessage(
                    "ended",
                    reason.words,
                    reason=reason,
                    counters=counters,
                    remarks=self._changed,
                    alarm=self.alarm,
                )
            )

    def _session(
        self, rows: RingWriter, frames: RingWriter, closing: ExitStack
    ) -> tuple[StopReason, JsonObject]:
        remarks: list[str] = []
        computer: list[CheckItem] = []
        if self.rig.simulated is not None and self.rig.bus.interface == "virtual":
            closing.enter_context(simulated_rig(self.rig, self.order.payload, seed=self.order.seed))
        if self.rig.pacing == "real-time":
            granted = ask_for_real_time()
            remarks += [each.words for each in granted]
            computer = [CheckItem("this computer", True, each.words, advice=not each.ok) for each in granted]
        drives = RigDrives(self.rig)
        closing.callback(self._leave, drives)
        check = RigCheck((*computer, *check_rig(drives).items))
        if not check.ok:
            self.tell(AcquisitionMessage("checked", check.problems, check=check))
            return StopReason(StopCause.BUS, check.problems), {}
        ahead, controllers = self.order.ahead, None
        loop_here = None if ahead is None else ahead.loop
        if loop_here is None:
            gains = read_servo_gains(drives)
            remarks += gains.remarks
            controllers = gains.controllers
        else:
            check = RigCheck((*check.items, CheckItem("position loop", True, loop_here.words, advice=True)))
            remarks.append(loop_here.words)
        streams = drives.configure(None if ahead is None else ahead.entry)
        for axis, drive in zip(self.rig.axes, drives.drives, strict=True):
            remarks += [f"joint {axis.joint} (node {axis.node}): {said}" for said in drive.set_up_remarks]
        receiver = open_receiver(self.rig, streams)
        closing.callback(receiver.close)
        positions = None
        if loop_here is not None:
            positions = open_positions(self.rig, streams)
            closing.callback(positions.close)
        loop = SamplingLoop(self.rig, streams, receiver, rows, frames, drives.network.sent, ahead, positions)
        self.tell(
            AcquisitionMessage(
                "checked",
                check=check,
                remarks=tuple(remarks),
                clock_source=receiver.clock_source,
                controllers=controllers,
                held_before=drives.held_before(),
            )
        )
        asked = self._wait(drives, lambda: self._arm_asked)
        trouble = asked or self._await_recorder(drives)
        if trouble is not None:
            return trouble, {}
        drives.stream()
        self.tell(AcquisitionMessage("armed"))
        mode = None
        if isinstance(loop.setpoints, TorqueSetpoints):
            mode = TorqueMode(self.rig, drives, loop.setpoints)
        sequence = MotionSequence(self.rig, loop.setpoints, self._trajectory, mode)
        sequence_reason = self._move(loop, sequence, drives)
        counters = {**loop.counters(), "remarks": remarks}
        return sequence_reason, counters

    def _leave(self, drives: RigDrives) -> None:
        self._changed = tuple(drives.close())

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
        offset = None
        if self.order.ahead is not None:
            offset = np.concatenate([np.zeros(approach.shape, np.int16), self.order.ahead.counts])
        return Trajectory(np.concatenate([approach, plan]), phase, offset)

    def _wait(self, drives: RigDrives, until: Callable[[], bool]) -> StopReason | None:
        """Wait, without motion, until a command has come; a reason to end instead, or None."""
        while not until():
            reason = self.watch(drives) or drives.trouble()
            if reason is not None:
                return reason
            self._listen(0.05)
        return None

    def _move(self, loop: SamplingLoop, sequence: MotionSequence, drives: RigDrives) -> StopReason:
        """The loop from armed to rest and no power, read back."""
        if self.rig.pacing == "as-fast-as-answered":
            # In simulated time nothing passes until the operator starts.
            asked = self._wait(drives, lambda: self.start_asked)
            if asked is not None:
                loop.end()
                return asked
        else:
            loop.start()
        story = EndStory()
        motion = Motion(self, loop, sequence, drives, story)
        try:
            motion.run()
        except DriverError as error:
            # The bus itself failed: nothing more can be seen there, and power is taken as far as anything still goes.
            story.first(StopReason(StopCause.BUS, str(error)))
        except Exception:
            motion.cut_in_vain()
            raise
        finally:
            with contextlib.suppress(DriverError):
                loop.end()
        return motion.read_back()

    def watch(self, drives: RigDrives) -> StopReason | None:
        """Everything that ends a motion and does not come with a sample, nor from a drive."""
        self._listen(0.0)
        now = time.monotonic()
        if now - self._beaten >= self.rig.supervision.heartbeat_period:
            # While the axes are being stopped too: a drive that misses us stops in its own way, amid ours.
            self._beaten = now
            drives.heartbeat()
        if self._terminated:
            return StopReason(
                StopCause.DEAD_PARENT, "the acquisition process was asked to terminate (SIGTERM)"
            )
        if self._stop_asked is not None:
            return StopReason(StopCause.OPERATOR, self._stop_asked)
        if now - self._heard > self.rig.supervision.parent_timeout:
            silent = now - self._heard
            sentence = (
                "the supervising process, which holds the stop button, is gone"
                if np.isinf(silent)
                else f"the supervising process, which holds the stop button, did not respond for {silent:.1f} s"
            )
            return StopReason(StopCause.DEAD_PARENT, sentence)
        return self._recorder_trouble()

    def _recorder_trouble(self) -> StopReason | None:
        """Take what the recorder said: `ready` once, whoever waits for it by then; all else is trouble."""
        try:
            if not self._recorder_gone and self._recorder.poll():
                word = self._recorder.recv()
                if isinstance(word, StopReason):
                    return word
                self._recording = True
        except (EOFError, OSError):
            self._recorder_gone = True
        if not self._recorder_gone:
            return None
        kept = "; what it had written is kept" if self._recording else " before the session was armed"
        return StopReason(
            StopCause.RECORDER,
            f"the recorder process died{kept}; look at memory and disk of this computer, then start a new session",
        )

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
                    self.recording = Path(argument) if argument else None
                elif word == "start":
                    self.start_asked = True
                timeout = 0.0
        except (EOFError, OSError):
            # Not an exception here: a motion may be under way and must come to rest first.
            self._heard = -np.inf
            time.sleep(timeout)

    def tell(self, message: AcquisitionMessage) -> None:
        """Send a message to the parent; one that is gone counts as silent from now on."""
        try:
            self._parent.send(message)
        except OSError:
            self._heard = -np.inf

    def tell_moving(self) -> None:
        """The axes get power now."""
        self.tell(AcquisitionMessage("moving"))

    def tell_progress(self, cycle: int, cycles: int, first: int | None) -> None:
        """How far the plan has been driven, and at which SYNC it begins."""
        self.tell(AcquisitionMessage("progress", cycle=cycle, cycles=cycles, first=first))

    def tell_alarm(self, alarm: str) -> None:
        """What a person must do now; empty words take it back."""
        self.tell(AcquisitionMessage("alarm", alarm))

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
