"""How much the diagnosis depends on each of its constants: `python -m tests.sensitivity [--cases N] [--seed S]
[--record FILE…] [--only CONSTANT…] [--sizes] [--write docs/diagnosis.md]`.

Every constant that decides is halved and doubled while all others keep their values, and the cases of a reduced blind bench are
diagnosed again; with `--sizes` so are the guards, bounds of work and sizes of tables, which are said to decide nothing. A part
that is nearer to 1 than to 0 is varied by its distance from 1.
"""

from __future__ import annotations

import argparse
import re
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from types import ModuleType

from identify.diagnosis import deciding_constants
from tests.blind.__main__ import recorded
from tests.sensitivity.reduced_bench import Tried, drawn_bench, recorded_bench

HOME = "identify.diagnosis.deciding_constants"
DECIDING = {
    **{name: HOME for name in vars(deciding_constants) if name.isupper()},
    "LARGEST_DEFLECTION": "identify.effects.transmission",
}
"""Every constant that decides names and verdicts, and its module."""
SIZES = {
    "NEIGHBOURS": "identify.diagnosis.structure",
    "HISTORY": "identify.diagnosis.structure",
    "LAGS": "identify.diagnosis.structure",
    "HISTORY_RIDGE": "identify.diagnosis.structure",
    "LINE_BAND": "identify.diagnosis.structure",
    "LINE_NEIGHBOURHOOD": "identify.diagnosis.structure",
    "BIN": "identify.diagnosis.disturbance",
    "FILTER_MEMORY": "identify.diagnosis.disturbance",
    "REACH": "identify.diagnosis.disturbance",
    "RIDGE": "identify.diagnosis.disturbance",
    "INDEPENDENT": "identify.diagnosis.disturbance",
    "TURNING": "identify.diagnosis.disturbance",
    "PAIRED": "identify.diagnosis.pairs",
    "LOAD_KNOTS": "identify.diagnosis.free_functions",
    "DEPENDENT": "identify.diagnosis.option_fits",
}
"""Numbers that are said to decide nothing."""
AFTER_THE_SEARCH = frozenset(
    {
        "STRETCHES", "STANDS_OUT", "NOISE_TIME", "NOISE_MEMORY", "LOUD", "WORSE", "STRUCTURE_RIGHT",
        *(name for name, module in SIZES.items() if module.endswith(("structure", "disturbance"))),
    }
)  # fmt: skip
"""What acts on what the search ended with only: it is varied there, without another search."""
IN_EVERY_FIT = frozenset({"FOLDS", "BAND", "LARGEST_DEFLECTION", "LOAD_KNOTS", "DEPENDENT"})
"""What changes columns or stretches, so that no fit and no product of the search as it was can be used again."""
HEADING = "## Sensitivity"


@contextmanager
def varied(name: str, module: str, value: float) -> Iterator[None]:
    """A constant with another value, in its module and wherever it was imported."""
    home = sys.modules[module]
    before = vars(home)[name]
    places = [
        each
        for key, each in list(sys.modules.items())
        if key.startswith("identify.") and (each is home or _imports(each, module, name))
    ]
    for each in places:
        setattr(each, name, value)
    try:
        yield
    finally:
        for each in places:
            setattr(each, name, before)


def _imports(place: ModuleType, module: str, name: str) -> bool:
    """Whether a module imports a constant of another by name."""
    if not place.__file__ or name not in vars(place):
        return False
    source = Path(place.__file__).read_text(encoding="utf-8")
    lists = re.findall(rf"^from {re.escape(module)} import (\([^)]*\)|[^(\n]*)", source, re.MULTILINE)
    return any(re.search(rf"\b{name}\b", listed) for listed in lists)


def other_values(value: float) -> tuple[float, float]:
    """Half and double; of a part near 1 with twice and half its distance from 1."""
    if 0.5 < value < 1:
        return 1 - 2 * (1 - value), 1 - (1 - value) / 2
    if isinstance(value, int):
        return max(1, value // 2), 2 * value
    return value / 2, value * 2


def row(name: str, module: str, bench: Sequence[Tried]) -> str:
    """What halving and doubling a constant does on some cases."""
    value = vars(sys.modules[module])[name]
    cells = f"| `{name}` | {value:g} "
    for other in other_values(value):
        with varied(name, module, other):
            again = [
                tried.concluded_again()
                if name in AFTER_THE_SEARCH
                else tried.searched_again(name in IN_EVERY_FIT)
                for tried in bench
            ]
        right = sum(said.right for said in again)
        changed = sum(said.words != tried.said.words for said, tried in zip(again, bench, strict=True))
        moved = [tried.said.farthest(said) for said, tried in zip(again, bench, strict=True)]
        cells += f"| {other:.3g} | {right} | {changed} | {sum(moved) / len(moved):.2f} "
    return cells + "|"


def main() -> None:
    """Vary every constant and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=24, help="half of them at the edge, half clear")
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument(
        "--record", type=Path, nargs="+", help="choose from what these records of the blind bench say instead"
    )
    parser.add_argument("--write", type=Path, help="a page whose section on sensitivity is replaced")
    parser.add_argument("--only", nargs="+", help="these constants")
    parser.add_argument("--sizes", action="store_true", help="what is said to decide nothing")
    options = parser.parse_args()
    wanted = SIZES if options.sizes else DECIDING
    if options.only:
        unknown = set(options.only) - set(wanted)
        if unknown:
            parser.error(f"--only: {', '.join(sorted(unknown))}: give some of {', '.join(wanted)}")
        wanted = {name: wanted[name] for name in options.only}
    with tempfile.TemporaryDirectory() as scratch:
        if options.record:
            scores = recorded(options.record)
            bench = recorded_bench(scores, options.cases, Path(scratch))
            seeds = ", ".join(str(seed) for seed in sorted({score.seed for score in scores}))
        else:
            bench = drawn_bench(options.cases, options.seed, Path(scratch))
            seeds = str(options.seed)
        known, edge = sum(tried.said.right for tried in bench), sum(tried.said.at_the_edge for tried in bench)
        plants = ", ".join(
            f"{sum(tried.plant == plant for tried in bench)} {plant}"
            for plant in dict.fromkeys(t.plant for t in bench)
        )
        lines = [
            HEADING,
            "",
            f"{datetime.now(UTC).date()}, {len(bench)} cases of the blind bench (seed {seeds}: {plants}),",
            f"{edge} of them at the edge, {known} right with the constants as they are. Of each constant, halved and doubled:",
            "how many are right, in how many something else is said, and by how much the probability moves that moves",
            "farthest, as a mean over the cases.",
            "",
            "| constant | value | less | right | said otherwise | moves | more | right | said otherwise | moves |",
            "|---|---|---|---|---|---|---|---|---|---|",
        ]
        print("\n".join(lines), flush=True)
        for name, module in wanted.items():
            lines.append(row(name, module, bench))
            print(lines[-1], flush=True)
    text = "\n".join(lines) + "\n"
    if options.write:
        page = options.write.read_text(encoding="utf-8").partition(HEADING)[0]
        options.write.write_text(page.rstrip("\n") + "\n\n" + text, encoding="utf-8")


if __name__ == "__main__":
    main()
