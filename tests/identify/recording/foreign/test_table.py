"""Columns by their names, and clocks of every kind, of a table made by hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from identify.recording.errors import InputError
from identify.recording.foreign.table import ForeignColumn, ForeignTable, unit_words
from identify.recording.units import Unit, unit_of


def column(name, numbers=(0.0, 1.0), **more) -> ForeignColumn:
    return ForeignColumn(name, np.array(numbers), **more)


def table(*columns: ForeignColumn, **more) -> ForeignTable:
    return ForeignTable(Path("log.csv"), columns, **more)


def clock(numbers, unit=None, **more):
    return table(column("t", numbers, **more)).clock("t", unit)


def refusal(of, *arguments) -> str:
    with pytest.raises(InputError) as refused:
        of(*arguments)
    return str(refused.value)


def test_a_column_is_found_as_written_then_without_its_unit_then_in_other_capitals():
    made = table(column("q [deg]"), column("Q"), column("I [mA]"), column("i [mA]"))
    assert made.place("q [deg]", "x") == 0
    assert made.place(" q ", "x") == 0
    assert made.place("Q", "x") == 1
    assert made.place("i", "x") == 3
    assert made.place("I [mA]", "x") == 2
    assert table(column("Speed")).place("SPEED", "x") == 0
    assert made.has("Q")
    assert not made.has("q")


def test_a_column_is_found_by_its_number_from_one_unless_that_is_a_name():
    made = table(column(""), column("b"))
    assert made.place("#1", "x") == 0
    assert made.place("#2", "x") == 1
    assert table(column("b"), column("#1")).place("#1", "x") == 1
    for name in ("#0", "#3", "#", "#²"):
        assert f"there is no column '{name}' for the time; there are #1, b" in refusal(
            made.place, name, "the time"
        )


def test_names_that_stand_more_than_once_are_refused_with_their_places():
    twice = table(column("a"), column("q"), column("q"))
    assert "stands twice (columns 2 and 3); rename one, or say which: '#2'" in refusal(twice.place, "q", "x")
    thrice = table(*[column("q")] * 3)
    assert "stands 3 times (columns 1 and 2 and 3)" in refusal(thrice.place, "q", "x")
    parts = table(column("arm:q"), column("q2"), column("arm:i"))
    assert "'arm' has 2 columns; say which for x, arm:q for example" in refusal(parts.place, "arm", "x")


def test_forty_names_are_shown_at_most():
    names = [column(f"c{k}") for k in range(41)]
    assert table(*names[:40]).names() == ", ".join(f"c{k}" for k in range(40))
    assert table(*names).names() == ", ".join(f"c{k}" for k in range(40)) + " ..."


def test_a_sample_is_named_by_its_line_where_there_are_lines():
    assert table(column("q")).sample(4) == "sample 5"
    lined = table(column("q"), lines=np.array([3, 4, 7]))
    assert lined.sample(2) == "line 7"
    assert lined.sample(3) == "sample 4"


def test_lengths_and_base_names():
    assert len(column("q", (1.0, 2.0, 3.0))) == 3
    assert len(ForeignColumn("w", None, ["a", "b"])) == 2
    assert len(ForeignColumn("w", None)) == 0
    assert column("q [deg]").base_name == "q"


def test_a_clock_without_a_unit_is_in_seconds_and_one_with_a_unit_in_that():
    plain = clock((2.0, 2.5))
    assert (plain.seconds.tolist(), plain.begin, plain.of_day) == ([2.0, 2.5], None, False)
    assert plain.said == "t: s (no unit is stated)"
    given = clock((2000.0, 2500.0), "ms")
    assert given.seconds.tolist() == [2.0, 2.5]
    assert given.said == "t: ms as given"
    made = table(ForeignColumn("t", np.array([2000.0, 2500.0]), None, unit_of("ms"), "the header"))
    assert made.clock("t", None).said == "t: ms by the header"
    assert made.clock("t", None).seconds.tolist() == [2.0, 2.5]
    assert made.clock("t", "us").seconds.tolist() == pytest.approx([2e-3, 2.5e-3])


def test_a_clock_in_no_unit_of_time_is_refused():
    assert "--time-unit: 'deg' is not known; use s, ms, us, ns, min, h, d, 100ns" in refusal(
        clock, (0.0, 1.0), "deg"
    )
    assert "--time-unit: 'blink' is not known" in refusal(clock, (0.0, 1.0), "blink")
    made = table(ForeignColumn("t", np.array([0.0, 1.0]), None, unit_of("A"), "the header"))
    assert "column 't' is in A by the header, which is no time" in refusal(made.clock, "t", None)


@pytest.mark.parametrize(("factor", "form"), [(1.0, "s"), (1e3, "ms"), (1e6, "us"), (1e9, "ns")])
def test_numbers_as_large_as_a_date_count_from_1970(factor, form):
    """2026-01-29T10:40:00.500 is 1 769 683 200.5 s."""
    begin = 1_769_683_200.5
    numbers = np.array([begin, begin + 0.25]) * factor
    found = clock(numbers)
    np.testing.assert_allclose(found.seconds, [0.0, 0.25], atol=1e-6)
    assert found.begin == pytest.approx(begin * 1e9, abs=1000)
    assert found.said.endswith("counted from 2026-01-29T10:40:00.500Z")
    # a unit that is given and is another is taken at its word
    other = clock(numbers, "min")
    assert other.begin is None
    assert other.seconds[0] == pytest.approx(begin * factor * 60)
    assert clock(numbers, form).begin == found.begin


def test_ticks_of_windows_count_from_1601():
    ticks = np.array([1_769_683_200.5, 1_769_683_200.75]) * 1e7 + 11_644_473_600 * 1e7
    found = clock(ticks.astype(np.int64))
    np.testing.assert_allclose(found.seconds, [0.0, 0.25], atol=1e-6)
    assert found.begin == pytest.approx(
        1_769_683_200.5e9, abs=3200
    )  # a step of the double that the ticks are


def test_instants_of_a_recording_are_nanoseconds():
    begin = 1_769_683_200_500_000_000
    found = table(ForeignColumn("t", np.array([begin, begin + 2_000_000]), absolute=True)).clock("t", None)
    assert found.seconds.tolist() == [0.0, 0.002]
    assert found.begin == begin
    assert found.said == "t: instants of the recording, counted from 2026-01-29T10:40:00.500Z"
    early = table(ForeignColumn("t", np.array([5, 7]), absolute=True)).clock("t", None)
    assert early.said == "t: instants of the recording"
    assert early.seconds.tolist() == [0.0, pytest.approx(2e-9)]
    none = table(ForeignColumn("t", np.array([], np.int64), absolute=True)).clock("t", None)
    assert (none.begin, len(none.seconds)) == (0, 0)


def test_times_in_words_are_dates_or_times_of_day():
    def of(*words):
        return table(ForeignColumn("t", None, list(words))).clock("t", None)

    day = of("14:03:00.000", "14:03:00.250")
    assert (day.of_day, day.said) == (True, "t: times of day")
    assert day.seconds.tolist() == [0.0, 0.25]
    assert day.begin == (14 * 3600 + 180) * 10**9
    dated = of("2026-01-29T10:40:00.500", "2026-01-29T10:40:00.750")
    assert not dated.of_day
    assert dated.begin == 1_769_683_200_500_000_000
    assert dated.said == "t: dates with a time of day, counted from 2026-01-29T10:40:00.500Z"
    night = of("23:59:59.900", "00:00:00.100")
    assert night.said == "t: times of day, past midnight"
    np.testing.assert_allclose(night.seconds, [0.0, 0.2])
    assert "column 't', sample 2: 'soon' is neither a number nor a time" in refusal(of, "14:03:00", "soon")


def test_what_a_unit_does_is_said_where_it_does_something():
    degrees = unit_of("deg")
    assert degrees is not None
    assert unit_words(degrees) == "deg -> rad (× 0.0174532925)"
    assert unit_words(Unit("A", "current", 1.0)) == ""
    assert unit_words(Unit("K", "temperature", 1.0, -273.15)) == "K -> °C (× 1 -273.15)"
    assert unit_words(Unit("F", "temperature", 0.5, 3.0)) == "F -> °C (× 0.5 +3)"
