"""Runs tests in forks of a process that has imported everything that is not ours.

Started by `tests.mutants` in the copy of the checkout. Starting Python and importing numpy, scipy, pydantic, hypothesis and
the web framework takes longer than most tests; here that is done once. Our own modules are imported in the fork, from the
copy as it stands at that moment, so that whoever imported a mutated module has the mutated one.

One request a line on the standard input, `{"arguments": […], "slowest": seconds, "known": {test: seconds}, "budget": seconds}`;
one answer a line, an `Outcome` as JSON.
"""

from __future__ import annotations

import ctypes
import importlib
import json
import os
import pkgutil
import resource
import select
import signal
import sys
import time
import warnings
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any, Literal

import pytest
from hypothesis import Phase, settings

ROOMS = ("api", "daq", "drivers", "identify")
FOR_TESTS = ("hypothesis", "hypothesis.strategies", "hypothesis.extra.numpy", "fastapi.testclient", "httpx")
PATIENCE = 6.0
PR_SET_CHILD_SUBREAPER = 36
"""<linux/prctl.h>"""
MEMORY = 6 << 30
"""bytes that a mutant may have: one that asks for more fails instead of taking the machine's"""
OPTIONS = ("-x", "-q", "-p", "no:cacheprovider", "-W", "ignore::pytest.PytestAssertRewriteWarning")
MARKED = ("-m", "not browser and not vcan")


@dataclass
class Outcome:
    """What became of one run of tests.

    word    : passed, failed, late (one test took too long), stopped (the budget was up; all passed until then)
    test    : node of the test, or of the file, that failed or was late; empty where it is not known
    seconds : time that each test took which passed
    spent   : s, all in all
    note    : how the run ended, where no test says it
    """

    word: Literal["passed", "failed", "late", "stopped", "empty"]
    test: str = ""
    seconds: dict[str, float] = field(default_factory=dict)
    spent: float = 0.0
    note: str = ""


class Reporter:
    """A pytest plug-in that writes to a pipe which test begins, passes and fails."""

    def __init__(self, pipe: int) -> None:
        self._pipe = pipe

    def _say(self, word: str, node: str) -> None:
        os.write(self._pipe, f"{word}\t{node}\n".encode())

    def pytest_sessionstart(self) -> None:
        """An example that fails is not made smaller, which may take minutes: that it fails is all that is asked."""
        phases = (Phase.explicit, Phase.generate)
        settings.register_profile("mutants", settings(), phases=phases)
        settings.load_profile("mutants")

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        """A test begins."""
        self._say("begin", nodeid)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """A phase of a test ended."""
        if report.failed:
            self._say("failed", report.nodeid)
        elif report.when == "teardown":
            self._say("passed", report.nodeid)

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """A file could not be imported."""
        if report.failed:
            self._say("failed", report.nodeid)


def preload() -> None:
    """Import what our modules, pytest's plug-ins and the tests import of others."""
    reading, writing = os.pipe()
    pid = os.fork()
    if pid == 0:
        with suppress(BaseException):
            warnings.simplefilter("ignore")
            for room in ROOMS:
                for module in pkgutil.walk_packages([room], f"{room}."):
                    if not module.name.endswith("__main__"):
                        importlib.import_module(module.name)
        os.write(writing, "\n".join(sys.modules).encode())
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading) as names:
        loaded = names.read().splitlines()
    os.waitpid(pid, 0)
    theirs = [name for name in loaded if name.partition(".")[0] not in (*ROOMS, "tests", "__main__")]
    plugins = [plugin.module for plugin in entry_points(group="pytest11")]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for name in (*theirs, *plugins, *FOR_TESTS):
            with suppress(Exception):
                importlib.import_module(name)


def run(arguments: list[str], slowest: float, known: dict[str, float], budget: float) -> Outcome:
    """Run pytest in a fork until a test fails, one takes longer than it may, or the budget is up.

    slowest : s that a test may take of which nothing is known
    known   : s that tests took when they passed; such a test may take four times that and ten seconds, at least
    budget  : s for all

    Seconds are those that the process computed, so that a busy machine condemns nobody; a process that waits for others is
    allowed `PATIENCE` times as many of the clock.
    """
    reading, writing = os.pipe()
    pid = os.fork()
    if pid == 0:
        os.close(reading)
        _become(writing, arguments)
    os.close(writing)
    try:
        watch = Stopwatch(pid)
        outcome = _follow(reading, watch, slowest, known, budget)
        outcome.spent = watch()
        return outcome
    finally:
        end_all_children()
        os.close(reading)


def adopt_orphans() -> None:
    """Make this process the parent of whatever its descendants leave behind (prctl(2), PR_SET_CHILD_SUBREAPER)."""
    if ctypes.CDLL(None, use_errno=True).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0) != 0:
        raise OSError(ctypes.get_errno(), "prctl(PR_SET_CHILD_SUBREAPER)")


def end_all_children() -> None:
    """Kill this process's children until there are none: a mutant's own processes end with it.

    Acquisition processes lead sessions of their own, which the signal to a process group does not reach. Whose parent is
    killed becomes a child of this process (`adopt_orphans`), so that the next round meets it.
    """
    while children := _children():
        for child in children:
            os.kill(child, signal.SIGKILL)  # a child that has ended keeps its number until it is waited for
        for child in children:
            os.waitpid(child, 0)


def _children() -> list[int]:
    """Processes whose parent is this one (proc(5): `children` of every thread)."""
    lists = Path("/proc/self/task").glob("*/children")
    return [int(child) for children in lists for child in children.read_text().split()]


def _become(pipe: int, arguments: list[str]) -> None:
    """In the fork: pytest, in a process group of its own, heard by nobody but the pipe."""
    status = 70
    try:
        os.setsid()
        null = os.open(os.devnull, os.O_RDWR)
        for stream in (0, 1, 2):
            os.dup2(null, stream)
        resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))
        os.set_inheritable(pipe, False)
        status = int(pytest.main([*OPTIONS, *MARKED, *arguments], plugins=[Reporter(pipe)]))
        os.write(pipe, f"ended\t{status}\n".encode())
    finally:
        os._exit(status)


class Stopwatch:
    """Seconds of a process: what it computed, or a share of the clock's, whichever is more."""

    def __init__(self, pid: int) -> None:
        self._stat = Path(f"/proc/{pid}/stat")
        self._begun = time.monotonic()

    def __call__(self) -> float:
        """Seconds since the process began."""
        # proc(5): utime, stime, and those of its children that have ended, are fields 14 to 17; the name may hold blanks
        fields = self._stat.read_text().rpartition(")")[2].split()
        computed = sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")
        return max(computed, (time.monotonic() - self._begun) / PATIENCE)


def _follow(pipe: int, now: Stopwatch, slowest: float, known: dict[str, float], budget: float) -> Outcome:
    """Read what a fork reports until it has ended or must end."""
    outcome = Outcome("failed")
    begun, test, rest = 0.0, "", b""
    while True:
        if not select.select([pipe], [], [], 0.5)[0]:
            spent = now()
            late = spent - begun > (
                max(slowest, 4.0 * known.get(test, 0.0) + 10.0) if test else 2.0 * slowest
            )
            if late or spent > budget:
                outcome.word, outcome.test = ("late", test) if late else ("stopped", "")
                return outcome
            continue
        piece = os.read(pipe, 1 << 16)
        if not piece:  # it died without a word
            outcome.test, outcome.note = test, "the process died"
            return outcome
        *lines, rest = (rest + piece).split(b"\n")
        for line in lines:
            word, _, node = line.decode().partition("\t")
            if word == "begin":
                begun, test = now(), node
            elif word == "passed":
                outcome.seconds[node] = now() - begun
                begun, test = now(), ""
            elif word == "failed":
                outcome.test = node
                return outcome
            else:
                outcome.word = {"0": "passed", "5": "empty"}.get(node, "failed")
                outcome.note = f"pytest ended with status {node}"
                return outcome
        if now() > budget:
            outcome.word = "stopped"
            return outcome


def main() -> None:
    """Answer requests until the input ends."""
    adopt_orphans()
    preload()
    print("ready", flush=True)
    for line in sys.stdin:
        request: dict[str, Any] = json.loads(line)
        print(json.dumps(asdict(run(**request))), flush=True)


if __name__ == "__main__":
    main()
