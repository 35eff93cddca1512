"""MAT files of level 5, byte order and nesting: written by SciPy, which shares no line with our reader."""

import io

import numpy as np
import pytest
from scipy.io import savemat

from identify.recording.foreign.mat5 import DEEPEST, Damaged, Mat5


def content_of(**variables: object) -> bytes:
    stream = io.BytesIO()
    savemat(stream, variables)
    return stream.getvalue()


def nested(depth: int, kind: str) -> object:
    value: object = 1.5
    for _ in range(depth):
        if kind == "struct":
            value = {"inner": value}
        else:
            cell = np.empty((1, 1), dtype=object)
            cell[0, 0] = value
            value = cell
    return value


@pytest.mark.parametrize(
    "kind", ["int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "f4", "f8"]
)
def test_numbers_of_every_type_are_read_exactly(kind):
    values = np.array([[0, 1, 2], [100, 50, 127]]).astype(kind)
    ((name, found),) = Mat5(content_of(x=values)).variables()
    assert name == "x"
    np.testing.assert_array_equal(found, values)


@pytest.mark.parametrize("kind", ["struct", "cell"])
def test_structs_and_cells_may_be_nested_so_deep_and_no_deeper(kind):
    """A damaged file could send a reader down for ever."""
    list(Mat5(content_of(x=nested(DEEPEST, kind))).variables())
    with pytest.raises(Damaged, match="too deep"):
        list(Mat5(content_of(x=nested(DEEPEST + 1, kind))).variables())


def test_several_variables_come_in_their_order_and_text_is_text():
    found = dict(Mat5(content_of(second=np.arange(3.0), first="drive A", third=[[1.0]])).variables())
    assert list(found) == ["second", "first", "third"]
    assert found["first"] == "drive A"
    np.testing.assert_array_equal(np.ravel(found["second"]), np.arange(3.0))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda content: content[:100], "cut short"),
        (lambda content: content[:126] + b"XX" + content[128:], "byte order"),
    ],
)
def test_what_is_no_file_of_level_5_is_refused(change, said):
    with pytest.raises(Damaged, match=said):
        Mat5(change(content_of(x=1.0)))


@pytest.mark.parametrize("value", [{"a": 1.0}, np.array([[1.0]], dtype=object)], ids=["structs", "cells"])
def test_more_elements_than_there_are_bytes_are_refused_before_any_is_made(value):
    """A few bytes that speak of a thousand million structs would fill the memory."""
    content = content_of(x=value)
    dimensions = np.array([1, 1], "<i4").tobytes()
    assert content.count(dimensions) >= 1
    changed = content.replace(dimensions, np.array([1 << 15, 1 << 15], "<i4").tobytes(), 1)
    with pytest.raises(Damaged, match=r"1073741824 elements in \d+ bytes"):
        list(Mat5(changed).variables())
