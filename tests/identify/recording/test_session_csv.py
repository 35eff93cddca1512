"""A session in CSV: read as the contract says, wrong lines named."""

import gzip
import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from identify.recording import InputError, load_experiment
from identify.recording.samples import SampleColumns
from identify.recording.session_csv import read_csv_session, write_csv_session


def table(rows=40, **changed):
    """Lines of a session of one joint at 1 kHz; `changed` replaces lines by their number (line_3="...")."""
    lines = ["t,q1,v1", *(f"{k / 1000},{1e-6 * k * k},{0.1 * k}" for k in range(rows))]
    for name, line in changed.items():
        lines[int(name.removeprefix("line_")) - 1] = line
    return "\n".join(lines) + "\n"


def read(folder, content, name="session-00.csv"):
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    experiment = load_experiment(folder)
    return experiment.read(experiment.sessions[0])


MISTAKES = {
    "no column v1": (table(line_1="t,q1,w1"), ["line 1", "v1 missing", "t, q1, v1"]),
    "no time": (table(line_1="time,q1,v1"), ["line 1", "column t missing"]),
    "a column twice": (table(line_1="t,q1,q1"), ["line 1", "'q1' occurs twice"]),
    "a column without a name": (table(line_1="t,q1,"), ["line 1", "column 3 has no name"]),
    "a second joint": ("t,q1,v1,q2\n0,1,2,3\n", ["line 1", "'q2'", "1 joint"]),
    "external force of joint 0": ("t,q1,v1,ext0\n0,1,2,3\n", ["line 1", "'ext0'", "1 joint"]),
    "empty": ("", ["is empty", "t, q1, v1"]),
    "a header only": ("t,q1,v1\n", ["no samples"]),
    "a few samples": (table(5), ["5 samples", "at least 16"]),
    "an empty cell": (table(line_7="0.005,,0.5"), ["line 7", "'q1'", "empty cell"]),
    "a blank cell": (table(line_7="0.005, ,0.5"), ["line 7", "'q1'", "empty cell"]),
    "nan": (table(line_7="0.005,nan,0.5"), ["line 7", "'q1'", "'nan'", "finite number"]),
    "NaN in the last line": (table(line_41="0.039,1,NaN"), ["line 41", "'v1'", "'NaN'"]),
    "inf": (table(line_7="0.005,0.1,-inf"), ["line 7", "'v1'", "'-inf'"]),
    "a word": (table(line_9="0.007,0.1,off"), ["line 9", "'v1'", "'off'"]),
    "a number as Python writes it": (table(line_9="0.007,1_0,1"), ["line 9", "'q1'", "'1_0'"]),
    "time repeated": (table(line_9="0.006,0.1,1"), ["line 9", "'t'", "0.006 does not come after 0.006"]),
    "time backwards": (
        table(line_9="-1,0.1,1"),
        ["line 9", "'t'", "-1 does not come after 0.006", "increase"],
    ),
    "a cell too many": (table(line_9="0.007,0.1,1,2"), ["line 9", "4 cells", "3 columns"]),
    "a cell too few": (table(line_9="0.007,0.1"), ["line 9", "2 cells", "3 columns"]),
    "semicolons": (table().replace(",", ";"), ["line 1", "';'", "','"]),
    "decimal commas": (table(line_2="0,000,0,1,0,2"), ["line 2", "6 cells", "'.'"]),
    "tabs": (table().replace(",", "\t"), ["line 1", "tabs", "','", "coulomb import"]),
    "spaces": (table().replace(",", " "), ["line 1", "spaces", "','", "coulomb import"]),
    "a value beyond all measuring": (table(line_7="0.005,1e300,0.5"), ["line 7", "'q1'", "1e300", "1e+12"]),
    "a quote left open": (table(20_000, line_9='"0.007,0.1,1'), ["line 9", "quote"]),
    "one endless line": ("t,q1,v1\n" + "0" * (1 << 21), ["line 2", "longer than"]),
    "time in milliseconds": (
        "t,q1,v1\n" + "".join(f"{2 * k},{k},{k}\n" for k in range(40)),
        ["typical step of time is 2 s", "seconds"],
    ),
    "not text": (b"t,q1,v1\n" + bytes(range(128, 256)) * 20, ["UTF-8"]),
    "a picture": (b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR", ["UTF-8"]),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_is_named_with_its_line_and_column(folder, name):
    content, said = MISTAKES[name]
    with pytest.raises(InputError) as raised:
        read(folder, content)
    message = str(raised.value)
    assert message.startswith(str(folder / "session-00.csv"))
    assert "\n" not in message
    for part in said:
        assert part in message


def test_a_mistake_far_inside_a_packed_file_is_named(folder, monkeypatch):
    monkeypatch.setattr("identify.recording.session_csv.BLOCK_BYTES", 1 << 16)
    lines = table(20_000).splitlines()
    lines[15_000] = "14.999,broken,1"
    content = gzip.compress("\n".join(lines).encode())
    with pytest.raises(InputError, match="line 15001: column 'q1': 'broken'"):
        read(folder, content)


def test_a_gzip_file_cut_short_is_named(folder):
    whole = gzip.compress(table(5000).encode())
    for length in (len(whole) // 2, len(whole) - 4, 12):
        with pytest.raises(InputError, match="gzip file is damaged or cut short"):
            read(folder, whole[:length])


def test_a_gzip_file_with_a_wrong_byte_is_named(folder):
    whole = bytearray(gzip.compress(table(5000).encode()))
    whole[len(whole) // 2] ^= 0xFF
    with pytest.raises(InputError, match=r"session-00\.csv"):
        read(folder, bytes(whole))


def test_external_forces_come_for_all_joints_or_none(tmp_path):
    (tmp_path / "s.csv").write_text("t,q1,q2,v1,v2,ext2\n" + "".join(f"{k},0,0,0,0,0\n" for k in range(20)))
    with pytest.raises(InputError, match="column 'ext1' missing; give ext1"):
        read_csv_session(tmp_path / "s.csv", 2)


@pytest.mark.parametrize("ending", ["\n", "\r\n"])
@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
@pytest.mark.parametrize("last", [True, False])
def test_line_endings_and_a_byte_order_mark_do_not_matter(folder, ending, mark, last):
    text = table().replace("\n", ending)
    session = read(folder, mark + (text if last else text.removesuffix(ending)).encode())
    assert len(session.time) == 40
    np.testing.assert_array_equal(session.command[:, 0], [0.1 * k for k in range(40)])


def test_columns_come_in_any_order_and_others_are_kept(folder):
    rows = [f"{0.5 * k},on,{k},{k / 1000},{k % 3 or ''},{2 * k}" for k in range(40)]
    session = read(folder, "\n".join([" v1 ,state, q1,t,count,temp1", *rows]))
    np.testing.assert_allclose(session.time, np.arange(40) / 1000)
    np.testing.assert_array_equal(session.position[:, 0], np.arange(40.0))
    np.testing.assert_array_equal(session.command[:, 0], 0.5 * np.arange(40))
    assert session.temperature is not None
    np.testing.assert_array_equal(session.temperature[:, 0], 2.0 * np.arange(40))
    assert list(session.extra) == ["state", "count"]
    assert set(session.extra["state"]) == {"on"}
    np.testing.assert_array_equal(session.extra["count"], [float(k % 3 or "nan") for k in range(40)])
    assert session.external is None


def test_an_extra_column_that_turns_into_words_late_is_text(folder, monkeypatch):
    monkeypatch.setattr("identify.recording.session_csv.BLOCK_BYTES", 1 << 16)
    rows = [f"{k / 1000},{k},{k},{'stop' if k == 19_999 else k},{k}" for k in range(20_000)]
    session = read(folder, "\n".join(["t,q1,v1,note,number", *rows]))
    assert session.extra["note"][-1] == "stop"
    assert session.extra["note"][0] == "0"
    assert session.extra["number"][-1] == 19_999.0


numbers = st.floats(-1e12, 1e12, width=64)  # beyond, the reader refuses


@settings(max_examples=40, deadline=None)
@given(data=st.data(), n=st.integers(1, 3), packed=st.booleans())
def test_what_is_written_is_read_to_the_last_bit(tmp_path_factory, data, n, packed):
    rows = data.draw(st.integers(1, 30))
    time = np.sort(data.draw(arrays(np.float64, rows, elements=numbers, unique=True)))
    position, command, external = (
        data.draw(arrays(np.float64, (rows, n), elements=numbers)) for _ in range(3)
    )
    path = tmp_path_factory.mktemp("written") / ("s.csv.gz" if packed else "s.csv")
    write_csv_session(path, time, position, command, external, extra={"state": ["on"] * rows})
    raw = read_csv_session(path, n)
    np.testing.assert_array_equal(raw.time, time)
    np.testing.assert_array_equal(raw.position, position)
    np.testing.assert_array_equal(raw.command, command)
    np.testing.assert_array_equal(raw.external, external)
    assert raw.temperature is None
    assert list(raw.extra["state"]) == ["on"] * rows


@settings(max_examples=30, deadline=None)
@given(
    sizes=st.lists(st.integers(0, 50), min_size=1, max_size=12),
    width=st.integers(0, 4),
    limit=st.integers(0, 3000),
)
def test_columns_are_the_same_in_memory_and_in_a_file(sizes, width, limit):
    rng = np.random.default_rng(0)
    blocks = [rng.standard_normal((size, width) if width else size) for size in sizes]
    columns = SampleColumns(width, largest_in_memory=limit)
    for block in blocks:
        columns.append(block)
    np.testing.assert_array_equal(columns.array(), np.concatenate(blocks))


def test_reading_does_not_import_pandas_where_it_is_installed(tmp_path):
    """A third of the time of a whole `identify` went into that import."""
    installed = tmp_path / "installed" / "pandas"
    installed.mkdir(parents=True)
    (installed / "__init__.py").write_text("raise RuntimeError('pandas was imported')\n")
    file = tmp_path / "session.csv"
    rows = [
        f"{0.001 * k},{0.1 * k},{k},{'' if k % 2 else k},{'warm' if k < 20 else 'cold'}" for k in range(40)
    ]
    file.write_text("\n".join(["t,q1,v1,gap,mood", *rows]) + "\n")
    program = (
        "import sys; from pathlib import Path; from identify.recording.session_csv import read_csv_session;"
        f"found = read_csv_session(Path({str(file)!r}), 1);"
        "print(found.position[5, 0], found.extra['gap'][:3], found.extra['mood'][[0, 39]], 'pandas' in sys.modules)"
    )
    path = os.pathsep.join([str(tmp_path / "installed"), *(entry for entry in sys.path if entry)])
    told = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        env=os.environ | {"PYTHONPATH": path},
        check=False,
    )
    assert told.stdout == "0.5 [ 0. nan  2.] ['warm' 'cold'] False\n", told.stderr
