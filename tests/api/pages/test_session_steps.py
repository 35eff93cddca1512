"""The steps of a session in the browser: each answers with the next, and what is refused is said where it was typed."""

import re
from types import SimpleNamespace

import pytest

from api.pages.session_steps import _state_without_processes
from api.service.accounts import Role
from api.service.unlisted_recordings import RECORDING
from daq.session_events import SessionState
from tests.api.driven_arm import short_plan

RIG = "rx130l-joint3-simulated"
HTML = {"Accept": "text/html"}
PAGE = "/pages/experiments/arm/sessions/session-00"


@pytest.fixture
def operator(service):
    """Who prepared a session of the plan `short` with the disk of 6.97 kg."""
    plans = service.service.settings.data_folder / "plans"
    plans.mkdir(exist_ok=True)
    (plans / "short.json").write_text(short_plan("short").to_json())
    client = service.client(Role.OPERATOR, "ada")
    assert client.post("/experiments", json={"name": "arm", "rig": RIG}).status_code == 201
    new = {"rig": RIG, "plan": "short", "payload": {"name": "disk-7"}}
    assert client.post("/experiments/arm/sessions", json=new).json()["id"] == "session-00"
    client.headers.update(HTML)
    return client


def now(text):
    """The step that is to be taken, of the five."""
    found = re.search(r'aria-current="step"><span[^>]*>\d</span> (\w+)<', text)
    return found and found[1]


def test_each_step_answers_with_the_next_and_a_wrong_mass_stays_to_be_corrected(operator, service):
    text = operator.get(PAGE).text
    assert now(text) == "Check"
    assert "cannot be predicted before a first model" in text  # the plan is shown beside its steps
    assert "The service was restarted" not in text
    text = operator.post(f"{PAGE}/check").text
    assert now(text) == "Weigh"
    assert "3 of" not in text.split("<details")[0]
    for typed, words in (("3,4584", "6.97 kg"), ("heavy", "is not a mass"), ("-1", "is not a possible mass")):
        answer = operator.post(f"{PAGE}/weigh", data={"mass": typed})
        assert (answer.status_code, now(answer.text)) == (200, "Weigh")
        assert f'value="{typed}"' in answer.text
        assert words in re.search(r'id="mass-refused"[^>]*>([^<]+)<', answer.text)[1]
    assert operator.post(f"{PAGE}/weigh", data={"mass": " "}).status_code == 409  # there is no scale to ask
    text = operator.post(f"{PAGE}/weigh", data={"mass": "6,971"}).text
    assert (now(text), "mass-refused" in text) == ("Confirm", False)
    assert now(operator.post(f"{PAGE}/confirm").text) == "Arm"

    other = service.client(Role.OPERATOR, "grace")
    seen = other.get(f"{PAGE}/steps", headers=HTML).text
    assert "ada operates the rig." in seen
    assert "/discard" not in seen
    operator.post(f"/rigs/{RIG}/hand-over", json={"to": "grace"})
    seen = other.get(f"{PAGE}/steps", headers=HTML).text
    assert (now(seen), "confirmed by the previous operator" in seen) == ("Confirm", True)

    gone = other.post(f"{PAGE}/discard", headers=HTML)
    assert (gone.status_code, gone.headers["HX-Redirect"]) == (204, "/pages/new-session")
    assert other.get(PAGE, headers=HTML).status_code == 404


def test_a_session_whose_processes_are_gone_begins_again_and_one_measured_elsewhere_has_no_steps(
    operator, service
):
    experiments = service.service.experiments
    row = experiments.session("arm", "session-00")
    row.state = SessionState.CHECKED.value
    experiments.change_session(row)
    text = operator.get(f"{PAGE}/steps").text
    assert (now(text), "The service was restarted" in text) == ("Check", True)
    row = experiments.session("arm", "session-00")
    row.rig = None
    experiments.change_session(row)
    refused = operator.get(f"{PAGE}/steps")
    assert refused.status_code == 404
    assert "was not measured here" in refused.text


@pytest.mark.parametrize(
    ("state", "file", "shown"),
    [
        ("new", None, SessionState.NEW),
        ("armed", None, SessionState.NEW),
        ("running", None, SessionState.NEW),
        ("running", "session-00.h5", SessionState.ABORTED),
        (RECORDING, "incomplete/session-00.h5", SessionState.ABORTED),
        ("done", "session-00.h5", SessionState.DONE),
        ("faulted", None, SessionState.FAULTED),
        ("armed", "session-00.h5", SessionState.ARMED),
    ],
)
def test_without_processes_a_session_is_at_its_beginning_or_over(state, file, shown):
    assert _state_without_processes(SimpleNamespace(state=state, file=file)) is shown
