"""What a reader of other people's files may take, and what is said when it takes more."""

import os
import threading
from types import SimpleNamespace

import pytest

from api.service import confined_reader, job_process
from api.service.confined_reader import ConfinedReader
from api.service.problems import Problem
from api.service.process_limits import MEBIBYTE, LimitExceeded, ProcessLimits
from identify.recording.errors import InputError

WORK = """
import ctypes, os, signal, time
import numpy as np
from identify.recording.errors import InputError

def takes_memory(progress):
    return len(bytearray(10 << 30))

def takes_memory_in_an_array(progress):
    return np.ones(1 << 30).sum()

def hangs(progress):
    signal.pause()

def computes_for_ever(progress):
    while True:
        progress(0.5, "still at it")

def opens_many_files(progress):
    kept = [open("/dev/null") for _ in range(10_000)]
    return len(kept)

def writes_much(progress, target):
    with open(target, "wb") as stream:
        for _ in range(100):
            stream.write(bytes(1 << 20))

def breaks_the_interpreter(progress):
    ctypes.string_at(0)

def fails(progress):
    return {}["nothing"]

def wrong(progress):
    raise InputError("a.csv line 3: not a number")

def answers(progress, value):
    return value + 1

def waits_for(progress, file):
    while not os.path.exists(file):
        time.sleep(0.005)
    return True
"""


@pytest.fixture
def work(tmp_path, monkeypatch):
    """A module of computations that the processes can import."""
    (tmp_path / "reading_of_these_tests.py").write_text(WORK)
    monkeypatch.syspath_prepend(str(tmp_path))
    return "reading_of_these_tests"


def reader(seconds=20.0, simultaneous=2):
    limits = ProcessLimits(memory=256 * MEBIBYTE, seconds=seconds, descriptors=64, written=2 * MEBIBYTE)
    return ConfinedReader(limits, simultaneous)


def test_what_is_read_comes_back(work):
    assert reader()(f"{work}:answers", value=3) == 4


@pytest.mark.parametrize(
    ("function", "words"),
    [
        ("takes_memory", "more than 0.25 GB of memory"),
        ("takes_memory_in_an_array", "more than 0.25 GB of memory"),
        ("opens_many_files", "more than 64 files"),
    ],
)
def test_a_reader_that_takes_too_much_is_ended_in_words(work, function, words):
    with pytest.raises(LimitExceeded, match=words):
        reader()(f"{work}:{function}")


def test_a_reader_that_writes_too_much_is_ended_in_words(work, tmp_path):
    with pytest.raises(LimitExceeded, match="more than 2097152 bytes"):
        reader()(f"{work}:writes_much", target=str(tmp_path / "much"))
    assert (tmp_path / "much").stat().st_size <= 2 * MEBIBYTE


@pytest.fixture
def started(monkeypatch):
    """Process ids of the readers, as they are started."""
    ids = []

    class Started(job_process.JobProcess):
        def __init__(self, *arguments):
            super().__init__(*arguments)
            ids.append(self._process.pid)

    monkeypatch.setattr(confined_reader, "JobProcess", Started)
    return ids


@pytest.mark.parametrize("function", ["hangs", "computes_for_ever"])
def test_a_reader_that_does_not_end_is_ended(work, function, started):
    with pytest.raises(LimitExceeded, match=r"not done within 1\.5 s"):
        reader(seconds=1.5)(f"{work}:{function}")
    (process,) = started
    with pytest.raises(ProcessLookupError):
        os.kill(process, 0)


@pytest.mark.parametrize(
    ("function", "words"),
    [
        ("breaks_the_interpreter", "SIGSEGV"),
        ("fails", "KeyError: 'nothing'"),
        ("wrong", "^a.csv line 3: not a number$"),
    ],
)
def test_a_reader_that_dies_or_fails_says_that_the_input_is_wrong(work, function, words):
    with pytest.raises(InputError, match=words):
        reader()(f"{work}:{function}")


def test_the_time_that_a_busy_machine_takes_to_start_a_process_is_no_reading(work, tmp_path, monkeypatch):
    """A clock that stands at the limit by the time that the code is loaded."""
    now = [0.0]
    monkeypatch.setattr(job_process, "time", SimpleNamespace(monotonic=lambda: now[0]))
    go = tmp_path / "go"
    (tmp_path / "slow_to_load.py").write_text(
        f"import os\nwhile not os.path.exists({str(go)!r}):\n    pass\n\n\ndef answers(progress):\n    return 2\n"
    )
    process = job_process.JobProcess("slow_to_load:answers", {}, ProcessLimits(256 * MEBIBYTE, 5.0))
    try:
        now[0] = 100.0
        go.touch()
        messages = []
        while not messages or messages[-1] is None:
            messages.append(process.message(4.0))
        assert messages[-1] == ("result", 2)
        assert process._deadline == 105.0
    finally:
        process.end()


def test_no_more_read_at_the_same_time_than_may(work, tmp_path):
    """The second waits as long as a reading may take, and hears then that others read."""
    read = reader(seconds=20.0, simultaneous=1)
    go = tmp_path / "go"
    first = threading.Thread(target=read, args=(f"{work}:waits_for",), kwargs={"file": str(go)})
    first.start()
    read.limits = ProcessLimits(256 * MEBIBYTE, 0.2)
    while read._free._value:
        pass
    with pytest.raises(Problem) as refused:
        read(f"{work}:answers", value=1)
    assert refused.value.status == 503
    go.touch()
    first.join()
    read.limits = ProcessLimits(256 * MEBIBYTE, 20.0)
    assert read(f"{work}:answers", value=1) == 2
