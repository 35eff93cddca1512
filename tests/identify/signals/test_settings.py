"""Rates that follow from cut-offs: at least a kilohertz, at least ten and twenty times the cut-offs."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from identify.signals.settings import SignalSettings


@pytest.mark.parametrize(
    ("rate", "position", "decimation", "stride"),
    [
        (500.0, 50.0, 10.0, 1),
        (1000.0, 50.0, 10.0, 1),
        (5000.0, 50.0, 10.0, 5),
        (4999.0, 50.0, 10.0, 4),
        (10_000.0, 200.0, 10.0, 5),
        (10_000.0, 50.0, 250.0, 2),
    ],
)
def test_rows_come_at_a_kilohertz_or_so_many_times_the_cut_offs(rate, position, decimation, stride):
    assert SignalSettings((1.0, position), decimation).stride(1 / rate) == stride


@given(rate=st.floats(100, 20_000), position=st.floats(1, 100), decimation=st.floats(0.5, 50))
def test_a_decimated_sample_is_a_whole_number_of_rows_and_still_sees_the_cut_off(rate, position, decimation):
    settings = SignalSettings((position,), decimation)
    factor, stride = settings.decimation_factor(1 / rate), settings.stride(1 / rate)
    assert factor % stride == 0
    assert factor == stride or rate / factor > 2 * decimation


def test_the_slowest_joint_s_filter_decides_what_is_trimmed():
    assert SignalSettings((60.0, 15.0), 4.0).edge() == pytest.approx(1.5 / 15.0 + 1.0 / 4.0)
