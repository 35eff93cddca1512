"""Notes are texts by session file; anything else in the file is refused in one line."""

import pytest

from api.service.session_notes import NOTES, read_notes, write_notes
from identify.recording import InputError


def test_notes_come_back_as_they_were_written(tmp_path):
    assert read_notes(tmp_path) == {}
    notes = {"session-00.h5": "Süd, no. 2: colder\nsecond line", "session-01.csv": "- 1"}
    write_notes(tmp_path, notes)
    assert read_notes(tmp_path) == notes


def test_an_empty_file_holds_no_notes(tmp_path):
    (tmp_path / NOTES).write_text("# nothing yet\n")
    assert read_notes(tmp_path) == {}


@pytest.mark.parametrize("content", ["- 1\n", "a: 1\n", "1: text\n", "a: [b\n", "a: {b: c}\n"])
def test_what_is_no_note_is_refused_in_one_line(tmp_path, content):
    (tmp_path / NOTES).write_text(content)
    with pytest.raises(InputError, match=r"^notes\.yaml: .*correct or remove it$") as refusal:
        read_notes(tmp_path)
    assert content.startswith("a: [b") or "\n" not in str(refusal.value)
