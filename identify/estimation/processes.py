"""An executor that reduces sessions in processes of this machine."""

import os
import pickle
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Future
from multiprocessing import Pipe
from types import TracebackType
from typing import Any, Self

from identify.estimation.executor import Found, Item, WorkerLost

MOST_ATTEMPTS = 3
"""Processes that may end at the same item before it is given up: a machine that is short of memory kills one
now and then, an item that kills every process is at fault itself."""


class Processes:
    """Reduces sessions in `workers` processes, which each read and filter their own.

    The processes start when first asked and stay, with the motion that they hold, until the end of the `with`
    block, or until this process ends. An item goes to the process that had it before, unless another has
    nothing to do. What was under way in a process that is killed is computed anew by another.

    Not `multiprocessing`: its children import the caller's main module again, and a job of the service may
    have none.
    """

    def __init__(self, workers: int) -> None:
        self.workers = workers
        self._processes: list[_Worker | None] = [None] * workers
        self._places: dict[Any, int] = {}
        self._turn = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the processes; they start again if asked."""
        for number, worker in enumerate(self._processes):
            if worker is not None:
                worker.end()
                self._processes[number] = None

    def __call__(self, function: Callable[[Item], Found], items: Sequence[Item], /) -> Iterable[Found]:
        """What the function finds on each item, in order, each as soon as it and those before it are there.

        :raises WorkerLost: three processes in a row ended at the same item.
        """
        turns = _Turns([self._place(item) for item in items], self.workers)
        futures: list[Future[Found]] = [Future() for _ in items]

        def serve(number: int) -> None:
            attempts = 0
            index = turns.take(number)
            while index is not None:
                try:
                    futures[index].set_result(self._worker(number).call(function, items[index]))
                except _Ended:
                    self._processes[number] = None
                    attempts += 1
                    if attempts < MOST_ATTEMPTS:
                        continue
                    futures[index].set_exception(
                        WorkerLost(
                            f"{MOST_ATTEMPTS} processes ended at {items[index]}; is the memory too small?"
                        )
                    )
                except BaseException as error:
                    futures[index].set_exception(error)
                attempts = 0
                index = turns.take(number)

        threads = [threading.Thread(target=serve, args=(n,), daemon=True) for n in range(self.workers)]
        for thread in threads:
            thread.start()
        try:
            for future in futures:
                yield future.result()
        finally:
            turns.end()
            if not all(future.done() for future in futures):  # given up in between
                self.close()
            for thread in threads:
                thread.join()

    def _place(self, item: Any) -> int:
        """The worker of an item, by turns as they come up; what has no hash is not remembered."""
        try:
            return self._places.setdefault(item, len(self._places) % self.workers)
        except TypeError:
            self._turn += 1
            return self._turn % self.workers

    def _worker(self, number: int) -> "_Worker":
        worker = self._processes[number]
        if worker is None:
            worker = self._processes[number] = _Worker()
        return worker


class _Turns:
    """Which worker takes which item: its own first, then the last of who has most left."""

    def __init__(self, places: Sequence[int], workers: int) -> None:
        self._waiting = [deque(i for i, place in enumerate(places) if place == n) for n in range(workers)]
        self._lock = threading.Lock()

    def take(self, worker: int) -> int | None:
        with self._lock:
            if self._waiting[worker]:
                return self._waiting[worker].popleft()
            longest = max(self._waiting, key=len)
            return longest.pop() if longest else None

    def end(self) -> None:
        with self._lock:
            for turn in self._waiting:
                turn.clear()


class _Ended(Exception):
    """The process ended before it answered."""


class _Worker:
    """One process and our end of the connection to it."""

    def __init__(self) -> None:
        self._connection, theirs = Pipe()
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
        environment.setdefault("OPENBLAS_NUM_THREADS", "1")
        command = [sys.executable, "-m", "identify.estimation.worker_process", str(theirs.fileno())]
        self.process = subprocess.Popen(
            command,
            pass_fds=[theirs.fileno()],
            stdin=subprocess.DEVNULL,
            stdout=sys.stderr.fileno(),
            env=environment,
        )
        theirs.close()

    def call(self, function: Callable[[Item], Found], item: Item) -> Found:
        """What the function finds, or raises, in the process.

        :raises _Ended: the process ended.
        """
        task = pickle.dumps((function, item), protocol=pickle.HIGHEST_PROTOCOL)
        try:
            self._connection.send_bytes(task)
            good, answer = self._connection.recv()
        except (EOFError, OSError):
            self.end()
            raise _Ended from None
        if good:
            return answer
        raise answer

    def end(self) -> None:
        """End the process, whatever it computes."""
        self.process.kill()
        self.process.wait()
        self._connection.close()
