"""Samples of the sessions that somebody looks at: read from disk once while they do."""

from pathlib import Path

from identify.recording import Session, load_experiment
from identify.recording.session_cache import SessionCache

LARGEST_IN_MEMORY = 512 << 20
"""Bytes of samples held for all viewers together."""


class SessionSamples:
    """The sessions used last, by file and by the times of change of the file and of its experiment's settings."""

    def __init__(self) -> None:
        self._held: SessionCache[tuple[str, int, int], Session] = SessionCache(LARGEST_IN_MEMORY)

    def read(self, experiment_folder: Path, place: int) -> Session:
        """The session at that place of the experiment, read now or held. Raises InputError if it cannot be read."""
        experiment = load_experiment(experiment_folder)
        entry = experiment.sessions[place]
        settings = (experiment_folder / "experiment.yaml").stat().st_mtime_ns
        key = (str(entry.path), entry.path.stat().st_mtime_ns, settings)
        return self._held.get(key, lambda: experiment.read(entry))
