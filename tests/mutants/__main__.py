"""Do the tests notice? `python -m tests.mutants [--sample N] [--seed S] [--module PATH]… [--budget SECONDS]`.

A seeded sample of small changes (an operator, a comparison, a constant) is drawn over the modules. Each is made in a copy of
the checkout, and the tests that mirror the module are run on it, until one fails or their time is up. Printed is what
nobody noticed. What of it may live, and why, stands in `tests/mutants/README.md`.
"""

from __future__ import annotations

import argparse
import random
import tempfile
from collections import Counter
from pathlib import Path

from tests.mutants.mirrors import mirrors
from tests.mutants.mutations import Mutation, mutations
from tests.mutants.trial import Checkout, Court

ROOT = Path(__file__).resolve().parents[2]
MODULES = ("identify", "daq", "drivers", "api/service")


def drawn(root: Path, modules: list[str], sample: int, seed: int) -> list[tuple[Path, Mutation]]:
    """The sample: module and mutation, in the order in which they are tried."""
    files = sorted(
        {
            file.relative_to(root)
            for name in modules
            for file in ([root / name] if (root / name).is_file() else (root / name).rglob("*.py"))
        }
    )
    every = [(file, mutation) for file in files for mutation in mutations((root / file).read_bytes())]
    return random.Random(seed).sample(every, min(sample, len(every)))


def main() -> None:
    """Draw, try, print the survivors and the counts by room."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--sample", type=int, default=200)
    parser.add_argument("--seed", type=int, default=2026)
    parser.add_argument("--module", action="append", help="a file or folder; may be repeated")
    parser.add_argument("--budget", type=float, default=150.0, help="s of tests for one mutant")
    parser.add_argument("--slowest", type=float, default=40.0, help="s for a test of which nothing is known")
    options = parser.parse_args()
    counts: Counter[tuple[str, str]] = Counter()
    with tempfile.TemporaryDirectory() as scratch, Checkout(ROOT, Path(scratch)) as checkout:
        court = Court(checkout, options.slowest, options.budget)
        # Everything is read in the copy: the checkout may be worked on meanwhile.
        copy = checkout.folder
        for file, mutation in drawn(copy, options.module or list(MODULES), options.sample, options.seed):
            source = (copy / file).read_bytes()
            mutated = mutation.apply(source)
            tests = [str(test.relative_to(copy)) for test in mirrors(file, copy / "tests")]
            verdict = court.verdict(file, mutated, tests)
            counts[file.parts[0], verdict.word] += 1
            line = mutation.line(source)
            was, now = (text.split(b"\n")[line - 1].decode().strip() for text in (source, mutated))
            print(f"{verdict.word:9} {verdict.seconds:5.1f} s  {file}:{line}  {verdict.test}", flush=True)
            if verdict.word != "noticed":
                print(f"    - {was}\n    + {now}", flush=True)
        for test in court.unfit():
            print(f"left out, since it fails on the unchanged code: {test}")
    for room in (*sorted({room for room, _ in counts}), ""):
        of_room = Counter[str]()
        for (each, word), count in counts.items():
            of_room[word] += count if each.startswith(room) else 0
        share = 100 * of_room["noticed"] / max(of_room.total(), 1)
        print(
            f"{room or 'all':9} {of_room['noticed']} of {of_room.total()} noticed ({share:.0f} %), {dict(of_room)}"
        )


if __name__ == "__main__":
    main()
