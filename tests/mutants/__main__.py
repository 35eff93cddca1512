"""Do the tests notice? `python -m tests.mutants [--sample N] [--seed S] [--module PATH]… [--limit SECONDS]`.

A seeded sample of small changes (an operator, a comparison, a constant) is drawn over the modules. Each is made in a copy of
the checkout, and the tests that mirror the module are run on it, until one fails or their time is up. Printed is what
nobody noticed. What of it may live, and why, stands in `tests/mutants/README.md`.
"""

from __future__ import annotations

import argparse
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from tests.mutants.mirrors import mirrors
from tests.mutants.mutations import Mutation, mutations

ROOT = Path(__file__).resolve().parents[2]
MODULES = ("identify", "daq", "drivers", "api/service")
LEFT_OUT = (".git", ".venv", "__pycache__", "artifacts", ".hypothesis", ".pytest_cache", "dist", "build")


@dataclass(frozen=True)
class Verdict:
    """What became of one mutant: noticed, survived, late (the time was up), or untested."""

    word: str
    seconds: float


def drawn(modules: list[str], sample: int, seed: int) -> list[tuple[Path, Mutation]]:
    """The sample: module and mutation, in the order in which they are tried."""
    files = sorted(
        {
            file.relative_to(ROOT)
            for name in modules
            for file in ([ROOT / name] if (ROOT / name).is_file() else (ROOT / name).rglob("*.py"))
        }
    )
    every = [(file, mutation) for file in files for mutation in mutations((ROOT / file).read_bytes())]
    return random.Random(seed).sample(every, min(sample, len(every)))


def run(copy: Path, files: list[Path], limit: float) -> Verdict:
    """Run test files one after the other in the copy, until one fails or the time is up."""
    if not files:
        return Verdict("untested", 0.0)
    began = time.monotonic()
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "-p", "no:rerunfailures"]
    command += ["-m", "not browser and not vcan", *(str(file.relative_to(ROOT)) for file in files)]
    environment = os.environ | {"PYTHONDONTWRITEBYTECODE": "1"}
    with subprocess.Popen(
        command,
        cwd=copy,
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    ) as process:
        try:
            status = process.wait(limit)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, 9)
            return Verdict("late", time.monotonic() - began)
    # 5: no test was left by the selection
    word = {0: "survived", 5: "untested"}.get(status, "noticed")
    return Verdict(word, time.monotonic() - began)


def prepared(scratch: Path) -> Path:
    """A copy of the checkout, beside what the tests look for next to it."""
    copy = scratch / "checkout"
    shutil.copytree(ROOT, copy, ignore=shutil.ignore_patterns(*LEFT_OUT), symlinks=True)
    # Compiled once; by the sources' digests, so that a mutant written within the same second is compiled anew.
    rooms = [*sorted({name.split("/")[0] for name in MODULES}), "tests"]
    command = [sys.executable, "-m", "compileall", "-q", "--invalidation-mode", "checked-hash", *rooms]
    subprocess.run(command, cwd=copy, check=True)
    measured = ROOT.parent / "shared"
    if measured.is_dir():
        (scratch / "shared").symlink_to(measured)
    return copy


def main() -> None:
    """Draw, try, print the survivors and the count."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--sample", type=int, default=200)
    parser.add_argument("--seed", type=int, default=2026)
    parser.add_argument("--module", action="append", help="a file or folder; may be repeated")
    parser.add_argument("--limit", type=float, default=120.0, help="s for the tests of one mutant")
    options = parser.parse_args()
    counts: dict[str, int] = {}
    with tempfile.TemporaryDirectory() as scratch:
        copy = prepared(Path(scratch))
        for file, mutation in drawn(options.module or list(MODULES), options.sample, options.seed):
            source = (ROOT / file).read_bytes()
            mutated = mutation.apply(source)
            (copy / file).write_bytes(mutated)
            verdict = run(copy, mirrors(file, ROOT / "tests"), options.limit)
            (copy / file).write_bytes(source)
            counts[verdict.word] = counts.get(verdict.word, 0) + 1
            line = mutation.line(source)
            was, now = (text.split(b"\n")[line - 1].decode().strip() for text in (source, mutated))
            print(f"{verdict.word:9} {verdict.seconds:5.0f} s  {file}:{line}", flush=True)
            if verdict.word != "noticed":
                print(f"    - {was}\n    + {now}", flush=True)
    tried = sum(counts.values())
    noticed = counts.get("noticed", 0)
    print(f"{noticed} of {tried} noticed ({100 * noticed / max(tried, 1):.0f} %), {counts}")


if __name__ == "__main__":
    main()
