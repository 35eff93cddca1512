"""The linear algebra library is held to one thread while a computation runs, and only then."""

import sys

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from identify.estimation.small_algebra import THREADS_BY_ENVIRONMENT, single_threaded


def threads() -> list[int]:
    """Threads of each linear algebra library that is loaded."""
    return [library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"]


def solve_and_count(scale: float, *, size: int) -> tuple[float, list[int]]:
    return float(np.linalg.solve(scale * np.eye(size), np.ones(size)).sum()), threads()


with_one_thread = single_threaded(solve_and_count)


def test_a_computation_has_one_thread_and_gives_back_what_it_found(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in THREADS_BY_ENVIRONMENT:
        monkeypatch.delenv(name, raising=False)
    with threadpool_limits(limits=2, user_api="blas"):
        before = threads()
        result, inside = with_one_thread(4.0, size=8)
        assert result == 2.0
        assert before
        assert set(inside) == {1}
        assert threads() == before


def test_a_failure_gives_the_threads_back_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(THREADS_BY_ENVIRONMENT[0], raising=False)
    with threadpool_limits(limits=2, user_api="blas"):
        before = threads()
        with pytest.raises(np.linalg.LinAlgError):
            with_one_thread(0.0, size=8)
        assert threads() == before


def test_a_process_that_was_started_with_one_thread_is_not_searched_for_libraries(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for name in THREADS_BY_ENVIRONMENT:
        monkeypatch.setenv(name, "1")
    monkeypatch.setitem(sys.modules, "threadpoolctl", None)  # an import of it fails now
    assert with_one_thread(1.0, size=2)[0] == 2.0
