"""An experiment: a robot, its payloads and its recorded sessions."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from os.path import isdir, isfile  # unlike Path's, no error for a name that no file system takes
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from identify.recording.controller_file import ControllerFile
from identify.recording.errors import InputError
from identify.recording.experiment_file import (
    EXPERIMENT_FILE,
    ExperimentFile,
    Payload,
    PriorBodies,
    Robot,
    SignalCutoffs,
    read_experiment_file,
)
from identify.recording.sampling import uniform_session
from identify.recording.session import Session, SessionEntry
from identify.recording.session_cache import SessionCache
from identify.recording.session_hdf5 import is_hdf5, read_hdf5_controller, read_hdf5_session

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Experiment:
    """An experiment on disk; sessions are read when asked for (`read`)."""

    name: str
    path: Path
    """The experiment file."""
    robot: Robot
    sessions: tuple[SessionEntry, ...]
    """Those that take part, in the order of the file."""
    payloads: tuple[Payload, ...]
    signals: SignalCutoffs
    effects: tuple[Path, ...]
    """Files of the user's own effects."""
    excluded: tuple[SessionEntry, ...] = ()
    """Sessions that the file lists and excludes: models neither use them nor are checked on them."""
    prior: PriorBodies | None = None
    """The links as a file of the robot states them, to be compared with what is identified."""
    _held: SessionCache[SessionEntry, Session] = field(
        default_factory=lambda: SessionCache(), compare=False, repr=False
    )

    @property
    def folder(self) -> Path:
        """The folder that holds the experiment file."""
        return self.path.parent

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.robot.joints)

    @cached_property
    def drive_gain(self) -> Array:
        """(n, n): joint torque = drive_gain @ v, eq. (7)."""
        if self.robot.drive_gain_matrix is not None:
            return np.array(self.robot.drive_gain_matrix, dtype=float)
        return np.diag([float(joint.drive_gain or 0.0) for joint in self.robot.joints])

    def read(self, entry: SessionEntry) -> Session:
        """Read the samples of a session.

        What was read is held while it is small, so that asking twice costs one reading. Samples are not to
        be written.

        Raises InputError: the file is wrong; names file, line and column.
        """
        return self._held.get(entry, lambda: _read_session(entry, self.n))

    def read_with_setpoints(self, entry: SessionEntry) -> Session:
        """The same samples, a recording of ours with the setpoints in force as further columns `qref1` ... `qrefn`.

        Raises InputError: as `read`.
        """
        if not is_hdf5(entry.path):
            return self.read(entry)
        return uniform_session(entry, read_hdf5_session(entry.path, self.n, setpoints=True))

    def recorded_controllers(self, entry: SessionEntry) -> ControllerFile | None:
        """The gains of the drives' controllers that a recording of ours holds; None of other files, and where none were read.

        Raises InputError: the file cannot be read.
        """
        return read_hdf5_controller(entry.path) if is_hdf5(entry.path) else None


def _read_session(entry: SessionEntry, n: int) -> Session:
    if is_hdf5(entry.path):
        return uniform_session(entry, read_hdf5_session(entry.path, n))
    from identify.recording.session_csv import read_csv_session  # loads Arrow, which takes half a second

    return uniform_session(entry, read_csv_session(entry.path, n))


def load_experiment(path: str | Path, stored: Path | None = None) -> Experiment:
    """Load an experiment: a folder, an `experiment.yaml`, or the name of one in the folder `stored`.

    Raises InputError: with one line that names file, line or field and what would be right.
    """
    file = _experiment_file(Path(path), stored)
    declared = read_experiment_file(file)
    return experiment_from(declared, file)


def experiment_from(declared: ExperimentFile, file: Path) -> Experiment:
    """An experiment from its checked file: the files that it names must exist.

    Raises InputError: a session's or an effect's file is not there.
    """
    payloads = {payload.name: payload for payload in declared.payloads}
    needed = [
        (f"sessions[{index}]", session.file)
        for index, session in enumerate(declared.sessions)
        if session.excluded is None
    ]
    needed += [(f"effects[{index}]", name) for index, name in enumerate(declared.effects)]
    for place, name in needed:
        if not isfile(file.parent / name):
            raise InputError(f"{file}: {place}: there is no file '{name}' in {file.parent}")
    listed = [
        SessionEntry(
            session.file,
            file.parent / session.file,
            payloads[session.payload],
            session.role,
            session.excluded,
        )
        for session in declared.sessions
    ]
    return Experiment(
        name=declared.name,
        path=file,
        robot=declared.robot,
        sessions=tuple(entry for entry in listed if entry.excluded is None),
        payloads=declared.payloads,
        signals=declared.signals,
        effects=tuple(file.parent / name for name in declared.effects),
        excluded=tuple(entry for entry in listed if entry.excluded is not None),
        prior=declared.prior,
    )


def _experiment_file(path: Path, stored: Path | None) -> Path:
    candidates = [path]
    if stored is not None and not path.is_absolute():
        candidates.append(stored / path)
    for candidate in candidates:
        if isfile(candidate):
            return candidate
        if isdir(candidate):
            if isfile(candidate / EXPERIMENT_FILE):
                return candidate / EXPERIMENT_FILE
            raise InputError(f"{candidate}: the folder holds no {EXPERIMENT_FILE}")
    known = f", nor an experiment of that name in {stored}" if stored is not None else ""
    raise InputError(f"{path}: there is no such folder or file{known}")
