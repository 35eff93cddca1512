"""Numbers as people and instruments write them: what each cell means, told by the rules that the module states."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from identify.recording.foreign.cells import (
    decimal_of,
    is_empty,
    is_number,
    is_typed,
    number,
    numbers,
    unit_in_cells,
)


@pytest.mark.parametrize(
    ("cell", "decimal", "value"),
    [
        ("1", ".", 1.0),
        (" 1.5 ", ".", 1.5),
        ("-.5", ".", -0.5),
        ("−2.5", ".", -2.5),
        ("+ 3", ".", 3.0),
        ("5.", ".", 5.0),
        ("1e3", ".", 1000.0),
        ("1.5D-2", ".", 0.015),
        ("2d1", ".", 20.0),
        ("1,234.5", ".", 1234.5),
        ("1,234,567", ".", 1234567.0),
        ("1 234.5", ".", 1234.5),
        ("1'234.5", ".", 1234.5),
        ("1\u202f234", ".", 1234.0),
        ("1,5", ",", 1.5),
        ("-,5", ",", -0.5),
        ("1.234,5", ",", 1234.5),
        ("1.234", ",", 1234.0),
        ("1.5", ",", 1.5),
        ("1,5e-3", ",", 0.0015),
        ("12.5 rpm", ".", 12.5),
        ("12.5%", ".", 12.5),
        ("3 N", ".", 3.0),
        ("TRUE", ".", 1.0),
        ("falsch", ".", 0.0),
        ("inf", ".", np.inf),
        ("1_000", ".", None),
        ("1,5", ".", None),
        ("word", ".", None),
        ("", ".", None),
        ("1.2.3", ".", None),
    ],
)
def test_a_cell_is_the_number_that_is_written(cell, decimal, value):
    assert number(cell, decimal) == value


@given(value=st.floats(-1e12, 1e12), decimal=st.sampled_from([".", ","]))
def test_a_number_that_python_writes_is_read_exactly_with_either_decimal_sign(value, decimal):
    text = repr(value).replace(".", decimal)
    assert number(text, decimal) == value
    column, wrong = numbers([text, "", text], decimal)
    assert wrong == []
    np.testing.assert_array_equal(column, [value, np.nan, value])


@pytest.mark.parametrize("cell", ["", " ", "-", "--", "NaN", "NULL", "n/a", "#N/A", "?", "-nan(ind)"])
def test_what_stands_for_no_value_is_empty_and_no_number(cell):
    assert is_empty(cell)
    assert is_typed(cell)
    assert number(cell, ".") is None or np.isnan(number(cell, "."))


def test_cells_that_are_neither_number_nor_empty_are_counted_by_their_place():
    column, wrong = numbers(["1.5", "oops", "", "2"], ".")
    np.testing.assert_array_equal(column, [1.5, np.nan, np.nan, 2.0])
    assert wrong == [1]


def test_whole_numbers_beyond_the_precision_of_floats_stay_whole():
    clock = [2**53 - 1, 2**53 + 1, 2**60 + 3]
    column, wrong = numbers([str(count) for count in clock], ".")
    assert wrong == []
    assert column.dtype == np.int64
    assert column.tolist() == clock
    assert numbers([str(2**53 - 1)], ".")[0].dtype == np.float64
    assert numbers(["1e16", "2e16"], ".")[0].dtype == np.float64


@pytest.mark.parametrize(
    ("cells", "decimal", "sure"),
    [
        (["1", "2"], None, False),
        (["1.5", "2"], ".", True),
        (["1,5", "2,25"], ",", True),
        (["1,234.5"], ".", True),
        (["1.234,5"], ",", True),
        (["1.234.567"], ",", True),
        (["1,234,567"], ".", True),
        (["1.234", "5.678"], ".", False),
        (["1,234", "5,678"], ",", False),
        (["1.234", "5.6"], ".", True),
        (["0.234", "5.678"], ".", True),
        (["0,234"], ",", True),
        (["1.5", "1,5", "2,5"], ",", True),
        (["1.5", "1,5"], ".", True),
    ],
)
def test_the_decimal_sign_of_a_column_and_whether_it_is_sure(cells, decimal, sure):
    assert decimal_of(cells) == (decimal, sure)


@pytest.mark.parametrize(
    ("cells", "unit"),
    [
        (["1.5 rad", "2 rad", ""], "rad"),
        (["1.5rad/s", "2 rad/s"], "rad/s"),
        (["1.5 rad", "2 deg"], None),
        (["1.5 rad", "2"], None),
        (["1.5", "2"], None),
        (["", "-"], None),
    ],
)
def test_a_unit_stands_behind_every_number_or_is_none(cells, unit):
    assert unit_in_cells(cells) == unit


@pytest.mark.parametrize(
    ("cell", "a_number", "typed"),
    [
        ("1.5", True, True),
        ("1,234.5", True, True),
        ("-Infinity", True, True),
        ("1 234,5", False, True),
        ("12:30:01.5", False, True),
        ("2026-11-28", False, True),
        ("wahr", False, True),
        ("12 rpm", False, True),
        ("position", False, False),
        ("q1", False, False),
    ],
)
def test_samples_are_told_from_names(cell, a_number, typed):
    assert is_number(cell) is a_number
    assert is_typed(cell) is typed
