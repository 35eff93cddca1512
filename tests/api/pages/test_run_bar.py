"""What every page shows of what moves: a session before a homing, how long still, and who must do what at once."""

from types import SimpleNamespace

import pytest

from api.pages.number_format import duration
from api.pages.run_bar import alarm_lines, seconds_left
from api.service.accounts import Role
from api.service.active_session import ActiveSession
from api.service.homings import HomingRun
from daq.session_events import Progress, SessionState

RIG = "rx130l-joint3-simulated"


@pytest.mark.parametrize(
    ("elapsed", "fraction", "left"), [(3.0, 0.25, 9.0), (8.0, 0.8, 2.0), (5.0, 1.0, 0.0), (0.0, 0.0, None)]
)
def test_what_is_left_follows_from_the_time_that_the_share_done_took(elapsed, fraction, left):
    found = seconds_left(SimpleNamespace(elapsed=elapsed, fraction=fraction))
    assert found == (None if left is None else pytest.approx(left))


def test_alarms_are_lines_by_rig():
    sessions = SimpleNamespace(alarms=lambda: {"b": "look at j2", "a": "press the emergency stop"})
    assert alarm_lines(SimpleNamespace(sessions=sessions)) == ["a: press the emergency stop", "b: look at j2"]


@pytest.fixture
def bar(service):
    """What the page of `grace`, who watches, shows beside an operator `ada`; a session and a homing to put under way."""
    held = service.service
    service.client(Role.OPERATOR, "ada").post(f"/rigs/{RIG}/take")
    client = service.client(Role.VIEWER, "grace")

    def shown(session=None, homing=None):
        with pytest.MonkeyPatch.context() as put:
            put.setattr(held.sessions, "under_way", lambda: session)
            put.setattr(held.homings, "under_way", lambda: homing)
            return client.get("/pages/run-state").json()

    return shown


def session(state, progress):
    steps = SimpleNamespace(state=state, progress=progress, alarm="")
    return ActiveSession(RIG, "arm-1", "the arm", "session-02", steps, "ada")


def test_a_session_that_moves_is_shown_with_what_is_left_of_it(bar):
    running = bar(session(SessionState.RUNNING, Progress(cycle=2500, cycles=10000, elapsed=5.0)))
    assert running["running"] is True
    assert (running["rig"], running["title"]) == (RIG, "The robot moves")
    assert running["detail"] == "the arm, session-02, by ada"
    assert (running["fraction"], running["left"]) == (0.25, f"{duration(15.0)} left")
    assert (running["rig_state"], running["rig_words"]) == ("warn", "Moving")
    assert running["onlookers"] == "ada operates the rig"
    assert "Everything measured is kept" in running["note"]
    armed = bar(session(SessionState.ARMED, Progress(cycle=0, cycles=10000, elapsed=0.0)))
    assert (armed["left"], armed["fraction"], armed["rig_words"]) == ("", 0.0, "Armed")


def test_a_homing_is_shown_where_no_session_moves(bar):
    homing = HomingRun(RIG, "j3", 37, "ada")
    shown = bar(homing=homing)
    assert (shown["running"], shown["rig"]) == (True, RIG)
    assert (shown["title"], shown["detail"]) == ("j3 is being homed", f"{RIG}, by ada")
    assert (shown["rig_state"], shown["rig_words"]) == ("warn", "Homing")
    assert shown["onlookers"] == "ada operates the rig"
    both = bar(session(SessionState.RUNNING, Progress(cycle=1, cycles=4, elapsed=1.0)), homing)
    assert both["title"] == "The robot moves"


def test_where_nothing_moves_the_bar_says_so_and_whoever_looks_is_seen(bar, service):
    shown = bar()
    assert (shown["running"], shown["rig"], shown["left"]) == (False, None, "")
    assert (shown["rig_state"], shown["rig_words"], shown["alarms"]) == ("good", "Nothing moves", [])
    assert service.service.operators.onlookers(RIG) == ["grace"]
