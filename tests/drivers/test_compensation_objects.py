"""What a profile says of a drive's own compensation: raw values in the objects' types, and nothing that they cannot hold."""

import numpy as np
import pytest
from pydantic import ValidationError

from drivers.compensation_objects import CurrentRow, FrictionObjects, SpeedRow


def row(**changed):
    return CurrentRow.model_validate(
        {"index": 0x2021, "points": 2, "type": "int16", "scale": 0.001, "unit": "A", "source": "manual"}
        | changed
    )


def test_values_are_in_counts_and_those_that_do_not_fit_are_named_with_their_object():
    assert row().raw(np.array([0.0126, -1.5])) == (13, -1500)
    assert row(type="float32", scale=1.0).raw(np.array([0.1, 2.0]))[0] == float(np.float32(0.1))
    with pytest.raises(ValueError, match=r"0x2021:01 to 02: 40 does not fit int16"):
        row().raw(np.array([1.0, 40.0]))
    with pytest.raises(ValueError, match=r"0x2021:01: 3 is beyond the largest value, 2"):
        row(points=1, largest=2.0).raw(np.array([3.0]))


def test_a_row_of_which_no_number_is_stated_is_one_object_at_its_first_sub_index():
    stated = {"index": 0x2023, "type": "int16", "scale": 0.001, "unit": "A", "source": "manual"}
    one = CurrentRow.model_validate(stated)
    assert (one.points, one.subindex, one.largest) == (1, 1, None)
    with pytest.raises(ValueError, match="0x2023:01: 40 does not fit int16"):
        one.raw(np.array([40.0]))


def test_every_speed_has_its_current():
    speeds = {"index": 0x2020, "points": 3, "type": "int32", "scale": 0.01, "unit": "rpm", "source": "manual"}
    assert SpeedRow.model_validate(speeds).radians == pytest.approx(2.0 * np.pi / 60.0)
    with pytest.raises(ValidationError, match="has 2 points, the speeds 3"):
        FrictionObjects.model_validate({"speeds": speeds, "forward": row()})
