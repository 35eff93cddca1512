"""A part of the matrix of whole sessions: cells in which an earlier version failed, and one of each kind."""

import pytest

from tests.faults.sessions import SESSION_FAULTS, session_cell

BY_NAME = {fault.name: fault for fault in SESSION_FAULTS}
CELLS = [
    ("experiment's folder deleted", "checked"),  # the session could not be closed
    ("recording deleted", "fast"),
    ("acquisition and recorder killed", "slow"),
]


@pytest.mark.parametrize(("fault", "phase"), CELLS)
def test_the_session_ends_says_what_is_so_and_blocks_no_other(fault, phase, tmp_path):
    assert session_cell(BY_NAME[fault], phase, tmp_path).failures == ()
