"""The plan that tells most: better than the standard one, within every limit, the same for the same request."""

import numpy as np
import pytest

from daq.excitation import standard_plan, violations
from daq.excitation.optimal_excitation import information_of, one_period, optimal_plan, score
from daq.excitation.sinusoid import Sinusoids
from identify.recording.experiment_file import Payload
from tests.daq.excitation.planned_pendulum import request_of


@pytest.mark.parametrize("criterion", ["d-optimal", "condition"])
def test_the_optimal_plan_is_better_than_the_standard_one_and_keeps_every_limit(rig, criterion):
    request = request_of(rig, criterion=criterion)
    plan = optimal_plan(request)
    assert violations(plan, rig) == []
    assert plan.duration <= 40.0 + 1e-6
    best, standard = information_of(plan, request), information_of(standard_plan(rig, 40.0), request)
    scale = standard.scale
    assert score(best, criterion, scale) > score(standard, criterion, scale) + 0.1


def test_the_same_request_gives_the_same_plan(rig, planned):
    assert optimal_plan(request_of(rig)).phases == planned.phases
    assert optimal_plan(request_of(rig, seed=5)).phases != planned.phases


def test_what_repeats_is_looked_at_for_one_period_in_the_middles_of_equal_steps():
    swing = Sinusoids(
        frequency=0.5, repeats=3, fade=0.5, centre=(0.2,), cosine=((0.1, 0.02),), sine=((0.0, 0.05),)
    )
    payloads = (Payload(name="none", mass=0.0), Payload(name="disk", mass=2.0))
    motions = one_period(swing, payloads)
    assert [motion.payload.name for motion in motions] == ["none", "disk"]
    begin, _ = swing.repeated
    for motion in motions:
        count = len(motion.time)
        assert motion.period * count == pytest.approx(1 / swing.frequency)
        assert motion.time == pytest.approx(begin + motion.period * (np.arange(count) + 0.5))
        position, velocity, acceleration, _ = swing.evaluate(motion.time, np.array(swing.centre))
        for found, expected in ((motion.q, position), (motion.dq, velocity), (motion.ddq, acceleration)):
            assert found == pytest.approx(expected)
