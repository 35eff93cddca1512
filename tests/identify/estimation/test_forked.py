"""Work divided among forks: the same results, in order, whatever happens to a fork."""

import multiprocessing
import os
import signal
import threading
from contextlib import contextmanager

import numpy as np
import pytest

from identify.estimation.executor import computed_by
from identify.estimation.forked import dividing, each, forked, side_by_side


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


@contextmanager
def together(processes: int):
    """So many processes side by side. Gives what makes a function wait, when a process calls it first, until each of them has
    taken an item: none takes two before."""
    everyone = multiprocessing.get_context("fork").Barrier(processes)

    def in_every_process(function):
        waited = []

        def called(item):
            if not waited:
                waited.append(item)
                everyone.wait(60)
            return function(item)

        return called

    with forked(processes), side_by_side(processes):
        yield in_every_process


class Known:
    """Something that is compared by being the same object."""


def test_each_item_is_answered_in_order_by_this_process_and_its_forks():
    with together(3) as in_every_process:
        assert dividing() == 3
        found = each(in_every_process(lambda item: (item, os.getpid())), range(6))
    assert [item for item, _ in found] == list(range(6))
    processes = {process for _, process in found}
    assert len(processes) == 3
    assert os.getpid() in processes


def test_without_forks_everything_is_done_here():
    assert each(lambda item: os.getpid(), range(3)) == [os.getpid()] * 3
    with forked(2):
        assert each(lambda item: os.getpid(), range(3)) == [os.getpid()] * 3
        with side_by_side(2):
            assert each(lambda item: os.getpid(), [0]) == [os.getpid()]
    assert dividing() == 1


def test_what_has_one_part_is_done_in_one_process(forks):
    with forked(2), side_by_side(1):
        assert each(lambda item: os.getpid(), range(2)) == [os.getpid()] * 2
    assert not forks


def test_all_processes_know_what_each_of_them_found(forks):
    """What a fork was told comes back to where it can be looked at."""
    with together(3) as in_every_process:
        first = each(in_every_process(lambda item: 10 * item), range(5))
        told = each(in_every_process(lambda item: (os.getpid(), list(first))), range(3))
    assert {process for process, _ in told} == {os.getpid(), *forks}
    assert [found for _, found in told] == [[0, 10, 20, 30, 40]] * 3
    assert_gone(forks)


def test_what_is_kept_goes_to_the_process_that_had_it(forks):
    held: dict[int, int] = {}

    def count(item):
        held[item] = held.get(item, 0) + 1
        return os.getpid(), held[item]

    with together(2):
        first, second = (each(count, range(4), kept=True) for _ in range(2))
    assert [times for _, times in second] == [2] * 4
    assert [process for process, _ in first] == [process for process, _ in second]
    assert {process for process, _ in first} == {os.getpid(), *forks}


def test_what_is_divided_is_not_divided_again(forks):
    def again(item):
        with side_by_side(2):
            return os.getpid(), each(lambda _: os.getpid(), range(2))

    with together(2) as in_every_process:
        found = each(in_every_process(again), range(2))
    assert all(within == [process] * 2 for process, within in found)
    assert len(forks) == 1


def test_what_was_known_before_stays_the_same_object():
    known = [Known(), Known()]
    with together(2) as in_every_process:
        found = each(in_every_process(lambda item: (known[item], {"part": known[1 - item]})), range(2), known)
        # as a fork sees it
        same = each(
            in_every_process(lambda item: [found[i][0] is known[i] for i in range(2)]), range(2), known
        )
    for item in range(2):
        assert found[item][0] is known[item]
        assert found[item][1]["part"] is known[1 - item]
    assert same == [[True, True]] * 2


def test_answers_larger_than_a_pipe_arrive_whole():
    with together(2) as in_every_process:
        found = each(in_every_process(lambda item: np.full(1_000_000, item)), range(2))
        again = each(in_every_process(lambda item: found[1 - item] + 1), range(2))
    for item in range(2):
        np.testing.assert_array_equal(found[item], np.full(1_000_000, item))
        np.testing.assert_array_equal(again[item], np.full(1_000_000, 2 - item))


def test_an_error_in_a_fork_is_raised_here_and_no_fork_is_left(forks):
    here = os.getpid()

    def wrong(item):
        if os.getpid() != here:
            raise ValueError("in a fork")

    with together(2) as in_every_process:
        with pytest.raises(ValueError, match="in a fork"):
            each(in_every_process(wrong), range(2))
        assert_gone(forks)
        assert each(lambda item: os.getpid(), range(2)) == [here] * 2


def test_an_error_here_ends_the_forks(forks):
    here = os.getpid()

    def wrong(item):
        if os.getpid() == here:
            raise ValueError("here")
        signal.pause()

    with together(2) as in_every_process, pytest.raises(ValueError, match="here"):
        each(in_every_process(wrong), range(2))
    assert_gone(forks)


def test_an_error_beside_what_is_divided_ends_the_forks_too(forks):
    with pytest.raises(ValueError, match="beside"), together(2):
        raise ValueError("beside")
    assert_gone(forks)


def test_what_a_killed_fork_had_is_computed_here(forks):
    here = os.getpid()

    def function(item):
        if os.getpid() != here:
            os.kill(os.getpid(), signal.SIGKILL)
        return item

    with together(2) as in_every_process:
        assert each(in_every_process(function), range(4)) == [0, 1, 2, 3]
        assert dividing() == 1
        assert each(lambda item: item, range(4)) == [0, 1, 2, 3]
    assert_gone(forks)


def test_what_cannot_be_sent_is_computed_here(forks):
    """A function without a name."""
    with together(2) as in_every_process:
        found = each(in_every_process(lambda item: lambda: item), range(4))
    assert [function() for function in found] == [0, 1, 2, 3]
    assert_gone(forks)


def test_a_fork_that_comes_to_something_else_is_left_behind(forks):
    here = os.getpid()
    with together(2):
        count = 3 if os.getpid() == here else 2
        assert each(lambda item: (item, os.getpid()), range(count)) == [(item, here) for item in range(3)]
    assert_gone(forks)


def test_nobody_hears_of_a_fork(forks, capfd):
    with together(2):
        os.write(1, b"once")
        each(lambda item: item, range(2), kept=True)
    assert capfd.readouterr().out == "once"
    assert_gone(forks)


def test_a_process_with_other_threads_does_not_fork(monkeypatch):
    monkeypatch.setattr(threading, "active_count", lambda: 2)
    with together(2):
        assert each(lambda item: os.getpid(), range(2)) == [os.getpid()] * 2


def test_where_sessions_go_to_workers_nothing_is_forked(forks):
    with computed_by(lambda function, items: list(map(function, items))), together(2):
        assert each(lambda item: os.getpid(), range(2)) == [os.getpid()] * 2
    assert not forks
