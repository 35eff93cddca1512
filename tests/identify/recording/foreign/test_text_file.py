"""Text in the encodings that instruments and spreadsheets write, and what is no text."""

import gzip

import pytest

from identify.recording.errors import InputError
from identify.recording.foreign.text_file import LOOKED_AT, open_text

TEXT = "Zeit;Größe °\n1,5;−2\n3;4\n"


@pytest.mark.parametrize(
    ("encoding", "said"),
    [
        ("utf-8", ""),
        ("utf-8-sig", "UTF-8 with a byte order mark"),
        ("utf-16", "UTF-16"),
        ("utf-16-le", "UTF-16"),
        ("utf-16-be", "UTF-16"),
        ("utf-32", "UTF-32"),
    ],
)
def test_unicode_is_known_by_its_mark_or_by_its_zeros(tmp_path, encoding, said):
    text = TEXT * 20
    path = tmp_path / "session.csv"
    path.write_bytes(text.encode(encoding))
    opened = open_text(path)
    assert opened.said == said
    assert list(opened.lines()) == opened.head == text.splitlines()


def test_what_is_no_utf_8_is_windows_1252_and_failing_that_latin_1(tmp_path):
    path = tmp_path / "session.csv"
    path.write_bytes("Größe °\n1\n".encode("cp1252"))
    assert (open_text(path).said, open_text(path).head[0]) == ("Windows-1252", "Größe °")
    path.write_bytes(b"q\x81\n1\n")  # no letter in Windows-1252
    assert open_text(path).said == "Latin-1"


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_any_end_of_line_will_do_and_that_of_a_text_of_dos_is_cut(tmp_path, end):
    path = tmp_path / "session.csv"
    path.write_bytes(end.join(["a,b", "1,2", ""]).encode() + b"\x1a")
    assert open_text(path).head[:2] == ["a,b", "1,2"]
    assert "\x1a" not in "".join(open_text(path).head)


def test_the_begin_and_the_end_of_a_long_file_are_looked_at(tmp_path):
    path = tmp_path / "session.csv"
    count = 2 * LOOKED_AT + 500
    path.write_text("".join(f"{number}\n" for number in range(count)))
    opened = open_text(path)
    assert opened.count == count
    assert (opened.head[0], opened.head[-1]) == ("0", str(LOOKED_AT - 1))
    assert (opened.tail[0], opened.tail[-1]) == (str(count - LOOKED_AT), str(count - 1))
    assert sum(1 for _ in opened.lines()) == count


def test_a_packed_file_is_read_and_a_torn_one_is_named(tmp_path):
    path = tmp_path / "session.csv.gz"
    packed = gzip.compress(TEXT.encode() * 100)
    path.write_bytes(packed)
    assert open_text(path).count == 300
    path.write_bytes(packed[: len(packed) // 2])
    with pytest.raises(InputError, match="damaged or cut short"):
        open_text(path)


@pytest.mark.parametrize(
    "content", [b"\x00\x01\x02\x03" * 50, b"a\x01b\x02c\x03d\n", b"\x7fELF\x01\x01\x01\x00" * 9]
)
def test_what_is_no_text_is_refused(tmp_path, content):
    path = tmp_path / "session.csv"
    path.write_bytes(content)
    with pytest.raises(InputError, match="is neither text nor a kind of file that is known"):
        open_text(path)
