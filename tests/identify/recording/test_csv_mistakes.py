"""What is wrong with a CSV file, in words: the whole message of each mistake, for one joint and for two."""

import gzip

import pytest

from identify.recording.csv_mistakes import check_header, first_mistake, is_gzip, needed
from identify.recording.errors import InputError


@pytest.fixture
def written(tmp_path):
    def write(text: str | bytes):
        path = tmp_path / "s.csv"
        path.write_bytes(text.encode() if isinstance(text, str) else text)
        return path

    return write


def test_a_session_needs_time_positions_and_commands():
    assert needed(1) == ["t", "q1", "v1"]
    assert needed(2) == ["t", "q1", "q2", "v1", "v2"]


@pytest.mark.parametrize(
    ("header", "joints", "said"),
    [
        ("", 1, "is empty; the first line must name the columns: t, q1, v1"),
        (" , ,", 1, "is empty; the first line must name the columns: t, q1, v1"),
        ("t,q1", 1, "line 1: column v1 missing; a session of 1 joint needs t, q1, v1"),
        ("t,q1,v1", 2, "line 1: columns q2, v2 missing; a session of 2 joints needs t, q1, q2, v1, v2"),
        ("t;q1;v1", 1, "line 1: columns are separated by ';'; separate them by ','"),
        ("t\tq1\tv1", 1, "line 1: columns are separated by tabs; separate them by ','"),
        ("t q1 v1", 1, "line 1: columns are separated by spaces; separate them by ','"),
        ("t,q1,v1,", 1, "line 1: column 4 has no name"),
        ("t,q1,v1,q1", 1, "line 1: column 'q1' occurs twice; keep one"),
        ("t,q1,v1,q2", 1, "line 1: column 'q2', but the experiment declares 1 joint"),
        ("t,q1,v1,v0", 1, "line 1: column 'v0', but the experiment declares 1 joint"),
        ("t,q1,q2,v1,v2,temp3", 2, "line 1: column 'temp3', but the experiment declares 2 joints"),
        ("t,q1,q2,v1,v2,ext2", 2, "line 1: column 'ext1' missing; give ext1 ... ext2, or none of them"),
    ],
)
def test_a_header_that_is_wrong_is_refused_with_what_would_be_right(written, header, joints, said):
    path = written(header + "\n")
    with pytest.raises(InputError) as error:
        check_header(path, joints)
    assert str(error.value).startswith(f"{path}{' ' if said.startswith('line') else ': '}{said}")


def test_a_header_may_have_other_columns_blanks_and_all_external_forces(written):
    assert check_header(written(" t, q1 ,v1,note,ext1,temp1\n"), 1) == [
        "t",
        "q1",
        "v1",
        "note",
        "ext1",
        "temp1",
    ]


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        (["0,1,2", "0.1,x,2"], "line 3: column 'q1': 'x' is not a finite number"),
        (["0,1,"], "line 2: column 'v1': an empty cell is not a finite number"),
        (["0,inf,2"], "line 2: column 'q1': 'inf' is not a finite number"),
        (["0,1_000,2"], "line 2: column 'q1': '1_000' is not a finite number"),
        (["0,1,-2e12"], "line 2: column 'v1': -2e12 is no measured value (beyond 1e+12)"),
        (["0,1,2", "0,1,2"], "line 3: column 't': 0 does not come after 0; time must increase"),
        (["0,1,2", "", "-1,1,2"], "line 4: column 't': -1 does not come after 0; time must increase"),
        (["0,1"], "line 2: 2 cells, but the header names 3 columns"),
        (["0,5,1,0,2,0"], "line 2: 6 cells, but the header names 3 columns; write decimals with '.'"),
    ],
)
def test_the_first_wrong_line_is_named(written, lines, said):
    path = written("\n".join(["t,q1,v1", *lines]) + "\n")
    assert str(first_mistake(path, ["t", "q1", "v1"], {"t", "q1", "v1"})) == f"{path} {said}"


def test_a_file_without_a_mistake_has_none_and_other_columns_may_hold_words(written):
    path = written("t,q1,v1,note\n0,1,1e12,begun\n1,1,-1e12,over\n")
    assert first_mistake(path, ["t", "q1", "v1", "note"], {"t", "q1", "v1"}) is None


def test_packed_files_are_known_by_their_first_bytes_and_a_torn_one_is_named(written):
    packed = gzip.compress(b"t,q1,v1\n" + b"0,1,2\n" * 500)
    path = written(packed)
    assert is_gzip(path)
    assert check_header(path, 1) == ["t", "q1", "v1"]
    torn = written(packed[:-20])
    assert "the gzip file is damaged or cut short" in str(
        first_mistake(torn, ["t", "q1", "v1"], {"q1"}) or ""
    )
    assert not is_gzip(written("t,q1,v1\n"))
