"""Slows down guessing of passwords, and bounds the work that checking them is."""

import ipaddress
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from threading import BoundedSemaphore, Lock

from api.service.problems import Problem

FREE_ATTEMPTS = 5
"""Failures before the first wait: a person who mistypes is not held up."""
FREE_FROM_ANYWHERE = 10 * FREE_ATTEMPTS
"""Failures for one name from addresses where its owner never signed in, all together."""
FIRST_WAIT = 2.0
"""s; doubles with every further failure."""
LONGEST_WAIT = 15 * 60.0
"""s; at this rate a day of guessing is under a hundred attempts, and a locked-out person is back in a
break."""
FORGOTTEN_AFTER = 60 * 60.0
"""s without a failure after which a count starts anew."""
REMEMBERED = 10_000
"""Keys kept; the oldest go first, so that made-up names cannot fill the memory."""
CHECKED_TOGETHER = 2
"""Passwords checked at the same time: each takes 64 MiB and a core for a tenth of a second."""
WAITING_TOGETHER = 8
"""Further requests that wait for it; each has a thread of the service."""


@dataclass
class _Failures:
    count: int
    last: float


class SignInThrottle:
    """Counts failed attempts by user name with address, and by address alone.

    Both, because one address may try many names, and because a name alone would let anybody lock its owner out. Who has many
    addresses is counted by the name alone as well, but nobody waits for that where they have signed in before. An attempt
    counts as failed before its password is looked at, so that attempts at the same time are no cheaper than one after the
    other; the right password takes its count back.

    Weighed and turned down: `limits`, whose windows count requests; here the wait doubles with every failure, and a right
    password takes the count of its name back and leaves that of its address.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._failures: dict[tuple[str, str], _Failures] = {}
        self._at_home: dict[tuple[str, str], None] = {}
        self._lock = Lock()
        self._checked = BoundedSemaphore(CHECKED_TOGETHER)
        self._admitted = BoundedSemaphore(CHECKED_TOGETHER + WAITING_TOGETHER)

    @contextmanager
    def attempt(self, name: str, address: str) -> Iterator[None]:
        """The time in which a password is checked; `succeeded` says that it was right.

        Raises the problem 429 where the name or the address has to wait, and 503 where too many passwords are checked.
        """
        if not self._admitted.acquire(blocking=False):
            raise Problem(503, "Too many sign-ins at the same time. Try again.", {"Retry-After": "2"})
        try:
            wait = self._begin(name, network(address))
            if wait:
                raise Problem(429, f"Too many attempts. Try again in {wait} s.", {"Retry-After": str(wait)})
            with self._checked:
                yield
        finally:
            self._admitted.release()

    def succeeded(self, name: str, address: str) -> None:
        """Forget that name's failures here, and the other counts of this attempt; not the others', else one's own account would
        reset them."""
        address = network(address)
        with self._lock:
            self._failures.pop((name, address), None)
            for key, _free in self._counts(name, address)[1:]:
                if (failures := self._failures.get(key)) is not None:
                    failures.count -= 1
            self._at_home.pop((name, address), None)
            self._at_home[name, address] = None
            if len(self._at_home) > REMEMBERED:
                self._at_home.pop(next(iter(self._at_home)))

    def _counts(self, name: str, address: str) -> list[tuple[tuple[str, str], int]]:
        """What an attempt is counted by, each with the failures that are free."""
        counts = [((name, address), FREE_ATTEMPTS), (("", address), 4 * FREE_ATTEMPTS)]
        return counts if (name, address) in self._at_home else [*counts, ((name, ""), FREE_FROM_ANYWHERE)]

    def _begin(self, name: str, address: str) -> int:
        """Count an attempt as failed; or, uncounted, the whole seconds that it has to wait."""
        now = self._clock()
        with self._lock:
            counts = self._counts(name, address)
            wait = max(self._wait(key, free, now) for key, free in counts)
            if wait > 0:
                return math.ceil(wait)
            for key, _free in counts:
                failures = self._failures.pop(key, None)
                if failures is None or now - failures.last > FORGOTTEN_AFTER:
                    failures = _Failures(0, now)
                self._failures[key] = _Failures(failures.count + 1, now)
            while len(self._failures) > REMEMBERED:
                self._failures.pop(next(iter(self._failures)))
        return 0

    def _wait(self, key: tuple[str, str], free: int, now: float) -> float:
        failures = self._failures.get(key)
        if failures is None or failures.count < free or now - failures.last > FORGOTTEN_AFTER:
            return 0.0
        wait = min(FIRST_WAIT * 2.0 ** min(failures.count - free, 30), LONGEST_WAIT)
        return max(0.0, failures.last + wait - now)


def network(address: str) -> str:
    """By what an address is counted: IPv4 whole, of IPv6 the /64 within which one computer chooses as it likes."""
    try:
        known = ipaddress.ip_address(address)
    except ValueError:
        return address
    if isinstance(known, ipaddress.IPv4Address):
        return address
    if known.ipv4_mapped is not None:
        return str(known.ipv4_mapped)
    return str(ipaddress.ip_network((known, 64), strict=False))
