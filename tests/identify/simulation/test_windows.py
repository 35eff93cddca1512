"""Where the windows of a simulation begin."""

from __future__ import annotations

from identify.simulation.simulate import MOST_WINDOWS
from identify.simulation.windows import window_starts


def test_windows_cover_the_record_and_are_no_more_than_needed():
    assert window_starts(100, 100, MOST_WINDOWS) == [0]
    starts = window_starts(1001, 101, MOST_WINDOWS)
    assert starts == list(range(0, 901, 100))
    many = window_starts(1_000_000, 11, MOST_WINDOWS)
    assert len(many) == MOST_WINDOWS
    assert many[0] == 0
    assert many[-1] + 11 <= 1_000_000
