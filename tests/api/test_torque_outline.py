"""An outline draws what the samples draw, and sums what they sum."""

import numpy as np
import pytest

from api.service.stored_samples import StoredSamples
from api.service.torque_outline import BLOCK, outline, reduced, sums
from tests.api.made_samples import made_samples


@pytest.fixture(scope="module")
def part() -> StoredSamples:
    """An hour-like session in small: 60 000 samples that rest now and then."""
    random = np.random.default_rng(5)
    time = 7.0 + 0.001 * np.arange(60_013)
    measured = 50 * np.sin(time) + random.normal(size=len(time))
    return made_samples(
        time,
        measured=measured,
        predicted=50 * np.sin(time),
        moving=(np.sin(3 * time) > -0.7).astype(float),
    )


@pytest.mark.parametrize("rows", [slice(0, 60_013), slice(1234, 57_891), slice(900, 2000)])
@pytest.mark.parametrize("points", [40, 400])
def test_every_extreme_of_a_range_is_drawn_in_its_place(part, rows, points) -> None:
    drawn, whole = reduced(part, outline(part), rows, points)
    assert whole.start <= rows.start < rows.stop <= whole.stop
    assert rows.start - whole.start < BLOCK
    assert len(drawn.time) <= points
    error = np.where(part.moving > 0, part.measured - part.predicted, np.nan)
    for name, values in (("measured", part.measured), ("predicted", part.predicted), ("error", error)):
        assert np.nanmax(drawn.curves[name]) == pytest.approx(np.nanmax(values[whole]), rel=1e-6)
        assert np.nanmin(drawn.curves[name]) == pytest.approx(np.nanmin(values[whole]), rel=1e-6)
    assert drawn.starts is not None
    for block, start in enumerate(drawn.starts):
        stop = drawn.starts[block + 1] if block + 1 < len(drawn.starts) else whole.stop
        assert drawn.curves["measured"][2 * block + 1] == pytest.approx(part.measured[start:stop].max(), 1e-6)
        assert drawn.time[2 * block] == pytest.approx(part.time[start], abs=1e-5)


def test_a_single_chosen_sample_marks_its_block(part) -> None:
    drawn, whole = reduced(part, outline(part), slice(0, 60_013), 400)
    chosen = np.zeros(60_013, bool)
    chosen[30_000] = True
    marks = drawn.marked(chosen[whole], whole)
    assert np.nansum(marks) == 2
    assert drawn.time[np.flatnonzero(marks == 1)[0]] == pytest.approx(part.time[30_000], abs=0.4)


@pytest.mark.parametrize("rows", [slice(0, 60_013), slice(1234, 57_891), slice(900, 930), slice(10, 10)])
def test_the_figures_of_a_range_are_those_of_its_samples(part, rows) -> None:
    found = sums(part, outline(part), rows)
    moving = part.moving[rows] > 0
    error = (part.measured - part.predicted)[rows][moving]
    assert found.samples == moving.sum()
    assert found.error == pytest.approx(np.sum(error**2))
    assert found.measured == pytest.approx(np.sum(part.measured[rows][moving] ** 2))
