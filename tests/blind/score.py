"""How a diagnosis fares on a case whose secret is known."""

from __future__ import annotations

import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import identify
from tests.blind.cases import Case
from tests.plants.single_joint import write_experiment

SAME_ON_THESE_DATA = ({"payload-mass", "drive-gain"},)
"""Effects that leave the same trace where all payloads are wrong by the same factor; either name is right, if the other
is given as indistinguishable."""


@dataclass(frozen=True)
class Score:
    """What a diagnosis said of a case, and whether it was right."""

    case: Case
    verdict: str
    missing: tuple[str, ...]
    right: bool
    seconds: float


def diagnose_blindly(case: Case) -> Score:
    """Write the record, show the diagnosis nothing else, and score what it says."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = write_experiment(Path(scratch, "experiment"), case.run())
        began = time.perf_counter()
        said = identify.diagnose(identify.load_experiment(folder), "usual").to_json()["joints"][0]
        seconds = time.perf_counter() - began
    return Score(case, said["verdict"], tuple(said["missing"]), _right(case, said), seconds)


def _right(case: Case, said: dict[str, Any]) -> bool:
    missing = said["missing"]
    if case.kind in ("null", "noisy null"):
        return said["verdict"] == "adequate" and not missing
    if case.kind == "uncatalogued":
        return said["verdict"] == "unexplained"
    if case.kind == "pair":
        return all(any(_same(name, other, said) for other in missing) for name in case.effects)
    (name,) = case.effects
    return said["verdict"] == "missing" and bool(missing) and _same(name, missing[0], said)


def _same(hidden: str, named: str, said: dict[str, Any]) -> bool:
    if hidden == named:
        return True
    rivals = next((c["indistinguishable_from"] for c in said["candidates"] if c["effect"] == named), [])
    return any({hidden, named} <= pair for pair in SAME_ON_THESE_DATA) and hidden in rivals
