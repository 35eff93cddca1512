"""Times in words against Python's own calendar, and numbers that can only be a computer's clock."""

from datetime import UTC, datetime, timedelta, timezone

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from identify.recording.foreign.instants import EPOCHS, epoch_of, is_instant, parse_instants

EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
MOMENTS = st.datetimes(datetime(1971, 1, 1), datetime(2099, 1, 1))  # noqa: DTZ001


def nanoseconds(moment: datetime) -> int:
    return (moment - EPOCH) // timedelta(microseconds=1) * 1000


def read(*texts: str) -> list[int]:
    parsed = parse_instants(texts)
    assert not isinstance(parsed, int), texts[parsed]
    return parsed[0].tolist()


@given(moment=MOMENTS, minutes=st.integers(-14 * 60, 14 * 60))
def test_iso_8601_is_read_to_the_microsecond_in_any_zone(moment, minutes):
    zoned = moment.replace(tzinfo=timezone(timedelta(minutes=minutes)))
    expected = [nanoseconds(zoned)]
    assert read(zoned.isoformat()) == expected
    assert read(zoned.strftime("%Y%m%dT%H%M%S.%f%z")) == expected
    assert read(zoned.astimezone(UTC).strftime("%Y-%m-%d %H:%M:%S.%fZ")) == expected


@given(moment=MOMENTS)
def test_dates_with_points_are_written_day_first_and_with_the_year_first_month_second(moment):
    midnight = nanoseconds(moment.replace(hour=0, minute=0, second=0, microsecond=0, tzinfo=UTC))
    assert read(moment.strftime("%d.%m.%Y")) == [midnight]
    assert read(moment.strftime("%Y/%m/%d")) == [midnight]
    assert read(moment.strftime("%a, %d.%m.%Y")) == [midnight]


@pytest.mark.parametrize(
    ("texts", "first"),
    [
        (["3/4/2026"], (2026, 3, 4)),
        (["3/4/2026", "13/4/2026"], (2026, 4, 3)),
        (["3/4/2026", "3/13/2026"], (2026, 3, 4)),
        (["13/4/2026"], (2026, 4, 13)),
        (["12/4/2026", "12/12/2026"], (2026, 12, 4)),
        (["3-4-2026"], (2026, 4, 3)),
        (["3/4/26"], (2026, 3, 4)),
    ],
)
def test_day_or_month_first_is_told_by_the_column_as_a_whole(texts, first):
    if texts == ["3/4/2026", "13/4/2026"]:
        # what contradicts the first guess makes the whole column day first or is named
        parsed = parse_instants(texts)
        assert isinstance(parsed, int) or parsed[0][0] == nanoseconds(datetime(2026, 4, 3, tzinfo=UTC))
        return
    assert read(*texts)[0] == nanoseconds(datetime(*first, tzinfo=UTC))


def test_times_of_day_are_ns_since_midnight_and_may_pass_it():
    assert read("00:00:00.000000001", "01:02:03") == [1, 3723 * 10**9]
    day = 86_400 * 10**9
    late, early = read("23:59:59.5", "00:00:00.5")
    assert early - late == 10**9
    assert read("23:59:59", "00:00:01", "23:59:59", "00:00:01")[-1] - day == read("00:00:01")[0] + day
    # a small step back is a fault of the clock, not a new day
    assert np.diff(read("12:00:01", "12:00:00")).tolist() == [-(10**9)]
    assert parse_instants(["12:00:00"])[1] is False
    assert parse_instants(["2026-11-28 12:00:00"])[1] is True


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ("12:00:00 AM", 0),
        ("12:00:01 PM", 43201),
        ("1:00:00 p.m.", 46800),
        ("11:59:59 am", 43199),
        ("10:30", 37800),
        ("02:30.5", 150.5),
        ("1:02:03:500", 3723.5),
        ("1:02:03,25", 3723.25),
        ("12:00:00+02:00", 36000),
        ("12:00:00-0130", 48600),
        ("12:00:00 UTC", 43200),
        ("100:00:00", 360000),
    ],
)
def test_a_time_of_day_in_the_manners_of_instruments(text, seconds):
    assert is_instant(text)
    assert read(text) == [round(seconds * 1e9)]


def test_the_first_text_that_is_no_time_is_named_by_its_place():
    assert parse_instants(["12:00:00", "12:00:01", "soon"]) == 2
    assert parse_instants(["2026-02-30"]) == 0
    assert not is_instant("soon")
    assert not is_instant("12")


@pytest.mark.parametrize(
    ("count", "unit"),
    [(1.8e9, 1.0), (1.8e12, 1e-3), (1.8e15, 1e-6), (1.8e18, 1e-9), (1.34e17, 1e-7)],
)
def test_counts_of_a_computer_s_clock_are_known_by_their_size(count, unit):
    found = epoch_of(count, 1.00001 * count)
    assert found is not None
    assert found[0] == unit


def test_both_ends_of_a_record_must_be_of_the_same_clock():
    for low, high, unit, words in EPOCHS:
        assert epoch_of(low, high) == (unit, words)
        assert epoch_of(low * 0.999, high) is None
        assert epoch_of(low, high * 1.001) is None
    assert epoch_of(0.0, 100.0) is None
    # FILETIME counts from 1601
    in_2026 = (
        (datetime(2026, 11, 28, tzinfo=UTC) - datetime(1601, 1, 1, tzinfo=UTC))
        // timedelta(microseconds=1)
        * 10
    )
    assert epoch_of(in_2026, in_2026 + 1e9) == (1e-7, "100 ns since 1601")
