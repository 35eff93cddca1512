"""Where the long computations of a command or of the service reduce their sessions."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Self

MOST_FORKS = 2
"""Processes in which a diagnosis goes side by side unless told otherwise. What it does not divide, each of them does."""


@dataclass(frozen=True)
class Computing:
    """Sessions are reduced one after the other in the computing process itself, unless said otherwise.

    workers : processes of this machine that a computation divides its sessions among
    cluster : address of a Dask scheduler, such as tcp://host:8786; its workers are used instead
    forks   : forks of this process, itself included, that a diagnosis divides its joints among. Not for a job of the
              service: it has other threads, and is counted and limited as one process
    """

    workers: int = 1
    cluster: str | None = None
    forks: int = 1

    @classmethod
    def of_diagnosis(cls, workers: int | None, cluster: str | None) -> Self:
        """As a command that diagnoses is told; told nothing, it uses a second core where there is one."""
        if workers is None and cluster is None:
            # elsewhere than on Linux a fork of a process that has loaded these libraries is not safe
            cores = len(os.sched_getaffinity(0)) if sys.platform == "linux" else 1
            return cls(forks=min(MOST_FORKS, cores))
        return cls(1 if workers is None else workers, cluster)

    @contextmanager
    def __call__(self) -> Iterator[None]:
        """What is computed inside this block is computed there.

        :raises InputError: both are given, or no scheduler with workers answers at that address.
        """
        if self.cluster is not None:
            if self.workers != 1:
                from identify.recording.errors import InputError

                raise InputError(
                    "--workers and --cluster: give one of them; a cluster has as many workers as it has"
                )
            from identify.estimation.dask_cluster import Dask
            from identify.estimation.executor import computed_by

            with Dask(self.cluster) as cluster, computed_by(cluster):
                yield
        elif self.workers > 1:
            from identify.estimation.executor import computed_by
            from identify.estimation.processes import Processes

            with Processes(self.workers) as processes, computed_by(processes):
                yield
        elif self.forks > 1:
            from identify.estimation.forked import forked

            with forked(self.forks):
                yield
        else:
            yield

    def check(self) -> None:
        """Find out before anybody waits for a result whether it can be computed there.

        :raises InputError: see `__call__`.
        """
        with self():
            if self.cluster is not None:
                from identify.estimation.executor import chosen_executor

                list(chosen_executor()(abs, [0]))
