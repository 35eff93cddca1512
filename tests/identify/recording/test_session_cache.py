"""What is held of the sessions that were read: what was used last, within bounds."""

from __future__ import annotations

import pickle
from dataclasses import dataclass

from identify.recording.session_cache import MOST_SESSIONS, SessionCache


@dataclass(frozen=True)
class Block:
    name: str
    size: int

    def in_memory(self) -> int:
        return self.size


def asked(cache: SessionCache, log: list[str], name: str, size: int = 10) -> Block:
    def read() -> Block:
        log.append(name)
        return Block(name, size)

    return cache.get(name, read)


def test_what_is_held_is_not_read_again_and_what_was_used_longest_ago_goes_first():
    read, cache = [], SessionCache(largest=30)
    for name in ("a", "b", "c", "a"):
        assert asked(cache, read, name).name == name
    assert read == ["a", "b", "c"]
    asked(cache, read, "d")  # one too many: b was used longest ago
    for name in ("c", "a", "d"):
        asked(cache, read, name)
    assert read == ["a", "b", "c", "d"]
    asked(cache, read, "b")
    assert read == ["a", "b", "c", "d", "b"]


def test_the_newest_is_held_whatever_its_size():
    read, cache = [], SessionCache(largest=30)
    asked(cache, read, "small")
    asked(cache, read, "large", 31)
    asked(cache, read, "large")
    assert read == ["small", "large"]
    asked(cache, read, "small")
    assert read == ["small", "large", "small"]


def test_sessions_that_cost_no_memory_are_bounded_by_their_number():
    read, cache = [], SessionCache()
    for index in range(MOST_SESSIONS + 1):
        asked(cache, read, str(index), 0)
    asked(cache, read, "1", 0)
    assert len(read) == MOST_SESSIONS + 1
    asked(cache, read, "0", 0)
    assert read[-1] == "0"


def test_a_copy_sent_elsewhere_has_the_bound_and_nothing_held():
    read, cache = [], SessionCache(largest=15)
    asked(cache, read, "a")
    copy = pickle.loads(pickle.dumps(cache))
    for name in ("a", "b", "b", "a"):
        asked(copy, read, name)
    assert read == ["a", "a", "b", "a"]
