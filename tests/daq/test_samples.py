"""Which rows a recording holds."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.samples import Phase, SessionRows, sample_dtype

S, A, P, T = Phase.STANDSTILL, Phase.APPROACH, Phase.PLAN, Phase.STOPPING


def rows_of(phases):
    rows = np.zeros(len(phases), sample_dtype(1))
    rows["cycle"], rows["phase"] = np.arange(len(phases)), phases
    return rows


@pytest.mark.parametrize(
    ("phases", "recorded"),
    [
        ([S, A, P, P, S], [2, 3]),
        ([S, A, P, T, T, S], [2, 3, 4]),
        ([S, A, T, T, S], []),
        ([A, P, P, S, S, T, T, S], [1, 2]),
        ([P, S, T, S, T], [0]),
        ([], []),
    ],
    ids=[
        "driven",
        "stopped",
        "stopped before",
        "stopped while settling",
        "cut after power was off",
        "nothing",
    ],
)
def test_a_recording_ends_where_the_axes_stand_still(phases, recorded):
    assert SessionRows().take(rows_of(phases))["cycle"].tolist() == recorded


@given(st.lists(st.sampled_from([S, A, P, T]), max_size=12), st.sets(st.integers(1, 11)))
def test_no_row_is_missing_between_two_however_they_come_in_blocks(phases, cuts):
    picked, rows = SessionRows(), rows_of(phases)
    bounds = [0, *sorted(cut for cut in cuts if cut < len(rows)), len(rows)]
    blocks = [picked.take(rows[a:b])["cycle"] for a, b in itertools.pairwise(bounds)]
    cycle = np.concatenate(blocks)
    assert cycle.tolist() == SessionRows().take(rows)["cycle"].tolist()
    assert (np.diff(cycle) == 1).all()
