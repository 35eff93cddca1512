"""The whole diagnosis beside what one would do today on the same record, in the same run.

    python benchmarks/diagnosis_speed.py [--six EXPERIMENT_FOLDER] [--eight EXPERIMENT_FOLDER] [--before CHECKOUT]
        [--pysindy-python PATH] [--seconds 60] [--rate 1000]

One joint: three payload sessions of the test joint of `tests/plants` with two effects hidden in it, 60 s at 1 kHz each,
as files. Compared, each a process of its own that starts from the files:

- `coulomb diagnose`, the full catalogue;
- a refit per candidate by hand (`refit_per_candidate.py`): SciPy's zero-phase filter and decimation, `numpy.linalg.lstsq`
  for every candidate column and every value of its constants, each refitted without one tenth of every session in turn;
- PySINDy 2 (`pysindy_on_a_record.py`) with a library of comparable columns and a sparse optimiser, with its threshold chosen
  by the same folds. Name an interpreter that has it with --pysindy-python; without one this row is left out.

The last two look once: they neither add what they found nor look again, do not search for combinations, give no evidence
that holds for coloured residuals and no check of what is left. So the work is not the same, and theirs is the smaller one.

Six joints: `--six`, by default the measured TX40 record where it is at hand; `coulomb diagnose` alone. Eight joints:
`--eight`, by default TIAGo; `coulomb improve`. With `--before` another checkout of this repository (`git worktree add`) runs the
same beside it, in turn, so that an old algorithm and a new one share the machine's load.
Ours runs twice: with what it does by itself, joints divided among two processes where there are two cores, and with one
(`--workers 1`); of each the quickest of `--runs` is shown, and with one process wall and CPU time are about the same where
nothing else runs. The last lines hold the wall times against the bounds that are promised.
Measured are wall and CPU time (user and system, with children) and peak memory, as the kernel counts them (wait4).
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

from process_cost import Cost, measure

REPOSITORY = Path(__file__).resolve().parent.parent
TX40 = REPOSITORY.parent / "shared" / "data" / "tx40"
TIAGO = REPOSITORY.parent / "shared" / "data" / "tiago"
PROMISED = {"one joint": 5.0, "six joints": 6.0, "eight joints": 15.0}
"""s of wall time on two cores on which nothing else runs."""
HIDDEN = {"load-friction-asymmetric": 0.5, "friction-position": 0.5}


def write_one_joint(folder: Path, seconds: float, rate: float) -> None:
    """Three payload sessions of the test joint."""
    sys.path.insert(0, str(REPOSITORY))
    from tests.plants.single_joint import record, write_experiment

    write_experiment(folder, record(HIDDEN, seed=4, duration=seconds, rate=rate))


def named(answer: dict) -> str:
    """What a diagnosis names, joint by joint."""
    return "; ".join(
        f"{joint['joint']}: {', '.join(joint['missing']) or joint['verdict']}" for joint in answer["joints"]
    )


def row(words: str, cost: Cost, reference: Cost, said: str) -> None:
    """One line of the table."""
    print(
        f"{words:26}{cost.wall:9.2f}{cost.cpu:9.2f}{cost.peak_memory / 1e6:9.0f}"
        f"{cost.wall / reference.wall:8.2f}  {said}"
    )


def main() -> None:
    """Measure and print the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--six", type=Path, default=TX40)
    parser.add_argument("--eight", type=Path, default=TIAGO)
    parser.add_argument("--before", type=Path, help="another checkout, which runs the same")
    parser.add_argument("--pysindy-python", help="interpreter that has pysindy 2")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--rate", type=float, default=1000.0)
    parser.add_argument("--runs", type=int, default=2)
    chosen = parser.parse_args()
    beside = Path(__file__).parent
    heading = f"{'':26}{'wall, s':>9}{'CPU, s':>9}{'MB':>9}{'ratio':>8}  names"

    def best(command: list[str]) -> Cost:
        return min((measure(command) for _ in range(chosen.runs)), key=lambda cost: cost.wall)

    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "one-joint"
        write_one_joint(folder, chosen.seconds, chosen.rate)
        print(
            f"one joint, three sessions of {chosen.seconds:g} s at {chosen.rate:g} Hz; hidden: {', '.join(HIDDEN)}"
        )
        print(heading)
        ours = best([sys.executable, "-m", "api", "diagnose", str(folder), "--json"])
        row("coulomb diagnose", ours, ours, named(ours.answer))
        held = {"one joint": ours.wall}
        if chosen.before:
            old = measure(
                [sys.executable, "-m", "api", "diagnose", str(folder), "--json"], chosen.before.resolve()
            )
            row("the other checkout", old, ours, named(old.answer))
        refit = best([sys.executable, str(beside / "refit_per_candidate.py"), str(folder)])
        said = f"{refit.answer['first']} (one look; {refit.answer['fits']} fits)"
        row("a refit per candidate", refit, ours, said)
        if chosen.pysindy_python:
            command = [chosen.pysindy_python, str(beside / "pysindy_on_a_record.py"), str(folder)]
            sparse = best(command)
            row("PySINDy", sparse, ours, ", ".join(sparse.answer["terms"]))
        else:
            print("PySINDy: left out, name an interpreter that has it with --pysindy-python")
    for words, command, folder in (
        ("six joints", "diagnose", chosen.six),
        ("eight joints", "improve", chosen.eight),
    ):
        if not (folder / "experiment.yaml").is_file():
            print(f"{words}: left out, no experiment.yaml in {folder}")
            continue
        print(f"\n{words}: {folder.name}")
        print(heading)
        called = [sys.executable, "-m", "api", command, str(folder.resolve()), "--json"]
        ours = best(called)
        row(f"coulomb {command}", ours, ours, concluded(ours.answer))
        alone = best([*called, "--workers", "1"])
        row("  with one process", alone, ours, concluded(alone.answer))
        held[words] = ours.wall
        if chosen.before:
            old = measure(called, chosen.before.resolve())
            row("the other checkout", old, ours, concluded(old.answer))
    print()
    for words, seconds in held.items():
        said = "holds" if seconds < PROMISED[words] else "IS EXCEEDED"
        print(f"{words:14}{seconds:6.2f} s of wall time; {PROMISED[words]:g} s {said}")


def concluded(answer: dict) -> str:
    """What a diagnosis names, or what an improvement adds."""
    if "steps" not in answer:
        return named(answer)
    added = [
        f"{step['added']['effect']}@{step['added']['joint']}" for step in answer["steps"] if step["added"]
    ]
    last = answer["steps"][-1]["relative_error"]
    return f"{', '.join(added) or 'nothing'}; {100 * last:.2f} %"


if __name__ == "__main__":
    main()
