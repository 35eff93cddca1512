"""The blind bench: `python -m tests.blind [--cases N] [--rigs N] [--seed S] [--workers N | --cluster ADDRESS]
[--write docs/blind.md]`.

A case is drawn, recorded and diagnosed by one worker. Those of a cluster need this checkout on their path.
"""

from __future__ import annotations

import argparse
import sys
from collections import defaultdict
from functools import partial
from itertools import chain
from pathlib import Path

from api.computing import Computing
from identify.estimation.executor import chosen_executor
from identify.recording.errors import InputError
from tests.blind.score import Score, of_a_joint, of_a_rig

AIM = {
    "null": 95,
    "noisy null": 95,
    "strong": 97,
    "weak": 90,
    "pair": 90,
    "uncatalogued": 85,
    "rig null": 95,
    "rig catalogued": 97,
    "rig pair": 90,
    "rig uncatalogued": 85,
}
HEAD = """# The diagnosis on hidden effects

{count} experiments, seed {seed}; `make blind` prints this. The test joint (`tests/plants/single_joint.py`) has parameters,
noise, payloads and motion of its own in every case; its effects are scaled: strong ones cause at least half of the
residual's power, weak ones a fifth to under a half. {rigs}

Right means: the hidden effect first and verdict `missing`; both of a pair named; `adequate` where nothing is hidden;
`unexplained` where the effect is in no catalogue. Two names for what these payloads cannot tell apart count as one if the
diagnosis says so. The last column counts the cases in which something was named beside what is hidden.

| class | cases | right | part | aim | median time | something beside |
|---|---|---|---|---|---|---|
"""
RIGS = """The rigs are `drivers/simulated` over the virtual bus, three
payload sessions of 30 s each; their effects are drawn from a range of what machines have."""


def table(scores: list[Score], seed: int) -> str:
    """The table by class and the cases that went wrong, as Markdown."""
    by_kind: dict[str, list[Score]] = defaultdict(list)
    for score in scores:
        by_kind[score.case.kind].append(score)
    lines = []
    for kind, aim in AIM.items():
        own = by_kind.get(kind, [])
        if own:
            right = sum(score.right for score in own)
            middle = sorted(score.seconds for score in own)[len(own) // 2]
            beside = sum(bool(score.beside) for score in own)
            part = f"{100 * right / len(own):.0f} %"
            lines.append(f"| {kind} | {len(own)} | {right} | {part} | {aim} % | {middle:.1f} s | {beside} |")
    lines += ["", "What went wrong:", "", "| class | hidden | said | seed |", "|---|---|---|---|"]
    for score in scores:
        if not score.right:
            said = f"{score.verdict}: {', '.join(score.missing)}" if score.missing else score.verdict
            lines.append(f"| {score.case.kind} | {score.case} | {said} | {score.case.seed} |")
    rigs = (
        RIGS
        if any(kind.startswith("rig") for kind in by_kind)
        else "This run had no simulated rigs (`--rigs N`)."
    )
    return HEAD.format(count=len(scores), seed=seed, rigs=rigs) + "\n".join(lines) + "\n"


def main() -> None:
    """Draw the cases, diagnose them where the options say, print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=200, help="of the test joint")
    parser.add_argument("--rigs", type=int, default=40, help="simulated rigs")
    parser.add_argument("--seed", type=int, default=2026)
    parser.add_argument("--workers", type=int, default=2, help="processes of this machine")
    parser.add_argument("--cluster", help="a Dask scheduler whose workers are used instead (tcp://host:8786)")
    parser.add_argument("--write", type=Path)
    options = parser.parse_args()
    scores: list[Score] = []
    if options.workers < 1:
        parser.error("--workers: must be 1 or more")
    try:
        with Computing(1 if options.cluster else options.workers, options.cluster)():
            place = chosen_executor()
            joints = place(partial(of_a_joint, options.seed), range(options.cases))
            rigs = place(partial(of_a_rig, options.seed), range(options.rigs))
            for score in chain(joints, rigs):
                scores.append(score)
                mark = "right" if score.right else "WRONG"
                print(mark, score.case.kind, score.case, score.verdict, *score.missing, flush=True)
    except InputError as error:
        print(error, file=sys.stderr)
        raise SystemExit(2) from None
    text = table(scores, options.seed)
    print(text)
    if options.write:
        options.write.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
