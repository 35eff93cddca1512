"""Work divided among forks: the same results, in order, whatever happens to a fork."""

import multiprocessing
import os
import signal
import threading

import numpy as np
import pytest

from identify.estimation.forked import each, forked


@pytest.fixture(autouse=True)
def alone(monkeypatch):
    """As in a command, which has one thread; the test runner's own is idle."""
    monkeypatch.setattr(threading, "active_count", lambda: 1)


@pytest.fixture
def forks(monkeypatch) -> list[int]:
    """The processes that are forked."""
    fork, known = os.fork, []

    def remembered():
        process = fork()
        known.append(process)
        return process

    monkeypatch.setattr(os, "fork", remembered)
    return known


def assert_gone(forks: list[int]) -> None:
    assert forks
    for process in forks:
        with pytest.raises(ChildProcessError):
            os.waitpid(process, os.WNOHANG)


class Known:
    """Something that is compared by being the same object."""


def in_every_process(processes: int, function):
    """The function, called once each of some processes has taken an item: none takes two before."""
    everyone = multiprocessing.get_context("fork").Barrier(processes)
    waited = []

    def called(item):
        if not waited:
            waited.append(item)
            everyone.wait(60)
        return function(item)

    return called


def test_each_item_is_answered_in_order_by_this_process_and_its_forks():
    with forked(3):
        found = each(in_every_process(3, lambda item: (item, os.getpid())), range(6))
    assert [item for item, _ in found] == list(range(6))
    processes = {process for _, process in found}
    assert len(processes) == 3
    assert os.getpid() in processes


def test_without_forks_everything_is_done_here():
    assert each(lambda item: os.getpid(), range(3)) == [os.getpid()] * 3
    with forked(2):
        assert each(lambda item: os.getpid(), [0]) == [os.getpid()]


def test_what_was_known_before_stays_the_same_object():
    known = [Known(), Known()]
    with forked(2):
        found = each(
            in_every_process(2, lambda item: (known[item], {"part": known[1 - item]})), range(2), known
        )
    for item in range(2):
        assert found[item][0] is known[item]
        assert found[item][1]["part"] is known[1 - item]


def test_answers_larger_than_a_pipe_arrive_whole():
    with forked(2):
        found = each(in_every_process(2, lambda item: np.full(1_000_000, item)), range(2))
    for item in range(2):
        np.testing.assert_array_equal(found[item], np.full(1_000_000, item))


def test_an_error_in_a_fork_is_raised_here_and_no_fork_is_left(forks):
    here = os.getpid()

    def wrong(item):
        if os.getpid() != here:
            raise ValueError("in a fork")

    with forked(2), pytest.raises(ValueError, match="in a fork"):
        each(in_every_process(2, wrong), range(2))
    assert_gone(forks)


def test_an_error_here_ends_the_forks(forks):
    here = os.getpid()

    def wrong(item):
        if os.getpid() == here:
            raise ValueError("here")
        signal.pause()

    with forked(2), pytest.raises(ValueError, match="here"):
        each(in_every_process(2, wrong), range(2))
    assert_gone(forks)


def test_what_a_killed_fork_had_is_computed_here(forks):
    here = os.getpid()

    def function(item):
        if os.getpid() != here:
            os.kill(os.getpid(), signal.SIGKILL)
        return item

    with forked(2):
        assert each(in_every_process(2, function), range(4)) == [0, 1, 2, 3]
    assert_gone(forks)


def test_a_process_with_other_threads_does_not_fork(monkeypatch):
    monkeypatch.setattr(threading, "active_count", lambda: 2)
    with forked(2):
        assert each(lambda item: os.getpid(), range(2)) == [os.getpid()] * 2
