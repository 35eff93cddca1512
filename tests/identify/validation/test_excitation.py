"""What is said of parameters and motion before anybody relies on them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import identify
from identify.estimation.doubts import parameter_doubts
from identify.estimation.parameters import Parameter, column_names
from identify.validation.excitation import excitation, undetermined
from tests.plants.single_joint import record, write_experiment


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    recorded = record({}, seed=3, duration=20.0, rate=250.0, payload_masses=(0.0, 3.0))
    folder = write_experiment(tmp_path_factory.mktemp("told") / "joint", recorded)
    return identify.identify(identify.load_experiment(folder))


def test_a_good_record_tells_its_parameters_and_none_is_doubtful(result):
    document = result.document()
    assert document.excitation.verdict != "insufficient"
    assert not any(parameter.doubt for parameter in document.parameters)


def test_a_negative_inertia_and_an_impossible_friction_are_marked_where_they_stand(result):
    names = [name for name, *_ in column_names(result.fitted)]
    chi = result.fitted.fit.chi.copy()
    inertia = next(place for place, name in enumerate(names) if name.startswith(("ZZ", "Ia")))
    friction = names.index("FV1")
    chi[inertia], chi[friction] = -2.0, -0.5
    doubted = parameter_doubts(replace(result.fitted, fit=replace(result.fitted.fit, chi=chi)))
    assert doubted[inertia].words == f"{names[inertia]} is negative, which no mass and no inertia can be"
    assert doubted[friction].words == "FV1 is impossible: it can be at least 0"
    assert set(doubted) == {inertia, friction}


def test_friction_that_least_squares_would_make_negative_is_marked_as_held(result):
    names = [name for name, *_ in column_names(result.fitted)]
    free = result.fitted.fit.chi.copy()
    chi = free.copy()
    place = names.index("FC1")
    chi[place], free[place] = 0.0, -0.3
    doubted = parameter_doubts(replace(result.fitted, fit=replace(result.fitted.fit, chi=chi, free=free)))
    assert doubted[place].words.startswith("FC1 is held at 0")


def test_a_fit_that_fails_on_unseen_motion_says_so_first(tx40):
    told = identify.identify(identify.load_experiment(tx40)).document().excitation
    assert told.verdict == "insufficient"
    assert "did not see" in told.cannot_tell[0]


def test_parameters_that_the_motion_does_not_show_are_named(result):
    dropped = replace(result.fitted.fit, dropped=np.array([0]))
    told = excitation(replace(result, fitted=replace(result.fitted, fit=dropped)))
    assert told.verdict == "partial"
    assert any("nothing in this motion shows" in sentence for sentence in told.cannot_tell)


def test_a_record_too_short_for_coloured_deviations_is_judged_by_the_others():
    def estimate(name, std, std_robust):
        return Parameter(name, "j1", 2.0, std, std_robust, "N m", None)

    listed = [
        estimate("FV1", 1.1, None),
        estimate("FC1", 0.9, None),
        estimate("MX1", 1.1, 0.9),
        estimate("MY1", 0.9, 1.1),
        estimate("ZZ1R", None, None),
    ]
    assert undetermined(listed) == ["FV1", "MY1"]
