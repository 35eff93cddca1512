"""Which part of a log of CAN frames is a session, which setpoint took effect when, and what the recording of it says."""

from __future__ import annotations

import struct

import h5py
import pytest

from daq.can_log import FEWEST_ROWS, read_can_log, write_recording
from daq.rig import RIGS, Rig
from identify.recording.errors import InputError
from identify.recording.experiment_file import Payload

CYCLE = 0.002
"""s, of the rig file"""
SWITCHED_ON, ENABLED = 0x0233, 0x0637


@pytest.fixture(scope="module")
def rig():
    return Rig.load(RIGS / "rx130l-joint3-simulated.yaml")


def line(time, can_id, data):
    return f"({time:.6f}) can0 {can_id:03X}#{data.hex()}"


def log(path, words, position=lambda k: 100 + k, target=lambda k: 1000 + 10 * k, extra=()):
    """A log with one cycle for each statusword: SYNC, the drive's answer, and the target that is sent after it."""
    lines = list(extra)
    for k, word in enumerate(words):
        time = 50.0 + CYCLE * k
        lines.append(line(time, 0x080, b""))
        lines.append(line(time + 2e-4, 0x183, struct.pack("<ihH", position(k), 5, word)))
        lines.append(line(time + 3e-4, 0x203, struct.pack("<Hi", 0x0F, target(k))))
    path.write_text("\n".join(lines) + "\n", encoding="ascii")
    return path


def test_the_longest_stretch_in_which_the_drive_was_enabled_is_taken(tmp_path, rig):
    words = [SWITCHED_ON] * 5 + [ENABLED] * 20 + [SWITCHED_ON] * 7 + [ENABLED] * 30 + [SWITCHED_ON] * 4
    session = read_can_log(log(tmp_path / "a.log", words), rig)
    assert session.rows["position"][:, 0].tolist() == list(range(132, 162))
    assert (
        session.remarks[-1] == "30 cycles from 0.064 to 0.122 s of the log, in which all drives were enabled"
    )
    assert session.counters["alignment"]["lost_sync"] == 0


def test_a_part_that_is_named_is_taken_with_both_its_ends_whatever_the_drive_was(tmp_path, rig):
    path = log(tmp_path / "a.log", [SWITCHED_ON] * 100)
    session = read_can_log(path, rig, begin=0.02, end=0.1)
    assert session.rows["position"][:, 0].tolist() == list(range(110, 151))
    assert session.remarks[-1] == "41 cycles from 0.02 to 0.1 s of the log, as given"
    assert len(read_can_log(path, rig, begin=0.02).rows) == 90
    assert len(read_can_log(path, rig, end=0.1).rows) == 51


def test_a_log_that_ends_before_the_part_does_is_said(tmp_path, rig):
    path = log(tmp_path / "a.log", [ENABLED] * 100)  # the last cycle is at 0.198 s
    assert "ends before" not in read_can_log(path, rig, begin=0.0, end=0.2).remarks[-1]
    assert read_can_log(path, rig, begin=0.0, end=0.5).remarks[-1].endswith("; it ends before 0.5 s")


@pytest.mark.parametrize("count", [FEWEST_ROWS, FEWEST_ROWS - 1])
def test_fewer_cycles_than_a_session_needs_are_refused(tmp_path, rig, count):
    path = log(tmp_path / "a.log", [SWITCHED_ON] * 9 + [ENABLED] * count + [SWITCHED_ON] * 9)
    if count == FEWEST_ROWS:
        assert len(read_can_log(path, rig).rows) == FEWEST_ROWS
    else:
        with pytest.raises(
            InputError, match=r"a\.log: holds no 16 cycles .*name a part by --begin and --end$"
        ):
            read_can_log(path, rig)


def test_a_setpoint_takes_effect_at_the_sync_after_it_and_before_the_first_there_is_none(tmp_path, rig):
    rows = read_can_log(log(tmp_path / "a.log", [ENABLED] * 20), rig).rows
    assert rows["setpoint"][:, 0].tolist() == [0, *(1000 + 10 * k for k in range(19))]


def test_a_log_without_sync_and_one_with_short_frames_are_told(tmp_path, rig):
    path = log(tmp_path / "a.log", [ENABLED] * 30)
    whole = path.read_text(encoding="ascii").splitlines()
    without = tmp_path / "without.log"
    without.write_text("\n".join(each for each in whole if " 080#" not in each) + "\n", encoding="ascii")
    with pytest.raises(InputError, match=r"without\.log: holds no SYNC \(id 0x80\)"):
        read_can_log(without, rig)
    for cut, said in ((1, "1 frame has less data"), (2, "2 frames have less data")):
        places = [place for place, each in enumerate(whole) if " 183#" in each][-cut:]
        short = [each[:-8] if place in places else each for place, each in enumerate(whole)]
        path.write_text("\n".join(short) + "\n", encoding="ascii")
        assert any(remark.startswith(said) for remark in read_can_log(path, rig).remarks)


def test_frames_with_long_ids_and_of_other_devices_are_no_samples(tmp_path, rig):
    extra = [line(49.0, 0x18000183, b"\xff" * 8), line(49.1, 0x184, b"\xff" * 8)]
    session = read_can_log(log(tmp_path / "a.log", [ENABLED] * 20, extra=extra), rig)
    assert session.rows["position"][:, 0].tolist() == list(range(100, 120))


def test_the_recording_says_when_it_began_and_what_it_was_imported_from(tmp_path, rig):
    source = log(tmp_path / "a.log", [ENABLED] * 20)
    session = read_can_log(source, rig)
    write_recording(tmp_path / "a.h5", session, rig, Payload(name="gripper", mass=2.0), "validation", source)
    with h5py.File(tmp_path / "a.h5") as file:
        text = " ".join(str(value) for value in file.attrs.values())
    assert "imported from a.log" in text
    assert "1970-01-01T00:00:50" in text
    assert "validation" in text
    assert "complete" in text
