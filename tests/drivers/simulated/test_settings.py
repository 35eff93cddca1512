"""The section `simulated` of a rig file: units of the encoder, what the drive's objects can hold, nodes of their own."""

from __future__ import annotations

import math

import pytest
from pydantic import ValidationError

from drivers.simulated.settings import SimulatedAxis, SimulatedDrivesSettings


def test_an_encoder_counts_so_many_increments_in_each_radian():
    assert SimulatedAxis(node=3, counts_per_turn=4096).counts_per_radian * 2 * math.pi == pytest.approx(4096)


@pytest.mark.parametrize(("limit", "allowed"), [(32.767, True), (32.768, False)])
def test_a_current_limit_is_what_an_unsigned_per_mille_of_a_signed_target_can_hold(limit, allowed):
    """Objects 0x6072 and 0x6073 are per mille of the rated value, and 0x6071 of the same unit is an INTEGER16."""
    if allowed:
        assert SimulatedAxis(node=3, current_limit=limit).current_limit == limit
    else:
        with pytest.raises(ValidationError, match=r"current_limit is beyond 32\.767 times the rated current"):
            SimulatedAxis(node=3, current_limit=limit)


def test_drives_on_one_bus_have_nodes_of_their_own():
    axes = [{"node": 3}, {"node": 4}, {"node": 3}]
    with pytest.raises(ValidationError, match=r"every axis needs a node id of its own, not \[3, 4, 3\]"):
        SimulatedDrivesSettings.model_validate({"axes": axes})
    kept = SimulatedDrivesSettings.model_validate({"axes": axes[:2]})
    assert [axis.node for axis in kept.axes] == [3, 4]
    with pytest.raises(ValidationError):
        SimulatedDrivesSettings.model_validate({"axes": []})


def test_time_is_simulated_and_a_lost_sync_stops_a_drive_unless_the_file_says_otherwise():
    settings = SimulatedDrivesSettings.model_validate({"axes": [{"node": 1}]})
    (axis,) = settings.axes
    assert settings.run_on_after is None
    assert axis.sync_loss == "fault"
    assert axis.brake is True
    assert (axis.current_noise, axis.position_offset) == (0.0, 0)
    assert settings.servo_period < settings.sync_timeout
