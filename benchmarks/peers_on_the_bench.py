"""The blind bench's cases of one joint, diagnosed by ours and by what one would use instead.

    python benchmarks/peers_on_the_bench.py [--seed 7001] [--first 0] [--cases 24] [--pysindy-python PATH]
        [--mujoco-python PATH] [--keep FILE.jsonl]

Each case is drawn and written as files (docs/bench.md); every method sees the files only:

- `coulomb diagnose`;
- a refit per candidate by hand (`refit_per_candidate.py`): the candidate of the least error on parts left out is missing where
  it lowers that error by as much as ours asks of a name (1.5 %);
- PySINDy 2 (`pysindy_on_a_record.py`) with a library of comparable columns: the terms beside the usual model that a sparse fit
  keeps, the largest first. Name an interpreter that has it with --pysindy-python; without one it is left out;
- MuJoCo's system identification (`mujoco_on_a_record.py`), --mujoco-python an interpreter with mujoco[sysid]: the one effect that
  a hinge of MJCF or its modifiers of signals can express and that lowers the error most on parts left out, by the same 1.5 %. It
  has no load friction, Stribeck curve, ripple, presliding, play, and nothing that depends on position, time or temperature.

An answer is scored as docs/bench.md says. The peers know no `unexplained`; where the effect is in no catalogue they are right in
naming nothing. Prints a table by class.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path

BENCHMARKS = Path(__file__).resolve().parent
sys.path.insert(0, str(BENCHMARKS.parent))

from tests.blind.cases import Case, draw  # noqa: E402  the checkout's own plants

LEAST_DROP = 0.015
"""part of the error by which a peer's candidate must lower it, as ours must"""
KINDS = ("null", "noisy null", "strong", "weak", "pair", "uncatalogued")


def answer_of(script: str, interpreter: str, folder: Path) -> dict:
    """The last line that a script prints of a case."""
    found = subprocess.run(
        [interpreter, str(BENCHMARKS / script), str(folder)], capture_output=True, text=True, check=True
    )
    return dict(json.loads(found.stdout.splitlines()[-1]))


def ours(folder: Path) -> list[str] | None:
    """What we name; None where we say that the cause is in no catalogue."""
    import identify

    said = identify.diagnose(identify.load_experiment(folder), "usual").document().joints[0]
    return None if said.verdict == "unexplained" else list(said.missing)


def by_one_candidate(answer: dict) -> list[str]:
    """The best candidate where it lowers the error on parts left out by enough."""
    return [answer["first"]] if answer["after"] < (1 - LEAST_DROP) * answer["before"] else []


def is_right(case: Case, said: list[str] | None) -> bool:
    """Whether an answer is right (docs/bench.md); who knows no `unexplained` names nothing instead."""
    if case.kind.endswith("null"):
        return said == []
    if case.kind == "uncatalogued":
        return not said
    if said is None:
        return False
    if case.kind == "pair":
        return set(case.names) <= set(said)
    return said[:1] == list(case.names)


def main() -> None:
    """Diagnose the cases by every method and print how many are right."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seed", type=int, default=7001)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--cases", type=int, default=24)
    parser.add_argument("--pysindy-python", help="interpreter that has pysindy 2")
    parser.add_argument("--mujoco-python", help="interpreter that has mujoco[sysid]")
    parser.add_argument("--keep", type=Path, help="write every answer here, one JSON object a line")
    chosen = parser.parse_args()
    methods: dict[str, Callable[[Path], list[str] | None]] = {
        "coulomb": ours,
        "refit per candidate": lambda folder: by_one_candidate(
            answer_of("refit_per_candidate.py", sys.executable, folder)
        ),
    }
    if chosen.pysindy_python:
        methods["PySINDy"] = lambda folder: list(
            answer_of("pysindy_on_a_record.py", chosen.pysindy_python, folder)["terms"]
        )
    if chosen.mujoco_python:
        methods["MuJoCo"] = lambda folder: by_one_candidate(
            answer_of("mujoco_on_a_record.py", chosen.mujoco_python, folder)
        )
    right: dict[tuple[str, str], list[bool]] = defaultdict(list)
    for index in range(chosen.first, chosen.first + chosen.cases):
        case = draw(chosen.seed, index)
        with tempfile.TemporaryDirectory() as scratch:
            folder = case.experiment(Path(scratch))
            said = {method: answer(folder) for method, answer in methods.items()}
        for method, names in said.items():
            right[case.kind, method].append(is_right(case, names))
        line = {"seed": chosen.seed, "index": index, "kind": case.kind, "hidden": case.names, "said": said}
        if chosen.keep is not None:
            with chosen.keep.open("a", encoding="utf-8") as file:
                file.write(json.dumps(line) + "\n")
        print(case.kind, *case.names, said, flush=True)
    print("| class |", " | ".join(methods), "|")
    print("|---" * (len(methods) + 1) + "|")
    for kind in KINDS:
        cells = [right[kind, method] for method in methods]
        if cells[0]:
            print(f"| {kind} |", " | ".join(f"{sum(each)} of {len(each)}" for each in cells), "|")


if __name__ == "__main__":
    main()
