"""A reader never keeps the recorder from finishing."""

import subprocess
import sys

import h5py
import pytest

from daq.recording_file import set_status
from daq.recovery import recording_state
from identify.recording import InputError

READER = """
import sys, h5py
with h5py.File(sys.argv[1], "r", libver="latest", swmr=True):
    print("open", flush=True)
    sys.stdin.read()
"""


def test_a_recording_is_finished_while_another_process_reads_it(tmp_path):
    path = tmp_path / "session-00.h5"
    with h5py.File(path, "w", libver="latest") as file:
        file["cycle"] = [0, 1, 2]
        file.attrs.update({"status": "recording", "status_reason": "", "payload": '{"name": "none"}'})
    reader = [sys.executable, "-c", READER, str(path)]
    with subprocess.Popen(reader, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "open\n"
        set_status(path, "aborted", "stopped", {}, "operator's stop")
        process.stdin.close()
    found = recording_state(path)
    assert (found.status, found.reason, found.rows) == ("aborted", "stopped", 3)


def test_a_recording_that_is_half_written_when_it_is_looked_at_is_looked_at_again(tmp_path, monkeypatch):
    """Nothing but its reason is missing: another process writes that just now."""
    path = tmp_path / "session-00.h5"
    with h5py.File(path, "w", libver="latest") as file:
        file["cycle"] = [0, 1, 2]
        file.attrs.update({"status": "recording", "payload": '{"name": "none"}'})
        file.swmr_mode = True
        looks = []

        def pause(seconds):
            looks.append(seconds)
            if len(looks) == 2:
                file.close()
                set_status(path, "aborted", "stopped", {}, "operator's stop")

        monkeypatch.setattr("daq.recovery.time.sleep", pause)
        found = recording_state(path)
    assert (found.status, found.reason, found.rows) == ("aborted", "stopped", 3)
    assert len(looks) == 2


def test_a_closed_recording_that_lacks_something_is_refused_at_once(tmp_path, monkeypatch):
    path = tmp_path / "session-00.h5"
    with h5py.File(path, "w", libver="latest") as file:
        file["cycle"] = [0, 1, 2]
        file.attrs.update({"status": "recording", "payload": '{"name": "none"}'})
    monkeypatch.setattr("daq.recovery.time.sleep", lambda _: pytest.fail("nobody writes it"))
    with pytest.raises(InputError, match="cannot be read as a recording"):
        recording_state(path)
