"""Slows down guessing of passwords."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from threading import Lock

FREE_ATTEMPTS = 5
"""Failures before the first wait: a person who mistypes is not held up."""
FIRST_WAIT = 2.0
"""s; doubles with every further failure."""
LONGEST_WAIT = 15 * 60.0
"""s; at this rate a day of guessing is under a hundred attempts, and a locked-out person is back in a
break."""
FORGOTTEN_AFTER = 60 * 60.0
"""s without a failure after which a count starts anew."""
REMEMBERED = 10_000
"""Keys kept; the oldest go first, so that made-up names cannot fill the memory."""


@dataclass
class _Failures:
    count: int
    last: float


class SignInThrottle:
    """Counts failed attempts by user name with address, and by address alone.

    Both, because one address may try many names, and because a name alone would let anybody lock its owner
    out.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._failures: dict[tuple[str, str], _Failures] = {}
        self._lock = Lock()

    def seconds_to_wait(self, name: str, address: str) -> int:
        """0 if an attempt may be made now, else the whole seconds until then."""
        with self._lock:
            waits = [
                self._wait((name, address), FREE_ATTEMPTS),
                self._wait(("", address), 4 * FREE_ATTEMPTS),
            ]
        return math.ceil(max(waits))

    def failed(self, name: str, address: str) -> None:
        """Count a wrong password."""
        now = self._clock()
        with self._lock:
            for key in ((name, address), ("", address)):
                failures = self._failures.pop(key, None)
                if failures is None or now - failures.last > FORGOTTEN_AFTER:
                    failures = _Failures(0, now)
                self._failures[key] = _Failures(failures.count + 1, now)
            while len(self._failures) > REMEMBERED:
                self._failures.pop(next(iter(self._failures)))

    def succeeded(self, name: str, address: str) -> None:
        """Forget that name's failures; the address keeps its count, else one's own account would reset it."""
        with self._lock:
            self._failures.pop((name, address), None)

    def _wait(self, key: tuple[str, str], free: int) -> float:
        failures = self._failures.get(key)
        if failures is None or failures.count < free:
            return 0.0
        wait = min(FIRST_WAIT * 2.0 ** min(failures.count - free, 30), LONGEST_WAIT)
        return max(0.0, failures.last + wait - self._clock())
