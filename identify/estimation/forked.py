"""Work that several joints do not share, divided among processes that go through a computation side by side.

A fork has everything that this process has, without a copy and without loading a library. It then does what this process
does; where work is divided (`each`) every process takes some of the items, and all get what all found. So what is large (motion,
columns, factors) never goes from one to the other, and nothing is forked again and again: pages that are written after a fork
are copied, by both. What is not divided is computed by each, in the same time. All of it must follow from what the processes
had in common, whatever their caches hold; where one comes to something else, this process goes on alone.
"""

from __future__ import annotations

import os
import pickle
import signal
import struct
import threading
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from typing import Any, BinaryIO, NamedTuple

from identify.estimation.executor import SERIAL, Found, Item, chosen_executor

_processes: ContextVar[int] = ContextVar("processes of a joint's algebra", default=1)
_present: ContextVar[_Together | None] = ContextVar("processes side by side", default=None)

NO_MORE = -1
"""in the place of an item's index: what is left was taken by others"""


@contextmanager
def forked(processes: int) -> Iterator[None]:
    """What goes side by side inside this block does so in so many processes, this one included.

    Only for a process that has no other thread of its own: a fork would hold the locks that another thread had.
    """
    token = _processes.set(processes)
    try:
        yield
    finally:
        _processes.reset(token)


@contextmanager
def side_by_side(parts: int) -> Iterator[None]:
    """Go through this block in as many processes as `forked` says, and no more than what is divided has parts. The forks end with
    it, and nobody hears of them: what has an effect outside of the computation, but for words on the standard streams, does not
    belong inside.
    """
    processes = min(_processes.get(), parts)
    elsewhere = chosen_executor() is not SERIAL  # its workers answer one process
    if processes < 2 or elsewhere or _present.get() is not None or threading.active_count() > 1:
        yield
        return
    together = _Together(processes)
    token = _present.set(together)
    try:
        yield
    finally:
        together.end()
        _present.reset(token)


def dividing() -> int:
    """Number of processes that what is divided here is divided among."""
    together = _present.get()
    return 1 if together is None else together.processes


def each(
    function: Callable[[Item], Found],
    items: Sequence[Item],
    known: Sequence[object] = (),
    kept: bool = False,
) -> list[Found]:
    """What a function finds on each item, in order. What it returns is pickled on its way to the other processes.

    known : objects that it may return, or that are parts of what it returns, and that stay the same objects
    kept  : an item in one place of `items` always goes to the same process, which may keep something for the next time;
            otherwise a process takes the next when it has done its last
    Raises what the function raises.
    """
    together = _present.get()
    if together is None or together.processes < 2 or len(items) < 2:
        return [function(item) for item in items]
    tokens = _present.set(None), _processes.set(1)  # what is divided already is not divided again
    try:
        return together.each(function, items, known, kept)
    except BaseException:
        together.end()  # the others do not know of it
        raise
    finally:
        _present.reset(tokens[0])
        _processes.reset(tokens[1])


class _Together:
    """This process and its forks; in a fork, the fork and its parent.

    processes : how many go side by side; 1 as soon as one of the forks is lost
    """

    def __init__(self, processes: int) -> None:
        self.processes = processes
        self._place, self._calls = 0, 0
        self._forks: list[_Link] = []
        self._parent: _Link | None = None
        self._turns, self._filled = os.pipe()
        for place in range(1, processes):
            answers, orders = os.pipe(), os.pipe()
            with warnings.catch_warnings():
                # Python counts the idle threads of Arrow and OpenBLAS, which hold nothing and start anew in a fork that asks
                warnings.simplefilter("ignore", DeprecationWarning)
                process = os.fork()
            if process == 0:
                # an end of a pipe that two processes hold is not closed when one of them ends
                for descriptor in (self._filled, answers[0], orders[1]):
                    os.close(descriptor)
                for link in self._forks:
                    link.close()
                self._place, self._forks = place, []
                self._parent = _Link(os.getppid(), os.fdopen(orders[0], "rb"), os.fdopen(answers[1], "wb"))
                _unseen()
                return
            os.close(answers[1])
            os.close(orders[0])
            self._forks.append(_Link(process, os.fdopen(answers[0], "rb"), os.fdopen(orders[1], "wb")))

    def each(
        self, function: Callable[[Item], Found], items: Sequence[Item], known: Sequence[object], kept: bool
    ) -> list[Found]:
        """Do a part of the items, and exchange what was found for the rest."""
        self._calls += 1
        call = self._calls, len(items), len(known)
        if self._parent is not None:
            return self._as_fork(self._parent, call, function, items, known, kept)
        if not kept:
            turns = [*range(len(items)), *[NO_MORE] * self.processes]
            os.write(self._filled, struct.pack(f"{len(turns)}i", *turns))
        answers = {index: function(items[index]) for index in self._taken(len(items), kept)}
        held = [set(answers)]
        for link in self._forks:
            theirs = link.receive(known)
            if theirs is None or theirs[0] != call:
                self.end()
                break
            _, good, answer_or_error = theirs
            if not good:
                raise answer_or_error
            held.append(set(answer_or_error))
            answers |= answer_or_error
        # what a fork had that ended without an answer is computed here
        everything = [
            answers[index] if index in answers else function(item) for index, item in enumerate(items)
        ]
        for link, its in zip(self._forks, held[1:], strict=False):
            rest = {index: each for index, each in enumerate(everything) if index not in its}
            if not link.send((call, rest), known):
                self.end()
                break
        return everything

    def _as_fork(
        self,
        parent: _Link,
        call: tuple[int, int, int],
        function: Callable[[Item], Found],
        items: Sequence[Item],
        known: Sequence[object],
        kept: bool,
    ) -> list[Found]:
        try:
            answers = {index: function(items[index]) for index in self._taken(len(items), kept)}
        except Exception as error:
            parent.send((call, False, error), known)
            os._exit(0)
        rest = parent.receive(known) if parent.send((call, True, answers), known) else None
        if rest is None or rest[0] != call:
            os._exit(0)
        answers |= rest[1]
        return [answers[index] for index in range(len(items))]

    def _taken(self, count: int, kept: bool) -> Iterator[int]:
        """The indices of the items that this process takes."""
        if kept:
            yield from range(self._place, count, self.processes)
            return
        while turn := os.read(self._turns, struct.calcsize("i")):
            (index,) = struct.unpack("i", turn)
            if index == NO_MORE:
                return
            yield index

    def end(self) -> None:
        """End the forks, whatever they compute. A fork itself ends here, without the duties of the process that was forked."""
        if self._parent is not None:
            os._exit(0)
        if self._forks:
            os.close(self._turns)
            os.close(self._filled)
        for link in self._forks:
            os.kill(link.process, signal.SIGKILL)
            os.waitpid(link.process, 0)
            link.close()
        self._forks, self.processes = [], 1


class _Link(NamedTuple):
    """Our ends of the pipes from and to another process."""

    process: int
    reading: BinaryIO
    writing: BinaryIO

    def send(self, message: object, known: Sequence[object]) -> bool:
        """Whether all of it went out."""
        try:
            _Pickler(self.writing, known).dump(message)
            self.writing.flush()
        except (OSError, pickle.PicklingError, TypeError, AttributeError):
            return False  # the other is gone, or this is nothing that can be sent
        return True

    def receive(self, known: Sequence[object]) -> Any:
        """What was sent; None where the other has ended."""
        try:
            return _Unpickler(self.reading, known).load()
        except (EOFError, OSError, pickle.UnpicklingError):
            return None

    def close(self) -> None:
        """Close our ends, whatever waits to go out."""
        self.reading.close()
        with suppress(OSError):
            self.writing.close()


def _unseen() -> None:
    """Let nobody hear of this process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group; the parent ends us
    nowhere = os.open(os.devnull, os.O_RDWR)
    for stream in range(3):
        os.dup2(nowhere, stream)
    os.close(nowhere)


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
