"""What a person types into a form is read as people type, and refused in one sentence."""

from __future__ import annotations

import re

import pytest

from api.pages.form_input import input_errors_as_problems, typed_horizons, typed_mass
from api.service.problems import Problem
from identify.recording.errors import InputError


@pytest.mark.parametrize(
    ("typed", "mass"), [("3.458", 3.458), (" 3,5 ", 3.5), ("0", 0.0), ("100000", 1e5), ("1e-3", 0.001)]
)
def test_a_mass_is_read_with_a_point_or_a_comma(typed, mass):
    assert typed_mass(typed) == mass


@pytest.mark.parametrize(
    ("typed", "said"),
    [
        ("3 kg", "“3 kg” is not a mass; enter it in kg, such as 3.458."),
        ("", "“” is not a mass; enter it in kg, such as 3.458."),
        ("-1", "−1 kg is not a possible mass; enter what the scale shows, from 0 to 100 000 kg."),
        ("100001", "100001 kg is not a possible mass; enter what the scale shows, from 0 to 100 000 kg."),
        ("nan", "nan kg is not a possible mass; enter what the scale shows, from 0 to 100 000 kg."),
    ],
)
def test_what_is_no_mass_is_refused_with_what_would_be_right(typed, said):
    with pytest.raises(Problem) as refused:
        typed_mass(typed)
    assert (refused.value.status, refused.value.detail) == (422, said)


@pytest.mark.parametrize(
    ("error", "sentence"),
    [
        ("the payload is not declared", "The payload is not declared."),
        ("session.csv: line 3 is cut off", "session.csv: line 3 is cut off."),
        ("arm: file.csv is missing", "Arm: file.csv is missing."),
    ],
)
def test_an_error_becomes_a_sentence_and_the_name_of_a_file_stays_as_it_is(error, sentence):
    with pytest.raises(Problem) as refused, input_errors_as_problems():
        raise InputError(error)
    assert (refused.value.status, refused.value.detail) == (422, sentence)


def test_other_errors_pass():
    with pytest.raises(KeyError), input_errors_as_problems():
        raise KeyError("x")


@pytest.mark.parametrize(
    ("typed", "horizons"), [("0.1, 1", (0.1, 1.0)), (" 2 ", (2.0,)), ("0.1;0.5 1e0,", (0.1, 0.5, 1.0))]
)
def test_times_ahead_are_read_as_people_type_them(typed, horizons):
    assert typed_horizons(typed) == horizons


@pytest.mark.parametrize(
    ("typed", "said"),
    [
        ("0,1", "“0” is not a time ahead; enter seconds above zero, with a decimal point, such as 0.1, 1."),
        ("soon", "“soon” is not a time ahead"),
        ("-1", "“-1” is not a time ahead"),
        ("inf", "“inf” is not a time ahead"),
        ("1 2 3 4 5 6 7 8 9", "These are 9 times ahead; enter at most 8."),
    ],
)
def test_what_is_no_time_ahead_is_refused_in_one_sentence(typed, said):
    with pytest.raises(Problem, match=re.escape(said)):
        typed_horizons(typed)
