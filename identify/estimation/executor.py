"""Where sessions are reduced to factors: here, in other processes, or on a cluster.

Factors are merged exactly, so the place changes the time that it takes and nothing else.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import Any, Protocol, TypeVar

Item = TypeVar("Item")
Found = TypeVar("Found")


class Executor(Protocol):
    """Calls a function on every item and returns what it found, in the order of the items."""

    def __call__(self, function: Callable[[Item], Found], items: Sequence[Item], /) -> Iterable[Found]: ...


def SERIAL(function: Callable[[Item], Found], items: Sequence[Item], /) -> Iterable[Found]:
    """One after the other in this process: least memory, and quickest for records of a few minutes."""
    return [function(item) for item in items]


class Processes:
    """In processes of this machine; each reads and filters its own sessions.

    workers : how many; as many as there are processors if not said
    """

    def __init__(self, workers: int | None = None) -> None:
        self.workers = workers

    def __call__(self, function: Callable[[Item], Found], items: Sequence[Item], /) -> Iterable[Found]:
        import multiprocessing
        from concurrent.futures import ProcessPoolExecutor

        # spawn: a process that was forked from one with threads may hang
        context = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(self.workers, mp_context=context) as pool:
            return list(pool.map(function, items))


class Dask:
    """On a Dask cluster (extra `dask`).

    client : `distributed.Client`; the experiment's files must be reachable under the same path from every worker
    """

    def __init__(self, client: Any) -> None:
        self.client = client

    def __call__(self, function: Callable[[Item], Found], items: Sequence[Item], /) -> Iterable[Found]:
        return self.client.gather(self.client.map(function, list(items), pure=False))
