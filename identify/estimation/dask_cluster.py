"""An executor that reduces sessions on a Dask cluster (extra `dask`)."""

import time
from collections.abc import Callable, Iterable, Sequence
from types import TracebackType
from typing import Any, Self

from identify.estimation.executor import Found, Item, WorkerLost
from identify.estimation.small_algebra import single_threaded
from identify.recording.errors import InputError

CONNECTING = 10.0
"""s that a scheduler has to answer; one on the same network answers within a tenth of it"""
WITHOUT_WORKERS = 60.0
"""s that a cluster whose workers are all gone has to get others; a nanny starts one again within 5 s"""
LOOK = 1.0
"""s between looks at whether there are workers, while none has an answer"""


class Dask:
    """On the workers of a Dask cluster; the connection is made when first asked.

    cluster : address of a scheduler, such as `tcp://host:8786`, or a `distributed.Client`

    The experiment's files must be reachable under the same path from every worker, and the workers have this
    version of the program. An item goes to the worker that has held it before while that one is there. What was under
    way on a worker that is lost is computed anew by another; that is the scheduler's doing.
    """

    def __init__(self, cluster: Any) -> None:
        self.cluster = cluster
        self._client: Any = None if isinstance(cluster, str) else cluster

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._client is not None and self._client is not self.cluster:
            self._client.close()
            self._client = None

    @property
    def client(self) -> Any:
        """The connected client.

        :raises InputError: the extra is not installed, the address is wrong, or no worker answers there.
        """
        if self._client is None:
            self._client = _connected(self.cluster)
        return self._client

    def __call__(self, function: Callable[[Item], Found], items: Sequence[Item], /) -> Iterable[Found]:
        """What the function finds on each item, in order, each as soon as it and those before it are there.

        :raises InputError: see `client`.
        :raises WorkerLost: several workers in a row ended at the same item, or none is left.
        """
        client, here = self.client, self._workers()
        futures = [
            client.submit(
                _call,
                function,
                item,
                pure=False,
                workers=[here[index % len(here)]] if here else None,
                allow_other_workers=bool(here),  # without workers to choose from it is an error to say so
            )
            for index, item in enumerate(items)
        ]
        try:
            for future, item in zip(futures, items, strict=True):
                yield self._result(future, item)
        finally:
            client.cancel(futures)

    def _workers(self) -> list[str]:
        return sorted(self.client.scheduler_info(n_workers=-1)["workers"])

    def _result(self, future: Any, item: Any) -> Any:
        from distributed import KilledWorker

        alone_since: float | None = None
        try:
            while True:
                try:
                    return future.result(timeout=LOOK)
                except TimeoutError:
                    if future.done():  # just now, or this is the function's own
                        return future.result()
                if self._workers():
                    alone_since = None
                elif alone_since is None:
                    alone_since = time.monotonic()
                elif time.monotonic() - alone_since > WITHOUT_WORKERS:
                    raise WorkerLost(f"the cluster has had no worker for {WITHOUT_WORKERS:g} s")
        except KilledWorker as error:
            raise WorkerLost(
                f"the cluster's workers ended repeatedly at {item}; are they short of memory? ({error})"
            ) from None


@single_threaded
def _call(function: Callable[[Item], Found], item: Item) -> Found:
    return function(item)


def _connected(address: str) -> Any:
    try:
        import distributed
    except ImportError:
        raise InputError("--cluster: needs the extra 'dask': pip install 'coulomb[dask]'") from None
    import logging

    # a refusal is told in one line by us, not by its traceback in the log
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    expected = "expected the address of a Dask scheduler, such as tcp://host:8786"
    try:
        client = distributed.Client(address, timeout=CONNECTING, set_as_default=False)
    except (OSError, TimeoutError):
        raise InputError(f"--cluster {address}: no scheduler answers there; {expected}") from None
    except (ValueError, TypeError, RuntimeError) as error:
        raise InputError(f"--cluster {address}: {error}; {expected}") from None
    if not client.scheduler_info(n_workers=-1)["workers"]:
        client.close()
        raise InputError(
            f"--cluster {address}: the scheduler has no worker; start one with `dask worker {address}`"
        )
    return client
