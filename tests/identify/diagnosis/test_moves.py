"""A model is worth what it was when it was fitted, whatever was added and taken out since."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from identify.diagnosis import moves
from identify.diagnosis.moves import Fits, State, _better_refitted, verified, without_harmful
from identify.diagnosis.refusals import Refusals
from identify.diagnosis.screening import Screening
from identify.effects.model import Term
from identify.effects.position import JointSpring
from identify.effects.viscous import Stribeck, ViscousAsymmetric, ViscousCubic, ViscousQuadratic
from identify.estimation.fitting import fit_model
from identify.estimation.requested_model import open_record, requested_model
from identify.recording import load_experiment
from tests.plants.single_joint import Joint, record, write_experiment

SPRING, LEAN = (Term(JointSpring(), 0), 0), (Term(ViscousAsymmetric(), 0), 0)


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    made = record({"joint-spring": 1.0}, duration=6.0, rate=100.0, repeats=1, payload_masses=(0.0,))
    opened = open_record(load_experiment(write_experiment(tmp_path_factory.mktemp("moves"), made)), "usual")
    return fit_model(opened, requested_model(opened, "usual", ()))


def test_terms_that_are_left_of_more_are_taken_as_they_were_fitted(fitted):
    fits = Fits(fitted)
    alone, added = fits([SPRING], fitted)
    wider, _ = fits([*added, LEAN], alone)
    assert wider.fit.relative_error < alone.fit.relative_error
    again, left = fits.without_others(added, wider)
    assert again is alone
    assert left == added
    # in whatever order they stand, and only these
    other, _ = fits.without_others([LEAN], wider)
    assert [term.key for term in other.model.terms if term.key == SPRING[0].key] == []
    assert fits.without_others([LEAN, SPRING], alone)[0] is wider


def test_a_term_that_is_added_once_more_is_fitted_once_more(fitted):
    fits = Fits(fitted)
    alone, added = fits([SPRING], fitted)
    again, _ = fits(added, alone)
    assert again is not alone
    assert again.fit.relative_error == pytest.approx(alone.fit.relative_error, rel=1e-6)


def test_a_search_ends_with_the_constants_that_are_right_beside_all_that_it_added(tmp_path):
    made = record({"stribeck": 1.0}, duration=10.0, rate=250.0, repeats=1, payload_masses=(0.0,))
    opened = open_record(load_experiment(write_experiment(tmp_path / "curve", made)), "usual")
    usual = fit_model(opened, requested_model(opened, "usual", ()))
    fastest = Stribeck().grid(opened.summaries[0])[-1]  # several refinements away from the plant's 0.05 rad/s
    wrong = Term(Stribeck(), 0).chosen(fastest)
    present = fit_model(opened, usual.model.with_terms([wrong]), start=usual)
    fits = Fits(usual)
    settled = fits.settled(present, [(wrong, 0)])
    assert settled is not None
    better, ((term, _),) = settled
    assert better.fit.relative_error < present.fit.relative_error
    assert dict(term.constants)["stribeck_velocity"] == pytest.approx(0.05, rel=0.2)
    # what the search goes back to is fitted so, and no better fit is there
    assert fits.without_others([(term, 0)], better)[0] is better
    assert Fits(usual).settled(better, [(term, 0)]) is None
    assert fits.settled(usual, []) is None


@pytest.mark.parametrize("better", [True, False])
def test_only_what_the_fit_without_it_does_better_without_does_harm(fitted, monkeypatch, better):
    fits, refusals, harmful = Fits(fitted), Refusals(), set()
    present, added = fits([SPRING, LEAN], fitted)
    monkeypatch.setattr(moves, "worse_on_unseen", lambda model, terms: terms[:1] if len(terms) > 1 else [])
    monkeypatch.setattr(moves, "lowers_on_unseen", lambda narrower, wider, joint: better)
    _, left = without_harmful(fits, present, added, refusals, harmful)
    assert [term.key for term, _ in left] == [LEAN[0].key] if better else [SPRING[0].key, LEAN[0].key]
    assert harmful == ({SPRING[0].key} if better else set())
    assert set(refusals.present(left)) == harmful


def test_of_two_joints_that_asked_for_one_term_only_the_one_that_justifies_it_has_it(fitted, monkeypatch):
    """A search that kept both, for the term was there, looked at them again for ever."""
    term = SPRING[0]

    def beside_the_others(added, _least):
        return [
            (SimpleNamespace(candidate=SimpleNamespace(judged=judged, key=(term.effect.name, judged))), each)
            for each, judged in added
            if judged == 1
        ]

    looked_at = SimpleNamespace(beside_the_others=beside_the_others)
    monkeypatch.setattr(Screening, "of", lambda _present, only_justified: looked_at)
    monkeypatch.setattr(State, "of", lambda _screening, added, *_: added)
    fits = SimpleNamespace(without_others=lambda added, present: (present, added))
    refusals = Refusals()
    added = verified(fits, fitted, [(term, 0), (term, 1)], refusals, [0.0, 0.0])  # type: ignore[arg-type]
    assert added == [(term, 1)]
    assert refusals.present(added) == set()


@pytest.mark.parametrize(
    ("wrong", "right"), [(ViscousCubic(), "viscous-quadratic"), (ViscousQuadratic(), None)]
)
def test_what_stands_in_the_place_of_another_is_judged_with_constants_that_follow(tmp_path, wrong, right):
    """A Stribeck velocity that was chosen beside a cube of the speed is another than beside the square that is the cause."""
    hidden, quiet = {"viscous-quadratic": 0.3, "stribeck": 0.4}, Joint(command_noise=0.005, slow_noise=0.0005)
    made = record(hidden, joint=quiet, duration=20.0, rate=250.0, repeats=1, payload_masses=(0.0,))
    opened = open_record(load_experiment(write_experiment(tmp_path / "joint", made)), "usual")
    usual = fit_model(opened, requested_model(opened, "usual", ()))
    fits, refusals = Fits(usual), Refusals()
    curve = Term(Stribeck(), 0).chosen(Stribeck().grid(opened.summaries[0])[1])
    present, added = fits([(Term(wrong, 0), 0), (curve, 0)], usual)
    screening = Screening.of(present)
    state = State.of(screening, added, {}, refusals, [0.0])
    better = _better_refitted(state, fits, 0, refusals, set())
    assert (None if better is None else better[0].effect.name) == right
    # with no constants that could follow nothing is fitted anew
    alone, only = fits([(Term(wrong, 0), 0), SPRING], usual)
    nothing = State.of(Screening.of(alone), only, {}, refusals, [0.0])
    assert _better_refitted(nothing, fits, 0, refusals, set()) is None
