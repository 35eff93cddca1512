"""A computer that is held up in motion: said, and stopped, once it goes on."""

import os
import signal
import threading

import pytest

from daq.session_events import SessionState


@pytest.mark.second_chance(
    "real time: a machine that is busy may hold the acquisition up before the test does"
)
def test_an_acquisition_that_was_held_up_stops_the_motion_and_says_so(rig, armed_session, short_plan):
    in_time = rig.model_copy(
        update={
            "pacing": "real-time",
            "cycle": 0.02,
            "supervision": rig.supervision.model_copy(update={"silence": 0.5, "parent_timeout": 20.0}),
        }
    )
    session = armed_session(in_time)
    session.start()
    pause = threading.Event()
    while session.progress.cycle < 25 and not session.state.ended:
        pause.wait(0.02)
    assert not session.state.ended, session.reason
    os.kill(session.processes.acquisition.pid, signal.SIGSTOP)
    pause.wait(2.0)
    os.kill(session.processes.acquisition.pid, signal.SIGCONT)
    assert session.wait(60) is SessionState.FAULTED
    assert "this computer was held up for" in session.reason
    assert "did not go out" in session.reason
