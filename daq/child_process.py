"""Processes of our own that outlive their parent, each with connections passed by file descriptor.

Not `multiprocessing.Process`: its children import the parent's main module again, are tied to the parent's exit,
and share its resource tracker. These get a session of their own, so that neither Ctrl-C nor a closed terminal
reaches them.
"""

import os
import subprocess
import sys
from multiprocessing.connection import Connection
from pathlib import Path

_ROOT = Path(__file__).parents[1]


def start_process(module: str, *connections: Connection) -> "subprocess.Popen[bytes]":
    """Run a module's `main` in a process of its own.

    connections : passed on as file descriptor numbers in the arguments; closed here, so that the other side
        notices when that process dies
    """
    descriptors = [connection.fileno() for connection in connections]
    path = os.pathsep.join(part for part in (str(_ROOT), os.environ.get("PYTHONPATH")) if part)
    try:
        return subprocess.Popen(
            # Not `-m module`: what it sends would then be pickled as the classes of a module `__main__`.
            [sys.executable, "-c", f"from {module} import main; main()", *map(str, descriptors)],
            pass_fds=descriptors,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            env={**os.environ, "PYTHONPATH": path},
            start_new_session=True,
        )
    finally:
        for connection in connections:
            connection.close()
