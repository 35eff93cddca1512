"""The recorder's word that its files are there, at whatever moment it comes."""

from multiprocessing import Pipe

import pytest

from daq.acquisition import Acquisition, AcquisitionOrder
from daq.safety import StopCause, StopReason


class QuietDrives:
    """Drives of which nothing is heard."""

    def heartbeat(self):
        pass

    def trouble(self):
        return None


@pytest.fixture
def acquisition(rig):
    """An acquisition that waits for its arming, in this process; its parent's and its recorder's ends."""
    parent, theirs = Pipe()
    recorder, to_recorder = Pipe()
    order = AcquisitionOrder(rig, rig.payload("none"), None, "rows", "frames")
    with parent, theirs, recorder, to_recorder:
        yield Acquisition(order, theirs, to_recorder), parent, recorder


def armed(acquisition):
    drives = QuietDrives()
    return acquisition._wait(drives, lambda: acquisition._arm_asked) or acquisition._await_recorder(drives)


def test_a_recorder_that_is_ready_when_the_order_to_arm_is_heard_is_not_waited_for(acquisition):
    """On a busy machine both words lie there when the acquisition process comes to look."""
    process, parent, recorder = acquisition
    recorder.send("ready")
    parent.send(("arm", ""))
    assert armed(process) is None


def test_a_recorder_that_cannot_create_its_file_ends_the_session_with_its_words(acquisition):
    process, parent, recorder = acquisition
    recorder.send(StopReason(StopCause.RECORDER, "the recording cannot be created (no)"))
    parent.send(("arm", ""))
    reason = armed(process)
    assert (reason.cause, reason.words) == (StopCause.RECORDER, "the recording cannot be created (no)")


def test_a_recorder_that_dies_first_ends_the_session(acquisition):
    process, parent, recorder = acquisition
    parent.send(("arm", ""))
    recorder.close()
    reason = armed(process)
    assert reason.cause is StopCause.RECORDER
    assert "the recorder process died before the session was armed" in reason.words


def test_a_recorder_that_dies_before_anybody_asks_to_arm_ends_the_session(acquisition):
    process, _, recorder = acquisition
    recorder.close()
    reason = process._wait(QuietDrives(), lambda: process._arm_asked)
    assert reason.cause is StopCause.RECORDER


def test_the_operators_stop_is_heard_while_the_recorder_is_waited_for(acquisition):
    process, parent, _ = acquisition
    parent.send(("arm", ""))
    parent.send(("stop", "enough"))
    assert armed(process).words == "enough"
