"""Real-time priority and locked memory for the process that owns the bus, where the system permits them."""

import ctypes
import gc
import os
from dataclasses import dataclass

_PRIORITY = 50
"""of SCHED_FIFO, 1 to 99: above everything ordinary, level with the kernel's interrupt threads, far below its
watchdogs"""

_MCL_CURRENT, _MCL_FUTURE = 1, 2


@dataclass(frozen=True)
class Granted:
    """One thing that a real-time process needs."""

    ok: bool
    words: str
    """what was granted; or what was not, why, what comes of it, and what grants it"""


def ask_for_real_time() -> list[Granted]:
    """Ask for what a real-time process needs, for this process: its priority, and memory that stays."""
    granted = [_priority(), _locked_memory()]
    # A full collection over what was imported takes tens of milliseconds.
    gc.collect()
    gc.freeze()
    return granted


def _priority() -> Granted:
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
    except (OSError, AttributeError) as error:
        way = _way("rtprio", "LimitRTPRIO", str(_PRIORITY))
        return Granted(False, f"no real-time priority ({error}): cycles may be late; {way}")
    return Granted(True, f"real-time priority (SCHED_FIFO {_PRIORITY})")


def _locked_memory() -> Granted:
    try:
        libc = ctypes.CDLL(None, use_errno=True)
        if libc.mlockall(_MCL_CURRENT | _MCL_FUTURE) != 0:
            raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
    except (OSError, AttributeError) as error:
        way = _way("memlock", "LimitMEMLOCK", "infinity", in_limits="unlimited")
        return Granted(False, f"memory not locked ({error}): paging may delay a cycle; {way}")
    return Granted(True, "memory locked")


def _way(item: str, setting: str, value: str, in_limits: str | None = None) -> str:
    return (
        f"allow it: `{setting}={value}` in the service's unit, or `USER - {item} {in_limits or value}` in "
        "/etc/security/limits.conf and a new sign-in (docs/install.md)"
    )
