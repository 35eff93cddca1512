"""Whether a stop would be answered now: the sign of life that the acquisition waits for is given only then.

A pulse is the time at which a loop last took a turn. The service gives the acquisition its sign of life (`daq`'s
dead-man) while every pulse is young: the event loop's, which serves the pages, and the acceptor's, which answers the stop
button. A loop that hangs, or a thread that died, so ends the motion as a dead process does.
"""

import asyncio
import time

PERIOD = 0.1
"""s between two turns that a loop marks"""
OLD = 0.5
"""s after which a pulse is too old for a stop to be answered at once: a few periods, so that a busy computer does not count
as a frozen one."""


class Pulse:
    """When a loop last took a turn; written by that loop alone, read from any thread."""

    def __init__(self) -> None:
        self._last = time.monotonic()

    def beat(self) -> None:
        """The loop takes a turn."""
        self._last = time.monotonic()

    @property
    def age(self) -> float:
        """s since the last turn."""
        return time.monotonic() - self._last


class LoopPulse(Pulse):
    """The pulse of an asyncio event loop, between `start` and `end`, which are called in it."""

    def __init__(self) -> None:
        super().__init__()
        self._timer: asyncio.TimerHandle | None = None

    def start(self) -> None:
        """Mark every turn from now on."""
        self.beat()
        self._timer = asyncio.get_running_loop().call_later(PERIOD, self.start)

    def end(self) -> None:
        """Mark no more."""
        if self._timer is not None:
            self._timer.cancel()


class StopReadiness:
    """Whether every loop that a stop needs takes its turns."""

    def __init__(self) -> None:
        self._pulses: dict[str, Pulse] = {}

    def depend_on(self, name: str, pulse: Pulse) -> None:
        """From now on a stop needs this loop as well."""
        self._pulses[name] = pulse

    def no_longer(self, name: str) -> None:
        """The loop has ended in order."""
        self._pulses.pop(name, None)

    def could_stop_now(self) -> bool:
        """True if a stop that came now would be answered at once."""
        return all(pulse.age < OLD for pulse in list(self._pulses.values()))
