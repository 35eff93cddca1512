"""What a request to import records may say: each bound, at it and a step beyond it."""

import math

import pytest
from pydantic import ValidationError

from api.service.record_documents import CanLogImport, CarriedPayload, Dialect, JointOfRecord, RecordImport

JOINT = {"position": "q", "command": "i"}
# model, what is needed, field, values that are taken, values that are refused
BOUNDS = [
    (Dialect, {}, "header_line", (0, 100_000), (-1, 100_001)),
    (Dialect, {}, "separator", ("x" * 10,), ("x" * 11,)),
    (Dialect, {}, "decimal", (".", ","), (";", "")),
    (JointOfRecord, JOINT, "name", ("j", "x" * 64), ("", "x" * 65, "a\nb")),
    (JointOfRecord, JOINT, "position", ("q" * 200,), ("", "q" * 201)),
    (JointOfRecord, JOINT, "position_unit", ("d" * 40,), ("d" * 41,)),
    (JointOfRecord, JOINT, "command_unit", ("A" * 40,), ("A" * 41,)),
    (JointOfRecord, JOINT, "resolution", (-1e12, 1e12), (-1.1e12, 1.1e12, math.nan, math.inf)),
    (JointOfRecord, JOINT, "gain", (-35.15, 0.0), (math.nan, -math.inf)),
    (JointOfRecord, JOINT, "type", ("revolute", "prismatic"), ("linear",)),
    (JointOfRecord, JOINT, "dh", ([0.0, 1.0, 2.0, 3.0],), ([0.0, 1.0, 2.0], [0.0] * 5, [math.nan] * 4)),
    (CarriedPayload, {}, "name", ("x" * 100,), ("", "x" * 101)),
    (CarriedPayload, {}, "mass", (0.0, 1e5), (-1e-9, 1.1e5, math.inf)),
    (CarriedPayload, {}, "com", ([1.0, 2.0, 3.0],), ([1.0, 2.0], [math.inf] * 3)),
    (CanLogImport, {"rig": "arm"}, "name", ("x" * 100,), ("", "x" * 101, "a/b", "a\\b")),
    (CanLogImport, {"rig": "arm"}, "role", ("identification", "validation"), ("excluded",)),
    (RecordImport, {"joints": [JOINT]}, "joints", ([JOINT], [JOINT] * 32), ([], [JOINT] * 33)),
    (RecordImport, {"joints": [JOINT]}, "name", ("x" * 100,), ("", "x" * 101, "a/b", "a\\b")),
    (RecordImport, {"joints": [JOINT]}, "keep", ([], ["a"] * 100), (["a"] * 101, [""])),
    (RecordImport, {"joints": [JOINT]}, "time_unit", ("s" * 20,), ("s" * 21,)),
    (RecordImport, {"joints": [JOINT]}, "rate", (1e-9, 1e9), (0.0, -1.0, 1.1e9, math.inf)),
    (RecordImport, {"joints": [JOINT]}, "payloads", ([{}],), ([],)),
    (RecordImport, {"joints": [JOINT]}, "repair", ("drop", "bridge"), ("guess",)),
    (RecordImport, {"joints": [JOINT]}, "tip", ("t" * 200,), ("t" * 201,)),
    (RecordImport, {"joints": [JOINT]}, "gravity", ([0.0, 0.0, -9.81],), ([0.0, 0.0],)),
]


@pytest.mark.parametrize(("model", "needed", "field", "taken", "refused"), BOUNDS)
def test_a_field_is_taken_at_its_bound_and_refused_beyond_it(model, needed, field, taken, refused):
    for value in taken:
        model.model_validate({**needed, field: value})
    for value in refused:
        with pytest.raises(ValidationError, match=field):
            model.model_validate({**needed, field: value})


@pytest.mark.parametrize(
    ("model", "needed"),
    [
        (JointOfRecord, JOINT),
        (CarriedPayload, {}),
        (CanLogImport, {"rig": "a"}),
        (RecordImport, {"joints": [JOINT]}),
    ],
)
def test_a_field_that_is_misspelt_is_refused_and_what_is_needed_is_named(model, needed):
    with pytest.raises(ValidationError, match="forbidden"):
        model.model_validate({**needed, "masss": 1.0})
    for field in needed:
        with pytest.raises(ValidationError, match=field):
            model.model_validate({name: value for name, value in needed.items() if name != field})


def test_what_nobody_says_is_an_arm_without_a_load_read_as_it_stands():
    said = RecordImport.model_validate({"joints": [JOINT]})
    (joint,), (payload,) = said.joints, said.payloads
    assert (joint.type, joint.dh, joint.gain, joint.resolution) == (
        "revolute",
        (0.0, 0.0, 0.0, 0.0),
        None,
        None,
    )
    assert (payload.name, payload.mass, payload.com) == ("none", 0.0, (0.0, 0.0, 0.0))
    assert (said.name, said.role, said.join, said.repair) == ("records", "identification", False, None)
    log = CanLogImport.model_validate({"rig": "arm"})
    assert (log.name, log.payload, log.role, log.begin, log.end) == (
        "records",
        "none",
        "identification",
        None,
        None,
    )
