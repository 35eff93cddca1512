"""How a homing ends, in the operator's words, and that it ends by itself when no stop could be heard."""

from __future__ import annotations

import pytest

from api.service import homings
from api.service.homings import DEAF, HomingRun, Homings, HomingStop
from daq.homing import HomedJoint
from drivers.errors import DriverError


class Claim:
    """A bus that is held."""

    def __init__(self, run):
        self.run = run
        self.state_at_release = None

    def release(self):
        self.state_at_release = self.run.state


def ended(monkeypatch, error=None, stop_words="", stopped=False, own_words=""):
    """A homing whose drive answers with an error, or is homed."""
    run = HomingRun("bench", "j1", None, "ada", words=own_words)
    claim, stop = Claim(run), HomingStop(lambda: True)
    stop.words = stop_words
    if stopped:
        stop.set()

    def with_the_bus(*arguments):
        if error is not None:
            raise error
        return HOMED

    made = Homings(None, None, None, None)  # type: ignore[arg-type]
    monkeypatch.setattr(made, "_with_the_bus", with_the_bus)
    made._home(run, claim, None, 0, reset_faults=False, stop=stop)  # type: ignore[arg-type]
    assert claim.state_at_release == homings.HOMING  # who sees that it has ended may claim the bus at once
    return run


HOMED = HomedJoint(joint="j1", words="homed by method 35", position=0.25, within_limits=True)


def test_a_joint_that_is_homed_says_where_it_stands(monkeypatch):
    run = ended(monkeypatch)
    assert (run.state, run.words, run.position, run.within_limits) == (
        "done",
        "homed by method 35",
        0.25,
        True,
    )
    assert not run.moves


@pytest.mark.parametrize(
    ("options", "state", "words"),
    [
        ({}, "failed", "the drive has a fault"),
        ({"stopped": True}, "stopped", "the drive has a fault"),
        ({"stopped": True, "stop_words": "nobody was heard"}, "stopped", "nobody was heard"),
        ({"stopped": True, "own_words": "stopped by ada", "stop_words": "x"}, "stopped", "stopped by ada"),
    ],
)
def test_a_homing_that_does_not_end_well_says_who_or_what_ended_it(monkeypatch, options, state, words):
    run = ended(monkeypatch, DriverError("the drive has a fault"), **options)
    assert (run.state, run.words, run.position) == (state, words, None)


def test_a_mistake_of_ours_ends_it_too_and_is_named(monkeypatch):
    run = ended(monkeypatch, ZeroDivisionError("by nothing"))
    assert (run.state, run.words) == ("failed", "ZeroDivisionError: by nothing")


def test_a_homing_stops_by_itself_once_no_stop_could_have_been_heard_for_so_long(monkeypatch):
    now, hears = [100.0], [True]
    monkeypatch.setattr(homings.time, "monotonic", lambda: now[0])
    stop = HomingStop(lambda: hears[0])
    for passed in (0.0, 10 * DEAF):
        now[0] += passed
        assert not stop.is_set()
    hears[0] = False
    now[0] += DEAF
    assert not stop.is_set()
    now[0] += 0.1
    assert stop.is_set()
    assert (
        stop.words
        == "the service could not have answered the stop button for 2 s; it stopped the homing itself"
    )
    hears[0] = True
    assert stop.is_set()  # once stopped, for good
