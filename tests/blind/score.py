"""How a diagnosis fares on a case whose secret is known."""

from __future__ import annotations

import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import identify
from identify.results.diagnosis import JointDiagnosis
from tests.blind.cases import Case, draw
from tests.blind.rigs import RigCase, draw_rig

SAME_ON_THESE_DATA = (
    {"payload-mass", "drive-gain"},
    {"payload-com", "gravity-tilt"},
)
"""Effects that leave the same trace where all payloads are wrong by the same factor, or hang at the same place; either
name is right, if the other is given as indistinguishable."""


@dataclass(frozen=True)
class Score:
    """What a diagnosis said of a case, and whether it was right.

    beside : what was named beside what is hidden
    """

    case: Case | RigCase
    verdict: str
    missing: tuple[str, ...]
    right: bool
    beside: tuple[str, ...]
    seconds: float


def diagnose_blindly(case: Case | RigCase) -> Score:
    """Write the record, show the diagnosis nothing else, and score what it says."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = case.experiment(Path(scratch))
        began = time.perf_counter()
        said = identify.diagnose(identify.load_experiment(folder), "usual").document().joints[0]
        seconds = time.perf_counter() - began
    missing = said.missing
    beside = [name for name in missing if not any(_same(hidden, name, said) for hidden in case.names)]
    return Score(case, said.verdict, tuple(missing), is_right(case, said), tuple(beside), seconds)


def of_a_joint(seed: int, index: int) -> Score:
    """The score of the test joint's case of an index."""
    return diagnose_blindly(draw(seed, index))


def of_a_rig(seed: int, index: int) -> Score:
    """The score of the simulated rig of an index; one that could not be recorded counts as wrong."""
    case = draw_rig(seed, index)
    try:
        return diagnose_blindly(case)
    except RuntimeError as reason:
        return Score(case, f"not recorded: {reason}", (), False, (), 0.0)


def is_right(case: Case | RigCase, said: JointDiagnosis) -> bool:
    """Whether a diagnosis of a case is right, as docs/blind.md says."""
    missing = said.missing
    if case.kind.endswith("null"):
        return said.verdict == "adequate" and not missing
    if case.kind.endswith("uncatalogued"):
        return said.verdict == "unexplained"
    if case.kind.endswith("pair"):
        return all(any(_same(name, other, said) for other in missing) for name in case.names)
    (name,) = case.names
    return said.verdict == "missing" and bool(missing) and _same(name, missing[0], said)


def _same(hidden: str, named: str, said: JointDiagnosis) -> bool:
    if hidden == named:
        return True
    rivals = next((c.indistinguishable_from for c in said.candidates if c.effect == named), [])
    return any({hidden, named} <= pair for pair in SAME_ON_THESE_DATA) and hidden in rivals
