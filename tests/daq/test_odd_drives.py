"""Drives that differ from what a master expects run a session like any other; what is done otherwise is said."""

import numpy as np
import pytest

from daq.rig import Rig
from daq.session_events import SessionState, StepOutOfTurn
from daq.session_workflow import PayloadSession
from identify.recording import load_experiment


def with_oddities(rig: Rig, **oddities: object) -> Rig:
    """The simulated rig with a drive of these oddities."""
    drive = {**rig.simulated["drives"][0], "oddities": oddities}
    return rig.model_copy(update={"simulated": {**rig.simulated, "drives": [drive]}})


@pytest.mark.parametrize(
    ("oddities", "said"),
    [
        ({"fixed_pdos": True}, ""),
        ({"no_heartbeat_consumer": True}, "no heartbeat consumer (0x1016)"),
        ({"receive_pdos": 2}, "2 RPDOs; the others are left alone"),
        ({"fixed_interpolation": 2}, ""),
        (
            {"fixed_pdos": True, "no_heartbeat_consumer": True, "receive_pdos": 2, "fixed_interpolation": 2},
            "2 RPDOs",
        ),
    ],
)
def test_an_odd_drive_runs_a_session(tmp_path, rig, short_plan, oddities, said):
    odd = with_oddities(rig, **oddities)
    with PayloadSession(odd, tmp_path / "odd", short_plan, odd.payload("none"), "operator") as session:
        check = session.check()
        assert check.ok, check.problems
        assert said in "; ".join(item.words for item in check.items)
        session.confirm_payload(0.0)
        session.arm()
        session.start()
        assert session.wait(120) is SessionState.DONE, session.reason
    experiment = load_experiment(tmp_path / "odd")
    read = experiment.read(experiment.sessions[0])
    assert len(read.time) > 8000
    assert np.ptp(read.position) > 0.1
    assert np.ptp(read.command) > 0.1


def test_a_cycle_that_the_drive_cannot_be_told_is_named_with_the_one_that_it_has(tmp_path, rig, short_plan):
    odd = with_oddities(rig, fixed_interpolation=5)
    with (
        PayloadSession(odd, tmp_path / "odd", short_plan, odd.payload("none"), "operator") as session,
        pytest.raises(StepOutOfTurn, match=r"it is set to 0\.005 s: give the rig that cycle"),
    ):
        session.check()
