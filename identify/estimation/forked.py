"""Work that several joints do not share, done by forks of this process.

A fork has everything that this process has, without a copy and without loading a library: it starts in milliseconds where
a process of its own takes half a second, so that it pays for what takes a tenth of a second. It computes its part of the
items, sends what it found and ends. What it keeps for later (caches) ends with it.
"""

from __future__ import annotations

import os
import pickle
import signal
import struct
import threading
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, BinaryIO

from identify.estimation.executor import Found, Item

_processes: ContextVar[int] = ContextVar("processes of a joint's algebra", default=1)


@contextmanager
def forked(processes: int) -> Iterator[None]:
    """What is computed joint by joint inside this block is divided among so many processes, this one included.

    Only for a process that has no other thread of its own: a fork would hold the locks that another thread had.
    """
    token = _processes.set(processes)
    try:
        yield
    finally:
        _processes.reset(token)


def each(
    function: Callable[[Item], Found], items: Sequence[Item], known: Sequence[object] = ()
) -> list[Found]:
    """What a function finds on each item, in order. What it returns is pickled on its way from a fork.

    known : objects that it may return, or that are parts of what it returns, and that stay the same objects
    Raises what the function raises.
    """
    processes = min(_processes.get(), len(items))
    if processes < 2 or threading.active_count() > 1:
        return [function(item) for item in items]
    turns = _turns(len(items))
    forks: list[_Fork] = []
    token = _processes.set(1)  # what is divided already is not divided again
    try:
        forks += (_Fork(function, items, known, turns) for _ in range(1, processes))
        answers = {index: function(items[index]) for index in _taken(turns)}
        for fork in forks:
            answers |= fork.result()
    finally:
        _processes.reset(token)
        os.close(turns)
        for fork in forks:
            fork.end()
    # what a fork had that ended without an answer is computed here
    return [answers[index] if index in answers else function(item) for index, item in enumerate(items)]


def _turns(count: int) -> int:
    """A pipe that holds the indices of the items; each process takes the next when it has done its last."""
    turns, filled = os.pipe()
    os.write(filled, struct.pack(f"{count}i", *range(count)))
    os.close(filled)
    return turns


def _taken(turns: int) -> Iterator[int]:
    while index := os.read(turns, struct.calcsize("i")):
        yield struct.unpack("i", index)[0]


class _Fork:
    """A fork that calls a function on items as they come up, and our end of the pipe that it answers through."""

    def __init__(
        self, function: Callable[[Item], Found], items: Sequence[Item], known: Sequence[object], turns: int
    ) -> None:
        self._known = known
        self._answer, theirs = os.pipe()
        with warnings.catch_warnings():
            # Python counts the idle threads of Arrow and OpenBLAS, which hold nothing and start anew in a fork that asks for them
            warnings.simplefilter("ignore", DeprecationWarning)
            self._process = os.fork()
        if self._process == 0:
            os.close(self._answer)
            _answer(function, items, known, turns, theirs)
        os.close(theirs)

    def result(self) -> dict[int, Any]:
        """What was found, by the index of the item; nothing where the fork ended without an answer."""
        with os.fdopen(self._answer, "rb", closefd=False) as answer:
            try:
                good, answer_or_error = _Unpickler(answer, self._known).load()
            except (EOFError, pickle.UnpicklingError):
                return {}
        if good:
            return answer_or_error
        raise answer_or_error

    def end(self) -> None:
        """End the fork, whatever it computes."""
        os.close(self._answer)
        os.kill(self._process, signal.SIGKILL)
        os.waitpid(self._process, 0)


def _answer(
    function: Callable[[Item], Found], items: Sequence[Item], known: Sequence[object], turns: int, pipe: int
) -> None:
    """Write what the function finds, or raises, and end without the duties of the process that was forked."""
    try:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group; the parent ends us
        try:
            outcome = True, {index: function(items[index]) for index in _taken(turns)}
        except Exception as error:
            outcome = False, error
        with os.fdopen(pipe, "wb") as answer:
            _Pickler(answer, known).dump(outcome)
    finally:
        os._exit(0)


class _Pickler(pickle.Pickler):
    """Writes objects that both processes know as their places among these."""

    def __init__(self, file: BinaryIO, known: Sequence[object]) -> None:
        super().__init__(file, pickle.HIGHEST_PROTOCOL)
        self._places = {id(thing): place for place, thing in enumerate(known)}

    def persistent_id(self, obj: object) -> int | None:
        return self._places.get(id(obj))


class _Unpickler(pickle.Unpickler):
    """Reads from our own fork, through a pipe that nobody else has."""

    def __init__(self, file: BinaryIO, known: Sequence[object]) -> None:
        super().__init__(file)
        self._known = known

    def persistent_load(self, pid: int) -> object:
        return self._known[pid]
