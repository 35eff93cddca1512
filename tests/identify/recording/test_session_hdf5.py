"""Recordings in HDF5, by the layout of docs/architecture.md."""

import json
import signal
import subprocess
import sys

import h5py
import numpy as np
import pytest

from identify.recording import InputError
from identify.recording.experiment_file import Payload
from identify.recording.sampling import uniform_session
from identify.recording.session import SessionEntry
from identify.recording.session_hdf5 import read_hdf5_session

MATRIX = np.array([[1e-4, 0.0], [-5e-5, 2e-4]])
OFFSET = np.array([0.1, -0.2])
SCALE = np.array([0.01, -0.02])


def recording(path, rows=2000, period=1e-3, **changed):
    """Two axes at 1 kHz. `changed` replaces data sets or, as attribute__NAME, attributes; None removes."""
    rng = np.random.default_rng(0)
    time = period * np.arange(rows)
    sets = {
        "cycle": np.arange(rows) + 7,
        "sync_time": np.round((time + 1.7e9) * 1e9).astype(np.int64),
        "position": np.round(1e4 * np.stack([np.sin(6 * time), np.cos(4 * time)], axis=1)).astype(np.int32),
        "command": rng.integers(-1000, 1000, (rows, 2)).astype(np.int32),
        "setpoint": np.zeros((rows, 2), np.int32),
        "valid": np.full((rows, 2), 3, np.uint8),
    }
    attributes = {"format": 1, "cycle": period, "status": "complete", "status_reason": "", "rig": "{}"}
    attributes |= {
        name.removeprefix("attribute__"): value for name, value in changed.items() if "attribute__" in name
    }
    sets |= {name: value for name, value in changed.items() if "attribute__" not in name}
    with h5py.File(path, "w", libver="latest") as file:
        for name, values in sets.items():
            if values is not None:
                file[name] = values
        for name, value in attributes.items():
            if value is not None:
                file.attrs[name] = value
        if "position" in file:
            file["position"].attrs["matrix"] = MATRIX
            file["position"].attrs["offset"] = OFFSET
        if "command" in file:
            file["command"].attrs["scale"] = SCALE
    return sets


def session_of(path):
    entry = SessionEntry(path.name, path, Payload(name="none", mass=0.0), "identification")
    return uniform_session(entry, read_hdf5_session(path, 2))


def test_counts_are_scaled_by_the_attributes(tmp_path):
    path = tmp_path / "s.h5"
    sets = recording(path)
    session = session_of(path)
    np.testing.assert_allclose(session.position, sets["position"] @ MATRIX.T + OFFSET, atol=1e-14)
    np.testing.assert_allclose(session.command, sets["command"] * SCALE, atol=1e-14)
    np.testing.assert_allclose(session.time, 1e-3 * np.arange(2000), atol=1e-12)
    assert session.remarks == ()
    assert session.temperature is None


def test_setpoints_are_read_where_asked_for_as_they_were_in_force(tmp_path):
    path = tmp_path / "s.h5"
    counts = np.random.default_rng(1).integers(-1000, 1000, (2000, 2)).astype(np.int32)
    recording(path, setpoint=counts)
    assert read_hdf5_session(path, 2).extra == {}
    read = read_hdf5_session(path, 2, setpoints=True).extra
    found = np.column_stack([read["qref1"], read["qref2"]])
    np.testing.assert_allclose(found[1:], counts[:-1] @ MATRIX.T + OFFSET, atol=1e-12)


def test_a_wrong_gear_ratio_is_mended_by_mending_the_attribute(tmp_path):
    path = tmp_path / "s.h5"
    sets = recording(path)
    with h5py.File(path, "r+") as file:
        file["position"].attrs["matrix"] = 2 * MATRIX
    np.testing.assert_allclose(
        session_of(path).position, 2 * sets["position"] @ MATRIX.T + OFFSET, atol=1e-13
    )


def test_isolated_missing_samples_are_bridged_in_their_axis_alone(tmp_path):
    rng = np.random.default_rng(1)
    valid = np.full((2000, 2), 3, np.uint8)
    gone = np.sort(rng.choice(np.arange(2, 1990), 20, replace=False))
    valid[gone, 1] = 0
    path = tmp_path / "s.h5"
    sets = recording(path, valid=valid)
    counts = sets["position"].astype(float)
    spoiled = sets["position"].copy()
    spoiled[gone, 1] = 2_000_000_000  # what stands where nothing came is not used
    with h5py.File(path, "r+") as file:
        file["position"][:] = spoiled
    session = session_of(path)
    assert session.segments == (slice(0, 2000),)
    assert any("20 missing samples (0.005 of all) bridged" in remark for remark in session.remarks)
    expected = counts @ MATRIX.T + OFFSET
    there = np.setdiff1d(np.arange(2000), gone)
    np.testing.assert_allclose(session.position[there], expected[there], atol=1e-12)
    # Counts are whole numbers, so a bridged one is a count or two off.
    np.testing.assert_allclose(session.position[gone], expected[gone], atol=2 * 2e-4)


def test_a_longer_silence_of_one_axis_is_a_hole(tmp_path):
    valid = np.full((2000, 2), 3, np.uint8)
    valid[700:800, 0] = 2
    valid[1500:1505, 1] = 1
    path = tmp_path / "s.h5"
    sets = recording(path, valid=valid)
    session = session_of(path)
    assert [piece.stop - piece.start for piece in session.segments] == [700, 1200]
    assert any("100 cycles without an answer" in remark for remark in session.remarks)
    assert any("5 missing samples" in remark for remark in session.remarks)
    second = session.position[session.segments[1]]
    np.testing.assert_allclose(second, (sets["position"] @ MATRIX.T + OFFSET)[800:], atol=4e-4)


def test_cycles_that_were_never_recorded_are_a_hole_or_bridged(tmp_path):
    keep = np.concatenate([np.arange(0, 600), np.arange(602, 1000), np.arange(1300, 2000)])
    whole = recording(tmp_path / "whole.h5")
    path = tmp_path / "s.h5"
    recording(path, **{name: values[keep] for name, values in whole.items()})
    session = session_of(path)
    assert [piece.stop - piece.start for piece in session.segments] == [1000, 700]


def test_blocks_of_reading_leave_no_seam(tmp_path, monkeypatch):
    rng = np.random.default_rng(2)
    valid = np.where(rng.random((2000, 2)) < 0.02, 0, 3).astype(np.uint8)
    valid[[0, -1]] = 3
    path = tmp_path / "s.h5"
    recording(path, valid=valid)
    whole = read_hdf5_session(path, 2)
    monkeypatch.setattr("identify.recording.session_hdf5.BLOCK", 37)
    pieces = read_hdf5_session(path, 2)
    np.testing.assert_allclose(pieces.position, whole.position, atol=1e-12)
    np.testing.assert_allclose(pieces.command, whole.command, atol=1e-12)


def test_late_samples_are_used_and_said(tmp_path):
    valid = np.full((2000, 2), 3, np.uint8)
    valid[5:8, 0] |= 4
    recording(tmp_path / "s.h5", valid=valid)
    session = session_of(tmp_path / "s.h5")
    assert session.remarks == ("3 samples came late",)


def test_an_irregular_sync_is_taken_at_its_recorded_times(tmp_path):
    rng = np.random.default_rng(3)
    time = 1e-3 * (np.arange(2000) + rng.uniform(-0.3, 0.3, 2000))
    position = np.round(1e7 * np.stack([np.sin(6 * time), np.cos(4 * time)], axis=1)).astype(np.int32)
    path = tmp_path / "s.h5"
    recording(path, sync_time=np.round(time * 1e9).astype(np.int64), position=position)
    session = session_of(path)
    assert any("SYNC was not regular" in remark for remark in session.remarks)
    start = session.time + time[0]
    expected = 1e7 * np.stack([np.sin(6 * start), np.cos(4 * start)], axis=1) @ MATRIX.T + OFFSET
    np.testing.assert_allclose(session.position, expected, atol=1e-3)


def test_a_clock_that_was_read_a_little_late_does_not_disturb_a_regular_sync(tmp_path):
    rng = np.random.default_rng(4)
    stamps = 1e6 * np.arange(2000) + rng.uniform(0, 4e4, 2000)
    path = tmp_path / "s.h5"
    recording(path, sync_time=stamps.astype(np.int64))
    session = session_of(path)
    assert session.remarks == ()
    np.testing.assert_allclose(session.time, 1e-3 * np.arange(2000), atol=1e-12)


def test_a_cycle_that_took_longer_than_it_should_is_measured(tmp_path):
    path = tmp_path / "s.h5"
    recording(path, sync_time=(1_020_000 * np.arange(2000)).astype(np.int64))
    session = session_of(path)
    assert any("1.02 ms instead of 1 ms" in remark for remark in session.remarks)
    assert session.sampling_period == pytest.approx(1.02e-3)


def test_simulated_time_is_told_by_the_cycle_alone(tmp_path):
    rng = np.random.default_rng(5)
    path = tmp_path / "s.h5"
    recording(
        path,
        sync_time=np.cumsum(rng.integers(1000, 90_000, 2000)),
        attribute__rig=json.dumps({"pacing": "as-fast-as-answered"}),
    )
    session = session_of(path)
    assert session.remarks == ()
    assert session.sampling_period == pytest.approx(1e-3)


@pytest.mark.parametrize(
    "rig", ["[" * 50_000, "9" * 5000, "{", "[]"], ids=["deep", "long", "broken", "a list"]
)
def test_a_description_of_the_rig_that_nobody_can_read_leaves_the_samples_as_they_are(tmp_path, rig):
    recording(tmp_path / "s.h5", attribute__rig=rig)
    recording(tmp_path / "t.h5")
    read, whole = session_of(tmp_path / "s.h5"), session_of(tmp_path / "t.h5")
    np.testing.assert_array_equal(read.position, whole.position)
    assert read.remarks == whole.remarks


def test_temperatures_are_read_where_every_axis_has_some(tmp_path):
    path = tmp_path / "s.h5"
    warm = np.full((2000, 2), np.nan, np.float32)
    warm[::100, 0] = np.linspace(20, 30, 20)
    recording(path, temperature=warm)
    session = session_of(path)
    assert session.temperature is None
    assert any("axis 2 has no temperature" in remark for remark in session.remarks)
    warm[50::100, 1] = 25.0
    recording(path, temperature=warm)
    temperature = session_of(path).temperature
    assert temperature is not None
    assert temperature[1000, 0] == pytest.approx(20 + 10 * 10 / 19, abs=1e-4)
    assert (temperature[:, 1] == 25.0).all()


@pytest.mark.parametrize(
    ("status", "reason", "said"),
    [
        ("recording", "", "cut off before its end"),
        ("aborted", "stop button", "aborted: stop button"),
        ("faulted", "drive 3: overcurrent", "faulted: drive 3: overcurrent"),
    ],
)
def test_a_session_that_did_not_end_well_is_read_and_says_so(tmp_path, status, reason, said):
    path = tmp_path / "s.h5"
    recording(path, attribute__status=status, attribute__status_reason=reason)
    assert said in session_of(path).remarks[0]


WRITER = """
import sys, h5py, numpy as np
with h5py.File(sys.argv[1], "w", libver="latest") as file:
    file.attrs["format"], file.attrs["cycle"], file.attrs["status"] = 1, 1e-3, "recording"
    sets = {}
    for name, width, kind in (
        ("cycle", (), "i8"), ("sync_time", (), "i8"), ("position", (2,), "i4"),
        ("command", (2,), "i4"), ("setpoint", (2,), "i4"), ("valid", (2,), "u1"),
    ):
        sets[name] = file.create_dataset(name, (0, *width), kind, maxshape=(None, *width), chunks=(64,
        *width))
    sets["position"].attrs["matrix"], sets["position"].attrs["offset"] = np.eye(2), np.zeros(2)
    sets["command"].attrs["scale"] = np.ones(2)
    file.swmr_mode = True
    for start in range(0, 100_000, 100):
        rows = np.arange(start, start + 100)
        for name, data in sets.items():
            data.resize(start + 100, axis=0)
            data[start:] = {"cycle": rows, "sync_time": rows * 1_000_000, "valid": 3}.get(name, rows[:, None])
            data.flush()
        if start == 3000:
            print("ready", flush=True)
            sys.stdin.readline()
"""


def test_a_recording_whose_writer_was_killed_is_read(tmp_path):
    path = tmp_path / "s.h5"
    command = [sys.executable, "-c", WRITER, str(path)]
    writer = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert writer.stdin is not None
    assert writer.stdout is not None
    with writer.stdin, writer.stdout:
        assert writer.stdout.readline() == b"ready\n"
        writer.send_signal(signal.SIGKILL)
        writer.wait()
    raw = read_hdf5_session(path, 2)
    assert len(raw.time) == 3100
    np.testing.assert_array_equal(raw.position[:, 1], np.arange(3100))
    assert "cut off" in raw.remarks[0]


def test_rows_that_a_killed_writer_had_not_handed_over_are_left_out(tmp_path):
    cycle = np.arange(2000)
    cycle[1800:] = 0
    path = tmp_path / "s.h5"
    recording(path, cycle=cycle, attribute__status="recording")
    assert len(session_of(path).time) == 1800


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"attribute__format": None}, ["'format' is missing"]),
        ({"attribute__format": 9}, ["'format' is 9", "format 1"]),
        ({"attribute__format": "one"}, ["'format' is one", "format 1"]),
        ({"attribute__format": [1, 2]}, ["'format' is [1 2]", "format 1"]),
        ({"attribute__cycle": None}, ["'cycle'", "SYNC"]),
        ({"attribute__cycle": "1 ms"}, ["'cycle'", "no number"]),
        ({"command": np.full((2000, 2), b"a")}, ["'command'", "not numbers"]),
        ({"valid": None}, ["data set 'valid' is missing"]),
        ({"position": np.zeros((2000, 3), np.int32)}, ["'position'", "(2000, 3)", "2 joints"]),
        ({"cycle": np.zeros(2000, np.int64)}, ["'cycle' row 1", "0 does not come after 0"]),
        ({"sync_time": np.zeros(2000, np.int64)}, ["'sync_time' row 1", "does not come after"]),
        ({"cycle": np.zeros(0, np.int64)}, ["no samples"]),
        ({"valid": np.full((2000, 2), [3, 1], np.uint8)}, ["axis 2 never answered"]),
    ],
)
def test_a_file_that_is_not_of_the_layout_is_refused_by_name(tmp_path, changed, said):
    path = tmp_path / "s.h5"
    recording(path, **changed)
    with pytest.raises(InputError) as raised:
        session_of(path)
    assert str(raised.value).startswith(str(path))
    for part in said:
        assert part in str(raised.value)


@pytest.mark.parametrize(
    ("name", "value"), [("matrix", np.eye(3)), ("offset", [0.0, np.nan]), ("scale", None)]
)
def test_scaling_that_does_not_fit_is_refused_by_name(tmp_path, name, value):
    path = tmp_path / "s.h5"
    recording(path)
    with h5py.File(path, "r+") as file:
        attributes = file["command" if name == "scale" else "position"].attrs
        if value is None:
            del attributes[name]
        else:
            attributes[name] = value
    with pytest.raises(InputError, match=f"attribute '{name}'"):
        session_of(path)


def test_a_damaged_file_is_refused(tmp_path):
    path = tmp_path / "s.h5"
    recording(path)
    path.write_bytes(path.read_bytes()[:300])
    with pytest.raises(InputError, match="cannot be read as HDF5"):
        session_of(path)
