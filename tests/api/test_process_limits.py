"""Limits of a process: what the kernel is told, in a process of its own since there is no way back."""

from __future__ import annotations

import multiprocessing
import os
import resource
import signal
from pathlib import Path

import pytest

from api.service.process_limits import (
    AFTER_SIGXCPU,
    GIBIBYTE,
    MEBIBYTE,
    ProcessLimits,
    ended_by,
    half_of_memory,
)

LIMITS = ProcessLimits(memory=3 * GIBIBYTE // 2, seconds=7.5, descriptors=200, written=5 * MEBIBYTE)
KINDS = ("RLIMIT_CPU", "RLIMIT_NOFILE", "RLIMIT_CORE", "RLIMIT_FSIZE", "RLIMIT_AS")


def applied(pipe, limits):
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    limits.apply()
    pipe.send(
        (
            pages * os.sysconf("SC_PAGE_SIZE"),
            {kind: resource.getrlimit(getattr(resource, kind)) for kind in KINDS},
        )
    )


def kernel_says(limits):
    """Bytes of address space that a process began with, and its limits then."""
    here, there = multiprocessing.Pipe()
    process = multiprocessing.get_context("fork").Process(target=applied, args=(there, limits))
    process.start()
    answer = here.recv()
    process.join()
    return answer


def test_the_kernel_holds_a_process_to_its_limits():
    began, limits = kernel_says(LIMITS)
    assert limits["RLIMIT_CPU"] == (8, 8 + AFTER_SIGXCPU)
    assert limits["RLIMIT_NOFILE"] == (200, 200)
    assert limits["RLIMIT_CORE"] == (0, 0)
    assert limits["RLIMIT_FSIZE"] == (5 * MEBIBYTE, 5 * MEBIBYTE)
    soft, hard = limits["RLIMIT_AS"]
    assert soft == hard
    assert soft == pytest.approx(began + 1.5 * GIBIBYTE, abs=16 * MEBIBYTE)


def test_files_are_as_long_as_the_disk_allows_where_nothing_is_said():
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    _, limits = kernel_says(ProcessLimits(memory=GIBIBYTE, seconds=1.0))
    assert limits["RLIMIT_FSIZE"] == before


def test_a_limit_that_is_lower_already_is_not_raised():
    hard = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    _, limits = kernel_says(ProcessLimits(memory=GIBIBYTE, seconds=1.0, descriptors=hard + 1))
    assert limits["RLIMIT_NOFILE"] == (hard, hard)


def test_what_ended_a_process_and_which_limit_it_was_is_said_in_words():
    assert ended_by(-signal.SIGKILL) == "the process was ended by SIGKILL"
    assert ended_by(-signal.SIGXCPU) == "the process was ended by SIGXCPU"
    assert ended_by(0) == "the process ended with status 0"
    assert ended_by(3) == "the process ended with status 3"
    assert LIMITS.memory_words == "it needs more than 1.5 GB of memory, which is the most it may have"
    assert LIMITS.time_words == "it was not done within 7.5 s, which is the most it may take"


def test_half_of_the_memory_is_what_the_kernel_says_of_it():
    total = next(
        int(line.split()[1])
        for line in Path("/proc/meminfo").read_text().splitlines()
        if line.startswith("MemTotal:")
    )
    assert half_of_memory(1 << 60) == pytest.approx(total * 1024 / 2, rel=0.02)
    assert half_of_memory(12345) == 12345
