"""Results that are kept: the last ones, and made once."""

import threading

import pytest

from api.pages.lru_cache import LruCache


def test_what_weighs_too_much_together_is_given_up_the_oldest_first() -> None:
    cache: LruCache[str] = LruCache(10, len)
    for key in ("aaaa", "bbbb", "cc"):
        cache.get(key, lambda key=key: key)
    cache.get("aaaa", str)
    cache.get("dd", lambda: "dd")
    assert cache.get("aaaa", str) == "aaaa"
    assert cache.get("bbbb", str) == ""
    # one that is too heavy by itself is kept until the next
    assert cache.get("long", lambda: "x" * 30) == cache.get("long", str)


def test_who_asks_while_it_is_made_waits_for_that_and_makes_it_where_that_fails() -> None:
    cache: LruCache[int] = LruCache(4)
    begun, go_on = threading.Event(), threading.Event()
    results: list[int] = []

    def slow(end: int | None) -> int:
        begun.set()
        assert go_on.wait(30)
        if end is None:
            raise ValueError("no result")
        return end

    for end, expected in ((1, 1), (None, 2)):
        begun.clear()
        go_on.clear()
        key = f"key {end}"
        failures: list[Exception] = []

        def make(key: str = key, end: int | None = end, failures: list[Exception] = failures) -> None:
            try:
                cache.get(key, lambda: slow(end))
            except ValueError as error:
                failures.append(error)

        first = threading.Thread(target=make)
        first.start()
        assert begun.wait(30)
        second = threading.Thread(target=lambda key=key: results.append(cache.get(key, lambda: 2)))
        second.start()
        go_on.set()
        first.join()
        second.join()
        assert results.pop() == expected
        assert len(failures) == (end is None)


def test_a_failure_is_not_kept() -> None:
    cache: LruCache[int] = LruCache(4)
    with pytest.raises(ZeroDivisionError):
        cache.get("key", lambda: 1 // 0)
    assert cache.get("key", lambda: 3) == 3
