"""An arm that is held over the bus (cyclic torque mode): whatever fails, it comes to rest, and its drive is left as it was.

The bench's plant is watched beside the bus: what really moved, what torque the drive was told, in which mode it was.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from daq.safety import StopCause
from drivers.cia402 import Mode
from drivers.simulated import process_image as slot
from drivers.simulated.faults import ENCODER_STANDS, SHOWN_STANDS
from tests.daq.held_over_the_bus import BOUND, held_over_the_bus, takes_torque_alone
from tests.faults.bench import Outcome, Stage, bench_rig, is_safe, run, short_plan

CSP, CST = int(Mode.CYCLIC_SYNCHRONOUS_POSITION), int(Mode.CYCLIC_SYNCHRONOUS_TORQUE)


@dataclass
class Watched:
    """(mode, target torque, torque demand) of the drive and the joint's position, with every stretch of time."""

    plant: Any = None
    rows: list[tuple[int, int, int, float]] = field(default_factory=list)

    def look(self, plant: Any) -> None:
        self.plant = plant
        image = plant.nodes[0].drive.image
        self.rows.append(
            (
                image[slot.MODE_DISPLAY],
                image[slot.TARGET_TORQUE],
                image[slot.TORQUE_DEMAND],
                plant.mechanism.joint_position,
            )
        )

    @property
    def left(self) -> tuple[int, int]:
        """Mode and target torque of the drive in the end."""
        image = self.plant.nodes[0].drive.image
        return image[slot.MODE_DISPLAY], image[slot.TARGET_TORQUE]


def driven(*faults: tuple[str, int], phase: str = "fast", **others: Any) -> tuple[Outcome, Watched]:
    planned = [
        {"fault": name, "value": value, "phase": phase, "speed": 50.0, "after": 3} for name, value in faults
    ]
    rig = takes_torque_alone(bench_rig(planned=planned))
    watched = Watched()
    outcome = run(rig, ahead=held_over_the_bus(rig, short_plan()), meanwhile=watched.look, **others)
    return outcome, watched


def quick(plant: Any, _: Any) -> bool:
    return abs(plant.mechanism.joint_velocity) > 0.5


def test_torque_mode_begins_and_ends_at_rest_without_a_jump_within_its_bound_and_the_drive_is_as_before():
    outcome, watched = driven()
    assert outcome.reason.cause is StopCause.PLAN_DONE
    assert is_safe(outcome)
    rows = np.array(watched.rows)
    inside = np.flatnonzero(rows[:, 0] == CST)
    first, last = inside[0], inside[-1]
    assert (rows[first : last + 1, 0] == CST).all()
    assert np.abs(rows[inside, 1]).max() <= BOUND
    # 20 ms on either side of a change of mode; how the drive's own loop begins is its own affair
    for change, ours in ((first, slice(first - 20, first + 20)), (last, slice(last - 20, last))):
        assert np.ptp(rows[change - 20 : change + 20, 3]) < 2e-4  # rad
        assert np.ptp(rows[ours, 2]) < 0.02 * BOUND
    assert watched.left == (CSP, 0)


def test_a_stop_by_the_operator_is_a_quick_stop_and_the_drive_does_not_stay_in_torque_mode():
    outcome, watched = driven(stop_when=quick)
    assert outcome.reason.cause is StopCause.OPERATOR
    assert is_safe(outcome)
    assert max(mode for mode, *_ in watched.rows) == CST
    assert watched.left == (CSP, 0)


def test_a_dead_parent_stops_it_as_the_operator_would():
    def parent_dies(stage: Stage) -> None:
        stage.beats = False
        stage.parent.close()

    outcome, watched = driven(("heartbeat", 1), triggered=parent_dies)
    # how far it has gone meanwhile is the wall clock's affair, which simulated time knows nothing of
    assert outcome.reason.cause is StopCause.DEAD_PARENT
    assert is_safe(outcome)
    assert watched.left == (CSP, 0)


@pytest.mark.parametrize(
    ("fault", "value", "cause"),
    [
        ("flip-feedback", 1, StopCause.LIMIT),
        ("nmt-state", 4, StopCause.LOST_FRAMES),
        ("nmt-state", 127, StopCause.LOST_FRAMES),
        ("lose", 1000, StopCause.LOST_FRAMES),
        ("restart", 1, StopCause.RESTARTED),
        ("emergency", 0x4310, StopCause.EMERGENCY),
        ("glitch", 200_000, StopCause.LIMIT),
    ],
)
def test_what_fails_in_motion_ends_it_within_a_hand_s_breadth(fault, value, cause):
    outcome, watched = driven((fault, value))
    assert outcome.reason.cause is cause, outcome.reason
    assert is_safe(outcome)
    assert outcome.travel < 0.15  # rad
    assert outcome.powered_for < 0.3  # s
    assert np.abs([torque for _, torque, *_ in watched.rows]).max() <= BOUND


@pytest.mark.parametrize("stands", [ENCODER_STANDS, SHOWN_STANDS])
@pytest.mark.parametrize(("phase", "speed", "after"), [("fast", 50.0, 3), ("slow", 12.0, 900)])
def test_a_drive_that_says_the_same_position_again_and_again_loses_its_torque(stands, phase, speed, after):
    """The loop over the bus sees an axis that does not follow, and would give it all the torque that it may."""
    rig = takes_torque_alone(
        bench_rig(
            planned=[
                {"fault": "feedback-stands", "value": stands, "phase": phase, "speed": speed, "after": after}
            ]
        )
    )
    watched, modes = Watched(), set()

    def look(plant: Any) -> None:
        watched.look(plant)
        if plant.nodes[0].drive.faults.feedback_stands and plant.nodes[0].drive.machine.enabled:
            modes.add(watched.rows[-1][0])

    outcome = run(rig, ahead=held_over_the_bus(rig, short_plan()), meanwhile=look)
    assert modes == {CST}
    assert outcome.reason.cause is StopCause.LIMIT
    assert not outcome.powered
    assert outcome.travel < 0.15
    assert outcome.powered_for < 0.3
    assert watched.left == (CSP, 0)


def test_a_drive_that_obeys_no_controlword_is_braked_by_our_torque_and_loses_its_power():
    outcome, watched = driven(("disobey", 1), stop_when=quick)
    assert outcome.reason.cause is StopCause.OPERATOR
    assert is_safe(outcome)
    assert not outcome.powered
    assert outcome.travel < 0.3
    assert np.abs([torque for _, torque, *_ in watched.rows]).max() <= BOUND


def test_a_frozen_drive_which_keeps_its_torque_is_told_to_a_person_at_once():
    outcome, _ = driven(("freeze", 1))
    assert outcome.powered
    assert "press the emergency stop" in outcome.ended_alarm
