"""The document that `make faults` prints: tables that were not driven now stay as they are, and every cell is counted."""

from pathlib import Path

from tests.faults.__main__ import Kept, document

DOCUMENT = Path(__file__).parents[2] / "docs" / "faults.md"


def test_what_was_not_driven_stays_as_it_is():
    text = DOCUMENT.read_text()
    assert document([], text) == text


def test_a_part_that_was_driven_takes_the_place_of_its_table_and_is_counted():
    driven = [
        Kept("session", "file", "recording deleted", "before", "done", fails=False),
        Kept(
            "session", "file", "recording deleted", "fast", "**fails**: the session did not end", fails=True
        ),
    ]
    only_these = document(driven, "")
    assert (
        "| file | recording deleted | done |  |  |  | **fails**: the session did not end |  |  |"
        in only_these
    )
    assert only_these.endswith("\n2 cells, 1 do not hold.\n")
    assert "raw log deleted" not in document(driven, DOCUMENT.read_text())
