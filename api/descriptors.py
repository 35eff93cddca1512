"""File descriptors: the limit raised at the start, and a few held back for the moment when there are no more."""

import errno
import os
import resource

NEEDED = 8192
"""descriptors that we ask for; connections, files, pipes and databases of a busy service together stay far below"""
HELD_BACK = 8
"""descriptors kept for stops while everybody else's are used up"""
OUT_OF_DESCRIPTORS = frozenset({errno.EMFILE, errno.ENFILE})


def raise_limit() -> int:
    """Raise the soft limit of open files towards the hard one; the soft limit then."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = NEEDED if hard == resource.RLIM_INFINITY else min(hard, NEEDED)
    if soft != resource.RLIM_INFINITY and soft < wanted:
        resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
        return wanted
    return NEEDED if soft == resource.RLIM_INFINITY else soft


class Reserve:
    """Open descriptors of nothing: given up when a connection could not be accepted, taken back when there is room."""

    def __init__(self) -> None:
        self._held: list[int] = []
        self.refill()

    def give_up_one(self) -> bool:
        """Make room for one descriptor; False if there is nothing left to give."""
        if not self._held:
            return False
        os.close(self._held.pop())
        return True

    def refill(self) -> None:
        """Hold back as many as there should be, as far as there are any."""
        try:
            while len(self._held) < HELD_BACK:
                self._held.append(os.open(os.devnull, os.O_RDONLY | os.O_CLOEXEC))
        except OSError:
            return

    def close(self) -> None:
        """Give up all."""
        while self.give_up_one():
            pass
