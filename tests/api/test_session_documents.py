"""What may be asked of a payload that is typed, and what a check of the rig says."""

from dataclasses import asdict

import pytest
from pydantic import ValidationError

from api.service.session_documents import RigCheckView, TypedPayload
from daq.rig_check import CheckItem, RigCheck


def test_a_payload_of_the_rig_is_named_and_another_has_a_mass() -> None:
    assert TypedPayload(name="disk-3.5").model_dump(exclude_none=True) == {"name": "disk-3.5"}
    assert TypedPayload(name="beam", mass=2.0, com=(0.1, 0.0, -0.1)).mass == 2.0
    for beside in ({"com": (0.1, 0.0, 0.0)}, {"inertia": (0.0,) * 6}):
        with pytest.raises(ValidationError, match="mass: is missing"):
            TypedPayload.model_validate({"name": "beam", **beside})


@pytest.mark.parametrize(
    ("field", "within", "beyond"),
    [
        ("name", "x" * 64, "x" * 65),
        ("name", "a.b_c-d", "-a"),
        ("mass", 0.0, -1e-9),
        ("mass", 1e5, 1e5 + 1),
        ("mass", 1.0, float("inf")),
        ("com", (-100.0, 0.0, 100.0), (0.0, 0.0, 100.1)),
        ("com", (0.0, 0.0, 0.0), (-100.1, 0.0, 0.0)),
        ("inertia", (-1e6, 0, 0, 0, 0, 1e6), (0, 0, 0, 0, 0, 1.1e6)),
        ("inertia", (0, 0, 0, 0, 0, 0), (-1.1e6, 0, 0, 0, 0, 0)),
    ],
)
def test_a_payload_is_one_that_a_robot_can_carry(field: str, within: object, beyond: object) -> None:
    payload = {"name": "beam", "mass": 2.0}
    assert getattr(TypedPayload.model_validate(payload | {field: within}), field) == within
    with pytest.raises(ValidationError, match=field):
        TypedPayload.model_validate(payload | {field: beyond})


def test_a_check_is_read_with_what_it_advises() -> None:
    check = RigCheck(
        (CheckItem("node 3", True, "answers"), CheckItem("bus", True, "is half full", advice=True))
    )
    view = RigCheckView.model_validate(check)
    assert view.model_dump()["items"] == [asdict(item) for item in check.items]
    assert (view.ok, [item.advice for item in view.items]) == (True, [False, True])
