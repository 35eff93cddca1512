"""One mutant on trial: its tests run on it, and what fails there must hold on the unchanged code."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Self

from tests.mutants.fork_server import ROOMS, Outcome

LEFT_OUT = (".git", ".venv", "__pycache__", "artifacts", ".hypothesis", ".pytest_cache", "dist", "build")

WITHOUT_CLOCK = ("identify",)
"""rooms whose tests wait for no other process and no clock: what fails once there fails always"""


@dataclass(frozen=True)
class Verdict:
    """What became of one mutant.

    word : noticed; survived; untested (no test mirrors the module)
    test : the test that noticed it, or how the run of tests broke down
    """

    word: str
    seconds: float
    test: str = ""


class Checkout:
    """A copy of the checkout, beside what the tests look for next to it, and the process that runs tests in it."""

    def __init__(self, root: Path, scratch: Path) -> None:
        self.folder = scratch / "checkout"
        shutil.copytree(root, self.folder, ignore=shutil.ignore_patterns(*LEFT_OUT), symlinks=True)
        # Compiled once; by the sources' digests, so that a mutant written within the same second is compiled anew.
        command = [sys.executable, "-m", "compileall", "-q", "--invalidation-mode", "checked-hash", *ROOMS]
        subprocess.run(command, cwd=self.folder, check=True)
        measured = root.parent / "shared"
        if measured.is_dir():
            (scratch / "shared").symlink_to(measured)

    def __enter__(self) -> Self:
        # Processes that the tests start import the copy too, not the checkout that is installed.
        environment = os.environ | {
            "PYTHONPATH": str(self.folder),
            "PYTHONDONTWRITEBYTECODE": "1",
            "OPENBLAS_NUM_THREADS": "1",
        }
        self._server = subprocess.Popen(
            [sys.executable, "-m", "tests.mutants.fork_server"],
            cwd=self.folder,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self._server.stdout is not None
        assert self._server.stdout.readline() == "ready\n", "the server of forks did not start"
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        assert self._server.stdin is not None
        self._server.stdin.close()
        self._server.wait()

    def run(self, arguments: list[str], slowest: float, known: dict[str, float], budget: float) -> Outcome:
        """Run tests on the copy as it stands (`tests.mutants.fork_server.run`)."""
        assert self._server.stdin is not None
        assert self._server.stdout is not None
        request = {"arguments": arguments, "slowest": slowest, "known": known, "budget": budget}
        print(json.dumps(request), file=self._server.stdin, flush=True)
        return Outcome(**json.loads(self._server.stdout.readline()))


@dataclass
class Court:
    """Tries mutants, and remembers which tests hold on the unchanged code, and how long they take.

    slowest : s that a test may take of which nothing is known
    budget  : s of tests for one mutant
    """

    checkout: Checkout
    slowest: float
    budget: float
    seconds: dict[str, float] = field(default_factory=dict)
    holds: dict[str, bool] = field(default_factory=dict)

    def unfit(self) -> list[str]:
        """Tests that fail, or take too long, on the unchanged code: nobody notices anything by them."""
        return sorted(test for test, holds in self.holds.items() if not holds)

    def verdict(self, file: Path, mutated: bytes, tests: list[str]) -> Verdict:
        """Try one mutant.

        file : the module, relative to the checkout; tests : files that mirror it, the nearest first
        """
        if not tests:
            return Verdict("untested", 0.0)
        place = self.checkout.folder / file
        source = place.read_bytes()
        left_out, spent = self.unfit(), 0.0
        while True:
            place.write_bytes(mutated)
            try:
                arguments = [*tests, *(f"--deselect={test}" for test in left_out)]
                outcome = self._run(arguments, self.budget - spent)
                fails = outcome.word == "late" or (
                    outcome.word == "failed"
                    and (
                        file.parts[0] in WITHOUT_CLOCK
                        # once more, so that no dice are taken for notice
                        or self._run([outcome.test or tests[0]], self.budget).word != "passed"
                    )
                )
            finally:
                place.write_bytes(source)
            spent += outcome.spent
            if outcome.word not in ("failed", "late"):
                return Verdict("untested" if outcome.word == "empty" else "survived", spent)
            if fails and self._holds(outcome.test or tests[0]):
                return Verdict("noticed", spent, outcome.test or outcome.note)
            if outcome.test in left_out or spent > self.budget:
                return Verdict("survived", spent)
            left_out.append(outcome.test)

    def _run(self, arguments: list[str], budget: float) -> Outcome:
        outcome = self.checkout.run(arguments, self.slowest, self.seconds, budget)
        for test, seconds in outcome.seconds.items():
            self.seconds[test] = max(seconds, self.seconds.get(test, 0.0))
        return outcome

    def _holds(self, test: str) -> bool:
        """Whether a test passes on the unchanged code; one that passed on another mutant does."""
        if test not in self.holds:
            self.holds[test] = test in self.seconds or self._run([test], self.budget).word == "passed"
        return self.holds[test]
