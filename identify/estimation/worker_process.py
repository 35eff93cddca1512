"""A worker of `Processes`: a process that calls the functions it is sent, and ends when nobody listens any more.

Started as `python -m identify.estimation.worker_process FD`, FD being its end of the connection.
"""

import os
import queue
import signal
import sys
import threading
from multiprocessing.connection import Connection
from typing import Any


def main(descriptor: int) -> None:
    """Receive (function, item), send (True, what it returned) or (False, what it raised)."""
    from threadpoolctl import threadpool_limits

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group; the parent ends us
    connection = Connection(descriptor)
    tasks: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    threading.Thread(target=_receive, args=(connection, tasks), daemon=True).start()
    import scipy.linalg  # noqa: F401  (loads its linear algebra, so that the limit below holds for it too)

    with threadpool_limits(limits=1, user_api="blas"):
        while True:
            answer = _call(tasks.get())
            try:
                connection.send(answer)
            except (TypeError, AttributeError, ValueError) as error:  # what cannot be pickled
                connection.send((False, RuntimeError(f"the result cannot be sent: {error}")))


def _receive(connection: Connection, tasks: "queue.SimpleQueue[bytes]") -> None:
    """Pass on what comes; end the process, whatever it computes, as soon as the parent is gone."""
    try:
        while True:
            tasks.put(connection.recv_bytes())
    except (EOFError, OSError):
        os._exit(0)


def _call(task: bytes) -> tuple[bool, Any]:
    import pickle
    import traceback

    try:
        function, item = pickle.loads(task)  # from our own parent, over a connection that nobody else has
        return True, function(item)
    except Exception as error:
        error.add_note(f"in a worker process:\n{traceback.format_exc()}")
        return False, error


if __name__ == "__main__":
    main(int(sys.argv[1]))
