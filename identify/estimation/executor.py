"""Where sessions are reduced to factors: here, in other processes, or on a cluster.

Factors are merged exactly, so the place changes the time that it takes and nothing else. A place is chosen for
a stretch of code, as joblib and Dask do it, so that whatever is computed there (a fit, a diagnosis, its lazily
computed figures) goes over the samples at that place:

    with computed_by(Processes(2)):
        identify.diagnose(experiment)
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Protocol, TypeVar

Item = TypeVar("Item")
Found = TypeVar("Found")


class Executor(Protocol):
    """Calls a function on every item and returns what it found, in the order of the items."""

    def __call__(self, function: Callable[[Item], Found], items: Sequence[Item], /) -> Iterable[Found]: ...


class WorkerLost(RuntimeError):
    """Workers ended again and again at the same item, or none is left."""


def SERIAL(function: Callable[[Item], Found], items: Sequence[Item], /) -> Iterable[Found]:
    """One after the other in this process: least memory, and quickest for records of a few minutes."""
    return map(function, items)


_chosen: ContextVar[Executor] = ContextVar("executor", default=SERIAL)


def chosen_executor() -> Executor:
    """The executor of the innermost `computed_by` around the caller in this thread; without one `SERIAL`."""
    return _chosen.get()


@contextmanager
def computed_by(executor: Executor) -> Iterator[None]:
    """Passes over the samples inside this block are made by an executor."""
    token = _chosen.set(executor)
    try:
        yield
    finally:
        _chosen.reset(token)
