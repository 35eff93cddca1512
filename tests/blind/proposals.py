"""What `next` expects of an experiment, beside what it tells once it is run: `python -m tests.blind.proposals [--seed S]
[--first I] [--cases N] [--record FILE]`.

Cases are those of the test joint with one effect, cut to one short session with one payload, which leaves rivals. `next` is
asked to part the hidden effect from its strongest rival; the best proposal, and the last that it shows, are then moved
by the same plant, and the diagnosis of both sessions says what the right one of the two has of the probability of both.
"""

from __future__ import annotations

import argparse
import json
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
import yaml
from numpy.typing import NDArray

import identify
from identify.diagnosis.next_experiment import next_experiment
from identify.recording.errors import InputError
from identify.results.diagnosis import JointDiagnosis
from identify.results.next_experiment import Proposal
from tests.blind.cases import Case, draw
from tests.blind.report import reliability
from tests.blind.score import SAID
from tests.plants.planned_motion import smooth_course
from tests.plants.single_joint import record_motion, write_session

Array = NDArray[np.float64]

SHORT = 12.0
"""s of the session that leaves rivals"""
RATE = 250.0
"""Hz of what is proposed"""


@dataclass(frozen=True)
class Told:
    """One proposal that was run.

    expected, told : share of the right one of the two before the run, as `next` says and as the diagnosis then gives
    so_far, given  : the same of the data before
    decides        : whether `next` says that it decides
    decided        : whether the right one is named then, and the rival neither with it nor as one that may be it
    said           : whether the diagnosis then says either of the two at all (`score.SAID`)
    """

    seed: int
    index: int
    hidden: str
    rival: str
    so_far: float
    given: float
    expected: float
    told: float
    decides: bool
    decided: bool
    said: bool = True


def short(case: Case) -> Case:
    """The case as one short session with the first of its payloads."""
    return replace(case, duration=SHORT, payload_masses=case.payload_masses[:1], repeats=1)


def of_a_case(seed: int, index: int) -> list[Told]:
    """The best proposal for a case and the last one shown, run; nothing where the short record cannot show what is hidden."""
    case = draw(seed, index)
    (hidden,) = case.names
    with tempfile.TemporaryDirectory() as scratch:
        folder = short(case).experiment(Path(scratch))
        _declare(folder, case)
        before = _diagnosed(folder)
        rival = _rival(before, hidden)
        if rival is None:
            return []
        try:
            planned = next_experiment(identify.load_experiment(folder), rivals=(hidden, rival))
        except InputError:
            return []
        found = []
        for number in sorted({0, len(planned.proposals) - 1} if planned.proposals else ()):
            proposal = planned.proposals[number]
            copy = Path(shutil.copytree(folder, folder.parent / f"with-{number}"))
            _run(copy, case, proposal)
            after = _diagnosed(copy)
            found.append(
                Told(
                    seed,
                    index,
                    hidden,
                    rival,
                    planned.probability_so_far or 0.5,
                    _share(before, hidden, rival),
                    proposal.probability or 0.5,
                    _share(after, hidden, rival),
                    proposal.decides,
                    _decided(after, hidden, rival),
                    max(_probabilities(after, hidden, rival)) >= SAID,
                )
            )
    return found


def motion_of(proposal: Proposal) -> tuple[Array, Array, Array, Array]:
    """Time, position, velocity and acceleration of what is proposed."""
    half = 0.5 * (proposal.position_to - proposal.position_from)
    if proposal.shape == "sinusoid":
        pulse = proposal.speed / half
        time = np.arange(round(2 * np.pi / pulse * proposal.repeats * RATE)) / RATE
        middle = proposal.position_from + half
        wave = half * np.cos(pulse * time)
        return time, middle - wave, half * pulse * np.sin(pulse * time), pulse**2 * wave
    return smooth_course(proposal.position_from, 2 * half, proposal.speed, proposal.repeats, RATE)


def _diagnosed(folder: Path) -> JointDiagnosis:
    return identify.diagnose(identify.load_experiment(folder)).document().joints[0]


def _rival(said: JointDiagnosis, hidden: str) -> str | None:
    """What may be the hidden effect as well, or else the candidate that comes next; None where the hidden one is none."""
    listed = [candidate.effect for candidate in said.candidates]
    if hidden not in listed:
        return None
    doubtful = said.candidate(hidden).indistinguishable_from
    return next(iter([*doubtful, *(name for name in listed if name != hidden)]), None)


def _share(said: JointDiagnosis, hidden: str, rival: str) -> float:
    """What the right one has of the probability of both."""
    right, other = _probabilities(said, hidden, rival)
    return right / (right + other) if right + other > 0 else 0.5


def _probabilities(said: JointDiagnosis, hidden: str, rival: str) -> tuple[float, float]:
    right, other = (
        next((c.probability or 0.0 for c in said.candidates if c.effect == name), 0.0)
        for name in (hidden, rival)
    )
    return right, other


def _decided(said: JointDiagnosis, hidden: str, rival: str) -> bool:
    return (
        hidden in said.missing
        and rival not in said.missing
        and rival not in said.candidate(hidden).indistinguishable_from
    )


def _declare(folder: Path, case: Case) -> None:
    """The case's other payloads lie ready beside the robot."""
    file = folder / "experiment.yaml"
    document = yaml.safe_load(file.read_text(encoding="utf-8"))
    document["payloads"] += [
        {"name": f"m{place}", "mass": mass, "com": [case.joint.reach, 0.0, 0.0]}
        for place, mass in enumerate(case.payload_masses[1:], start=1)
    ]
    file.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")


def _run(folder: Path, case: Case, proposal: Proposal) -> None:
    """Move the plant as proposed, and add the session."""
    mass = case.payload_masses[int(proposal.payload[1:])]
    columns = record_motion(
        case.effects,
        motion_of(proposal),
        joint=case.joint,
        payload_mass=mass,
        seed=case.seed,
        index=1,
        shape=case.shape,
    )
    write_session(folder / "proposed.csv", columns)
    file = folder / "experiment.yaml"
    document = yaml.safe_load(file.read_text(encoding="utf-8"))
    document["sessions"].append({"file": "proposed.csv", "payload": proposal.payload})
    file.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")


def with_one_effect(first: int) -> Iterator[int]:
    """Indices of the test joint's cases in which one effect of the catalogue is hidden, from one on."""
    index = first
    while True:
        if index % 8 in (2, 3, 4, 5):  # `cases.KINDS`
            yield index
        index += 1


def table(listed: Sequence[Told]) -> str:
    """How what was expected and what was told agree, by bins of what was expected, as Markdown. Where the diagnosis then says
    neither of the two there is no part of both; these are counted apart."""
    told = [each for each in listed if each.said]
    rows, error = reliability([(each.expected, each.told) for each in told])
    lines = [
        "| expected | proposals | mean of what was expected | mean of what was told |",
        "|---|---|---|---|",
        *(
            f"| {low:g} to {high:g} | {count} | {mean:.2f} | {told:.2f} |"
            for low, high, count, mean, told in rows
        ),
        "",
        f"Calibration error {error:.3f} over {len(told)} proposals; after {len(listed) - len(told)} neither is said.",
    ]
    decide = [each for each in listed if each.decides]
    if decide:
        lines.append(f"{sum(each.decided for each in decide)} of {len(decide)} that were to decide did.")
    return "\n".join(lines)


def main() -> None:
    """Run proposals for some cases and print how they agree."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=2026)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--cases", type=int, default=24)
    parser.add_argument("--record", type=Path, help="add every line to this file")
    options = parser.parse_args()
    indices = with_one_effect(options.first)
    listed = []
    for _ in range(options.cases):
        index = next(indices)
        found = of_a_case(options.seed, index)
        if not found:
            print(f"{index}: no rivals that this record can show", flush=True)
        for each in found:
            line = json.dumps(asdict(each))
            print(line, flush=True)
            if options.record is not None:
                with options.record.open("a", encoding="utf-8") as file:
                    file.write(f"{line}\n")
        listed += found
    print(table(listed))


if __name__ == "__main__":
    main()
