"""An experiment's folder altered anywhere is read, or refused in one line that names the file; nothing else comes of it."""

import numpy as np
import pytest
import yaml
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from identify.recording import InputError, load_experiment
from tests.altered_document import altered

DOCUMENT = {
    "format": 1,
    "name": "arm",
    "robot": {
        "gravity": [0.0, -9.81, 0.0],
        "joints": [
            {"name": "j1", "type": "revolute", "drive_gain": 10.0, "limits": {"position": [-1.0, 1.0]}}
        ],
    },
    "payloads": [{"name": "none", "mass": 0.0}, {"name": "disk", "mass": 3.0, "com": [0.5, 0.0, 0.0]}],
    "sessions": [
        {"file": "a.csv", "payload": "none"},
        {"file": "a.csv.gz", "payload": "disk", "role": "validation"},
    ],
    "signals": {"position_cutoff": 10.0},
}
TABLE = (
    "t,q1,v1,extra\n"
    + "".join(f"{k / 100},{np.sin(k / 20):.6f},{np.cos(k / 20):.5f},{k}\n" for k in range(60))
).encode()
MANY = settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def is_read_or_refused(folder):
    """A refusal names the file: of the folder, or where the experiment names one elsewhere."""
    files = [folder]
    try:
        experiment = load_experiment(folder)
        files += [entry.path for entry in experiment.sessions]
        for entry in experiment.sessions:
            session = experiment.read(entry)
            assert np.isfinite(session.position).all()
    except InputError as refused:
        assert len(str(refused).splitlines()) == 1, str(refused)  # noqa: PT017 - it may also be taken
        assert any(str(file) in str(refused) for file in files)  # noqa: PT017


def with_session(file):
    """The experiment with one session, of this file."""
    return DOCUMENT | {"sessions": [DOCUMENT["sessions"][0] | {"file": file}]}


@MANY
@given(document=altered(DOCUMENT))
@example(document=with_session("a" * 5000))  # no file system takes such a name
@example(document=with_session("/etc/passwd"))
def test_an_experiment_file_that_is_altered_is_read_or_refused_in_a_line(tmp_path, document):
    text = yaml.safe_dump(document, allow_unicode=True)
    (tmp_path / "experiment.yaml").write_text(text, encoding="utf-8", errors="surrogatepass")
    (tmp_path / "a.csv").write_bytes(TABLE)
    is_read_or_refused(tmp_path)


@MANY
@given(
    place=st.floats(0, 1),
    inserted=st.binary(max_size=8) | st.text(max_size=8).map(str.encode),
    cut=st.integers(0, 30),
)
@example(place=0.0, inserted=b"\xef\xbb\xbf", cut=0)
@example(place=0.5, inserted=b"\x00", cut=0)
def test_a_table_that_is_damaged_is_read_or_refused_in_a_line(tmp_path, place, inserted, cut):
    at = int(place * len(TABLE))
    document = DOCUMENT | {"sessions": DOCUMENT["sessions"][:1]}
    (tmp_path / "experiment.yaml").write_text(yaml.safe_dump(document))
    (tmp_path / "a.csv").write_bytes(TABLE[:at] + inserted + TABLE[at + cut :])
    is_read_or_refused(tmp_path)


@pytest.mark.parametrize("content", [b"", b"\x1f\x8b", b"\x1f\x8b\x08\x00" + bytes(20)])
def test_a_packed_table_that_is_none_is_refused_in_a_line(tmp_path, content):
    document = DOCUMENT | {"sessions": DOCUMENT["sessions"][1:]}
    (tmp_path / "experiment.yaml").write_text(yaml.safe_dump(document))
    (tmp_path / "a.csv.gz").write_bytes(content)
    with pytest.raises(InputError, match=r"a\.csv\.gz"):
        load_experiment(tmp_path).read(load_experiment(tmp_path).sessions[0])
