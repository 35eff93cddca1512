"""How a diagnosis fares on a case whose secret is known."""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import identify
from identify.results.diagnosis import DiagnosisDocument, JointDiagnosis
from tests.blind.arms import ArmCase, draw_arm_case
from tests.blind.cases import Case, draw
from tests.blind.loops import LoopCase, draw_loop
from tests.blind.noise import FloorScore, floor_score
from tests.blind.plasmodes import PlasmodeCase, draw_plasmode, known_of
from tests.blind.rigs import RigCase, draw_rig

SAME_ON_THESE_DATA = (
    {"payload-mass", "drive-gain"},
    {"payload-com", "gravity-tilt"},
)
"""Effects that leave the same trace where all payloads are wrong by the same factor, or hang at the same place; either
name is right, if the other is given as indistinguishable."""
SAID = 0.05
"""Probability below which a candidate is not said to be missing; there are some twenty such in every case."""

AnyCase = Case | RigCase | LoopCase | PlasmodeCase | ArmCase
DRAWS: dict[str, Callable[[int, int], AnyCase]] = {
    "joint": draw,
    "loop": draw_loop,
    "rig": draw_rig,
    "arm": draw_arm_case,
    "plasmode": draw_plasmode,
}
"""By plant, the case of a seed and an index."""


@dataclass(frozen=True)
class Score:
    """What a diagnosis said of a case, and whether it was right.

    plant      : joint, loop, rig, arm or plasmode; with seed and index the case
    hidden     : the case in words
    names      : what is hidden
    missing    : what was named
    beside     : what was named beside what is hidden
    statements : probability and truth of everything that was said: that nothing is missing, that nothing known is, that an effect
                 is missing (from `SAID` on)
    learned    : variable and form of what was offered as a description
    elsewhere  : effects named at joints where nothing is hidden, as joint:effect (in a plasmode those that the diagnosis of the
                 record itself does not name there); None where there is one joint only
    floor      : the noise floor beside what noise really leaves; None where the plant does not tell
    """

    plant: str
    seed: int
    index: int
    kind: str
    hidden: str
    names: tuple[str, ...]
    verdict: str
    missing: tuple[str, ...]
    right: bool
    beside: tuple[str, ...]
    seconds: float
    statements: tuple[tuple[float, bool], ...] = ()
    learned: str | None = None
    elsewhere: tuple[str, ...] | None = None
    floor: FloorScore | None = None

    def line(self) -> str:
        """One line of a record of the bench."""
        return json.dumps(asdict(self), ensure_ascii=False)

    @classmethod
    def of_line(cls, line: str) -> Score:
        """The score that a line of a record holds."""
        fields = json.loads(line)
        for name in ("names", "missing", "beside"):
            fields[name] = tuple(fields[name])
        fields["statements"] = tuple((float(p), bool(true)) for p, true in fields["statements"])
        if fields.get("elsewhere") is not None:
            fields["elsewhere"] = tuple(fields["elsewhere"])
        if fields.get("floor") is not None:
            fields["floor"] = FloorScore(**fields["floor"])
        return cls(**fields)


def diagnose_blindly(case: AnyCase, plant: str = "joint", seed: int = 0, index: int = 0) -> Score:
    """Write the record, show the diagnosis nothing else, and score what it says."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = case.experiment(Path(scratch))
        began = time.perf_counter()
        said = identify.diagnose(identify.load_experiment(folder), "usual").document()
        score = scored(case, said, time.perf_counter() - began, plant, seed, index)
        return replace(score, floor=floor_score(case, said.joints[place_of(case)], folder))


def place_of(case: AnyCase) -> int:
    """The joint, from 0, where something is hidden."""
    return case.joint if isinstance(case, PlasmodeCase | ArmCase) else 0


def scored(
    case: AnyCase, document: DiagnosisDocument, seconds: float, plant: str, seed: int, index: int
) -> Score:
    """What was said of a case, beside its secret."""
    said, elsewhere = document.joints[place_of(case)], _elsewhere(case, document)
    beside = [name for name in said.missing if not any(_same(hidden, name, said) for hidden in case.names)]
    return Score(
        plant,
        seed,
        index,
        case.kind,
        str(case),
        case.names,
        said.verdict,
        tuple(said.missing),
        is_right(case, said) and bool(case.names or not elsewhere),
        tuple(beside),
        seconds,
        tuple(_statements(case, said)),
        None
        if said.learned is None
        else f"{', '.join(said.learned.variables)}: {said.learned.form or 'table'}",
        elsewhere,
    )


def _elsewhere(case: AnyCase, document: DiagnosisDocument) -> tuple[str, ...] | None:
    """What is named at joints where nothing is hidden."""
    if len(document.joints) < 2:
        return None
    own = known_of(case.record) if isinstance(case, PlasmodeCase) else ((),) * len(document.joints)
    hiding = place_of(case) if case.names else None
    return tuple(
        f"{joint.joint}:{name}"
        for place, (joint, known) in enumerate(zip(document.joints, own, strict=True))
        if place != hiding
        for name in joint.missing
        if name not in known
    )


def _statements(case: AnyCase, said: JointDiagnosis) -> list[tuple[float, bool]]:
    """Probability and truth of what is said of a joint."""
    listed: list[tuple[float, bool]] = []
    if isinstance(case, PlasmodeCase):
        return listed  # what the machine has of its own nobody knows
    if said.probability_adequate is not None:
        listed.append((said.probability_adequate, not case.names))
    if said.probability_unexplained is not None:
        listed.append((said.probability_unexplained, case.kind.endswith("uncatalogued")))
    for candidate in said.candidates:
        if candidate.probability is not None and candidate.probability >= SAID:
            true = any(_same(hidden, candidate.effect, said) for hidden in case.names)
            listed.append((candidate.probability, true))
    return listed


def of_a_case(seed: int, place: tuple[str, int]) -> Score:
    """The score of a case by its plant and index; one that could not be recorded counts as wrong."""
    plant, index = place
    case = DRAWS[plant](seed, index)
    try:
        return diagnose_blindly(case, plant, seed, index)
    except RuntimeError as reason:
        verdict = f"not recorded: {reason}"
        return Score(plant, seed, index, case.kind, str(case), case.names, verdict, (), False, (), 0.0)


def is_right(case: AnyCase, said: JointDiagnosis) -> bool:
    """Whether a diagnosis of a case is right, as docs/blind.md says."""
    missing = said.missing
    if case.kind.endswith("null"):
        return said.verdict == "adequate" and not missing
    if case.kind.endswith("uncatalogued"):
        return said.verdict == "unexplained"
    if case.kind.endswith("pair"):
        return all(any(_same(name, other, said) for other in missing) for name in case.names)
    (name,) = case.names
    if isinstance(case, PlasmodeCase):  # the machine has effects of its own
        return any(_same(name, other, said) for other in missing)
    return said.verdict == "missing" and bool(missing) and _same(name, missing[0], said)


def _same(hidden: str, named: str, said: JointDiagnosis) -> bool:
    if hidden == named:
        return True
    rivals = next((c.indistinguishable_from for c in said.candidates if c.effect == named), [])
    return any({hidden, named} <= pair for pair in SAME_ON_THESE_DATA) and hidden in rivals
