"""The stop of a rig reaches whatever moves it, and says whether anything did."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from typing import Any

import pytest

from api.service.rig_stop import RigStop


@dataclass
class Mover:
    """Sessions or homings of one rig: under way, at rest, or None where there never were any."""

    moves: bool | None
    asked: list[tuple[Any, ...]] = field(default_factory=list)
    all_asked: threading.Event = field(default_factory=threading.Event)

    def stop(self, *arguments: Any) -> bool | None:
        self.asked.append(arguments)
        return self.moves

    def rigs(self) -> list[str]:
        return [] if self.moves is None else ["arm"]

    def rig_of(self, experiment: str, session: str) -> str | None:
        return "arm" if (experiment, session) == ("paint", "session-00") else None

    def stop_all(self, reason: str) -> None:
        self.asked.append((reason,))
        self.all_asked.set()


@pytest.mark.parametrize(
    ("session", "homing", "found"),
    [
        (True, True, True),
        (True, None, True),
        (False, True, True),
        (False, None, False),
        (None, False, False),
        (None, None, None),
    ],
)
def test_a_stop_reaches_sessions_and_homings_and_says_whether_anything_moved(session, homing, found):
    sessions, homings = Mover(session), Mover(homing)
    assert RigStop(sessions, homings).stop("arm", "ada") is found
    assert sessions.asked == [("arm", "ada")]
    assert homings.asked == [("arm", "stopped by ada")]


def test_a_session_is_stopped_by_its_rig_and_an_unknown_one_not_at_all():
    sessions, homings = Mover(True), Mover(None)
    stop = RigStop(sessions, homings)
    assert stop.stop_session("paint", "session-00", "ada") is True
    assert stop.stop_session("paint", "session-01", "ada") is None
    assert sessions.asked == [("arm", "ada")]


@pytest.mark.parametrize(("session", "stopped"), [(True, ["arm"]), (False, []), (None, [])])
def test_everything_is_every_rig_that_was_used(session, stopped):
    assert RigStop(Mover(session), Mover(None)).stop_everything("ada") == stopped


def test_the_stop_of_all_rigs_reaches_both():
    sessions, homings = Mover(True), Mover(True)
    RigStop(sessions, homings).stop_all("the service was asked to end")
    assert sessions.all_asked.wait(10)
    assert homings.all_asked.wait(10)
    assert sessions.asked == homings.asked == [("the service was asked to end",)]
