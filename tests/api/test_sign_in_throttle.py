"""Guessing is slowed, by name and by address, and nobody is locked out by another."""

from hypothesis import given
from hypothesis import strategies as st

from api.service.problems import Problem
from api.service.sign_in_throttle import (
    FREE_ATTEMPTS,
    FREE_FROM_ANYWHERE,
    LONGEST_WAIT,
    REMEMBERED,
    SignInThrottle,
)


class _Clock:
    now = 0.0

    def __call__(self):
        return self.now


def seconds_to_wait(throttle, name, address):
    """Make an attempt with a wrong password; 0 if its password was looked at."""
    try:
        with throttle.attempt(name, address):
            return 0
    except Problem as problem:
        return int(problem.headers["Retry-After"])


@given(attempts=st.integers(1, 60))
def test_the_wait_doubles_up_to_its_longest_and_a_day_holds_few_guesses(attempts):
    clock = _Clock()
    throttle = SignInThrottle(clock)
    waits = []
    for _ in range(attempts):
        wait = seconds_to_wait(throttle, "ada", "192.0.2.1")
        waits.append(wait)
        clock.now += wait
        if wait:
            assert seconds_to_wait(throttle, "ada", "192.0.2.1") == 0
    assert waits == [
        min(2 ** max(0, n - FREE_ATTEMPTS + 1), LONGEST_WAIT) * (n >= FREE_ATTEMPTS) for n in range(attempts)
    ]


def test_guessing_from_one_address_does_not_lock_out_the_owner_at_another():
    throttle = SignInThrottle(_Clock())
    for _ in range(50):
        seconds_to_wait(throttle, "ada", "192.0.2.1")
    assert seconds_to_wait(throttle, "ada", "192.0.2.1") > 0
    assert seconds_to_wait(throttle, "ada", "192.0.2.2") == 0


def test_trying_many_names_from_one_address_is_slowed_down():
    throttle = SignInThrottle(_Clock())
    for number in range(4 * FREE_ATTEMPTS):
        assert seconds_to_wait(throttle, f"user{number}", "192.0.2.1") == 0
    assert seconds_to_wait(throttle, "another", "192.0.2.1") > 0


def test_made_up_names_do_not_fill_the_memory():
    throttle = SignInThrottle(_Clock())
    for number in range(REMEMBERED):
        seconds_to_wait(throttle, f"user{number}", f"192.0.2.{number}")
    assert len(throttle._failures) <= REMEMBERED


def test_addresses_that_one_computer_chooses_among_count_as_one():
    throttle = SignInThrottle(_Clock())
    for number in range(4 * FREE_ATTEMPTS):
        seconds_to_wait(throttle, f"user{number}", f"2001:db8::{number:x}")
    assert seconds_to_wait(throttle, "another", "2001:db8::ffff") > 0
    assert seconds_to_wait(throttle, "another", "2001:db8:0:1::1") == 0


def test_who_has_many_addresses_guesses_no_more_and_keeps_nobody_from_where_they_have_signed_in_before():
    throttle = SignInThrottle(_Clock())
    assert seconds_to_wait(throttle, "ada", "192.0.2.1") == 0
    throttle.succeeded("ada", "192.0.2.1")
    looked_at = [seconds_to_wait(throttle, "ada", f"2001:db8:0:{number:x}::1") == 0 for number in range(500)]
    assert sum(looked_at) == FREE_FROM_ANYWHERE
    assert seconds_to_wait(throttle, "ada", "192.0.2.1") == 0
    assert seconds_to_wait(throttle, "grace", "2001:db8:1:1::1") == 0
