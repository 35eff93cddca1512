"""Does another checkout of this software compute the same figures, to 1e-9 of each?

    python benchmarks/same_figures.py OTHER_CHECKOUT [EXPERIMENT_FOLDER …] [--commands identify diagnose improve]

For a change that is to change no figure: `git worktree add ../before main`, then this against `../before`. Every command is run
in both checkouts, and their JSON compared key by key. Fields that only this checkout has are counted (the contract lets fields
be added); a field that is gone, a text that differs, or a number by more than 1e-9 of its size is printed, and ends in status 1.
Left out, the experiments are the measured ones beside the repository.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass, field
from pathlib import Path

from process_cost import REPOSITORY, measure

TOLERANCE = 1e-9
MEASURED = REPOSITORY.parent / "shared" / "data"
SHOWN = 10
"""differences of one document that are printed"""


@dataclass
class Comparison:
    """Two documents, walked through side by side."""

    numbers: int = 0
    largest: float = 0.0
    """relative difference of two numbers"""
    added: int = 0
    different: list[str] = field(default_factory=list)

    def walk(self, before: object, now: object, place: str = "") -> None:
        """Compare two values and all that is in them."""
        if isinstance(before, dict) and isinstance(now, dict):
            self.added += len(now.keys() - before.keys())
            for key, value in before.items():
                if key in now:
                    self.walk(value, now[key], f"{place}.{key}")
                else:
                    self.different.append(f"{place}.{key}: is gone")
        elif isinstance(before, list) and isinstance(now, list) and len(before) == len(now):
            for index, pair in enumerate(zip(before, now, strict=True)):
                self.walk(*pair, f"{place}[{index}]")
        elif _number(before) and _number(now):
            self.numbers += 1
            difference = abs(before - now) / max(abs(before), abs(now), sys.float_info.min)
            self.largest = max(self.largest, difference)
            if difference > TOLERANCE:
                self.different.append(f"{place}: {before} became {now}")
        elif before != now:
            self.different.append(f"{place}: {before!r} became {now!r}")


def _number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def main() -> None:
    """Run, compare and print one line for each command and experiment."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("checkout", type=Path)
    parser.add_argument("experiments", nargs="*", type=Path)
    parser.add_argument("--commands", nargs="+", default=["identify", "diagnose", "improve"])
    chosen = parser.parse_args()
    experiments = chosen.experiments or sorted(file.parent for file in MEASURED.glob("*/experiment.yaml"))
    failed = False
    for experiment in experiments:
        for command in chosen.commands:
            line = [sys.executable, "-m", "api", command, str(experiment.resolve()), "--json"]
            compared = Comparison()
            compared.walk(measure(line, chosen.checkout.resolve()).answer, measure(line).answer)
            print(
                f"{command} {experiment.name}: {compared.numbers} numbers, largest difference {compared.largest:.1e}, "
                f"{compared.added} fields added, {len(compared.different)} differences"
            )
            for each in compared.different[:SHOWN]:
                print(f"    {each}")
            failed |= bool(compared.different)
    sys.exit(int(failed))


if __name__ == "__main__":
    main()
