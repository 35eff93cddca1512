"""Which passwords are taken for a new account."""

import pytest

from api.service.new_password import check_new_password
from identify.recording.errors import InputError

LONG = "granite-violet-otter-"


@pytest.mark.parametrize("password", ["wD4#kq9Lm2", LONG * 47 + "7-qrs-8xyz-12"])
def test_a_password_of_ten_to_a_thousand_characters_that_is_not_guessed_is_taken(password):
    assert len(password) in (10, 1000)
    check_new_password("ada", password)


@pytest.mark.parametrize("password", ["wD4#kq9Lm", LONG * 47 + "7-qrs-8xyz-123"])
def test_one_character_less_or_more_is_refused_with_the_bounds(password):
    assert len(password) in (9, 1001)
    with pytest.raises(InputError, match="password: use 10 to 1000 characters"):
        check_new_password("ada", password)


@pytest.mark.parametrize(
    ("name", "password"),
    [
        ("ada", "1234567890"),
        ("ada", "password12"),
        ("charlemagne", "charlemagne1"),
        ("ada", "coulomb123"),
    ],
)
def test_what_is_guessed_first_is_refused_with_what_would_be_better(name, password):
    with pytest.raises(InputError, match=r"easily guessed \([a-z].*\); take three or four words"):
        check_new_password(name, password)
    if name in password:
        check_new_password("somebody else", f"{password} quartz 47 fjord")
