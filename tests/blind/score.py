"""How a diagnosis fares on a case whose secret is known."""

from __future__ import annotations

import json
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import identify
from identify.results.diagnosis import JointDiagnosis
from tests.blind.cases import Case, draw
from tests.blind.loops import LoopCase, draw_loop
from tests.blind.plasmodes import PlasmodeCase, draw_plasmode
from tests.blind.rigs import RigCase, draw_rig

SAME_ON_THESE_DATA = (
    {"payload-mass", "drive-gain"},
    {"payload-com", "gravity-tilt"},
)
"""Effects that leave the same trace where all payloads are wrong by the same factor, or hang at the same place; either
name is right, if the other is given as indistinguishable."""
SAID = 0.05
"""Probability below which a candidate is not said to be missing; there are some twenty such in every case."""

AnyCase = Case | RigCase | LoopCase | PlasmodeCase


@dataclass(frozen=True)
class Score:
    """What a diagnosis said of a case, and whether it was right.

    plant      : joint, rig or loop; with seed and index the case
    hidden     : the case in words
    names      : what is hidden
    missing    : what was named
    beside     : what was named beside what is hidden
    statements : probability and truth of everything that was said: that nothing is missing, that nothing known is, that an effect
                 is missing (from `SAID` on)
    learned    : variable and form of what was offered as a description
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
        return cls(**fields)


def diagnose_blindly(case: AnyCase, plant: str = "joint", seed: int = 0, index: int = 0) -> Score:
    """Write the record, show the diagnosis nothing else, and score what it says."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = case.experiment(Path(scratch))
        began = time.perf_counter()
        place = case.joint if isinstance(case, PlasmodeCase) else 0
        said = identify.diagnose(identify.load_experiment(folder), "usual").document().joints[place]
        seconds = time.perf_counter() - began
    return scored(case, said, seconds, plant, seed, index)


def scored(case: AnyCase, said: JointDiagnosis, seconds: float, plant: str, seed: int, index: int) -> Score:
    """What was said of a case, beside its secret."""
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
        is_right(case, said),
        tuple(beside),
        seconds,
        tuple(_statements(case, said)),
        None
        if said.learned is None
        else f"{', '.join(said.learned.variables)}: {said.learned.form or 'table'}",
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
    draws = {"joint": draw, "rig": draw_rig, "loop": draw_loop, "plasmode": draw_plasmode}
    case: AnyCase = draws[plant](seed, index)
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
