"""Columns that grow: the same array from memory and from a file, whatever the blocks."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from identify.recording.samples import SampleColumns, release


@given(
    sizes=st.lists(st.integers(0, 7), min_size=1, max_size=8),
    width=st.integers(0, 3),
    largest=st.integers(0, 300),
)
def test_what_was_appended_is_read_back(sizes, width, largest):
    columns, blocks = SampleColumns(width, largest), []
    for size in sizes:
        first = sum(map(len, blocks))
        block = np.arange(first, first + size, dtype=float)
        blocks.append(block if width == 0 else np.column_stack([block * (k + 1) for k in range(width)]))
        columns.append(blocks[-1])
    assert columns.rows == sum(sizes)
    if not columns.rows and largest == 0:
        return  # nothing is mapped of a file without bytes; a session without rows is refused where it is read
    array = columns.array()
    np.testing.assert_array_equal(array, np.concatenate(blocks))
    assert isinstance(array, np.memmap) == (columns.rows * max(width, 1) * 8 > largest)


def test_columns_in_any_layout_or_type_become_rows_of_float64():
    columns = SampleColumns(2, largest_in_memory=0)
    columns.append(np.asfortranarray([[1, 2], [3, 4]], dtype=np.int32))
    columns.append(np.array([[5.0, 6.0, 7.0, 8.0]])[:, ::2])
    assert columns.array().tolist() == [[1.0, 2.0], [3.0, 4.0], [5.0, 7.0]]


def test_pages_given_back_are_read_again_and_are_not_to_be_written():
    columns = SampleColumns(0, largest_in_memory=0)
    columns.append(np.arange(5000.0))
    array = columns.array()
    release(array[100:200])
    assert array.sum() == 5000 * 4999 / 2
    with pytest.raises(ValueError, match="read-only"):
        array[0] = 1.0
    release(np.zeros(3))  # nothing is mapped: nothing to give back


def test_nothing_appended_is_an_empty_array_of_the_width():
    assert SampleColumns(3).array().shape == (0, 3)
    assert SampleColumns().array().shape == (0,)
