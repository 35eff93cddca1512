"""Node guarding, for nodes without a heartbeat: the master asks by a remote frame, the answer has a bit that toggles.

CiA 301, section 7.2.8.3.2.1. A controller with a buffer for each identifier answers remote frames by itself, whether or not the
node's processor still runs: an answer whose toggle bit is the one of the answer before counts as none.
"""

_TOGGLE = 0x80
_STATE = 0x7F


class ToggleBit:
    """Tells an answer to node guarding from one that was sent again."""

    def __init__(self) -> None:
        self._last: int | None = None
        self.repeated = 0
        """answers so far whose toggle bit had not changed"""

    def accepts(self, answer: int) -> bool:
        """Whether an answer's byte says that the node lives; a boot-up (state 0) always does."""
        if not answer & _STATE:
            self._last = None
            return True
        toggle = answer & _TOGGLE
        if toggle == self._last:
            self.repeated += 1
            return False
        self._last = toggle
        return True


def life_time_factor(guard_time: float, timeout: float) -> int:
    """Object 0x100D: how many guard times (s) a node waits for the next remote frame, so that it is `timeout` s at least.

    2 at least, so that one lost frame is no loss of the master, 255 at most, which is what the object holds.
    """
    return min(255, max(2, -int(-timeout // guard_time)))
