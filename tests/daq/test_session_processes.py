"""What is said to a session's processes, beside stand-ins that never listen."""

import signal
import subprocess

import pytest

from daq import session_processes
from daq.session_processes import ProcessDied, SessionProcesses


@pytest.fixture
def processes(monkeypatch):
    """Processes that hold their ends of the pipes and read nothing."""

    def deaf(_module, *connections):
        descriptors = [connection.fileno() for connection in connections]
        process = subprocess.Popen(["sleep", "600"], pass_fds=descriptors)
        for connection in connections:
            connection.close()
        return process

    monkeypatch.setattr(session_processes, "start_process", deaf)
    started = SessionProcesses()
    started.start()
    yield started
    for process in (started.acquisition, started.recorder):
        process.kill()
        process.wait()
    started.wait_for_recording()
    started.close()


def fill(processes):
    """Say so much that the pipe holds no more."""
    while processes.say("arm", "x" * 4096):
        pass


def test_a_stop_that_the_acquisition_does_not_hear_is_a_signal_to_it(processes):
    fill(processes)
    processes.stop("operator's stop")
    assert processes.acquisition.wait() == -signal.SIGTERM
    processes.stop("again, when it has gone")
    assert processes.recorder.poll() is None, "the recorder has a file to close"


def test_a_stop_that_it_may_hear_is_no_signal(processes):
    processes.stop("operator's stop")
    processes.say("beat")
    assert processes.acquisition.poll() is None


def test_an_order_that_does_not_arrive_says_so(processes):
    fill(processes)
    with pytest.raises(ProcessDied, match="does not respond"):
        processes.order("start")


def test_a_process_that_died_is_found_by_who_hears_it_and_by_who_orders_a_recording(processes):
    for process in (processes.acquisition, processes.recorder):
        process.kill()
        process.wait()
    assert processes.say("beat"), "who hears it says that it died"
    with pytest.raises((EOFError, OSError)):
        processes.hear()
    with pytest.raises(ProcessDied, match="the recorder process died"):
        processes.record(None)


def test_what_does_not_end_by_itself_in_time_is_killed(processes):
    processes.end(0.01)
    assert processes.acquisition.returncode == processes.recorder.returncode == -signal.SIGKILL
