"""Which passwords are taken: long enough, and not among those that are guessed first (zxcvbn)."""

from identify.recording.errors import InputError

SHORTEST_PASSWORD = 10
"""Characters; below, guessing is quick even when throttled."""
LONGEST_PASSWORD = 1000
"""Characters; bounds the work of one sign-in attempt."""
LEAST_SCORE = 2
"""zxcvbn's: a million guesses are not enough. The throttle of sign-ins lets an address make less than a hundred a day."""
JUDGED = 72
"""Characters that are judged: zxcvbn takes long for long texts, and so many are enough."""


def check_new_password(name: str, password: str) -> None:
    """Raises InputError, with what would be better, for a password of `name` that is too short or easily guessed."""
    if not SHORTEST_PASSWORD <= len(password) <= LONGEST_PASSWORD:
        raise InputError(f"password: use {SHORTEST_PASSWORD} to {LONGEST_PASSWORD} characters")
    from zxcvbn import zxcvbn

    judged = zxcvbn(password[:JUDGED], user_inputs=[name, "coulomb"])
    if judged["score"] >= LEAST_SCORE:
        return
    reason = judged["feedback"]["warning"].rstrip(".") or "it is one of the first that would be guessed"
    raise InputError(
        f"password: easily guessed ({reason[0].lower()}{reason[1:]}); take three or four words that do not belong together"
    )
