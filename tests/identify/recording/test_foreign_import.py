"""An experiment made of other people's measurements is there whole or not at all, and remembers its columns."""

from __future__ import annotations

import errno

import numpy as np
import pytest

from identify.recording import load_experiment
from identify.recording.errors import InputError
from identify.recording.experiment_file import EXPERIMENT_FILE, Joint, LinkBody, Payload, PriorBodies, Robot
from identify.recording.foreign.roles import ColumnMap, MeasuredSession
from identify.recording.foreign_import import (
    COLUMNS_FILE,
    NewSession,
    import_sessions,
    read_columns,
    undone_on_error,
)

ROBOT = Robot(gravity=(0.0, 0.0, -9.81), joints=(Joint(name="j1", type="revolute", drive_gain=2.0),))
COLUMNS = ColumnMap(
    position=("q [deg]",), command=("i",), time="t", position_unit=("deg",), resolution=(4096.0,)
)


def session(file="a.csv", payload="none", role="identification", step=0.01):
    time = step * np.arange(400)
    q = np.sin(time)[:, None]
    return NewSession(
        file, MeasuredSession(time, q, 2 * q, None, None), Payload(name=payload, mass=0.0), role
    )


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()} if folder.is_dir() else None


def test_sessions_make_an_experiment_and_more_are_added_to_it(tmp_path):
    folder = tmp_path / "deep" / "arm"
    made = import_sessions([session(), session("b.csv", "disc", "validation")], folder, ROBOT, "arm", COLUMNS)
    assert [(entry.file, entry.payload.name, entry.role) for entry in made.sessions] == [
        ("a.csv", "none", "identification"),
        ("b.csv", "disc", "validation"),
    ]
    assert [payload.name for payload in made.payloads] == ["none", "disc"]
    prior = PriorBodies(source="arm.urdf", links=(LinkBody(mass=2.0),))
    more = import_sessions([session("c.csv.gz", "none")], folder, None, "", COLUMNS, prior)
    assert [entry.file for entry in more.sessions] == ["a.csv", "b.csv", "c.csv.gz"]
    assert [payload.name for payload in more.payloads] == ["none", "disc"]
    assert load_experiment(folder).prior == prior
    assert load_experiment(folder).read(more.sessions[-1]).command[:, 0] == pytest.approx(
        2 * np.sin(0.01 * np.arange(400))
    )
    assert read_columns(folder) == COLUMNS


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("a.h5", "--session: 'a.h5' must be a plain name that ends in .csv or .csv.gz"),
        ("../a.csv", "must be a plain name"),
        ("sub/a.csv", "must be a plain name"),
    ],
)
def test_a_session_s_file_has_a_plain_name(tmp_path, name, said):
    with pytest.raises(InputError, match=said):
        import_sessions([session(name)], tmp_path / "arm", ROBOT, "arm", COLUMNS)
    assert contents(tmp_path / "arm") is None


def test_nothing_that_stands_there_is_written_over(tmp_path):
    folder = tmp_path / "arm"
    import_sessions([session()], folder, ROBOT, "arm", COLUMNS)
    before = contents(folder)
    with pytest.raises(InputError, match="already exists; use --append to add a session to it"):
        import_sessions([session("b.csv")], folder, ROBOT, "arm", COLUMNS)
    with pytest.raises(InputError, match=r"a\.csv: already exists; choose another name for the session"):
        import_sessions([session()], folder, None, "", COLUMNS)
    assert contents(folder) == before


def test_a_session_that_cannot_be_read_back_leaves_everything_as_it_was(tmp_path):
    folder = tmp_path / "deep" / "arm"
    with pytest.raises(InputError):
        import_sessions([session(), session("b.csv", step=-0.01)], folder, ROBOT, "arm", COLUMNS)
    assert not (tmp_path / "deep").exists()
    import_sessions([session()], folder, ROBOT, "arm", COLUMNS)
    before = contents(folder)
    with pytest.raises(InputError):
        import_sessions([session("b.csv", "disc"), session("c.csv", step=-0.01)], folder, None, "", COLUMNS)
    assert contents(folder) == before


def begun(folder, error):
    """An import that ends with an error when half of it is written."""
    with undone_on_error(folder, ["a.csv"]):
        (folder / "a.csv").write_text("half")
        (folder / EXPERIMENT_FILE).write_text("half")
        raise error


def test_what_the_disk_refuses_is_said_and_undone(tmp_path):
    folder = tmp_path / "arm"
    full = OSError(errno.ENOSPC, "No space left on device")
    with pytest.raises(InputError, match=r"--out .*arm: cannot be written: No space left on device"):
        begun(folder, full)
    assert not folder.exists()
    folder.write_text("a file")
    with pytest.raises(InputError, match=r"--out .*arm: is a file; give a folder"):
        begun(folder, full)
    assert folder.read_text() == "a file"


def test_other_people_s_files_in_the_folder_stay(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(KeyboardInterrupt):
        begun(tmp_path, KeyboardInterrupt())
    assert contents(tmp_path) == {"notes.txt": b"mine"}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("position: [q]\ncommand: [i]\nspeed: [v]\n", "holds other fields than position, command, time"),
        ("- q\n", "holds other fields"),
        ("position: [q]\ncommand: i\n", "import.yaml line 2: command: must be a list of names"),
        ("position: [q]\ncommand: [[i]]\n", "import.yaml line 2: command: must be a list of names"),
        ("position: [q]\n", "position and command are missing"),
    ],
)
def test_a_record_of_columns_that_is_not_valid_is_refused(tmp_path, text, said):
    (tmp_path / COLUMNS_FILE).write_text(text)
    with pytest.raises(InputError, match=said):
        read_columns(tmp_path)


def test_where_no_columns_are_recorded_there_are_none(tmp_path):
    assert read_columns(tmp_path) is None
