"""A reader never keeps the recorder from finishing."""

import subprocess
import sys

import h5py

from daq.recording_file import set_status
from daq.recovery import recording_state

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
