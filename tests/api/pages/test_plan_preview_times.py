"""A plan is looked at where its motion is new, and its picture is of all of it."""

import numpy as np
import pytest

from api.pages.figures.plan_preview import _thinned
from api.pages.plan_preview_times import preview_times
from daq.excitation.standard_plan import standard_plan
from daq.rig import RIGS, Rig


@pytest.mark.parametrize("seconds", [60, 3600])
def test_every_instant_of_the_whole_has_the_motion_of_its_row(seconds: float) -> None:
    plan = standard_plan(Rig.load(RIGS / "rx130l-joint3-simulated.yaml"), seconds)
    times = preview_times(plan)
    assert times.new[0] == times.whole[0] == 0.0
    assert times.whole[-1] == pytest.approx(plan.duration)
    assert np.all(np.diff(times.whole) > 0)
    assert np.diff(times.whole).max() < 2.01 * times.spacing
    assert len(times.new) < 20_000
    some = slice(None, None, 37)
    here, _, _ = plan.setpoints(times.whole[some])
    there, _, _ = plan.setpoints(times.new[times.row[some]])
    np.testing.assert_allclose(here, there, atol=1e-6)


def test_the_picture_of_an_hour_has_an_even_edge_where_the_motion_repeats() -> None:
    plan = standard_plan(Rig.load(RIGS / "rx130l-joint3-simulated.yaml"), 3600)
    times = preview_times(plan)
    position = plan.setpoints(times.new)[0][times.row, 0]
    at, drawn = _thinned(times.whole, position)
    ((begin, end, period),) = plan.repeated
    inside = (at > begin + period) & (at < end - period)
    reach = np.ptp(drawn[inside])
    # a bucket is shorter than a period: what differs from one to the next is what it holds of it, never its sampling
    crests = drawn[inside][drawn[inside] > drawn[inside].max() - 0.02 * reach]
    assert len(crests) > 0.8 * (end - begin) / period
