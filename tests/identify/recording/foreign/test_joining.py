"""Files of one session joined on time: whose stamps are taken, what is interpolated how, and what is left out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.recording.errors import InputError
from identify.recording.foreign.joining import JOINED_TIME, join_on_time, join_session
from identify.recording.foreign.roles import ColumnMap
from identify.recording.foreign.table import ForeignColumn, ForeignTable


def table(name, time, absolute=False, time_name="t", **columns):
    listed = [ForeignColumn(time_name, np.asarray(time), absolute=absolute)]
    listed += [ForeignColumn(key, np.asarray(values, float)) for key, values in columns.items()]
    return ForeignTable(Path(name), tuple(listed))


def columns(joined):
    return {column.name: column.numbers for column in joined.columns}


SLOW = np.arange(0, 2, 0.01)
FAST = np.arange(0.5, 1.6, 0.004)
COLUMNS = ColumnMap(position=("q",), command=("i",))


def test_the_fastest_file_gives_the_stamps_within_what_all_files_cover():
    slow = table("slow.csv", SLOW, q=SLOW**3, v=3 * SLOW)
    fast = table("fast.csv", FAST, i=np.sin(FAST))
    joined = join_on_time([slow, fast], ["t", "t"], None, ["q"])
    found = columns(joined)
    assert list(found) == [JOINED_TIME, "q", "v", "i"]
    assert found[JOINED_TIME] == pytest.approx(FAST)
    assert found["i"] == pytest.approx(np.sin(FAST))
    assert found["q"] == pytest.approx(FAST**3, abs=1e-9)  # cubics give a cubic exactly
    assert found["v"] == pytest.approx(3 * FAST, abs=1e-9)
    assert joined.time == JOINED_TIME
    assert joined.path == Path("slow.csv")
    assert joined.remarks[-1] == (
        f"joined on time: {len(FAST)} samples of fast.csv, the others interpolated to its stamps;"
        f" {FAST[-1] - 0.5:.6g} s in common"
    )


def test_what_is_no_position_is_interpolated_by_straight_lines():
    slow = table("slow.csv", SLOW, q=SLOW**2, w=SLOW**2)
    fast = table("fast.csv", FAST, i=FAST)
    found = columns(join_on_time([slow, fast], ["t", "t"], None, ["q"]))
    between = np.isclose(np.mod(FAST + 1e-9, 0.01), 0.004, atol=1e-6)
    assert between.sum() > 20
    # halfway along a chord of x² lies (x - a)(b - x) above the curve
    assert (found["w"] - FAST**2)[between] == pytest.approx(np.full(between.sum(), 0.004 * 0.006), rel=1e-6)
    assert found["q"] == pytest.approx(FAST**2, abs=1e-9)


def test_files_with_common_stamps_are_put_side_by_side_and_names_that_recur_get_their_file():
    one, two = table("one.csv", SLOW, q=SLOW, n=SLOW), table("two.csv", SLOW, q=-SLOW)
    joined = join_on_time([one, two], ["t", "t"], None, [])
    assert list(columns(joined)) == [JOINED_TIME, "one:q", "n", "two:q"]
    assert columns(joined)["two:q"] == pytest.approx(-SLOW)
    assert "the others at common stamps; 1.99 s in common" in joined.remarks[-1]


def test_nothing_is_interpolated_across_a_hole_of_another_file():
    kept = np.r_[0:71, 90:200]  # 0.7 to 0.9 s is missing
    stamps = FAST + 0.001  # none of them is a stamp of the other file
    holed, fast = table("holed.csv", SLOW[kept], q=SLOW[kept]), table("fast.csv", stamps, i=stamps)
    joined = join_on_time([holed, fast], ["t", "t"], None, [])
    inside = (stamps > 0.7) & (stamps < 0.9)
    assert columns(joined)[JOINED_TIME] == pytest.approx(stamps[~inside])
    assert joined.remarks[-1] == f"{inside.sum()} samples in holes of another file left out"


def test_instants_are_counted_from_the_earliest_file():
    begin = 1_700_000_000_000_000_000
    early = begin + (SLOW * 1e9).astype(np.int64)
    late = begin + 500_000_000 + ((FAST - 0.5) * 1e9).round().astype(np.int64)
    joined = join_on_time(
        [table("early.csv", early, absolute=True, q=SLOW), table("late.csv", late, absolute=True, i=FAST)],
        ["t", "t"],
        None,
        [],
    )
    assert columns(joined)[JOINED_TIME] == pytest.approx(FAST, abs=1e-8)
    assert columns(joined)["q"] == pytest.approx(FAST, abs=1e-8)


@pytest.mark.parametrize(
    ("second", "said"),
    [
        (
            table("b.csv", SLOW + 1.9, i=SLOW),
            r"a\.csv: the files have too little time in common to join them: a\.csv 0 to 1\.99 s; b\.csv 1\.9 to 3\.89 s",
        ),
        (table("b.csv", SLOW[:9], i=SLOW[:9]), r"b\.csv: 9 samples; that is too few for a session"),
        (
            table("b.csv", SLOW[::-1], i=SLOW),
            r"b\.csv: column 't': time does not increase; --repair drop leaves such samples out",
        ),
        (table("b.csv", SLOW * 1000, i=SLOW), r"b\.csv: column 't': the typical step is 10 s"),
        (
            table("b.csv", 1_700_000_000_000_000_000 + (SLOW * 1e9).astype(np.int64), absolute=True, i=SLOW),
            r"b\.csv: its time column states dates, that of a\.csv seconds; they cannot be joined",
        ),
    ],
)
def test_files_that_cannot_be_joined_are_refused_in_one_line(second, said):
    with pytest.raises(InputError, match=said):
        join_on_time([table("a.csv", SLOW, q=SLOW), second], ["t", "t"], None, [])


def test_samples_that_step_back_are_left_out_on_request_with_their_values():
    stepping = SLOW.copy()
    stepping[50] = 0.2
    repaired = table("b.csv", stepping, i=np.arange(200.0))
    joined = join_on_time([table("a.csv", SLOW, q=SLOW), repaired], ["t", "t"], None, [], "drop")
    assert columns(joined)["i"] == pytest.approx(np.arange(200.0))  # what was left out lay on a straight line
    assert any(remark.startswith("b.csv: 1 step back in time: 1 of 200 samples") for remark in joined.remarks)


def test_the_time_columns_of_a_session_are_named_once_for_all_or_one_for_each():
    one, two = table("one.csv", SLOW, q=SLOW), table("two.csv", SLOW, time_name="s", i=SLOW)
    both = [one, table("two.csv", SLOW, i=SLOW)]
    joined, found = join_session([one, two], ["t", "s"], COLUMNS)
    assert list(columns(joined)) == [JOINED_TIME, "q", "i"]
    assert (found.time, found.joined) == (JOINED_TIME, ("t", "s"))
    for times, given in (
        (["t"], COLUMNS),
        ([], replace(COLUMNS, time="t")),
        ([], replace(COLUMNS, joined=("t",))),
    ):
        assert join_session(both, times, given)[1].joined == ("t", "t")
    with pytest.raises(InputError, match="--time: is missing; files are joined on their time columns"):
        join_session(both, [], COLUMNS)
    with pytest.raises(InputError, match="--time: 2 given for 3 files; give one, or 3"):
        join_session([*both, one], ["t", "t"], COLUMNS)


def test_a_unit_of_time_that_is_given_is_that_of_all_files_and_is_remembered():
    both = [table("a.csv", SLOW * 1000, q=SLOW), table("b.csv", SLOW * 1000, i=SLOW)]
    joined, found = join_session(both, ["t"], replace(COLUMNS, time_unit="ms"))
    assert columns(joined)[JOINED_TIME] == pytest.approx(SLOW)
    assert (found.time_unit, found.joined_unit) == (None, "ms")
    again, _ = join_session(both, [], found)
    assert columns(again)[JOINED_TIME] == pytest.approx(SLOW)
