"""Sessions read from disk, kept while somebody looks at them."""

from collections import OrderedDict
from pathlib import Path
from threading import Lock

from identify.recording import Session, load_experiment

LARGEST_CACHE = 512 * 1024 * 1024
"""Bytes of samples kept; a session larger than that is read for every request."""


class SessionCache:
    """The sessions used last, by file and its time of change."""

    def __init__(self, limit: int = LARGEST_CACHE) -> None:
        self._limit = limit
        self._kept: OrderedDict[tuple[str, int, int], Session] = OrderedDict()
        self._lock = Lock()

    def read(self, experiment_folder: Path, place: int) -> Session:
        """The session at that place of the experiment, read now or kept. Raises InputError if it cannot
        be read.
        """
        experiment = load_experiment(experiment_folder)
        entry = experiment.sessions[place]
        settings = (experiment_folder / "experiment.yaml").stat().st_mtime_ns
        key = (str(entry.path), entry.path.stat().st_mtime_ns, settings)
        with self._lock:
            if key in self._kept:
                self._kept.move_to_end(key)
                return self._kept[key]
        session = experiment.read(entry)
        with self._lock:
            self._kept[key] = session
            while self._kept and sum(map(_size, self._kept.values())) > self._limit:
                self._kept.popitem(last=False)
        return session


def _size(session: Session) -> int:
    arrays = [session.time, session.position, session.command, session.external, session.temperature]
    return sum(array.nbytes for array in [*arrays, *session.extra.values()] if array is not None)
