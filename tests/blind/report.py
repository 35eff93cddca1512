"""The page of the blind bench: the table by class, the reliability of the probabilities, and what went wrong."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from tests.blind.noise import holds, within
from tests.blind.score import Score

AIM = {
    "null": 98,
    "noisy null": 98,
    "strong": 98,
    "weak": 92,
    "pair": 92,
    "uncatalogued": 90,
    "loop null": 98,
    "loop strong": 98,
    "loop weak": 92,
    "loop uncatalogued": 90,
    "rig null": 98,
    "rig catalogued": 98,
    "rig pair": 92,
    "rig uncatalogued": 90,
    "arm null": 98,
    "arm strong": 98,
    "arm weak": 92,
    "plasmode strong": 90,
    "plasmode weak": 70,
}
"""Per cent."""
EDGES = (0.0, 0.05, 0.2, 0.4, 0.6, 0.8, 0.95, 1.0)
"""of the bins of the reliability diagram"""
HEAD = """# The diagnosis on hidden effects

{count} experiments, seed {seeds}; `make blind` prints this, [bench.md](bench.md) says how it is scored and how to submit.
The test joint (`tests/plants/single_joint.py`) has parameters, noise, payloads and motion of its own in every case. The loops
(`tests/plants/closed_loop.py`) are arms under a position controller with the disturbance inside the loop, each with its own
controller, bandwidth, noise and drift. The rigs are `drivers/simulated` over the virtual bus, the arms have two or three
coupled joints (`tests/plants/planar_arm.py`), one of which hides something. Effects are scaled: strong ones cause at
least half of the residual's power, weak ones a fifth to under a half. Plasmodes are real records with an effect put into one
joint's torque that adds 1.5 (strong) or 0.6 times (weak) what the usual model leaves.

Right means: the hidden effect first and verdict `missing`; both of a pair named; `adequate` where nothing is hidden;
`unexplained` where the effect is in no catalogue. Two names for what these payloads cannot tell apart count as one if the
diagnosis says so. The interval (95 %, Wilson) is that of the part; `beside`: cases in which something was named beside what is
hidden; `described`: cases in which a description was offered; `wrong joint`: of the cases with more than one joint those in which
something was named at a joint where nothing is hidden (in a plasmode beside what the diagnosis of the record itself names).

| class | cases | right | part | interval | aim | median time | beside | described | wrong joint |
|---|---|---|---|---|---|---|---|---|---|
"""


def page(scores: Sequence[Score]) -> str:
    """The page, as Markdown."""
    seeds = ", ".join(str(seed) for seed in sorted({score.seed for score in scores}))
    return "\n".join(
        [
            HEAD.format(count=len(scores), seeds=seeds) + "\n".join(_by_class(scores)),
            "",
            *_wrong_joint(scores),
            *_reliability(scores),
            "",
            *_floors(scores),
            "",
            *_wrong(scores),
            "",
        ]
    )


def _by_class(scores: Sequence[Score]) -> list[str]:
    by_kind: dict[str, list[Score]] = defaultdict(list)
    for score in scores:
        by_kind[score.kind].append(score)
    lines = []
    for kind, aim in AIM.items():
        listed = by_kind.get(kind, [])
        if listed:
            right = sum(score.right for score in listed)
            low, high = wilson(right, len(listed))
            middle = sorted(score.seconds for score in listed)[len(listed) // 2]
            beside = sum(bool(score.beside) for score in listed)
            described = sum(score.learned is not None for score in listed)
            lines.append(
                f"| {kind} | {len(listed)} | {right} | {100 * right / len(listed):.0f} % | {100 * low:.0f} to {100 * high:.0f} %"
                f" | {aim} % | {middle:.1f} s | {beside} | {described} | {_elsewhere(listed)} |"
            )
    return lines


def _elsewhere(scores: Sequence[Score]) -> str:
    """How many of the cases with more than one joint, and of how many."""
    several = [score.elsewhere for score in scores if score.elsewhere is not None]
    return f"{sum(map(bool, several))} of {len(several)}" if several else "–"


def _wrong_joint(scores: Sequence[Score]) -> list[str]:
    several = [score for score in scores if score.elsewhere is not None]
    wrong = [score for score in several if score.elsewhere]
    if not several:
        return []
    part = 100 * len(wrong) / len(several)
    low, high = (100 * each for each in wilson(len(wrong), len(several)))
    lines = [
        f"A wrong joint is blamed in {len(wrong)} of {len(several)} cases with more than one"
        f" ({part:.1f} %, {low:.0f} to {high:.0f} %; aim: 1 %).",
    ]
    lines += [
        f"- {score.hidden}: {', '.join(score.elsewhere or ())} ({score.seed}, {score.index})"
        for score in wrong
    ]
    return [*lines, ""]


def _floors(scores: Sequence[Score]) -> list[str]:
    """The noise floors by plant, where noise is known."""
    known = [(score.plant, score.floor) for score in scores if score.floor is not None]
    if not known:
        return []
    lines = [
        "## Noise floors",
        "",
        "Where the plant tells what noise leaves: the floor beside it. `null`: none was given; aim: within 15 % in nine of ten,",
        "and none above the error of the model with what was found missing.",
        "",
        "| plant | motion | cases | null | given | within 15 % | interval holds the truth | above the error |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for plant in dict.fromkeys(plant for plant, _ in known):
        for repeats in (True, False):
            of_these = [floor for name, floor in known if name == plant and floor.repeats is repeats]
            given = [floor for floor in of_these if floor.said is not None]
            if of_these:
                near, inside = sum(map(within, given)), sum(map(holds, given))
                above = sum((floor.said or 0.0) > floor.error * (1 + 1e-6) for floor in given)
                motion = "repeats" if repeats else "does not repeat"
                lines.append(
                    f"| {plant} | {motion} | {len(of_these)} | {len(of_these) - len(given)} | {len(given)} | {near}"
                    f" | {inside} | {above} |"
                )
    return [*lines, ""]


def wilson(right: int, count: int, z: float = 1.96) -> tuple[float, float]:
    """Interval of a part (E. B. Wilson, J. Am. Stat. Assoc. 22, 1927)."""
    part = right / count
    centre = (part + z**2 / (2 * count)) / (1 + z**2 / count)
    half = z / (1 + z**2 / count) * np.sqrt(part * (1 - part) / count + z**2 / (4 * count**2))
    return max(0.0, float(centre - half)), min(1.0, float(centre + half))


def reliability(
    statements: Sequence[tuple[float, float]],
) -> tuple[list[tuple[float, float, int, float, float]], float]:
    """Of the statements in each bin of probability: its edges, how many, their mean probability, and what part is true; and
    the expected calibration error, the mean distance of the two weighted by the number (Naeini, Cooper, Hauskrecht 2015)."""
    said = np.array([probability for probability, _ in statements])
    true = np.array([truth for _, truth in statements], float)
    rows, error = [], 0.0
    for low, high in pairwise(EDGES):
        inside = (said >= low) & ((said < high) | (high == EDGES[-1]))
        count = int(inside.sum())
        if count:
            mean, part = float(said[inside].mean()), float(true[inside].mean())
            rows.append((low, high, count, mean, part))
            error += count / len(said) * abs(mean - part)
    return rows, error


def _reliability(scores: Sequence[Score]) -> list[str]:
    statements = [each for score in scores for each in score.statements]
    if not statements:
        return []
    rows, error = reliability(statements)
    lines = [
        "## Reliability of the probabilities",
        "",
        "Of all that was said with a probability (that nothing is missing, that nothing known is, that an effect is missing;",
        f"effects from 0.05 on): what part is true. The expected calibration error is {error:.3f} over {len(statements)}",
        "statements (aim: 0.05).",
        "",
        "| said | statements | mean of what was said | true | |",
        "|---|---|---|---|---|",
    ]
    for low, high, count, mean, part in rows:
        bar = "█" * round(20 * part) + "·" * (20 - round(20 * part))
        lines.append(f"| {low:g} to {high:g} | {count} | {mean:.2f} | {part:.2f} | `{bar}` |")
    return lines


def _wrong(scores: Sequence[Score]) -> list[str]:
    lines = ["What went wrong:", "", "| class | hidden | said | seed, index |", "|---|---|---|---|"]
    for score in scores:
        if not score.right:
            said = f"{score.verdict}: {', '.join(score.missing)}" if score.missing else score.verdict
            lines.append(f"| {score.kind} | {score.hidden} | {said} | {score.seed}, {score.index} |")
    return lines
