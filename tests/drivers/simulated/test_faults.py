"""Faults of a simulated drive: each begins when its plan says, and not before."""

import pytest
from pydantic import ValidationError

from drivers.simulated.faults import (
    COMMAND_DOUBLE,
    COMMAND_LATE,
    COMMAND_LOSE,
    COMMAND_SATURATE,
    Faults,
    FaultSettings,
    PlannedFault,
)


def faults(seed: int = 1, **settings) -> Faults:
    return Faults(FaultSettings(**settings), seed)


def over(count: int, **settings) -> list[Faults]:
    """The state of one node's faults in each cycle, as (name, value) pairs would show it."""
    made = faults(**settings)
    states = []
    for cycle in range(count):
        made.enter_cycle(cycle)
        states.append((made.frozen, made.heartbeat_stopped, made.emergency, made.current_left, made.glitch))
        made.glitch, made.emergency = 0, None  # as the node takes them
    return states


def test_nothing_happens_where_nothing_is_planned():
    assert set(over(50)) == {(False, False, None, 1.0, 0)}
    quiet = faults()
    assert not any(quiet.loses(cycle) or quiet.delays(cycle) or quiet.doubles() for cycle in range(100))


@pytest.mark.parametrize(
    ("settings", "place", "before", "at", "after"),
    [
        ({"freeze_at": 5}, 0, False, True, True),
        ({"heartbeat_stops_at": 5}, 1, False, True, True),
        ({"emergency_at": 5, "emergency_code": 0x8611}, 2, None, 0x8611, None),
        ({"saturate_from": 5, "saturate_factor": 0.25}, 3, 1.0, 0.25, 0.25),
        ({"glitch_cycles": {5}, "glitch_counts": 77}, 4, 0, 77, 0),
    ],
)
def test_a_fault_begins_in_its_cycle(settings, place, before, at, after):
    seen = [state[place] for state in over(8, **settings)]
    assert seen == [before] * 5 + [at] + [after] * 2


def test_a_saturation_ends_where_its_plan_says():
    left = [state[3] for state in over(8, saturate_from=2, saturate_to=5, saturate_factor=0.5)]
    assert left == [1, 1, 0.5, 0.5, 0.5, 1, 1, 1]


def test_cycles_are_lost_and_late_as_listed():
    made = faults(lose_cycles={3}, late_cycles={4, 6})
    assert [cycle for cycle in range(10) if made.loses(cycle)] == [3]
    assert [cycle for cycle in range(10) if made.delays(cycle)] == [4, 6]


@pytest.mark.parametrize(
    ("setting", "method"), [("lose_probability", "loses"), ("late_probability", "delays")]
)
def test_probabilities_are_met_and_repeat_with_the_seed(setting, method):
    made, again = faults(**{setting: 0.3}), faults(**{setting: 0.3})
    hits = [getattr(made, method)(cycle) for cycle in range(4000)]
    assert sum(hits) / 4000 == pytest.approx(0.3, abs=0.03)
    assert hits == [getattr(again, method)(cycle) for cycle in range(4000)]
    other = faults(seed=2, **{setting: 0.3})
    assert hits != [getattr(other, method)(cycle) for cycle in range(4000)]


@pytest.mark.parametrize(
    ("phase", "enabled", "stopping", "speed", "begins"),
    [
        ("streaming", False, False, 0.0, True),
        ("enabled", False, False, 0.0, False),
        ("enabled", True, False, 0.0, True),
        ("slow", True, False, 0.0, False),
        ("slow", True, False, 5.0, True),
        ("slow", True, False, 10.0, True),
        ("slow", True, False, 10.1, False),
        ("slow", False, False, 5.0, False),
        ("fast", True, False, 10.0, False),
        ("fast", True, False, 10.1, True),
        ("fast", False, False, 50.0, False),
        ("stopping", True, False, 50.0, False),
        ("stopping", True, True, 0.0, True),
    ],
)
def test_a_planned_fault_waits_for_its_phase(phase, enabled, stopping, speed, begins):
    made = faults(planned=(PlannedFault(fault="restart", phase=phase, speed=10.0),))
    made.enter_phase(enabled, stopping, speed)
    assert made.restarts is begins
    assert len(made.waiting) == (0 if begins else 1)


def test_a_planned_fault_lets_its_syncs_pass_first_and_only_those_of_its_phase_count():
    made = faults(planned=(PlannedFault(fault="restart", phase="enabled", after=2),))
    for enabled in (True, False, True):
        made.enter_phase(enabled, False, 0.0)
        assert not made.restarts
    made.enter_phase(True, False, 0.0)
    assert made.restarts


def test_a_fault_that_does_not_exist_is_refused_with_those_that_do():
    with pytest.raises(ValidationError, match=r"'hiccup' is no fault; there are .*restart"):
        PlannedFault(fault="hiccup")


@pytest.mark.parametrize(
    ("command", "figure"),
    [
        (COMMAND_LOSE, "lose_probability"),
        (COMMAND_LATE, "late_probability"),
        (COMMAND_SATURATE, "current_left"),
        (COMMAND_DOUBLE, "double_probability"),
    ],
)
def test_shares_are_commanded_in_per_mille(command, figure):
    made = faults()
    for per_mille, share in ((0, 0.0), (1, 0.001), (250, 0.25), (1000, 1.0)):
        made.command(command, per_mille)
        assert getattr(made, figure) == share
