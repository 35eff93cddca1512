"""A candidate: its columns in the observation, how many parameters it has, and which estimates it cannot have."""

from types import SimpleNamespace

import numpy as np
import pytest

from identify.diagnosis import candidates
from identify.diagnosis.candidates import Candidate, find_candidates
from identify.effects.admissible import Admissible
from identify.effects.effect import DeclaredLoad


def candidate(
    constants=({"v": 0.1}, {"v": 0.2}, {"v": 0.3}), first=4, parameters=2, load=DeclaredLoad.CORRECTED
):
    effect = SimpleNamespace(
        name="stribeck",
        declared_load=load,
        from_derivatives=False,
        parameters_of=lambda summary, chosen: ["p"] * parameters,
        reported_offset=lambda chosen: 10.0 * chosen["v"],
    )
    return Candidate(SimpleNamespace(effect=effect, joint=1), 2, constants, first, 1, None)


@pytest.fixture
def observation():
    """Ten slots; slot k has columns 10 k and 10 k + 1."""
    return SimpleNamespace(slot_columns=[np.array([10 * k, 10 * k + 1]) for k in range(10)])


def test_each_choice_of_its_constants_has_the_columns_of_its_own_slot(observation):
    assert candidate().columns(observation, 0).tolist() == [40, 41]
    assert candidate().columns(observation, 2).tolist() == [60, 61]


def test_a_trial_has_the_columns_and_bounds_of_every_choice(observation, monkeypatch):
    asked = []
    monkeypatch.setattr(
        candidates, "own_values", lambda term, chosen, count, summary: asked.append((chosen["v"], count))
    )
    trial = candidate().trial(observation)
    assert [columns.tolist() for columns in trial.variants] == [[40, 41], [50, 51], [60, 61]]
    assert asked == [(0.1, 2), (0.2, 2), (0.3, 2)]


def test_a_constant_that_was_searched_counts_as_a_parameter_and_one_that_was_not_does_not(observation):
    assert candidate().complexity(observation, 1) == 3
    assert candidate(constants=({"v": 0.1},)).complexity(observation, 0) == 2


def test_its_parameters_bear_the_joint_s_number(monkeypatch):
    named = [SimpleNamespace(name="FS", unit="N m"), SimpleNamespace(name="vS", unit="rad/s")]
    monkeypatch.setattr(candidates, "named_parameters", lambda *of: named)
    assert candidate().parameters(2, 0) == [("FS2", "N m"), ("vS2", "rad/s")]


def test_it_is_known_by_its_effect_and_the_joint_that_it_is_judged_on():
    assert candidate().key == ("stribeck", 2)
    assert candidate().reported_offset(2) == pytest.approx(3.0)
    assert candidate().beside_ratio
    others = [load for load in DeclaredLoad if load is not DeclaredLoad.CORRECTED]
    assert others
    assert not any(candidate(load=load).beside_ratio for load in others)


# Two parameters between 0 and 5, of which the second is at most the first: p0 - p1 >= 0.
BOUNDS = Admissible(np.zeros(2), np.full(2, 5.0), np.array([[1.0, -1.0]]), np.zeros(1))


@pytest.mark.parametrize(
    ("estimates", "outside"),
    [
        ((3.0, 2.0), (False, False)),
        ((0.0, 0.0), (False, False)),
        ((5.0, 5.0), (False, False)),
        ((-0.1, -1.0), (True, True)),
        ((5.1, 2.0), (True, False)),
        ((3.0, -0.1), (False, True)),
        ((2.0, 3.0), (True, True)),  # each may be, both together may not
    ],
)
def test_estimates_outside_its_bounds_are_named_and_all_where_they_cannot_be_together(
    monkeypatch, estimates, outside
):
    monkeypatch.setattr(candidates, "own_values", lambda *of: BOUNDS)
    assert tuple(candidate().outside(np.array(estimates), 0)) == outside


def test_nothing_is_known_of_some_of_its_columns_only(monkeypatch):
    monkeypatch.setattr(candidates, "own_values", lambda *of: BOUNDS)
    assert not candidate(parameters=3).outside(np.array([-1.0, -1.0]), 0).any()


def effect(name, reason="", choices=1):
    return SimpleNamespace(
        name=name,
        prevented=lambda summary: reason,
        grid=lambda summary: [{"c": float(k)} for k in range(choices)],
        searched=lambda summary: choices - 1,
    )


def terms(made, joints, gain):
    return [SimpleNamespace(effect=made, joint=joints[0], key=(made.name, joints[0]))]


def test_every_effect_that_a_joint_s_model_lacks_is_a_candidate_with_slots_of_its_own(monkeypatch):
    known = {
        each.name: each
        for each in (effect("a", choices=3), effect("b"), effect("c", "no temperature"), effect("d"))
    }
    monkeypatch.setattr(candidates, "terms_of", terms)
    monkeypatch.setattr(candidates, "rows_of", lambda record, term: [] if term.key == ("d", 1) else [0, 1])
    model = SimpleNamespace(
        has=lambda name, joint: (name, joint) == ("a", 0), terms=[SimpleNamespace(key=("b", 1))]
    )
    record = SimpleNamespace(experiment=SimpleNamespace(drive_gain=None))
    summaries = [SimpleNamespace(joint=0, name="j1"), SimpleNamespace(joint=1, name="j2")]
    found, left_out = find_candidates(record, model, known, summaries, first=7)
    # on j1 all but `a`, which it has; on j2 all but `b`, which it has by another way, and `d`, which acts on no row of it
    assert [(each.name, each.judged, each.first, len(each.constants)) for each in found] == [
        ("b", 0, 7, 1),
        ("d", 0, 8, 1),
        ("a", 1, 9, 3),
    ]
    assert [(each.effect, each.joint, each.reason) for each in left_out] == [
        ("c", "j1", "no temperature"),
        ("c", "j2", "no temperature"),
    ]
    assert [each.summary.name for each in found] == ["j1", "j1", "j2"]
