"""Every reason to end a motion (design, section 4): the axis comes to rest, the data are there, the reason is said.

Those that need a bus of the kernel are in tests/vcan; a killed parent, recorder or acquisition in test_kills.py; the
operator's stop in test_session_workflow.py.
"""

import re

import h5py

from drivers.simulated.faults import PlannedFault
from tests.daq.ended_session import assert_at_rest_and_kept, ended
from tests.daq.rig_variants import with_faults, with_limits


def test_a_current_beyond_its_limit(rig, armed_session):
    session = armed_session(with_limits(rig, current=9.0))
    assert re.search(r"joint j3: current [\d.]+ A above 9 A in cycle \d+", ended(session))
    assert_at_rest_and_kept(session, "limit")


def test_a_following_error_beyond_its_limit(rig, armed_session):
    """The drive has too little current left and falls behind; our limit is narrower than its own."""
    narrow = with_limits(rig, following_error=0.01, current=40.0)
    session = armed_session(with_faults(narrow, saturate_from=2000, saturate_factor=0.1))
    assert "joint j3: following error" in ended(session)
    assert_at_rest_and_kept(session, "limit")


def test_a_temperature_beyond_its_limit(rig, armed_session, long_plan):
    warm = with_limits(rig, temperature=20.0).model_copy(update={"record_temperature": True})
    axis = warm.axes[0].model_copy(update={"drive": "simulated"})
    session = armed_session(warm.model_copy(update={"axes": (axis,)}), plan=long_plan)
    assert re.search(r"joint j3: temperature [\d.]+ °C above 20 °C", ended(session))


def test_a_lost_heartbeat(rig, armed_session, long_plan):
    quick = rig.supervision.model_copy(update={"heartbeat_timeout": 0.2, "heartbeat_period": 0.05})
    silent = with_faults(rig, heartbeat_stops_at=2000).model_copy(update={"supervision": quick})
    session = armed_session(silent, plan=long_plan)
    assert re.search(r"joint j3 \(node 3\): no heartbeat for", ended(session))
    assert_at_rest_and_kept(session, "lost heartbeat")


def test_a_drive_that_restarts_in_motion_is_said_to_have_restarted(rig, armed_session, long_plan):
    restart = PlannedFault(fault="restart", phase="enabled", after=2500)
    session = armed_session(with_faults(rig, planned=(restart,)), plan=long_plan)
    reason = ended(session)
    assert reason.startswith("joint j3 (node 3): it restarted (its boot-up was heard): look at its supply")
    assert reason.count("no position from the drive") <= 2  # what it was noticed by, and why power was cut
    (kept,) = session.experiment.glob("**/session-*.h5")
    with h5py.File(kept) as file:
        assert file.attrs["status"] == "faulted"
        assert file.attrs["stop_cause"] == "drive restarted"
        assert (file["valid"][:, 0] & 1).sum() > 500
