"""The give between a motor and its link against its definition."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.effects.give import Give


@settings(max_examples=60, deadline=None)
@given(
    compliance=st.floats(0.0, 1e-3),
    gap=st.floats(0.0, 0.05),
    flank=st.floats(0.01, 50.0),
    yielding=st.floats(1e-9, 1e-3),
    free=st.floats(-1.0, 1.0),
)
def test_what_is_carried_twists_the_give_by_what_is_left_of_the_free_twist(
    compliance, gap, flank, yielding, free
):
    give = Give(1.0, compliance, gap, flank)
    (load,) = give.load_where(np.array([free]), np.array([yielding]))
    assert give.twist(load) + yielding * load == pytest.approx(free, rel=1e-7, abs=1e-12)


def test_the_energy_of_a_give_is_the_work_of_its_load():
    give = Give(1.0, 2e-5, 3e-3, 7.0)
    load = np.linspace(0.0, 60.0, 4001)
    work = np.concatenate([[0.0], np.cumsum(0.5 * (load[1:] + load[:-1]) * np.diff(give.twist(load)))])
    np.testing.assert_allclose(give.energy(load), work, atol=1e-7)


def test_a_spring_and_a_gap_in_series_twist_by_the_sum():
    spring, gap = Give(3.0, compliance=2e-5), Give(4.0, gap=1e-3, flank_load=5.0)
    load = np.linspace(-40.0, 40.0, 9)
    for both in (spring.in_series_with(gap), gap.in_series_with(spring)):
        np.testing.assert_allclose(both.twist(load), spring.twist(load) + gap.twist(load))
        assert both.rotor == 3.0
