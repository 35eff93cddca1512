"""Sessions that were read and may be asked for again."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable
from typing import Generic, Protocol, TypeVar


class Held(Protocol):
    """What can be held: it knows what it costs."""

    def in_memory(self) -> int:
        """Bytes in memory."""
        ...


Key = TypeVar("Key")
Value = TypeVar("Value", bound=Held)

LARGEST_IN_MEMORY = 256 << 20
"""Bytes of samples held in memory by one experiment."""
MOST_SESSIONS = 64
"""Sessions held; those mapped from temporary files cost disk."""


class SessionCache(Generic[Key, Value]):
    """Holds what was used last, within bounds. Safe to use from several threads; a copy sent elsewhere
    starts empty.

    largest : bytes in memory of all that is held; the newest is held whatever its size
    """

    def __init__(self, largest: int = LARGEST_IN_MEMORY) -> None:
        self._largest = largest
        self._held: OrderedDict[Key, Value] = OrderedDict()
        self._lock = threading.Lock()

    def get(self, key: Key, read: Callable[[], Value]) -> Value:
        """The value held for a key, or what `read` gives for it."""
        with self._lock:
            if key in self._held:
                self._held.move_to_end(key)
                return self._held[key]
        value = read()
        with self._lock:
            self._held[key] = value
            while len(self._held) > 1 and (
                len(self._held) > MOST_SESSIONS
                or sum(held.in_memory() for held in self._held.values()) > self._largest
            ):
                self._held.popitem(last=False)
        return value

    def __reduce__(self) -> tuple[type[SessionCache[Key, Value]], tuple[int]]:
        return SessionCache, (self._largest,)
