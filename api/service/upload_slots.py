"""How many uploads are taken in at the same time: each is kept on the disk while it comes."""

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager

from api.service.problems import Problem

MOST_OF_A_USER, MOST = 2, 6


class UploadSlots:
    """Counts uploads from before their first byte until they are answered; used in the event loop alone."""

    def __init__(self) -> None:
        self._of_user: Counter[str] = Counter()

    @contextmanager
    def taken(self, user: str) -> Iterator[None]:
        """An upload of that user. Raises the problem 429 where the user, or all together, have as many as they may."""
        if self._of_user[user] >= MOST_OF_A_USER or self._of_user.total() >= MOST:
            raise Problem(
                429,
                "Other uploads are in progress; send this one when they are done.",
                {"Retry-After": "10"},
            )
        self._of_user[user] += 1
        try:
            yield
        finally:
            self._of_user[user] -= 1
            self._of_user += Counter()  # forgets who has none
