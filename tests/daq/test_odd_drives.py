"""Drives that differ from what a master expects run a session like any other; what is done otherwise is said."""

import numpy as np
import pytest

from daq.rig import Rig
from daq.rig_drives import RigDrives
from daq.session_events import SessionState, StepOutOfTurn
from daq.session_workflow import PayloadSession
from daq.simulated_rig import simulated_rig
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
        unchanged = "; ".join(session.remarks)
        assert ("its PDO mapping cannot be changed" in unchanged) == ("fixed_pdos" in oddities)
        session.confirm_payload(0.0)
        session.arm()
        session.start()
        assert session.wait(120) is SessionState.DONE, session.reason
    experiment = load_experiment(tmp_path / "odd")
    read = experiment.read(experiment.sessions[0])
    assert len(read.time) > 8000
    assert np.ptp(read.position) > 0.1
    assert np.ptp(read.command) > 0.1


def test_a_quick_stop_that_is_weaker_than_a_stop_must_show_is_said_before_anything_moves(rig):
    weak = {**rig.simulated["drives"][0], "quick_stop_deceleration": 95.0}  # 1 rad/s² of the joint
    weaker = rig.model_copy(update={"simulated": {**rig.simulated, "drives": [weak]}})

    def said(of: Rig) -> str:
        with simulated_rig(of, of.payload("none")):
            drives = RigDrives(of)
            try:
                return "; ".join(item.words for item in drives.check().items)
            finally:
                drives.close()

    assert "quick_stop_deceleration" not in said(rig)
    assert "1 rad/s² if that is in counts: weaker than expected" in said(weaker)
    (axis,) = weaker.axes
    stated = axis.limits.model_copy(update={"quick_stop_deceleration": 0.9})
    known = weaker.model_copy(update={"axes": (axis.model_copy(update={"limits": stated}),)})
    assert "quick_stop_deceleration" not in said(known)


def test_a_cycle_that_the_drive_cannot_be_told_is_named_with_the_one_that_it_has(tmp_path, rig, short_plan):
    odd = with_oddities(rig, fixed_interpolation=5)
    with (
        PayloadSession(odd, tmp_path / "odd", short_plan, odd.payload("none"), "operator") as session,
        pytest.raises(StepOutOfTurn, match=r"it is set to 0\.005 s: give the rig that cycle"),
    ):
        session.check()
