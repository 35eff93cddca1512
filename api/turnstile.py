"""Requests begin a few in each turn of the event loop, stops first, and no others while many go on for nobody.

Whoever has let so many connections in could else be asked something by all of them in the same turn, and a turn that is long
takes the sign of life from the acquisition (`api/service/pulse.py`). The number of connections does not bound the requests of
those who ask and leave before the answer: each goes on to its end, and some thousand of them took memory without end.
"""

from asyncio import AbstractEventLoop
from collections.abc import Callable

AT_ONCE = 4
"""requests that begin in one turn: some milliseconds"""
MOST_ABANDONED = 64
"""requests under way whose connection is gone, beyond which the next ones but stops wait; more than there are threads to
work on them"""
Begin = Callable[[], None]


class Turnstile:
    """Those who wait to begin, in the order in which they came; each `begin` is one that waits, and equal to no other."""

    def __init__(self, loop: AbstractEventLoop) -> None:
        self._loop = loop
        self._stops: dict[Begin, None] = {}
        self._others: dict[Begin, None] = {}
        self._abandoned = 0
        self._turning = False

    def wait(self, begin: Begin, *, is_stop: bool) -> None:
        """Call `begin` in one of the next turns."""
        (self._stops if is_stop else self._others)[begin] = None
        self._go_on()

    def leave(self, begin: Begin) -> None:
        """Who waited is gone."""
        self._stops.pop(begin, None)
        self._others.pop(begin, None)

    def abandon(self) -> None:
        """A request under way lost who asked."""
        self._abandoned += 1

    def end_abandoned(self) -> None:
        """One of these came to its end."""
        self._abandoned -= 1
        self._go_on()

    def _next(self) -> dict[Begin, None]:
        """Those of whom the first may begin now."""
        return self._stops or (self._others if self._abandoned < MOST_ABANDONED else {})

    def _go_on(self) -> None:
        if not self._turning and self._next():
            self._turning = True
            self._loop.call_soon(self._turn)

    def _turn(self) -> None:
        self._turning = False
        for _ in range(AT_ONCE):
            if waiting := self._next():
                begin = next(iter(waiting))
                del waiting[begin]
                self._loop.call_soon(begin)
        self._go_on()
