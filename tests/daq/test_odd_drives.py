"""Drives that differ from what a master expects run a session like any other; what is done otherwise is said."""

import time

import numpy as np
import pytest

from daq.excitation.excitation_plan import ExcitationPlan, Move
from daq.rig import Rig
from daq.rig_check import check_rig
from daq.rig_drives import RigDrives
from daq.safety import StopCause
from daq.session_events import SessionState
from daq.session_workflow import PayloadSession
from daq.simulated_rig import simulated_rig
from drivers.errors import DriveError
from identify.recording import load_experiment

FIXED_COB_IDS = tuple(f"0x{first + number:04X}:01" for first in (0x1400, 0x1800) for number in range(4))
THERE_AND_BACK = ExcitationPlan(
    joints=("j3",),
    start=(0.35,),
    phases=(Move(to=(0.5,), duration=1.5, ramp=0.5), Move(to=(0.35,), duration=1.5, ramp=0.5)),
)


def with_oddities(rig: Rig, **oddities: object) -> Rig:
    """The simulated rig with a drive of these oddities."""
    drive = {**rig.simulated["drives"][0], "oddities": oddities}
    return rig.model_copy(update={"simulated": {**rig.simulated, "drives": [drive]}})


@pytest.mark.parametrize(
    ("oddities", "said"),
    [
        (
            {"fixed_pdos": True},
            "where it refuses 0x1600:00, it is driven by its PDOs as they stand: RPDO 1 (0x203: controlword, 0x6060, target)",
        ),
        ({"no_heartbeat_consumer": True}, "no heartbeat consumer (0x1016)"),
        (
            {"answers_after": 0.01, "shows_state_after": 5, "missing": ("0x1018:02", "0x6085", "0x605A")},
            "the drive does not tell it (0x6085)",
        ),
        ({"node_guarding_only": True}, "no heartbeat (0x1017): it is asked by remote frames (node guarding)"),
        ({"missing": ("0x6075", "0x6076")}, "does not tell what its current reference is a fraction of"),
        ({"receive_pdos": 2}, "2 RPDOs; the others are left alone"),
        (
            {"fixed_interpolation": 2},
            "its interpolation time (0x60C2) is the rig's cycle, 0.002 s, already: nothing is written there",
        ),
        ({"missing": ("0x6061",)}, "has no mode display (0x6061)"),
        (
            {"read_only": FIXED_COB_IDS, "holds": {"0x1800:01": 0x1A5, "0x1400:01": 0x2A5}},
            "where it refuses 0x1800:01 and 0x1400:01, it goes on with 0x1A5 and 0x2A5",
        ),
        (
            {"fixed_pdos": True, "no_heartbeat_consumer": True, "receive_pdos": 2, "fixed_interpolation": 2},
            "2 RPDOs",
        ),
    ],
)
def test_an_odd_drive_runs_a_session(tmp_path, rig, oddities, said):
    odd = with_oddities(rig, **oddities)
    with PayloadSession(odd, tmp_path / "odd", THERE_AND_BACK, odd.payload("none"), "operator") as session:
        check = session.check()
        assert check.ok, check.problems
        assert said in "; ".join(item.words for item in check.items)
        unchanged = "; ".join(session.remarks)
        assert ("its PDO mapping cannot be changed" in unchanged) == ("fixed_pdos" in oddities)
        assert ("its COB-IDs can only be read" in unchanged) == ("read_only" in oddities)
        session.confirm_payload(0.0)
        session.arm()
        session.start()
        assert session.wait(120) is SessionState.DONE, session.reason
    experiment = load_experiment(tmp_path / "odd")
    read = experiment.read(experiment.sessions[0])
    assert len(read.time) > 1000
    assert np.ptp(read.position) > 0.1
    assert np.ptp(read.command) > 0.1


def test_a_quick_stop_that_is_weaker_than_a_stop_must_show_is_said_before_anything_moves(rig):
    weak = {**rig.simulated["drives"][0], "quick_stop_deceleration": 95.0}  # 1 rad/s² of the joint
    weaker = rig.model_copy(update={"simulated": {**rig.simulated, "drives": [weak]}})

    def said(of: Rig) -> str:
        with simulated_rig(of, of.payload("none")):
            drives = RigDrives(of)
            try:
                return "; ".join(item.words for item in check_rig(drives).items)
            finally:
                drives.close()

    assert "quick_stop_deceleration" not in said(rig)
    assert "1 rad/s² if that is in counts: weaker than expected" in said(weaker)
    (axis,) = weaker.axes
    stated = axis.limits.model_copy(update={"quick_stop_deceleration": 0.9})
    known = weaker.model_copy(update={"axes": (axis.model_copy(update={"limits": stated}),)})
    assert "quick_stop_deceleration" not in said(known)


def test_a_guarded_drive_that_answers_no_more_stops_the_session_like_a_lost_heartbeat(rig):
    odd = with_oddities(rig, node_guarding_only=True)
    quick = odd.model_copy(
        update={"supervision": odd.supervision.model_copy(update={"heartbeat_timeout": 0.02})}
    )
    with simulated_rig(quick, quick.payload("none")) as plant:
        drives = RigDrives(quick)
        try:
            assert check_rig(drives).ok
            (node,) = plant.nodes
            node.faults.heartbeat_stopped = True
            drives.heartbeat()
            latest = time.monotonic() + 20.0
            while (trouble := drives.trouble()) is None and time.monotonic() < latest:
                drives.heartbeat()
        finally:
            drives.close()
    assert trouble is not None
    assert trouble.cause is StopCause.LOST_HEARTBEAT
    assert "joint j3 (node 3): no answer to node guarding for" in trouble.words


def test_a_cycle_that_the_drive_cannot_be_told_is_named_with_the_one_that_it_has(rig):
    odd = with_oddities(rig, fixed_interpolation=5)
    with simulated_rig(odd, odd.payload("none")):
        drives = RigDrives(odd)
        try:
            assert check_rig(drives).ok
            with pytest.raises(DriveError, match=r"it is set to 0\.005 s: give the rig that cycle"):
                drives.configure()
        finally:
            drives.close()
