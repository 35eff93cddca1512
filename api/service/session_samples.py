"""Samples of the sessions that somebody looks at: read once while they do, in a process of its own, and mapped from the
files that it leaves."""

import tempfile
from dataclasses import fields, replace
from pathlib import Path

import numpy as np

from api.service.confined_reader import ConfinedReader
from api.service.job_process import Progress
from api.service.problems import Problem
from api.service.process_limits import LimitExceeded
from identify.recording import Session, load_experiment
from identify.recording.session_cache import SessionCache

READ = "api.service.session_samples:read_session"
MOST_FURTHER = 200
"""Further columns that are kept; each is a mapped file of its own."""
NOTHING = np.zeros(0)
"""Stands in a session sent between processes for samples that are in a file."""


class SessionSamples:
    """The sessions used last, by file and by the times of change of the file and of its experiment's settings.

    folder : where the samples of sessions that are looked at lie; the files have no names, and go with the last viewer
    """

    def __init__(self, folder: Path, reader: ConfinedReader) -> None:
        self._folder = folder
        self._reader = reader
        self._held: SessionCache[tuple[str, int, int], Session] = SessionCache()

    def read(self, experiment_folder: Path, file: str) -> Session:
        """The session in that file, which the experiment lists, read now or held.

        Raises InputError if it cannot be read, and the problem 413 where that takes more memory or time than there is.
        """
        changed = (experiment_folder / file).stat().st_mtime_ns
        settings = (experiment_folder / "experiment.yaml").stat().st_mtime_ns
        key = (str(experiment_folder / file), changed, settings)
        return self._held.get(key, lambda: self._mapped(experiment_folder, file))

    def _mapped(self, experiment_folder: Path, file: str) -> Session:
        self._folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=self._folder) as output:
            try:
                session: Session = self._reader(
                    READ, experiment=str(experiment_folder), file=file, output=output
                )
            except LimitExceeded as error:
                raise Problem(413, f"The recording cannot be shown here: {error}.") from error
            samples = {saved.stem: np.load(saved, mmap_mode="r") for saved in Path(output).glob("*.npy")}
        further = {name: samples.pop(_further(place)) for place, name in enumerate(session.extra)}
        return replace(session, **samples, extra=further)


def read_session(progress: Progress, experiment: str, file: str, output: str) -> Session:
    """Read a session in a process of its own; its samples are left in `output`, one .npy each, and so are further columns
    that hold numbers."""
    loaded = load_experiment(Path(experiment))
    session = loaded.read(next(entry for entry in (*loaded.sessions, *loaded.excluded) if entry.file == file))
    columns = {
        field.name: value
        for field in fields(session)
        if isinstance(value := getattr(session, field.name), np.ndarray)
    }
    numeric = [(name, values) for name, values in session.extra.items() if values.dtype.kind in "fiu"]
    further = dict(numeric[:MOST_FURTHER])
    columns_of_files = columns | {_further(place): values for place, values in enumerate(further.values())}
    for name, values in columns_of_files.items():
        np.save(Path(output) / f"{name}.npy", values)
    return replace(session, extra=dict.fromkeys(further, NOTHING), **dict.fromkeys(columns, NOTHING))


def _further(place: int) -> str:
    """Name of the file of a further column: the column's own may be any text."""
    return f"further-{place}"
