"""A few cases of the blind bench on which a changed constant can show, and what is said of them with other constants.

Clear cases hang on no constant by a factor of two. A case is at the edge if the probability of anything that is said of it, that
nothing is missing or that an effect is, lies from 0.05 to 0.95. (Where a predictor finds structure of no catalogue all figures
follow from the 0.9 that this has always, so that such cases are clear.) In the bench's own order, in which the plants take turns,
the first cases at the edge are taken, at most `OF_A_CLASS` of one class, and as many clear ones, one of a class.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from inspect import signature
from pathlib import Path
from typing import Any

import identify
from identify.diagnosis import diagnosis as concluding
from identify.diagnosis import moves
from identify.diagnosis.deciding_constants import STRUCTURE_RIGHT
from identify.diagnosis.diagnosis import Diagnosis, diagnose_record, with_descriptions
from identify.diagnosis.joint_diagnosis import JointDiagnosis
from identify.diagnosis.screening import Screening
from identify.diagnosis.structure import leftover_structure
from identify.estimation.record import Record
from identify.estimation.requested_model import open_record, requested_model
from tests.blind.score import DRAWS, SAID, AnyCase, Score, scored

SIZES_OF_THE_BENCH = {"joint": 320, "loop": 240, "arm": 80, "rig": 40}
"""cases of each plant, whose places say in which order they take turns"""
OF_A_CLASS = 3


@dataclass(frozen=True)
class Said:
    """What a diagnosis says of a case.

    words         : verdict and names of every joint
    probabilities : of everything said of a joint, by joint and what it is about
    """

    words: tuple[tuple[str, tuple[str, ...]], ...]
    probabilities: dict[tuple[int, str], float]
    right: bool

    @property
    def at_the_edge(self) -> bool:
        """Whether a probability is neither near 0 nor near 1."""
        return undecided(list(self.probabilities.values()))

    def farthest(self, other: Said) -> float:
        """How far the probability moves that moves farthest."""
        keys = self.probabilities.keys() | other.probabilities.keys()
        return max(
            (abs(self.probabilities.get(k, 0.0) - other.probabilities.get(k, 0.0)) for k in keys), default=0.0
        )


def undecided(probabilities: Sequence[float]) -> bool:
    """Whether something that is said is neither nearly certain nor nearly excluded."""
    return STRUCTURE_RIGHT not in probabilities and any(SAID <= each <= 1 - SAID for each in probabilities)


@dataclass
class Known:
    """Fits and screenings of a record that were made with the constants as they are; neither depends on these but for a few.

    They are known by their model and by the fit they start from, which are the same as long as a search goes the same way.
    """

    made: dict[tuple[Any, ...], Any] = field(default_factory=dict)

    def once(self, make: Callable[..., Any]) -> Callable[..., Any]:
        """A function whose results are kept by its arguments, models by their terms."""

        def asked(*values: Any, **named: Any) -> Any:
            key = make, *map(_identity, values), *((k, _identity(v)) for k, v in sorted(named.items()))
            if key not in self.made:
                self.made[key] = (
                    values,
                    named,
                    make(*values, **named),
                )  # arguments stay alive, so that no id comes again
            return self.made[key][-1]

        return asked


def _identity(value: Any) -> Any:
    terms = getattr(value, "terms", None)
    if terms is None:
        return value if isinstance(value, bool) else id(value)
    return tuple((each.key, each.constants) for each in terms)


@dataclass(frozen=True)
class Tried:
    """A case with its record, and what is said of it with the constants as they are.

    diagnosis   : without descriptions
    conclusions : what the verdict on each joint was made from: the arguments of the search's last step, by name
    """

    plant: str
    case: AnyCase
    record: Record
    diagnosis: Diagnosis
    conclusions: Sequence[dict[str, Any]]
    said: Said
    known: Known

    @classmethod
    def of(cls, plant: str, case: AnyCase, folder: Path) -> Tried:
        """Record a case and diagnose it."""
        record, known = open_record(identify.load_experiment(case.experiment(folder))), Known()
        with _concluding() as conclusions, _remembering(known):
            diagnosis = _diagnosis(record)
        return cls(plant, case, record, diagnosis, conclusions, _described(case, diagnosis), known)

    def searched_again(self, everything: bool) -> Said:
        """What is said with other constants; `everything` also makes fits and products again."""
        instruments = self.record.instruments
        if everything:
            self.record.instruments = None
        try:
            with _remembering(Known() if everything else self.known):
                return _described(self.case, _diagnosis(self.record))
        finally:
            self.record.instruments = instruments

    def concluded_again(self) -> Said:
        """The same where the search is the same."""
        joints = tuple(
            concluding._conclude(
                **{**each, "structure": tuple(leftover_structure(each["final"].predictions[each["joint"]]))}
            )
            for each in self.conclusions
        )
        named = {(term.key, joint.joint) for joint in joints for term in joint.missing}
        names = self.record.joint_names
        added = tuple(
            term for term in self.diagnosis.added if any((term.key, name) in named for name in names)
        )
        return _described(self.case, replace(self.diagnosis, joints=joints, added=added))


def drawn_bench(cases: int, seed: int, folder: Path) -> list[Tried]:
    """The reduced bench of a seed."""
    edge, clear = _Wanted(cases - cases // 2, OF_A_CLASS), _Wanted(cases // 2, 1)
    listed = [
        (index / size, plant, index) for plant, size in SIZES_OF_THE_BENCH.items() for index in range(size)
    ]
    for _, plant, index in sorted(listed):
        case = DRAWS[plant](seed, index)
        if not edge.more and not clear.takes(case.kind):
            continue
        try:
            tried = Tried.of(plant, case, folder / f"{plant}-{index}")
        except RuntimeError:
            continue  # could not be recorded
        (edge if tried.said.at_the_edge else clear).take(case.kind, tried)
        if not edge.more and not clear.more:
            break
    return [*edge.taken, *clear.taken]


def recorded_bench(scores: Sequence[Score], cases: int, folder: Path) -> list[Tried]:
    """The same, chosen by what records of the blind bench say of the cases that they hold, in the same order."""
    edge, clear = _Wanted(cases - cases // 2, OF_A_CLASS), _Wanted(cases // 2, 1)
    listed = [score for score in scores if score.plant in SIZES_OF_THE_BENCH and score.statements]
    for score in sorted(listed, key=lambda each: (each.index / SIZES_OF_THE_BENCH[each.plant], each.plant)):
        at_edge = undecided([probability for probability, _ in score.statements])
        (edge if at_edge else clear).take(score.kind, score)
    chosen = [*edge.taken, *clear.taken]
    return [
        Tried.of(s.plant, DRAWS[s.plant](s.seed, s.index), folder / f"{s.plant}-{s.index}") for s in chosen
    ]


@dataclass
class _Wanted:
    """So many cases, and at most so many of one class."""

    count: int
    of_a_class: int
    taken: list[Any] = field(default_factory=list)
    classes: Counter[str] = field(default_factory=Counter)

    @property
    def more(self) -> bool:
        return len(self.taken) < self.count

    def takes(self, kind: str) -> bool:
        return self.more and self.classes[kind] < self.of_a_class

    def take(self, kind: str, case: Any) -> None:
        if self.takes(kind):
            self.taken.append(case)
            self.classes[kind] += 1


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


@contextmanager
def _remembering(known: Known) -> Iterator[None]:
    """Fits and screenings that are known are not made again."""
    fit, screening = concluding.fit_model, Screening.of
    concluding.fit_model = moves.fit_model = known.once(fit)
    Screening.of = known.once(screening)  # type: ignore[method-assign]
    try:
        yield
    finally:
        concluding.fit_model = moves.fit_model = fit
        Screening.of = screening  # type: ignore[method-assign]


def _diagnosis(record: Record) -> Diagnosis:
    return diagnose_record(record, "usual", requested_model(record, "usual"))


def _described(case: AnyCase, diagnosis: Diagnosis) -> Said:
    """What is said, descriptions that may stand in the place of an effect included, and whether it is right."""
    document = with_descriptions(diagnosis, of_doubted_only=True).document()
    probabilities = {}
    for place, joint in enumerate(document.joints):
        probabilities[place, "nothing"] = joint.probability_adequate or 0.0
        probabilities[place, "no catalogue"] = joint.probability_unexplained or 0.0
        for candidate in joint.candidates:
            if (candidate.probability or 0.0) >= SAID:
                probabilities[place, candidate.effect] = candidate.probability or 0.0
    words = tuple((joint.verdict, tuple(joint.missing)) for joint in document.joints)
    return Said(words, probabilities, scored(case, document, 0.0, "", 0, 0).right)
