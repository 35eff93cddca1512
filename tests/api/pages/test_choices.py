"""What an address asks for, and what is shown then."""

from types import SimpleNamespace

import pytest

from api.pages import choices
from api.pages.choices import ALL_SESSIONS, chosen_model, chosen_rig, files_of_session
from api.service.problems import Problem


@pytest.fixture
def stored():
    """Two versions, which are no longer numbered from 1; the second was fitted with one session less."""
    versions = [SimpleNamespace(id="m2"), SimpleNamespace(id="m7")]
    files = {"m2": ["a.csv", "b.csv"], "m7": ["b.csv"]}

    def model(identifier):
        if identifier not in files:
            raise Problem(404, f"no {identifier}")
        return identifier

    return SimpleNamespace(
        story=SimpleNamespace(versions=versions), model=model, fitted_files=lambda shown: files[shown]
    )


@pytest.mark.parametrize(
    ("asked", "shown"), [(None, None), ("", None), ("1", "m2"), ("2", "m7"), ("m2", "m2"), ("m7", "m7")]
)
def test_a_version_is_named_or_counted(stored, asked, shown):
    assert chosen_model(stored, asked) == shown


@pytest.mark.parametrize("asked", ["0", "3", "m1", "²"])
def test_a_version_that_there_is_not_is_said(stored, asked):
    with pytest.raises(Problem) as problem:
        chosen_model(stored, asked)
    assert problem.value.status == 404


def test_sessions_are_those_that_both_models_were_fitted_with(stored):
    assert files_of_session(stored, "m2", None, ALL_SESSIONS) == ["a.csv", "b.csv"]
    assert files_of_session(stored, "m2", "m7", ALL_SESSIONS) == ["b.csv"]
    assert files_of_session(stored, "m2", None, "a.csv") == ["a.csv"]
    for other, session in (("m7", "a.csv"), (None, "c.csv")):
        with pytest.raises(Problem, match="not fitted with a session") as problem:
            files_of_session(stored, "m2", other, session)
        assert problem.value.status == 404


@pytest.fixture
def rigs(monkeypatch):
    """Rigs of a service, and a browser that asks."""
    files = {"arm": "arm.yaml", "wrist": "wrist.yaml"}
    monkeypatch.setattr(
        choices.access,
        "service_of",
        lambda request: SimpleNamespace(rigs=SimpleNamespace(files=lambda: files)),
    )
    return files


def test_a_rig_is_the_one_asked_for_else_the_last_else_the_first(rigs):
    browser = SimpleNamespace(session={})
    assert chosen_rig(browser, None) == "arm"
    assert chosen_rig(browser, "wrist") == "wrist"
    assert chosen_rig(browser, None) == "wrist"
    del rigs["wrist"]
    assert chosen_rig(browser, None) == "arm"
    with pytest.raises(Problem, match="There is no rig wrist; there are arm") as problem:
        chosen_rig(browser, "wrist")
    assert problem.value.status == 404
    rigs.clear()
    with pytest.raises(Problem, match="There is no rig yet") as problem:
        chosen_rig(browser, None)
    assert problem.value.status == 404
