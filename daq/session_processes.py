"""The two processes of a session: the acquisition, which has the bus, and the recorder, which has the files.

What is said to them never waits long: the stop goes this way.
"""

import contextlib
import select
import subprocess
import threading
from multiprocessing import Pipe

from daq.acquisition import AcquisitionMessage, AcquisitionOrder
from daq.child_process import start_process
from daq.recorder import RecorderOrder

_SAY_TIMEOUT = 0.1
"""s that a word to the acquisition process may take; it empties its pipe in every cycle"""


class ProcessDied(Exception):
    """A process of the session is gone, in words."""


class SessionProcesses:
    """Pipes to both, and the processes once they are started.

    Raises OSError where the system has no descriptors left.
    """

    def __init__(self) -> None:
        self.acquisition: subprocess.Popen[bytes] | None = None
        self.recorder: subprocess.Popen[bytes] | None = None
        self._acquisition_words, self._acquisition_end = Pipe()
        self._recorder_order, self._recorder_end = Pipe()
        self._sending = threading.Lock()

    def start(self) -> None:
        """Start both; each waits for its order."""
        recorder_signs, acquisition_signs = Pipe()
        self.acquisition = start_process("daq.acquisition", self._acquisition_end, acquisition_signs)
        # It only waits for its order, but by then it has started.
        self.recorder = start_process("daq.recorder", recorder_signs, self._recorder_end)

    def acquire(self, order: AcquisitionOrder) -> None:
        """Have the bus taken and the drives looked at."""
        self._acquisition_words.send(order)

    def record(self, order: RecorderOrder) -> None:
        """Have the recording opened. Raises ProcessDied."""
        try:
            self._recorder_order.send(order)
        except OSError:
            raise ProcessDied(
                "the recorder process died before the session was armed; look at memory and disk of this computer, then "
                "begin a new session"
            ) from None

    def say(self, word: str, argument: str = "") -> bool:
        """Send a word to the acquisition; False if it could not take it within a moment. Never waits longer."""
        if not self._sending.acquire(timeout=_SAY_TIMEOUT):
            return False
        try:
            if not self._has_room():
                return False
            self._acquisition_words.send((word, argument))
        except OSError:
            pass  # it has died; who hears it says so
        finally:
            self._sending.release()
        return True

    def order(self, word: str, argument: str = "") -> None:
        """Send a word that must arrive. Raises ProcessDied."""
        if not self.say(word, argument):
            raise ProcessDied("the acquisition process does not respond; begin a new session")

    def hear(self) -> AcquisitionMessage:
        """Wait for what the acquisition says next. Raises EOFError or OSError where it died."""
        return self._acquisition_words.recv()

    def stop(self, reason: str) -> None:
        """Have the axes brought to rest."""
        if not self.say("stop", reason) and self.acquisition is not None:
            # It does not take words any more: a signal needs neither room in a pipe nor a lock of ours.
            with contextlib.suppress(ProcessLookupError):
                self.acquisition.terminate()

    def wait_for_acquisition(self) -> None:
        """Wait until it has ended, as it does when the motion has."""
        if self.acquisition is not None:
            self.acquisition.wait()

    def wait_for_recording(self) -> None:
        """Wait until the acquisition has ended, and the recorder has closed its file."""
        self.wait_for_acquisition()
        self._recorder_order.close()
        if self.recorder is not None:
            self.recorder.wait()

    def end(self, timeout: float) -> None:
        """Wait `timeout` s for each to end by itself, then kill it."""
        for process in (self.acquisition, self.recorder):
            if process is not None:
                try:
                    process.wait(timeout)
                except subprocess.TimeoutExpired:
                    process.kill()
                    process.wait()

    def close(self) -> None:
        """Close the pipe on which the acquisition was heard."""
        self._acquisition_words.close()

    def _has_room(self) -> bool:
        """Whether a short word can be sent without waiting, now or within a moment."""
        writable = select.poll()
        writable.register(self._acquisition_words.fileno(), select.POLLOUT)
        return any(
            event & (select.POLLOUT | select.POLLERR | select.POLLHUP)
            for _, event in writable.poll(1000 * _SAY_TIMEOUT)
        )
