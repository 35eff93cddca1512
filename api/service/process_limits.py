"""What a process that computes or reads files of others may take of this computer.

The kernel enforces memory, processor time, descriptors and bytes written (setrlimit); the clock on the wall is watched by
who waits. All of them end in one line that says which limit it was.
"""

import os
import resource
import signal
from dataclasses import dataclass
from pathlib import Path

MEBIBYTE = 1024 * 1024
GIBIBYTE = 1024 * MEBIBYTE
AFTER_SIGXCPU = 5
"""s of processor time from the signal that a process may handle to the one that it cannot"""


def half_of_memory(most: int) -> int:
    """Half of this computer's memory, and at most `most`; bytes."""
    return min(most, os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") // 2)


class LimitExceeded(Exception):
    """A process took more than it may; the words say of what."""


@dataclass(frozen=True)
class ProcessLimits:
    """Limits of one process.

    memory      : bytes of address space beyond what the process begins with
    seconds     : on the wall, and of processor time, whatever comes first
    descriptors : files and connections open at the same time
    written     : bytes of the largest file that it writes; None for as many as the disk holds
    """

    memory: int
    seconds: float
    descriptors: int = 1024
    written: int | None = None

    def apply(self) -> None:
        """Take the limits on, for this process and all that it starts; there is no way back."""
        begins_with = int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
        _lower(resource.RLIMIT_AS, begins_with + self.memory)
        # Ends a process whose service was killed and which nobody watches any more. It ends by SIGXCPU, which says why: at
        # the hard limit the kernel would send SIGKILL.
        _lower(resource.RLIMIT_CPU, int(self.seconds) + 1, AFTER_SIGXCPU)
        _lower(resource.RLIMIT_NOFILE, self.descriptors)
        _lower(resource.RLIMIT_CORE, 0)
        if self.written is not None:
            _lower(resource.RLIMIT_FSIZE, self.written)

    @property
    def memory_words(self) -> str:
        """What is said where the memory does not suffice."""
        return f"it needs more than {self.memory / GIBIBYTE:.3g} GB of memory, which is the most it may have"

    @property
    def time_words(self) -> str:
        """What is said where the time does not suffice."""
        return f"it was not done within {self.seconds:g} s, which is the most it may take"


def ended_by(status: int | None) -> str:
    """How a process ended, in words, from its exit status as `multiprocessing` has it."""
    if status is not None and status < 0:
        return f"the process was ended by {signal.Signals(-status).name}"
    return f"the process ended with status {status}"


def _lower(kind: int, wanted: int, room: int = 0) -> None:
    """The soft limit to `wanted` and the hard one to `room` above it; neither above what is allowed now."""
    hard = resource.getrlimit(kind)[1]

    def allowed(value: int) -> int:
        return value if hard == resource.RLIM_INFINITY else min(value, hard)

    resource.setrlimit(kind, (allowed(wanted), allowed(wanted + room)))
