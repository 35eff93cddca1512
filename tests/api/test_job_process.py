"""What a computation's process says, how long it may, and what becomes of what goes wrong in it."""

import errno
import multiprocessing
import os
import signal
import threading
from types import SimpleNamespace

import pytest

from api.computing import Computing
from api.service import job_process
from api.service.job_process import LONGEST_START, Cancelled, JobProcess
from api.service.problems import Problem
from api.service.process_limits import GIBIBYTE, ProcessLimits
from identify.recording.errors import InputError

LIMITS = ProcessLimits(memory=2 * GIBIBYTE, seconds=30.0, descriptors=64, written=5000)


class Pipe:
    """What a process has sent: a message, or that it has ended."""

    def __init__(self, *messages) -> None:
        self.messages = list(messages)
        self.waited: list[float] = []

    def poll(self, timeout: float) -> bool:
        self.waited.append(timeout)
        return bool(self.messages)

    def recv(self):
        message = self.messages.pop(0)
        if message is EOFError:
            raise EOFError
        return message


@pytest.fixture
def job(monkeypatch):
    """A job whose process and clock are ours: `job.sends(…)`, `job.now`."""
    pipe, clock = Pipe(), SimpleNamespace(now=1000.0)
    process = SimpleNamespace(start=lambda: None, join=lambda: None, exitcode=0)
    context = SimpleNamespace(
        Pipe=lambda duplex: (pipe, SimpleNamespace(close=lambda: None)),
        Event=lambda: None,
        Process=lambda **what: process,
    )
    monkeypatch.setattr(job_process, "_context", lambda: context)
    monkeypatch.setattr(job_process, "time", SimpleNamespace(monotonic=lambda: clock.now))
    made = JobProcess("module:function", {}, LIMITS)
    made.clock, made.pipe, made.process = clock, pipe, process
    return made


def test_the_start_has_a_time_of_its_own_and_the_computation_its_limit_from_its_begin(job):
    longest = LONGEST_START + LIMITS.seconds
    assert job.message(1.0) is None
    job.clock.now = 1000.0 + longest - 0.5
    assert job.message(0.25) is None
    assert job.message(1.0) == ("exceeded", "it was not done within 30 s, which is the most it may take")
    assert job.pipe.waited == [1.0, 0.25, 0.5]
    job.pipe.messages = [("begun", None)]
    assert job.message(1.0) is None
    job.clock.now += 29.0
    assert job.message(0.5) is None
    job.clock.now += 0.75
    assert job.message(0.5)[0] == "exceeded"


def test_progress_past_the_limit_is_too_late_and_a_result_is_not(job):
    job.pipe.messages = [("begun", None), ("progress", (0.5, "a")), ("progress", (0.6, "b")), ("result", 7)]
    assert job.message(1.0) is None
    job.clock.now += LIMITS.seconds - 1e-3
    assert job.message(1.0) == ("progress", (0.5, "a"))
    job.clock.now += 1e-3
    assert job.message(1.0) == ("exceeded", LIMITS.time_words)
    assert job.message(1.0) == ("result", 7)
    assert min(job.pipe.waited) == 0.0


@pytest.mark.parametrize(
    ("status", "message"),
    [
        (-signal.SIGXCPU, ("exceeded", "it was not done within 30 s, which is the most it may take")),
        (-signal.SIGKILL, ("died", "the process was ended by SIGKILL")),
        (3, ("died", "the process ended with status 3")),
    ],
)
def test_a_process_that_ends_without_a_result_is_told_by_its_status(job, status, message):
    job.process.exitcode = status
    job.pipe.messages = [EOFError]
    assert job.message(1.0) == message


@pytest.fixture
def work(monkeypatch):
    """Runs a computation as the process does, here; what it sends."""
    niceness, entered = [], []
    monkeypatch.setattr(job_process.os, "nice", niceness.append)
    monkeypatch.setattr(ProcessLimits, "apply", lambda limits: entered.append(limits))

    def run(computation, stopped=False, **arguments):
        sent = []
        module = SimpleNamespace(computation=computation)
        monkeypatch.setattr(job_process.importlib, "import_module", lambda name: module)
        job_process._work(
            SimpleNamespace(send=sent.append),
            SimpleNamespace(is_set=lambda: stopped),
            "somewhere:computation",
            arguments,
            LIMITS,
            Computing(),
        )
        assert niceness == [10]
        assert entered == [LIMITS]
        assert sent[0] == ("begun", None)
        return sent[1:]

    return run


def test_a_computation_tells_its_progress_and_its_result(work):
    def doubled(progress, value):
        progress(1, "half of it")
        return 2 * value

    assert work(doubled, value=21) == [("progress", (1.0, "half of it")), ("result", 42)]


def test_a_computation_that_is_to_stop_stops_at_its_next_report(work):
    assert work(lambda progress: progress(0.5, "still at it"), stopped=True) == [("cancelled", None)]


def raised(error):
    def computation(progress):
        raise error

    return computation


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (InputError("a.csv line 3: not a number"), ("wrong", "a.csv line 3: not a number")),
        (Problem(413, "too large"), ("refused", (413, "too large"))),
        (MemoryError(), ("exceeded", "it needs more than 2 GB of memory, which is the most it may have")),
        (
            OSError(errno.EFBIG, "File too large"),
            ("exceeded", "it writes more than 5000 bytes into one file"),
        ),
        (OSError(errno.EMFILE, "Too many"), ("exceeded", "it opens more than 64 files at the same time")),
        (OSError(errno.EIO, "I/O\nerror"), ("failed", "OSError: [Errno 5] I/O error")),
        (KeyError("nothing"), ("failed", "KeyError: 'nothing'")),
        (Cancelled(), ("cancelled", None)),
    ],
)
def test_what_goes_wrong_is_said_in_one_line(work, error, message):
    assert work(raised(error)) == [message]


def test_linear_algebra_has_one_thread_unless_somebody_says_otherwise(monkeypatch):
    for given, used in (("", "1"), ("4", "4")):
        monkeypatch.setenv("OPENBLAS_NUM_THREADS", given)
        job_process._context()
        assert os.environ["OPENBLAS_NUM_THREADS"] == used


def test_a_computation_whose_service_is_gone_ends_without_a_word(monkeypatch, caplog):
    receiver, sender = multiprocessing.Pipe(duplex=False)
    receiver.close()
    monkeypatch.setattr(os, "nice", lambda _steps: 0)
    with sender, pytest.raises(SystemExit):
        job_process._work(sender, threading.Event(), "math:sqrt", {}, LIMITS, Computing())
    assert caplog.records == []
