"""Mischief to the processes of a session and to the clock, for the matrix: what happens, and whether a motion may go on."""

import contextlib
import os
import socket
import time
from collections.abc import Callable, Iterator
from multiprocessing.connection import Connection
from typing import Any

from daq.safety import StopCause, StopReason
from tests.faults.bench import Stage

SOON = (("supervision", {"parent_timeout": 0.3}),)
"""A dead-man that is short beside the wall clock's time of a session that takes a second"""
REAL_TIME = (("pacing", "real-time"), ("cycle", 0.01))


def _silent(stage: Stage) -> None:
    stage.beats = False


def _parent_dies(stage: Stage) -> None:
    stage.beats = False
    _ends(stage.parent)


def _recorder_dies(stage: Stage) -> None:
    stage.recorder.close()


def _ends(connection: Connection) -> None:
    """The other side sees the end now, as when the kernel ends a process; after `close` it would wait for the thread that
    listens here."""
    with contextlib.suppress(OSError), socket.socket(fileno=os.dup(connection.fileno())) as ours:
        ours.shutdown(socket.SHUT_RDWR)


def _recorder_tells(stage: Stage) -> None:
    with contextlib.suppress(OSError):
        stage.recorder.send(StopReason(StopCause.FULL_DISK, "the disk is full"))


def _says(word: str, times: int = 1) -> Callable[[Stage], None]:
    def say(stage: Stage) -> None:
        for _ in range(times):
            with contextlib.suppress(OSError):
                stage.parent.send((word, "the operator's stop" if word == "stop" else ""))

    return say


def _stops_and_dies(stage: Stage) -> None:
    _says("stop")(stage)
    _parent_dies(stage)


def _parent_and_recorder_die(stage: Stage) -> None:
    _parent_dies(stage)
    # The recorder's connection stays for its last word, which is what is judged.
    _recorder_tells(stage)


def _terminated(stage: Stage) -> None:
    stage.acquisition.terminate()


PROCESS_KINDS: tuple[dict[str, Any], ...] = (
    {
        "name": "parent gives no sign of life",
        "mischief": _silent,
        "changes": SOON,
        "judged": False,
        "goes_on": True,
    },
    {"name": "parent dies", "mischief": _parent_dies},
    {"name": "recorder dies", "mischief": _recorder_dies},
    {"name": "recorder: the disk is full", "mischief": _recorder_tells},
    {"name": "parent dies, the disk is full", "mischief": _parent_and_recorder_die},
    {"name": "acquisition gets SIGTERM", "mischief": _terminated},
    {"name": "operator stops", "mischief": _says("stop")},
    {"name": "operator stops 50 times", "mischief": _says("stop", 50)},
    {"name": "operator stops and the parent dies", "mischief": _stops_and_dies},
    {"name": "armed once more", "mischief": _says("arm"), "goes_on": True},
    {"name": "started once more", "mischief": _says("start"), "goes_on": True},
)


_real = {name: getattr(time, name) for name in ("time", "time_ns", "monotonic")}


def _wall_clock_steps(seconds: float) -> Callable[[Stage], None]:
    def step(_stage: Stage) -> None:
        time.time = lambda: _real["time"]() + seconds
        time.time_ns = lambda: _real["time_ns"]() + round(seconds * 1e9)

    return step


def _held_up(seconds: float) -> Callable[[Stage], None]:
    def hold(_stage: Stage) -> None:
        # In the thread that runs the acquisition, or that which would arm it.
        latest = _real["monotonic"]() + seconds
        while _real["monotonic"]() < latest:
            pass

    return hold


@contextlib.contextmanager
def undone() -> Iterator[None]:
    """The clocks are as they were, afterwards."""
    try:
        yield
    finally:
        for name, function in _real.items():
            setattr(time, name, function)


CLOCK_KINDS: tuple[dict[str, Any], ...] = (
    {"name": "wall clock steps an hour on", "mischief": _wall_clock_steps(3600.0), "goes_on": True},
    {"name": "wall clock steps a day back", "mischief": _wall_clock_steps(-86400.0), "goes_on": True},
    {
        "name": "bus stands still for 0.05 s",
        "mischief": _held_up(0.05),
        "changes": REAL_TIME,
        "judged": False,
        "goes_on": True,
    },
    {
        "name": "bus stands still for 1 s",
        "mischief": _held_up(1.0),
        "changes": REAL_TIME,
        "judged": False,
        "harmless_before": True,
    },
)
