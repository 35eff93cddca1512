"""Requests begin a few in each turn of the event loop, stops first.

Whoever has let so many connections in could else be asked something by all of them in the same turn, and a turn that is long
takes the sign of life from the acquisition (`api/service/pulse.py`).
"""

from asyncio import AbstractEventLoop
from collections import deque
from collections.abc import Callable

AT_ONCE = 4
"""requests that begin in one turn: some milliseconds"""


class Turnstile:
    """Those who wait to begin, in the order in which they came."""

    def __init__(self, loop: AbstractEventLoop) -> None:
        self._loop = loop
        self._stops: deque[Callable[[], None]] = deque()
        self._others: deque[Callable[[], None]] = deque()
        self._turning = False

    def wait(self, begin: Callable[[], None], *, is_stop: bool) -> None:
        """Call `begin` in one of the next turns."""
        (self._stops if is_stop else self._others).append(begin)
        if not self._turning:
            self._turning = True
            self._loop.call_soon(self._turn)

    def _turn(self) -> None:
        for _ in range(AT_ONCE):
            if waiting := self._stops or self._others:
                self._loop.call_soon(waiting.popleft())
        self._turning = bool(self._stops or self._others)
        if self._turning:
            self._loop.call_soon(self._turn)
