"""The slave's side of node guarding (CiA 301, 7.2.8.3.2.1): remote frames answered, and missed."""

from collections.abc import Callable


class GuardedNode:
    """Answers every remote frame by its state with a bit that toggles, and knows when they have stayed away.

    can_id : 0x700 + node
    state  : the NMT state now; None while the node says nothing
    send   : puts a frame on the bus
    """

    def __init__(self, can_id: int, state: Callable[[], int | None], send: Callable[[int, bytes], None]):
        self.guard_time = 0.0
        """s, object 0x100C"""
        self.life_time_factor = 0
        """object 0x100D"""
        self.toggles = True
        """whether the toggle bit changes, as it has to"""
        self._can_id = can_id
        self._state = state
        self._send = send
        self._toggle = 0
        self._asked: float | None = None

    def restart(self) -> None:
        """Boot-up: the first answer has the toggle bit 0, and nobody has asked yet."""
        self.guard_time, self.life_time_factor = 0.0, 0
        self._toggle, self._asked = 0, None

    def answer(self, now: float) -> None:
        """A remote frame came at `now` (s)."""
        state = self._state()
        if state is None:
            return
        self._asked = now
        self._send(self._can_id, bytes((state | self._toggle,)))
        if self.toggles:
            self._toggle ^= 0x80

    def master_lost(self, now: float) -> bool:
        """Whether nobody has asked within the life time, since somebody first did (life guarding)."""
        life_time = self.guard_time * self.life_time_factor
        return bool(life_time) and self._asked is not None and now - self._asked > life_time
