"""Two effects that only help together: on columns made here, against least squares on the rows themselves."""

from __future__ import annotations

import numpy as np
import pytest

from identify.diagnosis import pairs
from identify.diagnosis.pairs import Pairs
from tests.identify.diagnosis.test_selection import (
    ROWS,
    ChosenColumns,
    held_out_square,
    names,
    random_columns,
    selection,
)


def hidden_pair(seed: int):
    """Columns of which 1 and 2 explain a cause together, each alone next to nothing; and Y without it, and the cause."""
    matrix, noise = random_columns(4, seed=seed)
    cause = np.random.default_rng(seed + 1).standard_normal(ROWS)
    matrix[:, 1] = cause + 12.0 * matrix[:, 2]
    return matrix, matrix[:, 0] + noise, cause


def test_two_effects_that_only_help_together_are_added_together():
    generator = np.random.default_rng(4)
    matrix, noise = random_columns(4, seed=5)
    cause = generator.standard_normal(ROWS)
    matrix[:, 1] = (
        cause + 12.0 * matrix[:, 2]
    )  # alone it explains next to nothing of the cause, and the other none
    measured = matrix[:, 0] + 2.0 * cause + noise
    candidates = [
        ChosenColumns(name, ((column,),)) for name, column in (("one", 1), ("other", 2), ("idle", 3))
    ]
    searched = selection([(matrix, measured)], candidates)
    findings, added = searched.search(set(), [0.0])
    assert not any(each.justified for each in findings[0])
    assert sorted(names(added)) == ["one", "other"]
    together = held_out_square(matrix[:, [0]], measured) - held_out_square(matrix[:, [0, 1, 2]], measured)
    assert len(searched.search(set(), [0.999 * together])[1]) == 2
    assert searched.search(set(), [1.001 * together])[1] == []
    impossible = [ChosenColumns("one", ((1,),), possible=False), *candidates[1:]]
    assert selection([(matrix, measured)], impossible).search(set(), [0.0])[1] == []


def test_pairs_come_the_strongest_first_and_each_is_asked_of_its_own_joint():
    matrix, plain, cause = hidden_pair(20)
    candidates = [
        ChosenColumns(name, ((column,),)) for name, column in (("one", 1), ("other", 2), ("idle", 3))
    ]
    searched = selection([(matrix, plain + 2.0 * cause)], candidates)
    asked = Pairs(searched.observation, searched.motion, 0, np.array([0]), 3)
    strong = asked.strong(searched.findings(0), 0.0)
    drops = [drop for drop, _ in strong]
    assert drops == sorted(drops, reverse=True)
    before = held_out_square(matrix[:, [0]], plain + 2.0 * cause)
    after = held_out_square(matrix[:, [0, 1, 2]], plain + 2.0 * cause)
    assert drops[0] == pytest.approx(1 - np.sqrt(after / before), rel=1e-8)
    assert sorted(names(strong[0][1])) == ["one", "other"]
    assert asked.holds(strong[0][1])
    # an idle column explains nothing beside the other
    assert not asked.holds([(candidates[0], 0), (candidates[2], 0)])
    assert asked.strong(searched.findings(0)[:1], 0.0) == []


@pytest.mark.parametrize(("strength", "asked_of"), [(0.25, {0}), (6.0, {0, 1})])
def test_nobody_asks_whether_a_pair_holds_that_another_joint_makes_wait(monkeypatch, strength, asked_of):
    matrix, plain, cause = hidden_pair(30)
    other, plain_of_other, cause_of_other = hidden_pair(40)
    single, noise = random_columns(2, seed=50)
    candidates = [
        ChosenColumns("one", ((1,),)),
        ChosenColumns("other", ((2,),)),
        ChosenColumns("left", ((5,),), judged=1),
        ChosenColumns("right", ((6,),), judged=1),
        ChosenColumns("alone", ((9,),), judged=2),
    ]
    searched = selection(
        [
            (matrix, plain + 6.0 * cause),
            (other, plain_of_other + strength * cause_of_other),
            (single, single[:, 0] + 4.0 * single[:, 1] + noise),
        ],
        candidates,
        model=(0, 4, 8),
    )
    joints: set[int] = set()
    evidence = pairs.group_evidence

    def counted(observation, joint, base, extra):
        joints.add(joint)
        return evidence(observation, joint, base, extra)

    monkeypatch.setattr(pairs, "group_evidence", counted)
    findings, added = searched.search(set(), [0.0] * 3)
    assert joints == asked_of
    assert {"one", "other", "alone"} <= set(names(added))
    assert ("left" in names(added)) == (1 in asked_of)
    # what was found stands for the next search, in which something is refused
    again, without = searched.search({("alone", 2)}, [0.0] * 3, findings)
    assert again == findings
    assert "alone" not in names(without)
    assert set(names(without)) == set(names(searched.search({("alone", 2)}, [0.0] * 3)[1]))
