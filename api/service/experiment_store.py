"""The experiment folders and their index in the database.

The folders are the truth; the index answers lists quickly and is rebuilt from them
(`ExperimentStore.reindex`). An experiment's id is the name of its folder, so that it survives a lost
database.
"""

import json
import re
import shutil
import tempfile
import unicodedata
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from math import isfinite
from pathlib import Path
from typing import cast

import h5py
from sqlalchemy import delete, select

from api.service.database import (
    LONGEST_NAME,
    LONGEST_STATE,
    LONGEST_WORDS,
    Database,
    ExperimentRow,
    SessionRow,
)
from api.service.problems import not_found
from api.stored_experiments import EXPERIMENT_ID
from identify.recording import ExperimentFile, InputError, write_experiment
from identify.recording.experiment_file import EXPERIMENT_FILE, DeclaredSession, read_experiment_file
from identify.results.document import Json

INCOMPLETE = "incomplete"
"""Folder within an experiment for recordings that were stopped."""
MEASURED = "measured"
"""State of a session whose file the experiment names; a recording that ended badly says so instead."""


RECORDED = frozenset({"done", "aborted", "faulted", "recording"})
"""States of files that this software recorded, as they say themselves."""


def session_id(file: str) -> str:
    """The id of a measured session: its file's name without the ending."""
    return re.sub(r"(\.csv\.gz|\.csv|\.h5|\.hdf5)$", "", file)


def id_from_name(name: str) -> str:
    """A readable id: `RX130L, joint 3` becomes `rx130l-joint-3`."""
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode().lower()
    return re.sub(r"[^a-z0-9]+", "-", plain).strip("-")[:50] or "experiment"


class ExperimentStore:
    """Experiments by id. A request only ever names ids; paths are made here from the index."""

    def __init__(self, database: Database, folder: Path, clock: Callable[[], float]) -> None:
        self._database = database
        self._clock = clock
        self.root = folder
        self.root.mkdir(parents=True, exist_ok=True)

    # --- the index

    def reindex(self) -> int:
        """Rebuild the index from the folders; returns how many experiments there are.

        Sessions that are being prepared and have no file yet are kept if their experiment still exists.
        """
        found = {
            folder.name: folder
            for folder in sorted(self.root.iterdir())
            if EXPERIMENT_ID.fullmatch(folder.name) and (folder / EXPERIMENT_FILE).is_file()
        }
        with self._database.transaction() as session:
            for row in session.scalars(select(ExperimentRow)):
                if row.id not in found:
                    session.delete(row)
        for identifier in found:
            self.refresh(identifier)
        return len(found)

    def refresh(self, identifier: str) -> None:
        """Bring the index of one experiment up to date with its folder."""
        folder = self.root / identifier
        file = folder / EXPERIMENT_FILE
        modified = file.stat().st_mtime
        declared, problem = None, None
        try:
            declared = read_experiment_file(file)
        except InputError as error:
            problem = str(error).replace(f"{folder}/", "")[:LONGEST_WORDS]
        with self._database.transaction() as session:
            row = session.get(ExperimentRow, identifier)
            if row is None:
                row = ExperimentRow(id=identifier, name=identifier, folder=identifier, joints=[], payloads=[])
                session.add(row)
            row.modified, row.problem = modified, problem
            if declared is None:
                return
            row.name = declared.name[:LONGEST_NAME]
            row.joints = [joint.name for joint in declared.robot.joints]
            row.payloads = [payload.model_dump() for payload in declared.payloads]
            session.flush()
            self._index_sessions(session, identifier, declared)

    def _index_sessions(self, session, identifier: str, declared: ExperimentFile) -> None:
        old = session.scalars(select(SessionRow).where(SessionRow.experiment == identifier))
        rows = {row.id: row for row in old}
        payloads = {payload.name: payload for payload in declared.payloads}
        for entry in declared.sessions:
            key = session_id(entry.file)
            row = rows.pop(key, None)
            if row is None:
                row = SessionRow(experiment=identifier, id=key, rig=None, plan=None, created=self._clock())
                session.add(row)
            row.file, row.role = entry.file, entry.role
            row.payload = payloads[entry.payload].model_dump()
            self._index_recording(row, self.root / identifier / entry.file)
        for file in sorted((self.root / identifier / INCOMPLETE).glob("*.h5")):
            self._index_incomplete(session, identifier, file, rows.pop(file.stem, None))
        for row in rows.values():  # what is left has no file; it stays only while it is being prepared
            if row.file is not None and row.file.startswith(INCOMPLETE):
                row.file = None  # stopped before anything was measured
            elif row.file is not None:
                session.delete(row)

    def _index_incomplete(self, session, identifier: str, file: Path, row: SessionRow | None) -> None:
        """A recording that was stopped or whose process died: kept, and not used by the identification."""
        if row is None:
            row = SessionRow(experiment=identifier, id=file.stem, rig=None, plan=None, created=self._clock())
            session.add(row)
            row.payload, row.role = _recorded_payload(file)
        row.file = f"{INCOMPLETE}/{file.name}"
        self._index_recording(row, file)

    def _index_recording(self, row: SessionRow, file: Path) -> None:
        row.state, row.reason = _recording_state(file)
        if row.weighed is None and row.state in RECORDED:
            row.weighed = _weighed_mass(file)

    # --- experiments

    def rows(self) -> list[ExperimentRow]:
        """All experiments, the one changed last first."""
        with self._database.transaction() as session:
            return list(session.scalars(select(ExperimentRow).order_by(ExperimentRow.modified.desc())))

    def row(self, identifier: str) -> ExperimentRow:
        """The index of one experiment, brought up to date if somebody edited its file. Raises the problem
        404.
        """
        row = self._row(identifier)
        try:
            modified = (self.root / row.folder / EXPERIMENT_FILE).stat().st_mtime
        except FileNotFoundError:
            raise not_found("experiment", identifier) from None
        if modified != row.modified:
            self.refresh(identifier)
            row = self._row(identifier)
        return row

    def _row(self, identifier: str) -> ExperimentRow:
        with self._database.transaction() as session:
            row = session.get(ExperimentRow, identifier)
        if row is None:
            raise not_found("experiment", identifier)
        return row

    def folder(self, identifier: str) -> Path:
        """The folder of an experiment. Raises the problem 404."""
        return self.root / self.row(identifier).folder

    def declared(self, identifier: str) -> ExperimentFile:
        """The checked experiment file. Raises the problem 404, and InputError if somebody broke the file."""
        return read_experiment_file(self.folder(identifier) / EXPERIMENT_FILE)

    def create(self, declared: ExperimentFile) -> ExperimentRow:
        """A new experiment without sessions."""
        with self.incoming() as folder:
            write_experiment(folder, declared)
            return self.adopt(folder, declared.name)

    @contextmanager
    def incoming(self) -> Iterator[Path]:
        """A folder on the same disk in which an experiment is put together; removed unless `adopt` took
        it.
        """
        folder = Path(tempfile.mkdtemp(prefix=".incoming-", dir=self.root))
        try:
            yield folder
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    def adopt(self, folder: Path, name: str) -> ExperimentRow:
        """Move a finished folder in, under an id made from the experiment's name."""
        wanted = id_from_name(name)
        folder.chmod(0o755)
        for number in range(1, 10_000):
            identifier = wanted if number == 1 else f"{wanted}-{number}"
            try:
                # On Linux a rename onto an existing folder succeeds only if that is empty; ours never are.
                folder.rename(self.root / identifier)
            except OSError:
                if not (self.root / identifier).exists():
                    raise
                continue
            self.refresh(identifier)
            return self.row(identifier)
        raise InputError(f"experiment {name}: ten thousand experiments have this name")

    # --- sessions

    def sessions(self, experiment: str) -> list[SessionRow]:
        """The sessions of an experiment: measured ones in the file's order, then those being prepared."""
        self.row(experiment)
        with self._database.transaction() as session:
            query = select(SessionRow).where(SessionRow.experiment == experiment)
            return list(session.scalars(query.order_by(SessionRow.id)))

    def session(self, experiment: str, identifier: str) -> SessionRow:
        """One session. Raises the problem 404."""
        self.row(experiment)
        with self._database.transaction() as session:
            row = session.get(SessionRow, (experiment, identifier))
        if row is None:
            raise not_found(f"session of {experiment}", identifier)
        return row

    def change_session(self, row: SessionRow) -> None:
        """Store what changed in a session's row, or a new one."""
        with self._database.transaction() as session:
            session.merge(row)

    def forget_session(self, row: SessionRow) -> None:
        """Remove a session that was never measured."""
        with self._database.transaction() as session:
            session.execute(
                delete(SessionRow).where(SessionRow.experiment == row.experiment, SessionRow.id == row.id)
            )

    def session_place(self, experiment: str, identifier: str) -> tuple[int, DeclaredSession]:
        """Where a measured session stands in the experiment file, from 0. Raises the problem 404."""
        for place, entry in enumerate(self.declared(experiment).sessions):
            if session_id(entry.file) == identifier:
                return place, entry
        raise not_found(f"measured session of {experiment}", identifier)

    def next_session_id(self, experiment: str) -> str:
        """`session-00`, `session-01`, …: one more than the highest in the index and the folder, as the
        recorder counts.
        """
        folder = self.folder(experiment)
        names = [row.id for row in self.sessions(experiment)]
        names += [path.name for place in (folder, folder / INCOMPLETE) for path in place.glob("session-*")]
        numbers = [int(found[1]) for name in names if (found := re.match(r"session-(\d+)(?:\.|$)", name))]
        return f"session-{max(numbers, default=-1) + 1:02d}"


def _recording_state(file: Path) -> tuple[str, str | None]:
    """State and reason of a session's file; only our own recordings say more than that they exist."""
    if not file.is_file():
        return "missing", f"the file {file.name} is not there"
    if file.suffix not in (".h5", ".hdf5"):
        return MEASURED, None
    try:
        attributes = _attributes(file)
    except OSError as error:
        return "damaged", str(error).replace(f"{file.parent}/", "")[:LONGEST_WORDS]
    status = attributes.get("status") or MEASURED
    reason = attributes.get("status_reason", "")[:LONGEST_WORDS]
    return ("done" if status == "complete" else status[:LONGEST_STATE]), reason or None


def _weighed_mass(file: Path) -> float | None:
    """kg, as a recording of ours has it."""
    try:
        mass = float(_attributes(file)["weighed_mass"])
    except (OSError, KeyError, ValueError):
        return None
    return mass if isfinite(mass) else None


def _recorded_payload(file: Path) -> tuple[Json, str]:
    """Payload and role of a recording of ours."""
    unknown: Json = {"name": "unknown", "mass": None}
    try:
        attributes = _attributes(file)
        payload = json.loads(attributes["payload"])
    except (OSError, KeyError, ValueError):
        return unknown, "identification"
    if not isinstance(payload, dict) or "name" not in payload:
        return unknown, "identification"
    return cast(Json, payload), attributes.get("role", "identification")


def _attributes(file: Path) -> dict[str, str]:
    """Texts among a recording's attributes; the file may be being written.

    What cannot be read, an attribute of a type that NumPy has not, for instance, is passed over: one odd file must not keep
    the service from starting.
    """
    found: dict[str, str] = {}
    with h5py.File(file, "r", swmr=True, locking=False) as recording:
        for name in recording.attrs:
            with suppress(TypeError, ValueError, OSError, RuntimeError, KeyError):
                found[name] = str(recording.attrs[name])
    return found
