"""The stop of a rig reaches whatever moves it, and says whether anything did."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import anyio
import pytest

from api.service.rig_stop import RigStop


@dataclass
class Mover:
    """Sessions or homings of which some are under way."""

    moves: bool
    asked: list[tuple[Any, ...]] = field(default_factory=list)
    all_asked: threading.Event = field(default_factory=threading.Event)

    def stop(self, *arguments: Any) -> bool:
        self.asked.append(arguments)
        return self.moves

    def stop_all(self, reason: str) -> None:
        self.asked.append((reason,))
        self.all_asked.set()


@pytest.mark.parametrize("session", [True, False])
@pytest.mark.parametrize("homing", [True, False])
def test_a_stop_reaches_sessions_and_homings_and_says_whether_anything_moved(session, homing):
    sessions, homings = Mover(session), Mover(homing)
    stop = RigStop(sessions, homings)
    user = SimpleNamespace(name="ada")
    assert anyio.run(stop.stop, "arm", user) is (session or homing)
    assert sessions.asked == [("arm", user)]
    assert homings.asked == [("arm", "stopped by ada")]


def test_the_stop_of_all_rigs_reaches_both():
    sessions, homings = Mover(True), Mover(True)
    RigStop(sessions, homings).stop_all("the service was asked to end")
    assert sessions.all_asked.wait(10)
    assert homings.all_asked.wait(10)
    assert sessions.asked == homings.asked == [("the service was asked to end",)]
