"""The plan that tells most: better than the standard one, within every limit, the same for the same request."""

import pytest

from daq.excitation import standard_plan, violations
from daq.excitation.optimal_excitation import information_of, optimal_plan, score
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
