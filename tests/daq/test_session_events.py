"""The ways between a session's states."""

import json

from daq.session_events import ENDS, TRANSITIONS, SessionEvent, SessionState


def test_every_state_has_its_ways_and_the_ends_have_none():
    assert set(TRANSITIONS) == set(SessionState)
    assert {state for state, ways in TRANSITIONS.items() if not ways} == {
        state for state in SessionState if state.ended
    }


def test_a_stop_is_possible_from_every_state_that_is_not_an_end():
    for state, ways in TRANSITIONS.items():
        assert state.ended or ways >= ENDS


def test_the_only_way_to_done_goes_through_every_step_in_order():
    way, state = [], SessionState.NEW
    while not state.ended:
        (state,) = TRANSITIONS[state] - ENDS
        way.append(state.value)
    assert way == ["checked", "payload confirmed", "armed", "running", "done"]


def test_an_event_as_json_is_plain_and_says_when_in_utc():
    event = SessionEvent("progress", SessionState.RUNNING, "", {"cycle": 3})
    document = json.loads(json.dumps(event.to_json()))
    assert (document["state"], document["data"]) == ("running", {"cycle": 3})
    assert document["time"].endswith("+00:00")
