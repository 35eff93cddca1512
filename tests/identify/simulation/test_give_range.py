"""What a give can be: every value within the range is a mechanism."""

from __future__ import annotations

import numpy as np
import pytest

from identify.simulation.give_range import GiveRange


@pytest.mark.parametrize(("spring", "gap"), [(True, False), (False, True), (True, True)])
def test_at_both_ends_motor_and_link_have_an_inertia_and_are_near_each_other(spring, gap):
    reach = GiveRange(12.0, 200.0, 1.5, 1e-5, spring, gap)
    assert len(reach.lower) == len(reach.upper) == 1 + 2 * spring + 2 * gap
    for values in (reach.lower, reach.upper, *reach.starts()):
        give = reach.give(values)
        assert 1.2 - 1e-9 <= give.rotor <= 10.8 + 1e-9
        assert (give.compliance > 0.0) == spring
        assert (give.gap > 0.0) == gap
        twist = give.twist(np.array([200.0]))[0]
        assert 0.0 < twist <= 0.05 * 1.5 * (spring + 0.5 * gap) * (1 + 1e-9)
    for start in reach.starts():
        assert np.all((start >= reach.lower) & (start <= reach.upper))


def test_a_damping_ratio_is_that_of_the_link_with_its_motor_held():
    reach = GiveRange(12.0, 200.0, 1.5, 1e-5, spring=True, gap=False)
    give = reach.give(np.array([2 / 3, np.log(1 / 2e4), 0.25]))
    damping, link = give.relaxation * 2e4, 8.0
    assert give.rotor == pytest.approx(4.0)
    assert damping == pytest.approx(2 * 0.25 * np.sqrt(2e4 * link))


@pytest.mark.parametrize(("spring", "gap"), [(True, False), (False, True)])
@pytest.mark.parametrize("dry", [0.0, 14.0])
def test_the_values_of_a_give_are_those_that_make_it(spring, gap, dry):
    reach = GiveRange(12.0, 200.0, 1.5, 1e-5, spring, gap, dry)
    for values in reach.starts():
        np.testing.assert_allclose(reach.values(reach.give(values)), values, rtol=1e-9)
        assert reach.give(values).link_dry == (dry * values[-1] if dry else 0.0)
