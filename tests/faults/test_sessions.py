"""A part of the matrix of whole sessions: cells in which an earlier version failed, and one of each kind."""

import contextlib

import pytest

from daq.session_events import SessionState, StepOutOfTurn
from daq.session_outcome import NOTHING_KEPT
from daq.session_workflow import PayloadSession
from tests.faults.bench import bench_rig
from tests.faults.sessions import SESSION_FAULTS, plan_within_limits, session_cell

BY_NAME = {fault.name: fault for fault in SESSION_FAULTS}
CELLS = [
    ("experiment's folder deleted", "checked"),  # the session could not be closed
    ("recording deleted", "fast"),
    ("acquisition and recorder killed", "slow"),
]


@pytest.mark.parametrize(("fault", "phase"), CELLS)
def test_the_session_ends_says_what_is_so_and_blocks_no_other(fault, phase, tmp_path):
    assert session_cell(BY_NAME[fault], phase, tmp_path).failures == ()


def test_a_fault_before_the_first_sample_says_that_nothing_was_kept_and_where_to_look(tmp_path):
    planned = [{"fault": "emergency", "value": 0x4310, "phase": "streaming", "after": 30}]
    rig = bench_rig(planned=planned)
    with PayloadSession(
        rig, tmp_path / "e", plan_within_limits(), rig.payload("none"), "operator"
    ) as session:
        session.check()
        session.confirm_payload(0.0)
        with contextlib.suppress(StepOutOfTurn):  # the fault may come before either
            session.arm()
            session.start()
        assert session.wait(60) is SessionState.FAULTED
        assert "EMCY 0x4310" in session.reason
        assert session.reason.endswith(NOTHING_KEPT)
