"""A rig whose sessions take a second, and the experiment that they go into."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from daq.excitation.excitation_plan import ExcitationPlan
from daq.excitation.standard_plan import standard_plan
from daq.rig import Rig
from daq.session_workflow import PayloadSession


@pytest.fixture(scope="session")
def rig() -> Rig:
    return Rig.load("rx130l-joint3-simulated")


@pytest.fixture(scope="session")
def short_plan(rig: Rig) -> ExcitationPlan:
    return standard_plan(rig, 20.0)


@pytest.fixture
def armed_session(tmp_path: Path, short_plan: ExcitationPlan) -> Iterator[Callable[..., PayloadSession]]:
    """Makes sessions that are armed; whatever becomes of them, their processes end with the test."""
    made = []

    def make(rig: Rig, payload: str = "none", plan: ExcitationPlan = short_plan, **more) -> PayloadSession:
        session = PayloadSession(rig, tmp_path / "experiment", plan, rig.payload(payload), "operator", **more)
        made.append(session)
        assert session.check().ok
        session.confirm_payload(session.payload.mass)
        session.arm()
        return session

    yield make
    for session in made:
        session.close()
