"""The simulated drive's own tables: a line over speed, a line over a turn, nothing where nothing was written."""

import pytest
from pydantic import ValidationError

from drivers.simulated.compensation import COGGING, FORWARD, SPEEDS, Compensation, CompensationSettings

TURN = 6000  # counts


def test_over_speed_it_rises_from_rest_goes_from_point_to_point_and_is_held():
    table = Compensation(
        CompensationSettings(speeds=(60.0, 180.0), forward=(2.0, 1.0), backward=(-3.0, -1.0), constant=0.25),
        TURN,
    )
    given = {
        0.0: 0.0,
        3000.0: 1.0,
        6000.0: 2.0,
        12000.0: 1.5,
        18000.0: 1.0,
        90000.0: 1.0,
        -6000.0: -3.0,
        -3000.0: -1.5,
    }
    for velocity, current in given.items():
        assert table.current(velocity, 0) == pytest.approx(current + 0.25)


def test_over_a_turn_it_closes_on_itself():
    table = Compensation(CompensationSettings(), TURN)
    assert table.current(5000.0, 10) == 0.0
    table.raw[COGGING][0], table.raw[COGGING][31] = 800, 400
    table.take()
    assert table.current(0.0, 0) == pytest.approx(0.8)
    assert table.current(0.0, -TURN) == pytest.approx(0.8)
    assert table.current(0.0, TURN - 6000 // 64) == pytest.approx(0.6, abs=0.01)


def test_a_table_that_is_being_written_has_no_points_whose_speed_does_not_rise():
    table = Compensation(CompensationSettings(), TURN)
    table.raw[FORWARD][:2] = [1000, 2000]
    table.raw[SPEEDS][1] = 6000
    table.take()
    assert table.current(6000.0, 0) == pytest.approx(2.0)
    with pytest.raises(ValidationError, match="of one length"):
        CompensationSettings(speeds=(1.0,))
