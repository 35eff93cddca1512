"""What is made of a table's lines, row by row, and what is said of it."""

from __future__ import annotations

import gzip

import numpy as np
import pytest

from identify.recording.errors import InputError
from identify.recording.foreign.csv_dialect import CsvOptions
from identify.recording.foreign.csv_table import read_csv

ROWS = [f"{k},{0.5 * k}" for k in range(1, 9)]


@pytest.fixture
def read(tmp_path):
    """Reads lines as a table."""

    def of(*lines: str, end: str = "\n", **options):
        path = tmp_path / "log.csv"
        path.write_text("\n".join(lines) + end, encoding="utf-8")
        return read_csv(path, CsvOptions(**options))

    return of


def refusal(read, *lines, **options) -> str:
    with pytest.raises(InputError) as refused:
        read(*lines, **options)
    return str(refused.value)


def test_numbers_names_and_lines_are_those_of_the_file(read):
    table = read("t,q [deg]", *ROWS)
    assert [column.name for column in table.columns] == ["t", "q [deg]"]
    np.testing.assert_array_equal(table.columns[0].numbers, np.arange(1, 9))
    np.testing.assert_array_equal(table.columns[1].numbers, 0.5 * np.arange(1, 9))
    assert table.lines.tolist() == list(range(2, 10))
    assert table.columns[1].unit.name == "deg"
    assert table.columns[1].unit_source == "the header"
    assert table.remarks == ("columns separated by ','; names in line 1",)


@pytest.mark.parametrize(
    ("separator", "named"), [(";", "';'"), ("\t", "tab"), (" ", "blanks"), ("|", "'|'"), ("~", "'~'")]
)
def test_the_separator_is_said(read, separator, named):
    lines = [line.replace(",", separator) for line in ("t,q", *ROWS)]
    stated = {"separator": "~"} if separator == "~" else {}
    assert read(*lines, **stated).remarks[0].startswith(f"columns separated by {named}; ")


def test_without_a_header_columns_are_numbered(read):
    table = read(*ROWS)
    assert [column.name for column in table.columns] == ["1", "2"]
    assert table.remarks[0].endswith("no header: columns are 1, 2, ...")
    assert table.lines.tolist() == list(range(1, 9))


def test_a_row_of_units_is_used_and_goes_before_the_names(read):
    table = read("t,q [deg]", "ms,rad", *ROWS)
    assert [column.unit.name for column in table.columns] == ["ms", "rad"]
    assert table.columns[1].unit_source == "the row of units"
    assert table.remarks[0].endswith("names in line 1; units in the row below")
    part = read("t,q [deg]", "ms,-", *ROWS)
    assert part.columns[1].unit.name == "deg"
    assert part.columns[1].unit_source == "the header"


def test_units_in_the_cells_are_used_where_nothing_else_states_one(read):
    table = read("t,q", *[f"{k},{0.5 * k} deg" for k in range(1, 9)])
    assert table.columns[1].unit.name == "deg"
    assert table.columns[1].unit_source == "its cells"
    np.testing.assert_array_equal(table.columns[1].numbers, 0.5 * np.arange(1, 9))
    assert table.columns[0].unit is None
    assert table.columns[0].unit_source == ""


def test_comments_and_the_header_that_comes_again_are_passed_over_and_said(read):
    table = read("t,q", *ROWS[:3], "# a note", "", "t,q", *ROWS[3:])
    np.testing.assert_array_equal(table.columns[0].numbers, np.arange(1, 9))
    assert table.lines.tolist() == [2, 3, 4, 8, 9, 10, 11, 12]
    assert "1 lines of comment passed over" in table.remarks
    assert "line 7: no samples, passed over" in table.remarks


def test_of_many_lines_passed_over_three_are_named(read):
    lines = ["t,q"]
    for row in ROWS:
        lines += [row, "interrupted"]
    table = read(*lines, "9,1", "10,1", "11,1", "12,1")
    assert "lines 3, 5, 7 ...: no samples, passed over" in table.remarks
    three = read("t,q", *ROWS[:2], "x", *ROWS[2:4], "x", *ROWS[4:6], "x", *ROWS[6:], "9,1", "10,1")
    assert "lines 4, 7, 10: no samples, passed over" in three.remarks


def test_a_line_cut_short_at_the_end_is_left_out_and_one_in_the_middle_is_wrong(read):
    table = read("t,q,i", *[f"{row},1" for row in ROWS], "9,4.5", end="")
    np.testing.assert_array_equal(table.columns[0].numbers, np.arange(1, 9))
    assert "line 10: cut off at the end of the file, left out" in table.remarks
    middle = read("t,q,i", *[f"{row},1" for row in ROWS[:3]], "3.5,4", *[f"{row},1" for row in ROWS[3:]])
    assert len(middle.columns[0]) == 9
    assert middle.columns[2].wrong == {3: "2 cells instead of 3"}
    assert np.isnan(middle.columns[2].numbers[3])
    assert middle.columns[0].numbers[3] == 3.5


def test_a_row_that_is_too_long_is_refused_unless_what_is_over_is_empty(read):
    words = refusal(read, "t,q", *ROWS[:3], "3.5,4,5", *ROWS[3:])
    assert "line 5: 3 cells, but there are 2 columns; mend the line, or give --separator" in words
    table = read("t,q", *ROWS[:3], "3.5,4,,", *ROWS[3:])
    assert table.columns[0].numbers[3] == 3.5


def test_columns_of_words_are_kept_and_columns_of_nothing_are_not(read):
    table = read("t,q,state,", *[f"{row},ok," for row in ROWS])
    assert [column.name for column in table.columns] == ["t", "q", "state"]
    assert table.columns[2].words == ["ok"] * 8
    assert table.columns[2].numbers is None


def test_half_of_a_column_must_be_numbers(read):
    """Four numbers of eight are numbers with holes; three of eight are words."""
    half = read("t,q", *ROWS[:4], *[f"{k},bad" for k in range(5, 9)])
    assert half.columns[1].numbers is not None
    assert half.columns[1].wrong == {4: "bad", 5: "bad", 6: "bad", 7: "bad"}
    less = read("t,q,i", *[f"{r},1" for r in ROWS[:3]], *[f"{k},bad,1" for k in range(4, 9)])
    assert less.columns[1].numbers is None


def test_instants_are_words_even_where_they_could_be_numbers(read):
    table = read("time,q", *[f"14:03:{k:02d},{k}" for k in range(8)])
    assert table.columns[0].words[1] == "14:03:01"


def test_the_decimal_sign_of_each_column_is_told_by_its_cells(read):
    comma = read("t;q", *[f"{k};{k},25" for k in range(1, 9)])
    np.testing.assert_array_equal(comma.columns[1].numbers, np.arange(1, 9) + 0.25)
    assert "decimal comma" in comma.remarks[0]
    mixed = read("t;q", *[f"{k}.5;{k},25" for k in range(1, 9)])
    np.testing.assert_array_equal(mixed.columns[0].numbers, np.arange(1, 9) + 0.5)
    np.testing.assert_array_equal(mixed.columns[1].numbers, np.arange(1, 9) + 0.25)
    assert "decimal comma in some columns, decimal point in others, by their cells" in mixed.remarks[0]
    doubted = read("t;q", *[f"{k};{k},234" for k in range(1, 9)])
    assert "'1,234' is read as 1.234 in column 2; if it means 1234, say --decimal ." in doubted.remarks[0]
    stated = read("t;q", *[f"{k};{k},234" for k in range(1, 9)], decimal=".")
    np.testing.assert_array_equal(stated.columns[1].numbers, 1000 * np.arange(1, 9) + 234)
    assert "decimal sign '.' as given" in stated.remarks[0]
    assert (
        "decimal sign ',' as given"
        in read("t;q", *[f"{k};{k},25" for k in range(1, 9)], decimal="comma").remarks[0]
    )


def test_thousands_are_told_by_the_sign_of_the_other_columns(read):
    table = read("t;q;i", *[f"{k};{k},234;{k}.25" for k in range(1, 9)])
    np.testing.assert_array_equal(table.columns[1].numbers, 1000 * np.arange(1, 9) + 234)
    np.testing.assert_array_equal(table.columns[2].numbers, np.arange(1, 9) + 0.25)


def test_an_open_quote_is_refused_only_where_samples_would_be_lost(read):
    words = refusal(read, "t,q", *ROWS[:2], '3,"1.5', *ROWS[3:])
    assert (
        'line 4: a quote (") is opened and not closed, so the samples from line 5 on would be lost' in words
    )
    table = read("t,q,note", f'{ROWS[0]},"over', 'two lines"', *[f"{row},ok" for row in ROWS[1:]])
    assert table.columns[2].words[0] == "over\ntwo lines"
    assert "line 2: a cell goes over several lines, by its quotes" in table.remarks
    assert table.lines.tolist() == [3, *range(4, 11)]


def test_a_header_without_samples_and_a_damaged_archive_are_refused(tmp_path, read):
    path = tmp_path / "log.csv.gz"
    whole = gzip.compress("\n".join(["t,q", *[f"{k},{np.sin(k)}" for k in range(9_000)]]).encode())
    path.write_bytes(whole)
    assert len(read_csv(path, CsvOptions()).columns[0]) == 9_000
    path.write_bytes(whole[:-3_000])
    with pytest.raises(InputError, match="the gzip file is damaged or cut short"):
        read_csv(path, CsvOptions())


def test_rows_are_the_same_over_the_bound_of_a_block(tmp_path):
    count = (1 << 15) + 5
    path = tmp_path / "long.csv"
    path.write_text("\n".join(["t,q", *[f"{k},{'x' if k == count - 2 else k}" for k in range(count)]]) + "\n")
    table = read_csv(path, CsvOptions())
    assert len(table.columns[0]) == count
    assert table.lines[-1] == count + 1
    assert table.columns[1].wrong == {count - 2: "x"}
