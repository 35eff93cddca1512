"""Texts of people: what is shown of them, and what a spreadsheet makes of them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from identify.recording import InputError, load_experiment
from identify.recording.plain_text import (
    LONGEST_NAME,
    check_printable,
    header_cell,
    printable,
    quoted,
    text_cell,
)
from identify.recording.session_csv import read_csv_session, write_csv_session

YAML = """format: 1
name: "NAME"
robot: {gravity: [0.0, -9.81, 0.0], joints: [{name: j1, type: revolute, drive_gain: 10.0}]}
payloads: [{name: none, mass: 0.0}]
"""


@pytest.mark.parametrize("text", ["rx130l", "Größe 3", "関節 2", "मोटर", "کتاب\u200cها", "a - b (c)", "π/2"])
def test_words_of_any_script_are_taken(text):
    assert check_printable(text) == text


@pytest.mark.parametrize(
    "character", ["\x00", "\x07", "\x1b", "\n", "\x7f", "\x9b", "\u202e", "\u2028", "\ufeff"]
)
def test_a_character_that_is_not_shown_is_refused_and_named(character):
    with pytest.raises(ValueError, match=f"U\\+{ord(character):04X}"):
        check_printable(f"arm{character}")


def test_an_experiment_whose_name_holds_an_escape_sequence_is_refused_with_its_line(tmp_path):
    (tmp_path / "experiment.yaml").write_text(YAML.replace("NAME", "\\e[2Jarm"))
    with pytest.raises(InputError, match=r"experiment.yaml line 2: name: holds the character U\+001B"):
        load_experiment(tmp_path)


@given(text=st.text())
def test_what_is_printed_is_taken(text):
    assert check_printable(printable(text)) == printable(text)


@given(text=st.text())
def test_no_cell_begins_as_a_formula_and_no_header_ends_its_cell(text):
    assert not text_cell(text).startswith(("=", "+", "-", "@", "\t", "\r"))
    cell = header_cell(text)
    assert not cell.startswith(("=", "+", "-", "@"))
    assert not set(cell) & set(',;"\r\n')


def test_a_column_called_as_a_formula_is_written_as_text(tmp_path):
    rows = np.arange(4.0)
    write_csv_session(tmp_path / "a.csv", rows, rows, rows, extra={"=cmd|'/C calc'!A0": rows, "a,b": rows})
    header = (tmp_path / "a.csv").read_text().splitlines()[0]
    assert header == "t,q1,v1,'=cmd|'/C calc'!A0,a_b"


@pytest.mark.parametrize("short", ["NAME", "name: j1", "name: none"])
def test_a_name_has_a_length_that_an_index_and_a_file_system_can_store(tmp_path, short):
    (tmp_path / "experiment.yaml").write_text(YAML.replace(short, short + "x" * LONGEST_NAME))
    with pytest.raises(InputError, match=f"experiment.yaml.* at most {LONGEST_NAME} characters"):
        load_experiment(tmp_path)


def test_a_message_quotes_nothing_that_a_terminal_would_obey_and_no_more_than_tells_what_it_is():
    assert quoted("12,5") == "'12,5'"
    assert quoted("\x1b[31m1\x00") == "' [31m1 '"
    assert quoted("9" * 5000) == f"'{'9' * 60}...'"


@pytest.mark.parametrize("cell", ["0.1\x1b]0;owned\x07", "-" + "\0" * 4096], ids=["terminal", "lost block"])
def test_a_cell_that_is_no_number_is_quoted_so(tmp_path, cell):
    (tmp_path / "session.csv").write_text(f"t,q1,v1\n0,{cell},1\n")
    with pytest.raises(InputError, match=r"line 2: column 'q1': .* is not a finite number") as refused:
        read_csv_session(tmp_path / "session.csv", 1)
    assert len(str(refused.value)) < len(str(tmp_path)) + 150
    assert str(refused.value).isprintable()
