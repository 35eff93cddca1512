"""The limit of open files, and descriptors that are held back for stops."""

import errno
import os
import resource

import pytest

from api import descriptors

INFINITY = resource.RLIM_INFINITY


@pytest.mark.parametrize(
    ("soft", "hard", "raised_to", "answer"),
    [
        (1024, 1_000_000, (8192, 1_000_000), 8192),
        (1024, 4096, (4096, 4096), 4096),
        (1024, INFINITY, (8192, INFINITY), 8192),
        (8192, 1_000_000, None, 8192),
        (20_000, 1_000_000, None, 20_000),
        (INFINITY, INFINITY, None, 8192),
    ],
)
def test_the_limit_is_raised_as_far_as_it_may_be_and_never_lowered(
    monkeypatch, soft, hard, raised_to, answer
):
    raised = []
    monkeypatch.setattr(resource, "getrlimit", lambda kind: (soft, hard))
    monkeypatch.setattr(resource, "setrlimit", lambda kind, limits: raised.append(limits))
    assert descriptors.raise_limit() == answer
    assert raised == ([] if raised_to is None else [raised_to])


def test_eight_are_held_back_given_up_one_by_one_and_taken_back():
    reserve = descriptors.Reserve()
    before = len(os.listdir("/proc/self/fd"))
    assert [reserve.give_up_one() for _ in range(9)] == [True] * 8 + [False]
    assert len(os.listdir("/proc/self/fd")) == before - 8
    reserve.refill()
    assert len(os.listdir("/proc/self/fd")) == before
    reserve.close()
    assert len(os.listdir("/proc/self/fd")) == before - 8


def test_where_there_are_none_to_hold_back_what_there_is_is_held(monkeypatch):
    opened, left = [], 3

    def scarce(*arguments: object) -> int:
        if len(opened) == left:
            raise OSError(errno.EMFILE, "too many open files")
        opened.append(real(*arguments))
        return opened[-1]

    real = os.open
    monkeypatch.setattr(os, "open", scarce)
    reserve = descriptors.Reserve()
    assert [reserve.give_up_one() for _ in range(4)] == [True] * 3 + [False]


def test_both_of_the_system_s_words_for_no_more_descriptors_are_known():
    assert {errno.EMFILE, errno.ENFILE} == descriptors.OUT_OF_DESCRIPTORS
