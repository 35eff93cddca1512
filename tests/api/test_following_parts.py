"""Following errors of two drives of one plan: compared where both have them, by speed and by quadrant."""

import numpy as np
import pytest

from api.following_parts import compared
from daq.following_error import FollowingError
from daq.rig import Rig
from daq.torque_offset import TorqueOffset


def test_errors_are_compared_over_the_cycles_of_both_drives_by_speed_and_quadrant() -> None:
    rig = Rig.load("rx130l-joint3-simulated")
    speed = np.array([0.0, 0.05, 0.2, 1.0, -1.0, 0.5])[:, None]
    load = np.array([9.0, 9.0, -9.0, 9.0, 9.0, 9.0])[:, None]
    sent = TorqueOffset(np.zeros((6, 1), np.int16), np.array([3.0]), np.array([0.25]))
    without = FollowingError(np.arange(6), np.array([1.0, 2.0, 4.0, 3.0, -5.0, 7.0])[:, None])
    # the second was stopped before the last cycle, and one position did not come
    with_ = FollowingError(np.arange(5), np.array([1.0, np.nan, 2.0, -1.0, 1.0])[:, None])
    (joint,) = compared(rig, sent, speed, load, without, with_)
    assert joint.rms_without == pytest.approx(np.sqrt((1 + 4 + 16 + 9 + 25) / 5))
    assert joint.rms_with == pytest.approx(np.sqrt((1 + 4 + 1 + 1) / 4))
    assert (joint.peak_without, joint.peak_with) == (5.0, 2.0)
    assert (joint.largest_offset, joint.bounded) == (3.0, 0.25)
    assert [(part.samples, part.rms_with) for part in joint.speeds] == [(2, 1.0), (1, 2.0), (2, 1.0)]
    driving, driven = joint.quadrants
    assert (driving.where, driving.samples, driving.rms_with) == ("driving its load", 2, 1.0)
    assert (driven.samples, driven.rms_without) == (2, pytest.approx(np.sqrt((16 + 25) / 2)))
    nothing = FollowingError(np.zeros(0, np.int64), np.zeros((0, 1)))
    assert compared(rig, sent, speed, load, without, nothing) == ()
