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


def test_a_give_is_told_with_its_units():
    assert (
        Give(3.0, compliance=2e-5).in_words(True) == "a stiffness of 5e+04 N m/rad before a rotor of 3 kg m²"
    )
    assert Give(4.0, 1e-6, 1e-3).in_words(False) == (
        "a stiffness of 1e+06 N/m and a gap of 0.001 m before a rotor of 4 kg"
    )
    assert (
        Give(4.0, 1e-6, link_dry=20.0)
        .in_words(True)
        .endswith("kg m², 20 N m of the dry friction on the link")
    )
