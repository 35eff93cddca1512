"""What people type into the form of an import: read, or refused in one sentence."""

import pytest

from api.pages.records_page import _checked, _number, _numbers
from api.service.problems import Problem
from api.service.record_documents import RecordImport


@pytest.mark.parametrize(
    ("typed", "numbers"),
    [
        ("0 0 -9.81", (0, 0, -9.81)),
        ("0 -9,81 0", (0, -9.81, 0)),
        ("0,0,-9.81", (0, 0, -9.81)),
        ("0; 0; -9,81", (0, 0, -9.81)),
        ("0, 0, -9.81", (0, 0, -9.81)),
    ],
)
def test_numbers_are_read_as_people_type_them(typed, numbers):
    assert _numbers(typed, 3, "Gravity") == numbers


@pytest.mark.parametrize("typed", ["0 0", "0 0 down", "1,2", ""])
def test_what_is_no_three_numbers_names_its_field(typed):
    with pytest.raises(Problem, match="Gravity") as refused:
        _numbers(typed, 3, "Gravity")
    assert refused.value.status == 422


def test_a_decimal_comma_is_a_decimal_sign():
    assert _number("35,15", "Gain") == 35.15
    with pytest.raises(Problem, match="Header line"):
        _number("1.5", "Header line", whole=True)


def test_what_a_form_may_not_hold_is_named_as_people_count():
    joint = {"position": "q", "command": ""}
    with pytest.raises(Problem) as refused:
        _checked({"joints": [{"position": "q", "command": "i"}, joint]}, RecordImport)
    assert refused.value.detail == "Joints 2 command: String should have at least 1 character."
