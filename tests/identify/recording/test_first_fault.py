"""What pydantic finds wrong is said in one line: where, and what."""

import pytest
from pydantic import BaseModel, ValidationError, field_validator

from identify.recording.first_fault import first_fault


class Axis(BaseModel):
    gain: float

    @field_validator("gain")
    @classmethod
    def _not_zero(cls, gain: float) -> float:
        if gain == 0:
            raise ValueError("is 0, so no torque would be measured")
        return gain


class Rig(BaseModel):
    axes: list[Axis]


def fault_of(text: str, *above: str) -> str:
    with pytest.raises(ValidationError) as refused:
        Rig.model_validate_json(text)
    return first_fault(refused.value, *above)


def test_the_field_is_named_by_its_path():
    assert fault_of('{"axes": [{"gain": 1}, {}]}') == "axes.1.gain: Field required"
    assert fault_of('{"axes": [{}]}', "rig") == "rig.axes.0.gain: Field required"


def test_our_own_words_stand_as_they_were_written():
    assert fault_of('{"axes": [{"gain": 0}]}') == "axes.0.gain: is 0, so no torque would be measured"


def test_a_text_that_is_no_json_has_no_field():
    assert fault_of("{").startswith("Invalid JSON: ")
