"""Which of some effects are added to a model: on columns made here, where what is missing is known.

What an effect gains is compared with least squares on the rows themselves, fold after fold, without products or Schur
complements.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from identify.diagnosis.deciding_constants import FOLDS, NEARLY_ALL, SIGNIFICANCE
from identify.diagnosis.held_out import Trial
from identify.diagnosis.selection import Selection
from identify.effects.effect import DeclaredLoad
from tests.identify.diagnosis.findings import finding, held_out, instruments
from tests.identify.estimation.synthetic_observation import observation_of

ROWS, BLOCKS = 1200, 40


@dataclass(frozen=True)
class ChosenColumns:
    """A candidate that is nothing but columns of the observation, one set for each choice of its constants."""

    name: str
    variants: tuple[tuple[int, ...], ...]
    judged: int = 0
    constants: int = 0
    possible: bool = True
    from_derivatives: bool = False
    declared_load: DeclaredLoad = DeclaredLoad.CORRECTED
    searched: int = 1

    @property
    def beside_ratio(self) -> bool:
        return self.declared_load is DeclaredLoad.CORRECTED

    @property
    def term(self) -> Any:
        return type("Term", (), {"key": (self.name, self.judged)})

    def columns(self, _observation, variant):
        return np.array(self.variants[variant], np.intp)

    def trial(self, observation):
        return Trial(tuple(self.columns(observation, each) for each in range(len(self.variants))))

    def complexity(self, observation, variant):
        return len(self.columns(observation, variant)) + self.constants

    def outside(self, estimates, _variant):
        return np.full(len(estimates), not self.possible)


def selection(joints, candidates, model=(0,), sessions=1, loop: Any = None) -> Any:
    """joints : for each joint its columns (samples, k) and Y; all columns are numbered through."""
    first, columns, rows = 0, [], []
    for matrix, measured in joints:
        columns.append(np.arange(first, first + matrix.shape[1]))
        rows.append(np.column_stack([matrix, measured]))
        first += matrix.shape[1]
    observation = observation_of(rows, columns, first, BLOCKS, sessions)
    return Selection(
        observation, np.ones(len(joints)), candidates, np.array(model, np.intp), np.zeros(0, np.intp), loop
    )


def random_columns(count: int, seed: int):
    generator = np.random.default_rng(seed)
    return generator.standard_normal((ROWS, count)), 0.3 * generator.standard_normal(ROWS)


def held_out_square(matrix, measured) -> float:
    """Squared error on the rows of each fold of a fit to all others, in which it keeps the weight of one sample."""
    folds = np.repeat(np.arange(FOLDS), ROWS // FOLDS)
    kept, total = FOLDS / ROWS, 0.0
    for fold in range(FOLDS):
        weight = np.sqrt(np.where(folds == fold, kept, 1 + kept))
        fit = np.linalg.lstsq(weight[:, None] * matrix, weight * measured, rcond=None)[0]
        total += float(np.sum((measured[folds == fold] - matrix[folds == fold] @ fit) ** 2))
    return total


def names(additions) -> list[str]:
    return [candidate.name for candidate, _ in additions]


def test_the_missing_effect_is_added_and_gains_what_rows_left_out_say():
    matrix, noise = random_columns(4, seed=1)
    measured = 3.0 * matrix[:, 0] + 0.8 * matrix[:, 2] + noise
    candidates = [ChosenColumns(f"effect {column}", ((column,),)) for column in (1, 2, 3)]
    searched = selection([(matrix, measured)], candidates)
    findings, added = searched.search(set(), [0.0])
    assert names(added) == ["effect 2"]
    best = findings[0][0]
    assert best.candidate.name == "effect 2"
    without = held_out_square(matrix[:, [0]], measured)
    gain = without - held_out_square(matrix[:, [0, 2]], measured)
    assert best.gain == pytest.approx(gain, rel=1e-8)
    assert best.measured == pytest.approx(measured @ measured)
    assert searched.held_out_error(0) == pytest.approx(np.sqrt(without / (measured @ measured)), rel=1e-8)
    assert searched.explains(0, np.array([2]))
    assert searched.explains(0, np.array([1, 3])) == (
        held_out_square(matrix[:, [0, 1, 3]], measured) < without
    )
    assert searched.worth(0, np.array([0]), np.array([2])) == pytest.approx(
        np.sqrt(without / (without - gain)) - 1, rel=1e-8
    )


def test_a_parameter_that_one_stretch_alone_tells_makes_no_guess_at_it():
    """The sign of a load that turns round within one stretch: in all others it is another offset."""
    matrix, noise = random_columns(3, seed=13)
    matrix[:, 1], matrix[:, 2] = 1.0, 1.0 + 1e-3 * matrix[:, 2]
    matrix[(np.arange(ROWS) > 500) & (np.arange(ROWS) < 520), 2] = -1.0
    measured = matrix @ [3.0, 0.5, 0.8] + noise
    searched = selection([(matrix, measured)], [], model=(0, 1, 2))
    of_noise = np.sqrt(noise @ noise / (measured @ measured))
    assert searched.held_out_error(0) == pytest.approx(of_noise, rel=0.05)
    assert searched.held_out_error(0) > of_noise * (1 - 2 * 3 / ROWS)


def test_what_is_refused_gains_too_little_or_cannot_be_is_not_added():
    matrix, noise = random_columns(3, seed=2)
    measured = matrix[:, 0] + 0.8 * matrix[:, 1] + noise
    missing = ChosenColumns("missing", ((1,),))
    searched = selection([(matrix, measured)], [missing, ChosenColumns("idle", ((2,),))])
    gain = searched.findings(0)[0].gain
    assert names(searched.search({("missing", 0)}, [0.0])[1]) == []
    assert names(searched.search(set(), [1.001 * gain])[1]) == []
    assert names(searched.search(set(), [0.999 * gain])[1]) == ["missing"]
    impossible = selection([(matrix, measured)], [ChosenColumns("missing", ((1,),), possible=False)])
    assert impossible.search(set(), [0.0])[1] == []


def test_the_choice_of_constants_is_the_one_that_explains():
    matrix, noise = random_columns(4, seed=3)
    measured = matrix[:, 0] - 0.7 * matrix[:, 3] + noise
    _, added = selection([(matrix, measured)], [ChosenColumns("searched", ((1,), (2,), (3,)))]).search(
        set(), [0.0]
    )
    assert [(candidate.name, variant) for candidate, variant in added] == [("searched", 2)]


def test_a_joint_that_gains_little_beside_another_waits():
    matrix, noise = random_columns(2, seed=6)
    other, its_noise = random_columns(2, seed=7)
    strong = (matrix, matrix[:, 0] + 3.0 * matrix[:, 1] + noise)
    candidates = [ChosenColumns("strong", ((1,),), judged=0), ChosenColumns("weak", ((3,),), judged=1)]

    def added(size: float) -> list[str]:
        joint = (other, other[:, 0] + size * other[:, 1] + its_noise)
        return names(selection([strong, joint], candidates, model=(0, 2)).search(set(), [0.0, 0.0])[1])

    assert added(0.2) == ["strong"]  # lowers its joint's error by a sixth, the strong one by nine tenths
    assert added(1.5) == ["strong", "weak"]


def test_of_effects_that_explain_alike_the_simpler_goes_first_and_names_the_other_as_its_rival():
    matrix, noise = random_columns(5, seed=8)
    matrix[:, 2] = matrix[:, 1] + 0.02 * matrix[:, 2]
    measured = matrix[:, 0] + 0.8 * matrix[:, 1] + noise
    simple, alike = ChosenColumns("simple", ((1,),)), ChosenColumns("alike", ((2,),), constants=2)
    idle = ChosenColumns("idle", ((4,),))
    searched = selection([(matrix, measured)], [idle, alike, simple])
    findings = searched.findings(0)
    assert [each.candidate.name for each in findings] == ["simple", "alike", "idle"]
    assert searched.rivals(findings[0], findings) == ("alike",)
    nothing_gained = finding(held_out(1.0), held_out(1.0))
    assert searched.rivals(nothing_gained, findings) == ()
    assert findings[1].gain >= NEARLY_ALL * findings[0].gain


def test_an_effect_that_explains_clearly_more_goes_first_however_complex():
    matrix, noise = random_columns(4, seed=9)
    matrix[:, 2] = matrix[:, 1] + 0.25 * matrix[:, 2]
    measured = matrix[:, 0] + 0.9 * matrix[:, 1] + 0.2 * noise
    cause, proxy = ChosenColumns("cause", ((1,),), constants=3), ChosenColumns("proxy", ((2,),))
    searched = selection([(matrix, measured)], [proxy, cause])
    findings = searched.findings(0)
    assert [each.candidate.name for each in findings] == ["cause", "proxy"]
    assert (
        findings[1].gain >= NEARLY_ALL * findings[0].gain
    )  # near enough to be a rival, if it were not decided
    assert searched.rivals(findings[0], findings) == ()


def test_a_term_that_says_nothing_beside_the_others_is_taken_out():
    matrix, noise = random_columns(4, seed=10)
    measured = matrix[:, 0] + 0.8 * matrix[:, 1] - 0.6 * matrix[:, 2] + noise
    added = [ChosenColumns(f"effect {column}", ((column,),)) for column in (1, 2, 3)]
    searched = selection([(matrix, measured)], added, model=(0, 1, 2, 3))
    kept = searched.beside_the_others(added, [0.0])
    assert [each.candidate.name for each in kept] == ["effect 1", "effect 2"]
    # each beside the other, and without the one that was taken out
    gain = held_out_square(matrix[:, [0, 2]], measured) - held_out_square(matrix[:, [0, 1, 2]], measured)
    assert kept[0].gain == pytest.approx(gain, rel=1e-8)
    assert [f.candidate.name for f in searched.beside_the_others(added, [1.001 * gain])] == []


def test_a_term_that_went_beside_one_that_went_as_well_is_asked_again():
    matrix, noise = random_columns(4, seed=10)
    measured = matrix[:, 0] + 0.9 * matrix[:, 1] + noise
    matrix[:, 2] = matrix[:, 1] + 0.2 * matrix[:, 2]
    impossible = ChosenColumns("nearer, with values that it cannot have", ((1,),), possible=False)
    near, idle = ChosenColumns("near", ((2,),)), ChosenColumns("idle", ((3,),))
    searched = selection([(matrix, measured)], [near, impossible, idle], model=(0, 1, 2, 3))
    beside = [searched._beside_the_rest(each, []) for each in (near, impossible)]
    assert beside[0].drop < beside[1].drop  # so that it goes first
    kept = searched.beside_the_others([impossible, near, idle], [0.0])
    assert [each.candidate.name for each in kept] == ["near"]
    gain = held_out_square(matrix[:, [0]], measured) - held_out_square(matrix[:, [0, 2]], measured)
    assert kept[0].gain == pytest.approx(gain, rel=1e-8)


def test_a_term_is_replaced_by_what_does_better_and_has_no_more_parameters():
    matrix, noise = random_columns(5, seed=11)
    matrix[:, 1] = matrix[:, 2] + 0.6 * matrix[:, 1]
    matrix[:, 3] = matrix[:, 2] + 0.001 * matrix[:, 3]
    measured = matrix[:, 0] + 0.9 * matrix[:, 2] + noise
    cause = ChosenColumns("cause", ((2,),))
    searched = selection([(matrix, measured)], [cause, ChosenColumns("idle", ((4,),))], model=(0, 1))
    assert searched.replacement(0, np.array([1]), 1) == (cause, 0)
    complex_cause = ChosenColumns("cause", ((2,),), constants=1)
    only_complex = selection([(matrix, measured)], [complex_cause], model=(0, 1))
    assert only_complex.replacement(0, np.array([1]), 1) is None
    assert only_complex.replacement(0, np.array([1]), 2) == (complex_cause, 0)
    # column 3 is all but the cause itself: the cause does no better, and is a replacement only where it is simpler
    alike = selection([(matrix, measured)], [cause], model=(0, 3))
    assert alike.replacement(0, np.array([3]), 1) is None


@pytest.mark.parametrize(("apart", "replaced"), [(0.04, False), (0.12, True)])
def test_a_term_found_first_gives_way_to_one_that_leads_by_what_a_parameter_must_bring(apart, replaced):
    """Without the cause the error is 0.81 + 0.09, of which 0.5 % is asked; the term lacks (0.9 apart)²: 0.14 % and 1.3 %."""
    matrix, noise = random_columns(3, seed=16)
    matrix[:, 2] = matrix[:, 1] + apart * matrix[:, 2]
    measured = matrix[:, 0] + 0.9 * matrix[:, 1] + noise
    searched = selection([(matrix, measured)], [ChosenColumns("cause", ((1,),))], model=(0, 2))
    found = searched.replacement(0, np.array([2]), 1)
    assert (found is not None) == replaced


def test_a_term_is_not_replaced_by_what_its_parameters_cannot_be():
    matrix, noise = random_columns(3, seed=11)
    matrix[:, 1] = matrix[:, 2] + 0.6 * matrix[:, 1]
    measured = matrix[:, 0] + 0.9 * matrix[:, 2] + noise
    impossible = selection(
        [(matrix, measured)], [ChosenColumns("cause", ((2,),), possible=False)], model=(0, 1)
    )
    assert impossible.replacement(0, np.array([1]), 1) is None


def test_friction_that_follows_the_load_takes_a_wider_one_s_place_with_the_loads_as_declared():
    matrix, noise = random_columns(4, seed=14)
    measured = matrix[:, 0] + 0.9 * matrix[:, 1] + noise
    matrix[:, 3] = matrix[:, 1]  # the payload's ratio would do its work
    simple = ChosenColumns("simple", ((1,),), declared_load=DeclaredLoad.TRUSTED)
    payload = ChosenColumns("payload", ((1,),), declared_load=DeclaredLoad.QUESTIONED)
    searched = selection([(matrix, measured)], [payload, simple], model=(0, 2))
    searched.ratio_columns = np.array([3])
    assert searched.replacement(0, np.array([2]), 3) == (simple, 0)
    searched.candidates = [payload]
    assert searched.replacement(0, np.array([2]), 3) is None


@pytest.mark.parametrize(("apart", "rivals"), [(0.004, ("other",)), (0.01, ())])
def test_a_rival_is_left_out_by_its_probability_and_not_by_a_p_value(apart, rivals):
    """The rival lacks 0.4 and 1 % of the cause: p-values of 1e-3 and 2e-6, of which −e p ln p leaves it 2e-2 and 7e-5."""
    matrix, noise = random_columns(3, seed=15)
    matrix[:, 2] = matrix[:, 1] + apart * matrix[:, 2]
    measured = matrix[:, 0] + 3.0 * matrix[:, 1] + noise
    cause, other = ChosenColumns("cause", ((1,),)), ChosenColumns("other", ((2,),))
    searched = selection([(matrix, measured)], [cause, other])
    findings = searched.findings(0)
    first = next(each for each in findings if each.candidate is cause)
    second = next(each for each in findings if each.candidate is other)
    assert searched._beside(first, second) < SIGNIFICANCE
    assert searched.rivals(first, findings) == rivals


def test_a_rival_takes_the_place_of_a_term_once_the_data_decide():
    matrix, noise = random_columns(4, seed=12)
    matrix[:, 1] = matrix[:, 2] + 0.4 * matrix[:, 1]
    measured = matrix[:, 0] + 0.9 * matrix[:, 2] + noise
    cause = ChosenColumns("cause", ((2,),))
    searched = selection([(matrix, measured)], [cause], model=(0, 1))
    assert searched.decided_since(0, np.array([1]), 1, ["cause"]) == (cause, 0)
    assert searched.decided_since(0, np.array([1]), 1, ["somebody else"]) is None
    # nor where the term explains what the rival does not
    both = measured + 0.5 * matrix[:, 1]
    undecided = selection([(matrix, both)], [cause], model=(0, 1))
    assert undecided.decided_since(0, np.array([1]), 1, ["cause"]) is None


@pytest.mark.parametrize(("apart", "place"), [(0.04, None), (0.12, 0)])
def test_a_rival_takes_no_place_for_what_it_makes_of_a_term_s_approximation(apart, place):
    """It leads by less than what a parameter must bring, though certainly: in the ranking it did not win by that.

    The rival's further column explains (2 · 0.04)² of a noise of 1 and a signal of 4: 0.1 % of the error without either, 1.1 %
    with 0.12. A parameter must bring 0.5 %.
    """
    matrix, noise = random_columns(4, seed=12)
    matrix[:, 2] = matrix[:, 1] + apart * matrix[:, 2]
    measured = matrix[:, 0] + 2.0 * matrix[:, 2] + noise
    searched = selection([(matrix, measured)], [ChosenColumns("wider", ((1, 2),))], model=(0, 1))
    found = searched.decided_since(0, np.array([1]), 1, ["wider"])
    assert (found and found[1]) == place


@pytest.mark.parametrize(("p_value", "added"), [(1e-6, ["derived"]), (0.5, [])])
def test_an_effect_made_of_derivatives_is_added_only_where_instruments_see_it(p_value, added):
    matrix, noise = random_columns(2, seed=13)
    measured = matrix[:, 0] + 0.8 * matrix[:, 1] + noise
    derived = ChosenColumns("derived", ((1,),), from_derivatives=True)
    asked = []

    def loop(joint, listed):
        asked.append((joint, names(listed)))
        return [instruments(p_value) for _ in listed]

    assert names(selection([(matrix, measured)], [derived], loop=loop).search(set(), [0.0])[1]) == added
    assert asked == [(0, ["derived"])]


def test_an_effect_that_harms_whole_sessions_is_not_added():
    """In one session the column acts one way, in the other, where it is weak, against it."""
    matrix, noise = random_columns(2, seed=14)
    half = ROWS // 2
    matrix[half:, 1] *= 0.5
    acts = np.where(np.arange(ROWS) < half, 0.8, -0.5)
    measured = matrix[:, 0] + acts * matrix[:, 1] + noise
    candidate = ChosenColumns("session's own", ((1,),))
    together = selection([(matrix, measured)], [candidate], sessions=1).findings(0)[0]
    apart = selection([(matrix, measured)], [candidate], sessions=2).findings(0)[0]
    assert together.sessions_agree
    assert not apart.sessions_agree
    assert not apart.justified
