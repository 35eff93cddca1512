"""The recorder: a process of its own that reads the rings and writes samples and raw frames to disk.

It outlives the web service and the acquisition process: whichever of them dies, what they had put into the rings
comes to disk and the recording says how it ended. If the recorder itself dies, the acquisition process ends the
motion, and what was flushed is there (`coulomb recover`).
"""

import errno
import signal
import sys
import time
from collections import deque
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from daq.json_object import JsonObject
from daq.raw_log import RawLog, raw_log_of
from daq.recording_file import RecordingFile, SessionDescription
from daq.recording_verdict import RecordingVerdict
from daq.ring_buffer import RingOverrun, RingReader
from daq.safety import StopCause, StopReason
from daq.samples import SessionRows

_PERIOD = 0.02
"""s between two looks at the rings; they hold a hundred times as much"""


@dataclass(frozen=True)
class RecorderOrder:
    """What a recorder is told when it starts.

    path : the recording (.h5), to be created; the raw log stands beside it
    rows, frames : names of the rings
    """

    path: Path
    description: SessionDescription
    rows: str
    frames: str
    claimed: bool = False
    """whether the empty raw log was made for us (`claim_recording`)"""
    provisional: bool = False
    """whether nobody wants the recording once its folder was removed; else it is written anew there"""


@dataclass(frozen=True)
class Ending:
    """What the acquisition process says last: how the motion ended, and what was counted."""

    reason: StopReason
    counters: JsonObject = field(default_factory=JsonObject)


class Recorder:
    """Moves rows and frames from the rings to disk until the writer says that none will follow, or has died.

    `tell(reason)` is called once when the disk is nearly full or refuses, or when somebody took the file away; recording
    goes on as far as it can.
    """

    def __init__(self, order: RecorderOrder, tell: Callable[[StopReason], None]) -> None:
        self._tell = tell
        self._storage = order.description.rig.storage
        self._provisional = order.provisional
        self._rows = RingReader(order.rows)
        self._frames = RingReader(order.frames)
        self._log = RawLog(raw_log_of(order.path), order.description.rig.bus.channel, claimed=order.claimed)
        try:
            self.file = RecordingFile(order.path, order.description)
        except OSError:
            self._log.close()
            raise
        self.lost_rows = 0
        self.lost_frames = 0
        self._waiting: deque[NDArray[Any]] = deque()
        self._of_the_session = SessionRows()
        self._refused = False
        self._verdict = RecordingVerdict(order.description.rig)
        self._flushed = self._synced = time.monotonic()

    def take(self) -> bool:
        """Move what is in the rings; whether there was anything."""
        moved = False
        try:
            rows = self._rows.read()
        except RingOverrun as overrun:
            self.lost_rows += overrun.lost
            rows = self._rows.read()
        try:
            frames = self._frames.read()
        except RingOverrun as overrun:
            self.lost_frames += overrun.lost
            frames = self._frames.read()
        if len(rows):
            moved = True
            recorded = self._of_the_session.take(rows)
            self._verdict.see(rows)
            self._verdict.take(recorded)
            if len(recorded):
                self._waiting.append(recorded)
        # What a full disk refuses waits: the motion ends within seconds, and there may be room then. Rows and raw frames
        # each by themselves, so that neither is lost by what the other met.
        with self._disk():
            while self._waiting:
                self.file.append(self._waiting[0])
                self._waiting.popleft()
        with self._disk():
            if len(frames):
                moved = True
                self._log.append(frames)
        self._rows.publish_position()
        self._frames.publish_position()
        self._flush_when_due()
        return moved

    def _flush_when_due(self) -> None:
        now = time.monotonic()
        if now - self._flushed < self._storage.flush_interval:
            return
        to_disk = now - self._synced >= self._storage.sync_interval
        with self._disk():
            self._log.flush(to_disk)
        with self._disk():
            self.file.flush(to_disk)
            if self.file.gone:
                sentence = (
                    f"the recording {self.file.path.name} or its folder was moved or deleted while it was being recorded; "
                    "what was measured is written anew at the same place"
                )
                self._refuse(StopReason(StopCause.RECORDER, sentence))
            free = self.file.free_space() / 1e6
            if free < self._storage.disk_reserve:
                sentence = (
                    f"the disk has {free:.0f} MB left, less than the {self._storage.disk_reserve:g} MB in reserve "
                    "(storage.disk_reserve); make room, then start a new session"
                )
                self._refuse(StopReason(StopCause.FULL_DISK, sentence))
        self._flushed = now
        if to_disk:
            self._synced = now

    @contextmanager
    def _disk(self) -> Generator[None]:
        """Turn a refusal of the disk into a word to the acquisition process."""
        try:
            yield
        except OSError as error:
            full = error.errno in (errno.ENOSPC, errno.EDQUOT)
            what = (
                "is full"
                if full
                else f"does not take the data ({error.strerror or 'it refuses without a reason'})"
            )
            sentence = f"the disk {what}; what it took is kept; make room or check the disk, then start a new session"
            self._refuse(StopReason(StopCause.FULL_DISK, sentence))

    def _refuse(self, reason: StopReason) -> None:
        if not self._refused:
            self._refused = True
            self._tell(reason)

    def finish(self, ending: Ending) -> None:
        """Drain the rings and close the files with the final status.

        Raises OSError when the disk does not take it; the files then stay as after a kill.
        """
        while self.take():
            pass
        counters = {
            **ending.counters,
            "rows": self.file.rows,
            "frames": self._log.frames,
            "rows_lost_in_ring": self.lost_rows,
            "frames_lost_in_ring": self.lost_frames,
        }
        reason = ending.reason
        if self.lost_rows and reason.status == "complete":
            sentence = f"{self.lost_rows} rows were overwritten in the ring before they could be recorded"
            reason = StopReason(StopCause.RECORDER, sentence)
        problems = self._verdict.problems()
        if problems and reason.status == "complete":
            sentence = f"{reason.words}, but: {'; '.join(problems)}"
            reason = StopReason(StopCause.DATA_IN_DOUBT, sentence)
        counters["problems"] = problems
        self._log.flush(to_disk=True)
        if self._provisional and self.file.gone:
            self.file.abandon()
        else:
            self.file.finish(reason.status, reason.words, counters, reason.cause.value)
        # Last: its lock says that somebody is at work on the recording, and keeps others from recovering it meanwhile.
        self._log.close()
        self._rows.close()
        self._frames.close()


def record(order: RecorderOrder, acquisition: Connection) -> None:
    """Record one session; returns when it is closed.

    acquisition : to the acquisition process; it is told `ready`, and a StopReason when the disk refuses, and says its
        `Ending` at the end. Its closing means that the process has died.
    """

    def tell(word: StopReason | str) -> None:
        # When it has died, nobody is left to tell; that is found below.
        with suppress(OSError):
            acquisition.send(word)

    try:
        recorder = Recorder(order, tell)
    except OSError as error:
        reason = error.strerror or str(error)
        sentence = f"the recording {order.path} cannot be created ({reason}); see who may write there, then start a new session"
        tell(StopReason(StopCause.RECORDER, sentence))
        return
    tell("ready")
    ending = None
    while ending is None:
        recorder.take()
        try:
            if acquisition.poll(_PERIOD):
                ending = acquisition.recv()
        except (EOFError, OSError):
            sentence = "the acquisition process died; what it had measured until then is here"
            ending = Ending(StopReason(StopCause.INTERNAL, sentence))
    recorder.finish(ending)


def main() -> None:
    """The process: connections to the acquisition process and to the parent are descriptors in the arguments."""
    # Ctrl-C and the end of the terminal are for the process that holds the stop button, which tells us.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    acquisition, parent = Connection(int(sys.argv[1])), Connection(int(sys.argv[2]))
    try:
        order = parent.recv()
    except EOFError:
        return
    parent.close()
    record(order, acquisition)
