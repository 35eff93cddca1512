"""A small fixed part of the blind bench: sixteen cases of the joint as it is, 30 s at 250 Hz.

Their strengths were scaled as the bench does (the scaling costs as much as the diagnosis). `make blind` runs the whole
bench, in which every case has a joint, payloads and motion of its own.
"""

from __future__ import annotations

from collections import Counter

import pytest

from tests.blind.cases import Case
from tests.blind.score import Score, diagnose_blindly
from tests.plants.single_joint import Joint

DRAWN: tuple[tuple[str, int, dict[str, float]], ...] = (
    ("null", 1014583970, {}),
    ("noisy null", 620936792, {}),
    ("strong", 322301094, {"elasticity": 0.076}),
    ("strong", 141133399, {"backlash": 0.103}),
    ("weak", 298957224, {"load-friction-asymmetric": 0.031}),
    ("weak", 625500707, {"friction-position": 0.099}),
    ("pair", 1061887872, {"joint-spring": 0.92, "torque-ripple": 0.068}),
    ("uncatalogued", 123172614, {"one-sided-bumper": 0.075}),
    ("null", 1041813759, {}),
    ("noisy null", 884186716, {}),
    ("strong", 533513788, {"viscous-asymmetric": 0.081}),
    ("strong", 1040475359, {"backlash": 0.174}),
    ("weak", 4009611, {"friction-temperature": 0.089}),
    ("weak", 1036048826, {"viscous-quadratic": 0.132}),
    ("pair", 796470490, {"delay": 0.122, "torque-ripple": 0.062}),
    ("uncatalogued", 658147012, {"shaking-base": 0.093}),
)

NOISY = Joint(command_noise=3 * Joint.command_noise, slow_noise=3 * Joint.slow_noise)


@pytest.fixture(scope="module")
def scores() -> list[Score]:
    return [
        diagnose_blindly(
            Case(kind, seed, effects, 250.0, 30.0, 2, joint=NOISY if kind == "noisy null" else Joint())
        )
        for kind, seed, effects in DRAWN
    ]


def right(scores: list[Score]) -> Counter[str]:
    return Counter(score.kind for score in scores if score.right)


def wrong(scores: list[Score]) -> list[tuple[str, tuple[str, ...], str, tuple[str, ...]]]:
    """What to print when a count is not what it was."""
    return [(score.kind, score.names, score.verdict, score.missing) for score in scores if not score.right]


def test_nothing_is_blamed_on_quiet_and_on_noisy_records_without_a_fault(scores):
    assert (right(scores)["null"], right(scores)["noisy null"]) == (2, 2), wrong(scores)


def test_strong_and_weak_effects_are_named_first(scores):
    assert (right(scores)["strong"], right(scores)["weak"]) == (4, 4), wrong(scores)


def test_both_of_a_pair_are_named(scores):
    assert right(scores)["pair"] == 2, wrong(scores)


def test_what_no_catalogue_holds_is_called_unexplained(scores):
    assert right(scores)["uncatalogued"] == 2, wrong(scores)


def test_a_wrong_answer_is_scored_as_wrong():
    """The score can fail: an effect that hides under the name of nothing is a false alarm."""
    mislabelled = Case("null", 533513788, {"viscous-asymmetric": 0.3}, 250.0, 30.0, 2)
    assert not diagnose_blindly(mislabelled).right
