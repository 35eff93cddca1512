"""One service on a data folder: a second one would take jobs of the first for lost, and its stop's socket."""

from __future__ import annotations

import contextlib
import fcntl
import os
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path

from identify.recording.errors import InputError
from identify.recording.plain_text import printable

SERVED = "service.lock"
"""Name in the data folder of the file that a service holds locked, and that says which one it is. It stays when the service ends:
the lock counts, which the system takes back however a process ends."""
LONGEST = 300
"""Bytes of it that are read."""


@contextmanager
def served_alone(folder: Path) -> Generator[Callable[[str], None]]:
    """Nobody else serves the folder meanwhile; what is given says at which address it is served, for who is turned away.

    A file system without locks, or a folder that cannot be written, turns nobody away.

    Raises InputError: another service has the folder, and which one.
    """
    with contextlib.ExitStack() as held:
        file: int | None = None
        with contextlib.suppress(OSError):
            folder.mkdir(parents=True, exist_ok=True)
            file = os.open(folder / SERVED, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o600)
            held.callback(os.close, file)
        if file is not None:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                whose = printable(os.pread(file, LONGEST, 0).decode("utf-8", "replace")).strip()
                raise InputError(
                    f"data folder {folder}: another service{f' ({whose})' if whose else ''} serves it; end that one,"
                    " or give another folder by --data"
                ) from None
            except OSError:
                file = None

        def say(address: str) -> None:
            if file is not None:
                with contextlib.suppress(OSError):  # a full disk: only the words are missing
                    os.ftruncate(file, 0)
                    os.pwrite(file, f"process {os.getpid()}, {address}".encode()[:LONGEST], 0)

        say("starting")
        yield say
