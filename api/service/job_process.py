"""One computation in a process of its own, so that it can be cancelled at any moment and never holds up the
service.

Measured (benchmarks/service_responsiveness.py): NumPy work in a thread of the service delays its answers by
the interpreter lock; a process leaves them alone. The processes are forked from a server process that has
`identify` loaded already, so that one starts in some 20 ms instead of a second.
"""

import errno
import importlib
import logging
import multiprocessing
import multiprocessing.forkserver
import os
import signal
import time
from collections.abc import Callable, Mapping
from multiprocessing.connection import Connection
from typing import Any

from api.computing import Computing
from api.service.problems import Problem
from api.service.process_limits import ProcessLimits, ended_by
from identify.recording.errors import InputError

Arguments = Mapping[str, object]
"""Keyword arguments of a computation, by name; they are pickled."""

Progress = Callable[[float, str], None]
"""progress(fraction of 0 to 1, words); raises `Cancelled` once the computation is to stop."""

NICENESS = 10
"""Computations give way to the acquisition and to the service."""
THREADS_OF_LINEAR_ALGEBRA = "1"
"""BLAS threads of one computation; more would take the core that the acquisition needs."""


LONGEST_START = 120.0
"""s on the wall for a process to be there with its code loaded; a busy machine may take long over it, which is no fault of what
is read then."""


class Cancelled(Exception):
    """Raised inside a computation by its progress function after somebody cancelled it."""


def _context() -> Any:
    if not os.environ.get("OPENBLAS_NUM_THREADS"):
        os.environ["OPENBLAS_NUM_THREADS"] = (
            THREADS_OF_LINEAR_ALGEBRA  # read when the fork server loads NumPy
        )
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(
        ["api.service.computations", "api.service.upload_reader", "api.service.session_samples"]
    )
    return context


def load_identifier_ahead() -> None:
    """Start the fork server now, so that the first job does not wait for `identify` to be loaded."""
    _context()
    multiprocessing.forkserver.ensure_running()


class JobProcess:
    """A running computation.

    function  : `module:name` of a function `f(progress, **arguments)` whose result can be pickled
    arguments : its keyword arguments
    limits    : what the process may take
    computing : where it reduces sessions
    """

    def __init__(
        self, function: str, arguments: Arguments, limits: ProcessLimits, computing: Computing | None = None
    ) -> None:
        context = _context()
        self._limits = limits
        self._receiver, sender = context.Pipe(duplex=False)
        self._stop = context.Event()
        self._process = context.Process(
            target=_work,
            args=(sender, self._stop, function, arguments, limits, computing or Computing()),
            daemon=True,
        )
        self._process.start()
        self._deadline = time.monotonic() + LONGEST_START + limits.seconds
        sender.close()

    def message(self, timeout: float) -> tuple[str, Any] | None:
        """The next message within `timeout` s; None if there is none yet.

        `progress` (fraction, words); or the last one: `result`, `wrong` (the input; one line), `refused` (status, words),
        `exceeded` (words: a limit), `died` (words: a signal), `failed` (words), `cancelled`.
        """
        left = self._deadline - time.monotonic()
        if not self._receiver.poll(max(0.0, min(timeout, left))):
            return ("exceeded", self._limits.time_words) if left < timeout else None
        try:
            message = self._receiver.recv()
        except EOFError:
            self._process.join()
            status = self._process.exitcode
            if status == -signal.SIGXCPU:
                return "exceeded", self._limits.time_words
            return "died", ended_by(status)
        if message[0] == "begun":
            self._deadline = time.monotonic() + self._limits.seconds
            return None
        # Without this a computation that never ceases to report would have no time limit on the wall.
        late = left <= 0 and message[0] == "progress"
        return ("exceeded", self._limits.time_words) if late else message

    def cancel(self) -> None:
        """Ask the computation to stop at its next report of progress."""
        self._stop.set()

    def end(self) -> None:
        """End the process, whatever it does, and give its resources back."""
        self._process.kill()
        self._process.join()
        self._process.close()
        self._receiver.close()


def _work(
    sender: Connection,
    stop: Any,
    function: str,
    arguments: Arguments,
    limits: ProcessLimits,
    computing: Computing,
) -> None:
    os.nice(NICENESS)

    def say(kind: str, what: Any) -> None:
        try:
            sender.send((kind, what))
        except BrokenPipeError:  # the service was killed: nobody is left to compute for, or to be told
            raise SystemExit(1) from None

    def progress(fraction: float, step: str) -> None:
        if stop.is_set():
            raise Cancelled
        say("progress", (float(fraction), str(step)))

    module, _, name = function.partition(":")
    try:
        computation = getattr(importlib.import_module(module), name)
        say("begun", None)
        limits.apply()
        with computing():
            result = computation(progress, **arguments)
    except Cancelled:
        say("cancelled", None)
    except InputError as error:
        say("wrong", str(error))
    except Problem as problem:
        say("refused", (problem.status, problem.detail))
    except MemoryError:
        say("exceeded", limits.memory_words)
    except Exception as error:
        say(*_failure(error, limits))
    else:
        say("result", result)


def _failure(error: Exception, limits: ProcessLimits) -> tuple[str, str]:
    detail = " ".join(str(error).split())
    if isinstance(error, OSError) and error.errno == errno.EFBIG:
        return "exceeded", f"it writes more than {limits.written} bytes into one file"
    if isinstance(error, OSError) and error.errno == errno.EMFILE:
        return "exceeded", f"it opens more than {limits.descriptors} files at the same time"
    logging.getLogger(__name__).error("a computation failed", exc_info=error)
    return "failed", f"{type(error).__name__}: {detail}"
