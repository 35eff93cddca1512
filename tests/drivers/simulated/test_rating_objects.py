"""What a simulated drive says of itself, against the units of CiA 402 worked out by hand."""

import pytest

from drivers.simulated.rating_objects import rating_objects
from drivers.simulated.settings import SimulatedAxis


def test_ratings_are_in_the_units_of_their_objects():
    axis = SimulatedAxis(
        node=5,
        rated_current=4.25,
        rated_torque=1.5,
        current_limit=2.5,
        max_speed=100.0 * 3.141592653589793,
        counts_per_turn=3600,
        following_error=0.25,
        following_error_time=0.04,
        quick_stop_deceleration=2 * 3.141592653589793,
    )
    assert rating_objects(axis) == {
        (0x6072, 0): 2500,
        (0x6073, 0): 2500,
        (0x6075, 0): 4250,
        (0x6076, 0): 1500,
        (0x6065, 0): 900,
        (0x6066, 0): 40,
        (0x6080, 0): 3000,
        (0x6085, 0): 3600,
        (0x6099, 1): 720,
        (0x608F, 1): 3600,
        (0x608F, 2): 1,
    }


@pytest.mark.parametrize(("limit", "value"), [(0.0004, 0), (0.0006, 1)])
def test_a_limit_is_rounded_to_a_thousandth_of_the_rated_current(limit, value):
    axis = SimulatedAxis(node=1, current_limit=limit)
    assert rating_objects(axis)[0x6073, 0] == value
