"""How much the diagnosis depends on each of its constants: `python -m tests.sensitivity [--cases N] [--seed S]
[--only MODULE.CONSTANT…] [--write docs/diagnosis.md]`.

Every constant is halved and doubled while all others keep their values, and the cases of a reduced blind bench are
diagnosed again. A part that is nearer to 1 than to 0 is varied by its distance from 1. Each case is recorded once, and what
acts on the search's outcome only (`AFTER_THE_SEARCH`) is varied there, without another search.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from inspect import signature
from itertools import count
from pathlib import Path
from typing import Any

import identify
from identify.diagnosis import diagnosis as concluding
from identify.diagnosis.diagnosis import Diagnosis, diagnose_record, with_descriptions
from identify.diagnosis.joint_diagnosis import JointDiagnosis
from identify.diagnosis.structure import leftover_structure
from identify.estimation.record import Record
from identify.estimation.requested_model import open_record, requested_model
from tests.blind.cases import KINDS as CLASSES
from tests.blind.cases import Case, draw
from tests.blind.score import is_right

CONSTANTS = {
    "finding": (
        "SIGNIFICANCE", "LEAST_DROP", "DROP_PER_PARAMETER", "LEAST_OF_TORQUE", "ACTS", "FEWEST_FOLDS",
        "PLAIN_DROP", "STEADY", "AS_GOOD", "SLIGHTLY_MORE", "TOO_SMALL",
    ),
    "selection": ("FOLDS", "RIVAL_GAIN", "KNOWN"),
    "screening": ("WORTH_OF_ALL",),
    "diagnosis": ("SIBLING_GAIN",),
    "instruments": ("VELOCITY_HELD", "BAND"),
    "verdict": ("MOST", "CLEARLY_BETTER", "NEARLY_ALL"),
    "structure": ("LEAST_SHARE", "LEAST_REMEMBERED", "LINE_STANDS_OUT"),
    "disturbance": ("NOISE_MEMORY", "LOUD", "STANDS_OUT"),
}  # fmt: skip
"""Constants that decide names and verdicts, by module of `identify.diagnosis`. Those of `probability` decide neither."""
AFTER_THE_SEARCH = ("verdict", "structure", "disturbance")
"""Modules whose constants act on what the search ended with: the verdict, and what is left in the residual."""
KINDS = ("null", "noisy null", "strong", "weak", "weak", "pair", "uncatalogued")
"""Classes of the reduced bench, in turn; weak cases twice, for they are the ones at the edge."""
HEADING = "## Sensitivity"


Said = tuple[str, tuple[str, ...]]
"""Verdict and names."""


@dataclass(frozen=True)
class Tried:
    """A case with its record, and what is said of it with the constants as they are.

    diagnosis  : of its one joint, without descriptions
    conclusion : what the verdict was made from: the arguments of the search's last step, by name
    """

    case: Case
    record: Record
    diagnosis: Diagnosis
    conclusion: dict[str, Any]
    said: Said
    right: bool

    def searched_again(self) -> tuple[Said, bool]:
        """What is said with other constants, and whether it is right."""
        return _described(self.case, _diagnosis(self.record))

    def concluded_again(self) -> tuple[Said, bool]:
        """The same where the search is the same."""
        structure = tuple(leftover_structure(self.conclusion["final"].predictions[0]))
        joint = concluding._conclude(**{**self.conclusion, "structure": structure})
        if _outcome(joint) == _outcome(self.diagnosis.joints[0]):
            return self.said, self.right
        named = {term.key for term in joint.missing}
        added = tuple(term for term in self.diagnosis.added if term.key in named)
        return _described(self.case, replace(self.diagnosis, joints=(joint,), added=added))


def _outcome(joint: JointDiagnosis) -> tuple[str, tuple[str, ...], str | None]:
    return joint.verdict, tuple(term.effect.name for term in joint.missing), joint.doubted


def reduced_bench(cases: int, seed: int, folder: Path) -> list[Tried]:
    """The first cases of the blind bench of each class in turn, recorded."""
    drawn: dict[str, Iterator[int]] = {kind: count() for kind in KINDS}
    found = []
    for index in range(cases):
        kind = KINDS[index % len(KINDS)]
        number = next(number for number in drawn[kind] if CLASSES[number % len(CLASSES)] == kind)
        case = draw(seed, number)
        path = case.experiment(folder / str(index))
        record = open_record(identify.load_experiment(path))
        with _concluding() as conclusions:
            diagnosis = _diagnosis(record)
        found.append(Tried(case, record, diagnosis, conclusions[-1], *_described(case, diagnosis)))
    return found


@contextmanager
def _concluding() -> Iterator[list[dict[str, Any]]]:
    """What the last step of a search is given."""
    given: list[dict[str, Any]] = []
    conclude = concluding._conclude
    names = tuple(signature(conclude).parameters)

    def noted(*values: Any) -> JointDiagnosis:
        given.append(dict(zip(names, values, strict=True)))
        return conclude(*values)

    concluding._conclude = noted
    try:
        yield given
    finally:
        concluding._conclude = conclude


def _diagnosis(record: Record) -> Diagnosis:
    return diagnose_record(record, "usual", requested_model(record, "usual"))


def _described(case: Case, diagnosis: Diagnosis) -> tuple[Said, bool]:
    """Verdict and names, and whether they are right."""
    said = with_descriptions(diagnosis, of_doubted_only=True).document().joints[0]
    return (said.verdict, said.missing), is_right(case, said)


@contextmanager
def varied(module: str, name: str, value: float) -> Iterator[None]:
    """A constant with another value, in its module and wherever it was imported."""
    home = sys.modules[f"identify.diagnosis.{module}"]
    before = vars(home)[name]
    places = [
        each
        for key, each in sys.modules.items()
        if key.startswith("identify.diagnosis.")
        and (each is home or (vars(each).get(name) == before and _imports(each, module, name)))
    ]
    for each in places:
        setattr(each, name, value)
    try:
        yield
    finally:
        for each in places:
            setattr(each, name, before)


def _imports(place: object, module: str, name: str) -> bool:
    """Whether a module imports a constant of another by name."""
    source = Path(str(vars(place)["__file__"])).read_text(encoding="utf-8")
    start = source.find(f"from identify.diagnosis.{module} import")
    return start >= 0 and name in source[start : start + 400]


def other_values(value: float) -> tuple[float, float]:
    """Half and double; of a part near 1 with twice and half its distance from 1."""
    if 0.5 < value < 1:
        return 1 - 2 * (1 - value), 1 - (1 - value) / 2
    if 1 < value < 1.5:
        return 1 + (value - 1) / 2, 1 + 2 * (value - 1)
    if isinstance(value, int):
        return max(1, value // 2), 2 * value
    return value / 2, value * 2


def main() -> None:
    """Vary every constant and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=28)
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--write", type=Path, help="a page whose section on sensitivity is replaced")
    parser.add_argument("--only", nargs="+", help="these constants, such as finding.STEADY")
    options = parser.parse_args()
    wanted = [(module, name) for module, names in CONSTANTS.items() for name in names]
    if options.only:
        unknown = set(options.only) - {f"{module}.{name}" for module, name in wanted}
        if unknown:
            parser.error(
                f"--only: {', '.join(sorted(unknown))}: not among those that decide names and verdicts"
            )
        wanted = [(module, name) for module, name in wanted if f"{module}.{name}" in options.only]
    with tempfile.TemporaryDirectory() as scratch:
        bench = reduced_bench(options.cases, options.seed, Path(scratch))
        known = sum(tried.right for tried in bench)
        lines = [
            HEADING,
            "",
            f"{len(bench)} cases of the blind bench (seed {options.seed}), {known} of them right with the constants as they are;",
            "`make sensitivity` prints this. Of each constant, halved and doubled: how many are right, and in how many something",
            "else is said.",
            "",
            "| constant | value | less | right | said otherwise | more | right | said otherwise |",
            "|---|---|---|---|---|---|---|---|",
        ]
        for module, name in wanted:
            value = vars(sys.modules[f"identify.diagnosis.{module}"])[name]
            row = f"| `{module}.{name}` | {value:g} "
            for other in other_values(value):
                with varied(module, name, other):
                    late = module in AFTER_THE_SEARCH
                    again = [tried.concluded_again() if late else tried.searched_again() for tried in bench]
                right = sum(found for _, found in again)
                changed = sum(said != tried.said for (said, _), tried in zip(again, bench, strict=True))
                row += f"| {other:.3g} | {right} | {changed} "
            lines.append(row + "|")
            print(lines[-1], flush=True)
    text = "\n".join(lines) + "\n"
    if options.write:
        page = options.write.read_text(encoding="utf-8").partition(HEADING)[0]
        options.write.write_text(page.rstrip("\n") + "\n\n" + text, encoding="utf-8")


if __name__ == "__main__":
    main()
