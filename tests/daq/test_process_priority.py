"""What the system grants the process that owns the bus, and what is said where it does not."""

import ctypes
import errno
import os
from types import SimpleNamespace

import pytest

from daq.process_priority import ask_for_real_time

FIFO_50 = (0, os.SCHED_FIFO, os.sched_param(50))


@pytest.fixture
def system(monkeypatch):
    """The system's answers, and what it was asked: neither is wanted of the tests' own process."""
    made = SimpleNamespace(grants=True, asked=[])

    def schedule(*arguments):
        made.asked.append(arguments)
        if not made.grants:
            raise PermissionError(errno.EPERM, os.strerror(errno.EPERM))

    def lock(flags):
        made.asked.append(flags)
        ctypes.set_errno(0 if made.grants else errno.ENOMEM)
        return 0 if made.grants else -1

    monkeypatch.setattr(os, "sched_setscheduler", schedule)
    monkeypatch.setattr(ctypes, "CDLL", lambda *_, **__: SimpleNamespace(mlockall=lock))
    return made


def test_priority_and_locked_memory_are_asked_for_and_said(system):
    assert [each.words for each in ask_for_real_time()] == [
        "real-time priority (SCHED_FIFO 50)",
        "memory locked",
    ]
    assert system.asked == [FIFO_50, 3]  # memory that is there, and that comes


def test_what_is_refused_is_said_with_what_comes_of_it_and_what_grants_it(system):
    system.grants = False
    priority, memory = ask_for_real_time()
    assert not priority.ok
    assert not memory.ok
    assert priority.words == (
        "no real-time priority ([Errno 1] Operation not permitted): cycles may be late; allow it: `LimitRTPRIO=50` in the "
        "service's unit, or `USER - rtprio 50` in /etc/security/limits.conf and a new sign-in (docs/install.md)"
    )
    assert "Cannot allocate memory" in memory.words
    assert "`LimitMEMLOCK=infinity` in the service's unit, or `USER - memlock unlimited`" in memory.words
