"""What a session's own file says of it: when, by whom, on which rig, how long, how many samples were lost."""

import json
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from api.service.confined_reader import ConfinedReader
from api.service.folder_description import HDF5_ENDINGS
from api.service.job_process import Progress
from api.service.problems import Problem
from api.service.process_limits import LimitExceeded
from identify.recording.errors import InputError
from identify.recording.plain_text import printable
from identify.recording.session_hdf5 import COMMAND_CAME, POSITION_CAME, SYNC_TIME, VALID

NANOSECONDS = 1e9
LONGEST_TEXT = 100
"""Letters of a name."""
TAIL = 4096
"""Bytes at the end of a table in which its last row is looked for."""


@dataclass(frozen=True)
class SessionFacts:
    """Facts of one session; None where the file does not say.

    started : ISO 8601, UTC
    seconds : from the first sample to the last
    lost    : share of the drives' answers that did not come, 0 to 1
    """

    started: str | None = None
    operator: str | None = None
    rig: str | None = None
    plan: str | None = None
    seconds: float | None = None
    lost: float | None = None


MOST_HELD = 5000
"""Files whose facts are kept; each is a few hundred bytes."""
READ = "api.service.session_facts:read_facts"
NOTHING = SessionFacts()


class FileFacts:
    """Facts of files, read in a process of its own, for anybody may have made them; again once a file has changed."""

    def __init__(self, reader: ConfinedReader) -> None:
        self._reader = reader
        self._held: dict[tuple[str, int, int], SessionFacts] = {}

    def of(self, files: Sequence[Path]) -> list[SessionFacts]:
        """Of each file, in the same order; nothing of one that is not there, or cannot be read."""
        keys = [_key(file) for file in files]
        new = list(dict.fromkeys(key for key in keys if key is not None and key not in self._held))
        if new:
            if len(self._held) + len(new) > MOST_HELD:
                self._held.clear()
            with suppress(InputError, LimitExceeded, Problem):  # the catalogue stands without them
                facts = self._reader(READ, files=[name for name, _, _ in new])
                self._held.update(zip(new, facts, strict=True))
        return [NOTHING if key is None else self._held.get(key, NOTHING) for key in keys]


def _key(file: Path) -> tuple[str, int, int] | None:
    try:
        status = file.stat()
    except OSError:
        return None
    return str(file), status.st_mtime_ns, status.st_size


def read_facts(_progress: Progress, files: list[str]) -> list[SessionFacts]:
    """What each session's file says of itself; nothing where it cannot be read."""
    return [_facts(Path(file)) for file in files]


def _facts(file: Path) -> SessionFacts:
    try:
        return _of_recording(file) if file.suffix.lower() in HDF5_ENDINGS else _of_table(file)
    except (OSError, RuntimeError, KeyError, TypeError, ValueError, RecursionError):
        return NOTHING


def _of_recording(file: Path) -> SessionFacts:
    with h5py.File(file, "r", swmr=True, locking=False) as recording:
        attributes = recording.attrs
        stamps = recording.get(SYNC_TIME)
        seconds = lost = None
        if isinstance(stamps, h5py.Dataset) and len(stamps) > 1:
            seconds = float(stamps[-1] - stamps[0]) / NANOSECONDS
        valid = recording.get(VALID)
        if isinstance(valid, h5py.Dataset) and valid.size:
            both = POSITION_CAME | COMMAND_CAME
            lost = float(np.mean((valid[()] & both) != both))
        return SessionFacts(
            started=_text(attributes.get("started")),
            operator=_text(attributes.get("operator")),
            rig=_name_in(attributes.get("rig")),
            plan=_name_in(attributes.get("plan")),
            seconds=seconds,
            lost=lost,
        )


def _of_table(file: Path) -> SessionFacts:
    """The time between the first row and the last; a packed table is not unpacked for that."""
    if file.suffix.lower() != ".csv":
        return SessionFacts()
    with file.open("rb") as stream:
        place = [name.strip() for name in stream.readline().decode().split(",")].index("t")
        first = stream.readline()
        stream.seek(max(stream.tell(), file.stat().st_size - TAIL))
        last = stream.read().rstrip().rpartition(b"\n")[2] or first
    begin, end = (float(row.split(b",")[place]) for row in (first, last))
    return SessionFacts(seconds=end - begin)


def _text(value: Any) -> str | None:
    return printable(str(value)[:LONGEST_TEXT]) if value else None


def _name_in(document: Any) -> str | None:
    """`name` of a JSON object."""
    content = json.loads(str(document)) if document else None
    return _text(content.get("name")) if isinstance(content, dict) else None
