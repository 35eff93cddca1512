"""A session that a fault is to end, and what must hold then."""

import h5py
import numpy as np

from daq.session_events import SessionState


def ended(session, timeout: float = 120.0) -> str:
    """Start, wait for the end; the reason."""
    session.start()
    assert session.wait(timeout) is SessionState.FAULTED, session.reason
    return session.reason


def assert_at_rest_and_kept(session, cause: str) -> None:
    """The last samples stand still, and the recording says what ended it."""
    with h5py.File(session.file) as file:
        assert file.attrs["status"] == "faulted"
        assert file.attrs["stop_cause"] == cause
        position = file["position"][:, 0][file["valid"][:, 0] & 1 == 1]
        assert len(position) > 500
        assert np.ptp(position[-20:]) * abs(session.rig.position_matrix[0, 0]) < 1e-4
