"""A rig whose sessions take a second, and the experiment that they go into."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import pytest

from daq.excitation.excitation_plan import ExcitationPlan
from daq.excitation.standard_plan import standard_plan
from daq.rig import Rig
from daq.session_events import SessionState
from daq.session_workflow import PayloadSession
from daq.simulated_rig import simulated_rig
from drivers.bus import BusSettings
from drivers.simulated.rig import SimulatedRig
from identify.recording import Experiment, load_experiment


@pytest.fixture(scope="session")
def rig() -> Rig:
    return Rig.load("rx130l-joint3-simulated")


@pytest.fixture
def still_rig(rig: Rig, request: pytest.FixtureRequest) -> Rig:
    """The rig on a bus that the tests of one module share."""
    channel = Path(request.path).stem
    return rig.model_copy(update={"bus": BusSettings(interface="virtual", channel=channel)})


@pytest.fixture
def powered(still_rig: Rig) -> Iterator[SimulatedRig]:
    """Its simulated drives, as long as the test lasts."""
    with simulated_rig(still_rig, still_rig.payload("none")) as on:
        yield on


@pytest.fixture(scope="session")
def short_plan(rig: Rig) -> ExcitationPlan:
    return standard_plan(rig, 20.0)


@pytest.fixture(scope="session")
def long_plan(rig: Rig) -> ExcitationPlan:
    return standard_plan(rig, 300.0)


@pytest.fixture(scope="session")
def recorded() -> Callable[..., Experiment]:
    """Drives a whole session with each payload, and gives the experiment that they make."""

    def drive(
        rig: Rig, plan: ExcitationPlan, folder: Path, payloads: Sequence[str], patience: float = 200.0
    ) -> Experiment:
        for payload in payloads:
            known = rig.payload(payload)
            with PayloadSession(rig, folder, plan, known, "operator") as session:
                assert session.check().ok
                session.confirm_payload(known.mass)
                session.arm()
                session.start()
                assert session.wait(patience) is SessionState.DONE, session.reason
        return load_experiment(folder)

    return drive


@pytest.fixture
def armed_session(tmp_path: Path, short_plan: ExcitationPlan) -> Iterator[Callable[..., PayloadSession]]:
    """Makes sessions that are armed; whatever becomes of them, their processes end with the test."""
    made = []

    def make(
        rig: Rig,
        payload: str = "none",
        plan: ExcitationPlan = short_plan,
        folder: Path = tmp_path / "experiment",
        **more,
    ) -> PayloadSession:
        session = PayloadSession(rig, folder, plan, rig.payload(payload), "operator", **more)
        made.append(session)
        assert session.check().ok
        session.confirm_payload(session.payload.mass)
        session.arm()
        return session

    yield make
    for session in made:
        session.close()
