"""The blind bench: `python -m tests.blind [--cases N] [--loops N] [--rigs N] [--arms N] [--plasmodes N] [--seed S]
[--workers N | --cluster ADDRESS] [--record FILE] [--part K/N] [--write docs/blind.md]`.

A case is drawn, recorded and diagnosed by one worker. Those of a cluster need this checkout on their path. With `--record` every
score is written to a file as soon as it is there, and cases that the file has are not run again: a run that was broken off
goes on, and parts that several machines ran (`--part 1/3` …) are put together with `--merge FILE…`.
"""

from __future__ import annotations

import argparse
import sys
from functools import partial
from pathlib import Path

from api.computing import Computing
from identify.estimation.executor import chosen_executor
from identify.recording.errors import InputError
from tests.blind.plasmodes import data, present
from tests.blind.report import page
from tests.blind.score import Score, of_a_case

PLANTS = {"joint": "cases", "loop": "loops", "rig": "rigs", "arm": "arms", "plasmode": "plasmodes"}
"""The plants and the options that say how many cases of each."""


def recorded(files: list[Path]) -> list[Score]:
    """The scores in some records; of one case that stands in several the first. A last line that was cut off is left out.

    Raises InputError: a line is no score.
    """
    scores: dict[tuple[str, int, int], Score] = {}
    for file in files:
        lines = file.read_text(encoding="utf-8").split("\n")
        for number, line in enumerate(lines[:-1], start=1):
            try:
                score = Score.of_line(line)
            except (ValueError, TypeError, KeyError):
                raise InputError(f"{file}: line {number}: no score of the blind bench") from None
            scores.setdefault((score.plant, score.seed, score.index), score)
    return list(scores.values())


def part_of(text: str) -> tuple[int, int]:
    """`K/N`: the K-th of N parts."""
    place, _, count = text.partition("/")
    if not (place.isdecimal() and count.isdecimal() and 1 <= int(place) <= int(count)):
        raise argparse.ArgumentTypeError(f"{text}: give K/N, K from 1 to N, such as 1/3")
    return int(place), int(count)


def main() -> None:
    """Draw the cases, diagnose them where the options say, print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=320, help="of the test joint, moved as planned")
    parser.add_argument("--loops", type=int, default=240, help="of arms in closed loop")
    parser.add_argument("--rigs", type=int, default=40, help="simulated rigs")
    parser.add_argument(
        "--arms", type=int, default=80, help="of two or three joints, one of which hides something"
    )
    parser.add_argument("--plasmodes", type=int, default=0, help="effects put into the measured records")
    parser.add_argument("--seed", type=int, default=2026)
    parser.add_argument("--workers", type=int, default=2, help="processes of this machine")
    parser.add_argument("--cluster", help="a Dask scheduler whose workers are used instead (tcp://host:8786)")
    parser.add_argument("--record", type=Path, help="keep every score in this file and go on where it ends")
    parser.add_argument("--part", type=part_of, default=(1, 1), help="run only the K-th of N parts: K/N")
    parser.add_argument("--merge", type=Path, nargs="+", help="run nothing; put these records together")
    parser.add_argument("--write", type=Path)
    options = parser.parse_args()
    if options.plasmodes and not present():
        parser.error(f"--plasmodes: there are no measured records in {data()}; set COULOMB_MEASURED_DATA")
    if options.workers < 1:
        parser.error("--workers: must be 1 or more")
    try:
        scores = recorded(options.merge) if options.merge else run(options)
    except InputError as error:
        print(error, file=sys.stderr)
        raise SystemExit(2) from None
    text = page(scores)
    print(text)
    if options.write:
        options.write.write_text(text, encoding="utf-8")


def run(options: argparse.Namespace) -> list[Score]:
    """The scores of the cases that the options ask for, those of an earlier run included.

    Raises InputError: the record is none, or there is no such cluster.
    """
    known = recorded([options.record]) if options.record is not None and options.record.exists() else []
    if options.record is not None:  # without a last line that was cut off
        options.record.parent.mkdir(parents=True, exist_ok=True)
        options.record.write_text("".join(f"{score.line()}\n" for score in known), encoding="utf-8")
    done = {(score.plant, score.index) for score in known if score.seed == options.seed}
    place, parts = options.part
    counts = {plant: int(getattr(options, option)) for plant, option in PLANTS.items()}
    listed = [(plant, index) for plant, count in counts.items() for index in range(count)]
    # plants take turns, so that a run that is broken off has some of each
    listed.sort(key=lambda case: case[1] / counts[case[0]])
    wanted = [case for case in listed if case[1] % parts == place - 1 and case not in done]
    scores = list(known)
    with Computing(1 if options.cluster else options.workers, options.cluster)():
        for score in chosen_executor()(partial(of_a_case, options.seed), wanted):
            scores.append(score)
            if options.record is not None:
                with options.record.open("a", encoding="utf-8") as file:
                    file.write(f"{score.line()}\n")
            mark = "right" if score.right else "WRONG"
            print(mark, score.kind, score.hidden, score.verdict, *score.missing, flush=True)
    return scores


if __name__ == "__main__":
    main()
