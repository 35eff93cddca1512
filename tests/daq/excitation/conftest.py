"""A plan for the rig of one joint."""

import pytest

from daq.excitation import ExcitationPlan
from daq.excitation.optimal_excitation import optimal_plan
from tests.daq.excitation.planned_pendulum import request_of


@pytest.fixture(scope="session")
def planned(rig) -> ExcitationPlan:
    return optimal_plan(request_of(rig))
