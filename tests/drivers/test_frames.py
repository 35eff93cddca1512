import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.frames import FD_FRAME, FRAME, block_of, column, empty_block


@given(st.lists(st.tuples(st.integers(-(2**31), 2**31 - 1), st.integers(-(2**15), 2**15 - 1)), max_size=20))
def test_column_reads_what_struct_packed(pairs):
    frames = block_of((k, 0x181, struct.pack("<ihH", *pair, 0x1237), 0) for k, pair in enumerate(pairs))
    assert column(frames, 0, "<i4").tolist() == [position for position, _ in pairs]
    assert column(frames, 4, "<i2").tolist() == [command for _, command in pairs]
    assert column(frames, 6, "<u2").tolist() == [0x1237] * len(pairs)


def test_column_of_selected_and_joined_frames_is_that_of_their_rows():
    frames = block_of([(k, 0x181 + k % 2, struct.pack("<q", k), 0) for k in range(10)])
    chosen = frames[frames["can_id"] == 0x182]
    joined = np.concatenate([chosen, frames[:1]])
    assert column(joined, 0, "<i8").tolist() == [1, 3, 5, 7, 9, 0]


@pytest.mark.parametrize("dtype", [FRAME, FD_FRAME])
def test_joining_blocks_keeps_the_layout(dtype):
    joined = np.concatenate([empty_block(dtype), block_of([(1, 2, b"abc", 0)], dtype)])
    assert joined.dtype == dtype
    assert bytes(joined[0]["data"][:3]) == b"abc"


@pytest.mark.parametrize(("offset", "kind"), [(5, "<i4"), (-1, "u1"), (8, "u1")])
def test_a_value_that_does_not_fit_the_frame_is_refused(offset, kind):
    with pytest.raises(ValueError, match="do not fit a frame of 8 data bytes"):
        column(empty_block(), offset, kind)
