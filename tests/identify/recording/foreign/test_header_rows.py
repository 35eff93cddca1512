"""Rows above the samples: units, types, and rows that say by their first cell what they hold."""

import pytest

from identify.recording.foreign.header_rows import is_types, is_units, labelled_header, trimmed

SAMPLES = [["trace_values", "0", "1"], ["", "0.1", "2"], ["", "0.2", "3"]]


@pytest.mark.parametrize(
    ("row", "units", "types"),
    [
        (["s", "deg", "A"], True, False),
        (["[foo]", "(bar)"], True, False),
        (["t", "q", "i"], False, False),
        (["REAL64", "int32"], False, True),
        ([], False, False),
    ],
)
def test_a_row_of_units_and_one_of_types_are_told(row, units, types):
    assert (is_units(row), is_types(row)) == (units, types)


def test_empty_cells_at_the_end_are_no_cells():
    assert trimmed(["a", "", "b", "", ""]) == ["a", "", "b"]


def test_names_and_units_are_in_the_rows_that_say_so():
    rows = [["unit", "s", "deg"], ["Name", "time", "q"], ["device", "", "DS1202"]]
    assert labelled_header(rows, SAMPLES, 3) == (1, ["", "time", "q"], ["", "s", "deg"])
    assert labelled_header(rows[1:], SAMPLES, 3) == (0, ["", "time", "q"], [])


@pytest.mark.parametrize(
    ("rows", "samples"),
    [
        ([["unit", "s", "deg"]], SAMPLES),
        ([["name", "time"]], SAMPLES),
        ([["name", "time", "q"]], [["0", "0.1", "2"], ["1", "0.2", "3"]]),
        ([["name", "time", "q"]], SAMPLES[:1]),
    ],
)
def test_other_rows_are_not_labelled(rows, samples):
    assert labelled_header(rows, samples, 3) is None
