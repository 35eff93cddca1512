"""Real-time priority and locked memory for the process that owns the bus, where the system permits them."""

import ctypes
import gc
import os

_PRIORITY = 50
"""of SCHED_FIFO, 1 to 99: above everything ordinary, level with the kernel's interrupt threads, far below its
watchdogs"""

_MCL_CURRENT, _MCL_FUTURE = 1, 2


def ask_for_real_time() -> list[str]:
    """Ask for what a real-time process needs; what was granted and what was not, in words."""
    remarks: list[str] = []
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
        remarks.append(f"real-time priority (SCHED_FIFO {_PRIORITY})")
    except (OSError, AttributeError) as error:
        remarks.append(
            f"no real-time priority ({error}): cycles may be late; allow it with an rtprio limit for this user"
        )
    try:
        libc = ctypes.CDLL(None, use_errno=True)
        if libc.mlockall(_MCL_CURRENT | _MCL_FUTURE) != 0:
            raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
        remarks.append("memory locked")
    except (OSError, AttributeError) as error:
        remarks.append(
            f"memory not locked ({error}): paging may delay a cycle; allow it with a memlock limit"
        )
    # A full collection over what was imported takes tens of milliseconds.
    gc.collect()
    gc.freeze()
    return remarks
