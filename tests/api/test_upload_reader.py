"""What an upload may hold, at each bound and a step beyond it."""

import gzip
import io
import zipfile

import h5py
import numpy as np
import pytest

from api.service import upload_reader
from api.service.problems import Problem
from api.service.upload_reader import (
    Allowance,
    _check_hdf5,
    _WithoutHugeDirectory,
    read_archive,
    read_session,
)
from identify.recording import DeclaredSession, InputError, Payload, load_experiment
from identify.recording.experiment_file import read_experiment_file

YAML = """format: 1
name: uploaded
robot: {gravity: [0.0, -9.81, 0.0], joints: [{name: j1, type: revolute, drive_gain: 10.0}]}
payloads: [{name: none, mass: 0.0}]
sessions: [SESSIONS]
"""
TABLE = b"t,q1,v1\n" + b"".join(b"%.2f,%.4f,0.5\n" % (k / 100, np.sin(k / 30)) for k in range(120))
MUCH = 10**7


@pytest.fixture
def upload(tmp_path):
    """Reads an archive of these members; the folder that it was unpacked to."""

    def read(members: dict[str, bytes], limit: int = MUCH):
        packed, folder = tmp_path / "upload.zip", tmp_path / "unpacked"
        folder.mkdir(exist_ok=True)
        sessions = ", ".join(
            f"{{file: {name!r}, payload: none}}" for name in members if not name.endswith(".yaml")
        )
        with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as out:
            for name, content in (
                {"experiment.yaml": YAML.replace("SESSIONS", sessions).encode()} | members
            ).items():
                out.writestr(name, content)
        return read_archive(lambda *said: None, str(packed), str(folder), limit), folder

    return read


def refused(upload, *given):
    with pytest.raises(Problem) as problem:
        upload(*given)
    assert problem.value.status == 413
    return problem.value.detail


def test_all_files_together_may_unpack_to_the_limit_and_no_byte_more(upload):
    zipped = gzip.compress(TABLE)
    (name, passed_over), folder = upload({"a.csv": TABLE, "b.csv.gz": zipped})
    assert (name, passed_over) == ("uploaded", [])
    declared = (folder / "experiment.yaml").stat().st_size
    assert [entry.file for entry in load_experiment(folder).sessions] == ["a.csv", "b.csv.gz"]
    # the packed session counts as it is packed and as it decompresses
    exactly = declared + len(TABLE) + len(zipped) + len(TABLE)
    for file in folder.iterdir():
        file.unlink()
    upload({"a.csv": TABLE, "b.csv.gz": zipped}, exactly)
    for file in folder.iterdir():
        file.unlink()
    assert "With b.csv.gz, the upload unpacks to more" in refused(
        upload, {"a.csv": TABLE, "b.csv.gz": zipped}, exactly - 1
    )


def test_an_allowance_is_used_up_at_its_last_byte():
    left = Allowance(10)
    left.take(4, "a")
    left.take(6, "b")
    with pytest.raises(Problem, match="With c"):
        left.take(1, "c")


@pytest.mark.parametrize("names", ["ab", "abc"])
def test_an_experiment_names_no_more_files_than_may_be(upload, monkeypatch, names):
    monkeypatch.setattr(upload_reader, "MOST_FILES", 2)
    sessions = {f"{name}.csv": TABLE for name in names}
    if len(names) > 2:
        assert "names 3 files; 2 are the most" in refused(upload, sessions)
    else:
        upload(sessions)


def test_settings_are_no_larger_than_settings_are(upload, monkeypatch):
    monkeypatch.setattr(upload_reader, "LARGEST_SETTINGS", 300)
    assert "larger than 300 bytes" in refused(
        upload, {"experiment.yaml": YAML.replace("SESSIONS", "").encode() + b"#" * 301}
    )


@pytest.mark.parametrize("count", [1 << 20, (1 << 20) + 1])
def test_a_list_of_members_is_not_read_beyond_a_mebibyte(count):
    file = _WithoutHugeDirectory(io.BytesIO(bytes(count)))
    if count > 1 << 20:
        with pytest.raises(Problem, match="longer than 1048576 bytes"):
            file.read(count)
    else:
        assert len(file.read(count)) == count


@pytest.fixture
def recording(tmp_path):
    path = tmp_path / "session.h5"
    with h5py.File(path, "w") as file:
        file.create_dataset("cycle", (100,), np.int64, chunks=(150,), maxshape=(None,))
        file.create_dataset("valid", (100,), np.uint8)
    return path


def test_a_chunk_is_unpacked_whole_however_little_of_it_is_there(recording):
    """150 int64 of the chunk, and 100 bytes."""
    _check_hdf5(recording, Allowance(150 * 8 + 100))
    with pytest.raises(Problem):
        _check_hdf5(recording, Allowance(150 * 8 + 99))


def test_a_recording_has_no_more_objects_and_attributes_than_may_be(recording, monkeypatch):
    with h5py.File(recording, "a") as file:
        file.attrs["operator"], file["cycle"].attrs["note"] = "x" * 10, np.zeros(50, np.uint8)
    monkeypatch.setattr(upload_reader, "MOST_OBJECTS", 2)
    _check_hdf5(recording, Allowance(MUCH))
    monkeypatch.setattr(upload_reader, "LARGEST_ATTRIBUTES", 50)
    _check_hdf5(recording, Allowance(MUCH))
    monkeypatch.setattr(upload_reader, "LARGEST_ATTRIBUTES", 49)
    with pytest.raises(Problem, match=r"holds attributes of 50 bytes; 49 are the most"):
        _check_hdf5(recording, Allowance(MUCH))
    monkeypatch.setattr(upload_reader, "MOST_OBJECTS", 1)
    with pytest.raises(Problem, match="holds 2 objects; 1 are the most"):
        _check_hdf5(recording, Allowance(MUCH))
    monkeypatch.setattr(upload_reader, "MOST_OBJECTS", 0)
    with h5py.File(recording, "w") as file:
        file.attrs["operator"] = "x"
    with pytest.raises(Problem, match="holds 1 attributes; 0 are the most"):
        _check_hdf5(recording, Allowance(MUCH))


def test_a_recording_holds_its_data_itself(tmp_path, recording):
    for name, make in (
        ("link.h5", lambda file: file.__setitem__("x", h5py.ExternalLink(str(recording), "cycle"))),
        ("group.h5", lambda file: file.create_group("x")),
        (
            "external.h5",
            lambda file: file.create_dataset("x", (4,), np.uint8, external=[("/etc/hostname", 0, 4)]),
        ),
    ):
        with h5py.File(tmp_path / name, "w") as file:
            make(file)
        with pytest.raises(
            InputError, match=rf"{name}: x (is a link|is not a data set|keeps its data in another file)"
        ):
            _check_hdf5(tmp_path / name, Allowance(MUCH))


def test_a_session_is_read_as_one_of_the_experiment_with_its_payload(tmp_path):
    (tmp_path / "declared").mkdir()
    (tmp_path / "declared" / "experiment.yaml").write_text(YAML.replace("SESSIONS", ""))
    declared = read_experiment_file(tmp_path / "declared" / "experiment.yaml")
    folder = tmp_path / "read"
    folder.mkdir()
    (folder / "new.csv").write_bytes(TABLE)
    addition = DeclaredSession(file="new.csv", payload="disk", role="validation")
    read_session(lambda *said: None, str(folder), declared, addition, Payload(name="disk", mass=3.5), MUCH)
    (entry,) = load_experiment(folder).sessions
    assert (entry.file, entry.payload.mass, entry.role) == ("new.csv", 3.5, "validation")
    (folder / "new.csv").write_bytes(b"no table")
    with pytest.raises(InputError) as error:
        read_session(
            lambda *said: None, str(folder), declared, addition, Payload(name="disk", mass=3.5), MUCH
        )
    assert str(folder) not in str(error.value)
