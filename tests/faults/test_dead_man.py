"""A process that holds the stop button and gives no sign of life any more: every axis rests within 2.2 s, counted on the bus."""

import time
from types import SimpleNamespace

import numpy as np
import pytest

import daq.acquisition
from daq.excitation.excitation_plan import ExcitationPlan
from daq.excitation.trapezoid import Move
from daq.rig import RIGS, Rig
from daq.safety import StopCause
from daq.sampling_loop import _CYCLES_PER_TURN, _NAP
from daq.session_workflow import _BEAT
from daq.stopping_watch import longest_stop
from tests.faults.bench import bench_rig, is_safe, run

DEAD_MAN = 2.2
"""s from the last sign of life until rest"""


@pytest.mark.parametrize("rig", sorted(path.stem for path in RIGS.glob("*.yaml")))
def test_timeout_turn_and_the_weakest_ramp_that_is_not_cut_together_are_short_enough(rig):
    """Whatever the drives' ramps are: what is weaker than `longest_stop` says is cut."""
    rig = Rig.load(rig)
    assert rig.supervision.parent_timeout + _NAP + longest_stop(rig) <= DEAD_MAN


def back_and_forth() -> ExcitationPlan:
    """Near the limit of 1.2 rad/s again and again, for 8 s."""
    moves = (Move(to=(1.4,), duration=1.3, ramp=0.35), Move(to=(0.35,), duration=1.3, ramp=0.35))
    return ExcitationPlan(joints=("j3",), start=(0.35,), phases=moves * 3)


@pytest.mark.parametrize("after", [0.0, 0.35, 0.7, 1.05])
def test_the_axis_rests_within_two_seconds_of_the_last_sign_of_life_in_every_phase_of_a_motion(
    after, monkeypatch
):
    """Signs of life, time-out and rest are counted in the time of the bus, so that no busy computer counts."""
    stages, beats, silent_from = [], [0.0], []
    monkeypatch.setattr(
        daq.acquisition,
        "time",
        SimpleNamespace(monotonic=lambda: stages[0].plant.time if stages else 0.0, sleep=time.sleep),
    )

    def begins(stage) -> None:
        stage.beats = False  # those of the wall clock
        stages.append(stage)

    def lives(plant) -> None:
        if not silent_from and abs(plant.mechanism.joint_velocity) > 0.5:
            silent_from.append(plant.time + after)
        if plant.time - beats[-1] >= _BEAT and not (silent_from and plant.time > silent_from[0]):
            beats.append(plant.time)
            stages[0].parent.send(("beat", ""))

    rig = bench_rig()
    outcome = run(rig, back_and_forth(), before=begins, meanwhile=lives)
    assert outcome.reason.cause is StopCause.DEAD_PARENT, outcome.reason.words
    assert is_safe(outcome)
    moving = outcome.trace.since(beats[-1])
    took = moving[np.abs(moving[:, 2]) > 0.01][-1, 0] - beats[-1]
    turn = _CYCLES_PER_TURN * rig.cycle  # a look at what the parent said, in simulated time
    assert rig.supervision.parent_timeout < took <= DEAD_MAN + turn
