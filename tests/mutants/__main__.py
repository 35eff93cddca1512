"""Do the tests notice? `python -m tests.mutants [--sample N] [--seed S] [--module PATH]… [--budget SECONDS] [--record FILE]`.

A seeded sample of small changes (an operator, a comparison, a constant) is drawn over the modules. Each is made in a copy of
the checkout, and the tests that mirror the module are run on it, until one fails or their time is up. Printed is what
nobody noticed. What of it may live, and why, stands in `tests/mutants/README.md`.

With `--record` each verdict is kept in a file, and a mutant that stands there is not tried again: a run that was stopped is
carried on, and after new tests only the survivors are tried (`--again`).
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections import Counter
from dataclasses import asdict, dataclass
from hashlib import sha256
from pathlib import Path
from typing import Self

from tests.mutants.mirrors import mirrors
from tests.mutants.mutations import Mutation, mutations
from tests.mutants.trial import Checkout, Court, Verdict

ROOT = Path(__file__).resolve().parents[2]
MODULES = ("identify", "daq", "drivers", "api/service")


@dataclass(frozen=True)
class Drawn:
    """One mutation of the sample.

    identity : tells it from every other; the same as long as its line, and how often that stands above, are the same
    """

    file: Path
    mutation: Mutation
    identity: str


def drawn(root: Path, modules: list[str], sample: int, seed: int) -> list[Drawn]:
    """The sample, by module in the order in which they are named.

    Every mutation has a rank that follows from the seed and its own identity, and the lowest ranks are drawn. So a change
    of one module changes what is drawn of that module, and nothing else of the sample but at its edge.
    """
    every: list[Drawn] = []
    for name in modules:
        for path in [root / name] if (root / name).is_file() else sorted((root / name).rglob("*.py")):
            file, source, seen = path.relative_to(root), path.read_bytes(), Counter[str]()
            for mutation in mutations(source):
                begin = source.rfind(b"\n", 0, mutation.start) + 1
                end = source.find(b"\n", mutation.stop)
                now = source[begin : mutation.start] + mutation.new.encode() + source[mutation.stop : end]
                change = f"{file} - {source[begin:end].decode().strip()} + {now.decode().strip()}"
                every.append(Drawn(file, mutation, f"{change} #{seen[change]}"))
                seen[change] += 1
    chosen = sorted(every, key=lambda each: sha256(f"{seed} {each.identity}".encode()).digest())[:sample]
    identities = {each.identity for each in chosen}
    return [each for each in every if each.identity in identities]


class Record:
    """Verdicts that are kept in a file, one JSON object a line; the last of a mutant counts."""

    def __init__(self, path: Path | None) -> None:
        self._path = path
        self.verdicts: dict[str, Verdict] = {}
        if path is not None and path.exists():
            for line in path.read_text(encoding="utf-8").splitlines():
                entry = json.loads(line)
                identity = entry.pop("identity")
                self.verdicts[identity] = Verdict(**entry)

    @classmethod
    def of(cls, name: str | None) -> Self:
        """The record in a file; of none, one that is kept nowhere."""
        return cls(Path(name).resolve() if name else None)

    def keep(self, identity: str, verdict: Verdict) -> None:
        """Add a verdict."""
        self.verdicts[identity] = verdict
        if self._path is not None:
            with self._path.open("a", encoding="utf-8") as file:
                file.write(json.dumps({"identity": identity, **asdict(verdict)}) + "\n")


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
    parser.add_argument("--record", help="file of verdicts; what stands there is not tried again")
    parser.add_argument("--again", action="store_true", help="try again what the record says nobody noticed")
    parser.add_argument(
        "--list", action="store_true", help="print the sample and what the record says, try nothing"
    )
    options = parser.parse_args()
    record, counts = Record.of(options.record), Counter[tuple[str, str]]()
    with tempfile.TemporaryDirectory() as scratch, Checkout(ROOT, Path(scratch)) as checkout:
        court = Court(checkout, options.slowest, options.budget)
        # Everything is read in the copy: the checkout may be worked on meanwhile.
        copy = checkout.folder
        for each in drawn(copy, options.module or list(MODULES), options.sample, options.seed):
            source = (copy / each.file).read_bytes()
            mutated = each.mutation.apply(source)
            verdict = record.verdicts.get(each.identity)
            if not options.list and (verdict is None or (options.again and verdict.word != "noticed")):
                tests = [str(test.relative_to(copy)) for test in mirrors(each.file, copy / "tests")]
                verdict = court.verdict(each.file, mutated, tests)
                record.keep(each.identity, verdict)
            verdict = verdict or Verdict("not tried", 0.0)
            counts[each.file.parts[0], verdict.word] += 1
            line = each.mutation.line(source)
            was, now = (text.split(b"\n")[line - 1].decode().strip() for text in (source, mutated))
            print(
                f"{verdict.word:9} {verdict.seconds:5.1f} s  {each.file}:{line}  {verdict.test}", flush=True
            )
            if verdict.word != "noticed":
                print(f"    - {was}\n    + {now}", flush=True)
        for test in court.unfit():
            print(f"left out, since it fails on the unchanged code: {test}")
    for room in (*sorted({room for room, _ in counts}), ""):
        of_room = Counter[str]()
        for (each_room, word), count in counts.items():
            of_room[word] += count if each_room.startswith(room) else 0
        share = 100 * of_room["noticed"] / max(of_room.total(), 1)
        print(
            f"{room or 'all':9} {of_room['noticed']} of {of_room.total()} noticed ({share:.0f} %), {dict(of_room)}"
        )


if __name__ == "__main__":
    main()
