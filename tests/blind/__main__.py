"""The blind bench: `python -m tests.blind [--cases N] [--seed S] [--write docs/blind.md]`."""

from __future__ import annotations

import argparse
from collections import defaultdict
from concurrent.futures import ProcessPoolExecutor
from itertools import repeat
from pathlib import Path

from tests.blind.cases import draw
from tests.blind.score import Score, diagnose_blindly

AIM = {"null": 95, "noisy null": 95, "strong": 97, "weak": 90, "pair": 90, "uncatalogued": 85}


def table(scores: list[Score], seed: int) -> str:
    """The table by class and the cases that went wrong, as Markdown."""
    by_kind: dict[str, list[Score]] = defaultdict(list)
    for score in scores:
        by_kind[score.case.kind].append(score)
    lines = [
        "# The diagnosis on hidden effects",
        "",
        f"{len(scores)} experiments of the test joint (`tests/plants/single_joint.py`), seed {seed}; `make blind` prints this.",
        "Right means: the hidden effect first and verdict `missing`; both of a pair named; `adequate` where nothing is hidden;",
        "`unexplained` where the effect is in no catalogue. Strong effects cause at least half of the residual's power, weak",
        "ones a fifth to under a half.",
        "",
        "| class | cases | right | part | aim | median time |",
        "|---|---|---|---|---|---|",
    ]
    for kind, aim in AIM.items():
        own = by_kind.get(kind, [])
        if own:
            right = sum(score.right for score in own)
            middle = sorted(score.seconds for score in own)[len(own) // 2]
            lines.append(
                f"| {kind} | {len(own)} | {right} | {100 * right / len(own):.0f} % | {aim} % | {middle:.1f} s |"
            )
    lines += [
        "",
        "What went wrong:",
        "",
        "| class | hidden | said | seed, rate, duration, repeats |",
        "|---|---|---|---|",
    ]
    for score in scores:
        if not score.right:
            case = score.case
            hidden = (
                ", ".join(f"{name} × {strength:.2g}" for name, strength in case.effects.items()) or "nothing"
            )
            said = f"{score.verdict}: {', '.join(score.missing)}" if score.missing else score.verdict
            where = f"{case.seed}, {case.rate:.0f} Hz, {case.duration:.0f} s, {case.repeats}"
            lines.append(f"| {case.kind} | {hidden} | {said} | {where} |")
    return "\n".join(lines) + "\n"


def _drawn_and_diagnosed(seed: int, index: int) -> Score:
    return diagnose_blindly(draw(seed, index))


def main() -> None:
    """Draw the cases, diagnose them in two processes, print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=240)
    parser.add_argument("--seed", type=int, default=2026)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--write", type=Path)
    options = parser.parse_args()
    scores: list[Score] = []
    with ProcessPoolExecutor(options.processes) as pool:
        for score in pool.map(_drawn_and_diagnosed, repeat(options.seed), range(options.cases)):
            scores.append(score)
            mark = "right" if score.right else "WRONG"
            print(mark, score.case.kind, score.case.effects, score.verdict, *score.missing, flush=True)
    text = table(scores, options.seed)
    print(text)
    if options.write:
        options.write.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
