"""The experiment folders and their index in the database.

The folders are the truth; the index answers lists quickly and is rebuilt from them
(`ExperimentStore.reindex`). An experiment's id is the name of its folder, so that it survives a lost
database.
"""

import re
import shutil
import tempfile
import threading
import unicodedata
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from sqlalchemy import delete, select

from api.proof_drive import Drive
from api.service.confined_reader import ConfinedReader
from api.service.database import (
    LONGEST_STATE,
    LONGEST_WORDS,
    Database,
    ExperimentRow,
    SessionRow,
)
from api.service.folder_description import INCOMPLETE, FolderDescription, RecordingDescription
from api.service.problems import not_found
from api.service.process_limits import GIBIBYTE, LimitExceeded, ProcessLimits
from api.service.proof_drives import drive_of_proof
from api.service.session_ids import drive_id, session_id
from api.stored_experiments import EXPERIMENT_ID
from daq.rig import RIGS
from identify.recording import ExperimentFile, InputError, write_experiment
from identify.recording.experiment_file import EXPERIMENT_FILE, DeclaredSession

READING_LIMITS = ProcessLimits(memory=2 * GIBIBYTE, seconds=60.0, descriptors=256)
"""Of the process that looks at a few folders for the index."""
DESCRIBED_TOGETHER = 50
"""Folders that one process looks at; where it fails, each is looked at alone, so that one bad file hides no other."""
DESCRIBE = "api.service.folder_description:describe_folders"


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
        self._read_confined = ConfinedReader(READING_LIMITS)
        self._declared: dict[str, tuple[tuple[int, int], ExperimentFile | str]] = {}
        self._lock = threading.Lock()

    def shown(self, text: str) -> str:
        """The same words with files called by their place among the experiments, or beside them in the data folder or the
        software's settings, and not on this computer."""
        for root in (self.root, self.root.resolve()):
            text = text.replace(f"{root}/", "").replace(f"{root.parent}/", "")
        return text.replace(f"{RIGS.parent}/", "")

    # --- the index

    def reindex(self) -> int:
        """Rebuild the index from the folders; returns how many experiments there are.

        Sessions that are being prepared and have no file yet are kept if their experiment still exists.
        """
        folders = {
            folder.name: folder
            for folder in sorted(self.root.iterdir())
            if EXPERIMENT_ID.fullmatch(folder.name) and (folder / EXPERIMENT_FILE).is_file()
        }
        with self._database.transaction() as session:
            for row in session.scalars(select(ExperimentRow)):
                if row.id not in folders:
                    session.delete(row)
        identifiers = list(folders)
        for start in range(0, len(identifiers), DESCRIBED_TOGETHER):
            self._refresh(identifiers[start : start + DESCRIBED_TOGETHER])
        return len(folders)

    def refresh(self, identifier: str) -> None:
        """Bring the index of one experiment up to date with its folder."""
        self._refresh([identifier])

    def _refresh(self, identifiers: list[str]) -> None:
        stamps = {each: _stamp(self.root / each / EXPERIMENT_FILE) for each in identifiers}
        for identifier, description in zip(identifiers, self._describe(identifiers), strict=True):
            with self._lock:
                self._declared[identifier] = (
                    stamps[identifier],
                    description.declared or description.problem or "cannot be read",
                )
            self._index(identifier, description, stamps[identifier][0] / 1e9)

    def _describe(self, identifiers: list[str]) -> list[FolderDescription]:
        try:
            return self._read_confined(DESCRIBE, folders=[str(self.root / each) for each in identifiers])
        except (InputError, LimitExceeded) as error:
            if len(identifiers) > 1:
                return [self._describe([each])[0] for each in identifiers]
            return [FolderDescription(None, f"its files cannot be looked at: {error}")]

    def _index(self, identifier: str, description: FolderDescription, modified: float) -> None:
        declared = description.declared
        with self._database.transaction() as session:
            row = session.get(ExperimentRow, identifier)
            if row is None:
                row = ExperimentRow(id=identifier, name=identifier, folder=identifier, joints=[], payloads=[])
                session.add(row)
            row.modified = modified
            row.problem = description.problem and description.problem[:LONGEST_WORDS]
            if declared is None:
                return
            row.name = declared.name
            row.joints = [joint.name for joint in declared.robot.joints]
            row.payloads = [payload.model_dump() for payload in declared.payloads]
            session.flush()
            self._index_sessions(session, identifier, declared, description.recordings)

    def _index_sessions(
        self,
        session,
        identifier: str,
        declared: ExperimentFile,
        recordings: dict[str, RecordingDescription],
    ) -> None:
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
            row.payload = payloads[entry.payload]
            _index_recording(row, recordings[entry.file])
        listed = {entry.file for entry in declared.sessions}
        for file, recording in recordings.items():
            if file not in listed:
                stem = session_id(file.removeprefix(f"{INCOMPLETE}/"))
                self._index_incomplete(session, identifier, file, stem, recording, rows.pop(stem, None))
        for row in rows.values():  # what is left has no file; it stays only while it is being prepared
            if drive_of_proof(row) is not None:
                continue  # kept by its proof, in a folder of its own
            if row.file is not None and row.file.startswith(INCOMPLETE):
                row.file = None  # stopped before anything was measured
            elif row.file is not None:
                session.delete(row)

    def _index_incomplete(
        self,
        session,
        identifier: str,
        file: str,
        stem: str,
        recording: RecordingDescription,
        row: SessionRow | None,
    ) -> None:
        """A recording that was stopped or whose process died: kept, and not used by the identification."""
        if row is None:
            row = SessionRow(experiment=identifier, id=stem, rig=None, plan=None, created=self._clock())
            session.add(row)
            row.payload, row.role = recording.payload, recording.role
        row.file = file
        _index_recording(row, recording)

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
            modified = _stamp(self.root / row.folder / EXPERIMENT_FILE)[0]
        except FileNotFoundError:
            raise not_found("experiment", identifier) from None
        if modified / 1e9 != row.modified:
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
        stamp = _stamp(self.folder(identifier) / EXPERIMENT_FILE)
        with self._lock:
            held = self._declared.get(identifier)
        if held is None or held[0] != stamp:
            self.refresh(identifier)
            with self._lock:
                held = self._declared[identifier]
        if isinstance(held[1], str):
            raise InputError(held[1])
        return held[1]

    def create(self, declared: ExperimentFile) -> ExperimentRow:
        """A new experiment without sessions."""
        with self.incoming() as folder:
            write_experiment(folder, declared)
            return self.adopt(folder, declared.name)

    @contextmanager
    def incoming(self) -> Iterator[Path]:
        """A folder on the same disk in which an experiment is put together; removed unless `adopt` took
        it. Processes that still write there, because who led them was killed, no longer find it by its name.
        """
        folder = Path(tempfile.mkdtemp(prefix=".incoming-", dir=self.root))
        try:
            yield folder
        finally:
            removed = folder.with_name(f"{folder.name}-removed")
            with suppress(FileNotFoundError):
                folder.rename(removed)
            shutil.rmtree(removed, ignore_errors=True)

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
        """The sessions of an experiment: measured ones in the file's order, then those being prepared.

        Drives of proofs are none of them: no model is fitted to them or checked on them.
        """
        self.row(experiment)
        with self._database.transaction() as session:
            query = select(SessionRow).where(SessionRow.experiment == experiment)
            rows = list(session.scalars(query.order_by(SessionRow.id)))
        return [row for row in rows if drive_of_proof(row) is None]

    def newest_on_rig(self, rig: str) -> SessionRow | None:
        """The session that was prepared last on a rig, whatever became of it; None where there was none."""
        with self._database.transaction() as session:
            query = select(SessionRow).where(SessionRow.rig == rig)
            return session.scalars(query.order_by(SessionRow.created.desc()).limit(1)).first()

    def session(self, experiment: str, identifier: str) -> SessionRow:
        """One session. Raises the problem 404."""
        self.row(experiment)
        with self._database.transaction() as session:
            row = session.get(SessionRow, (experiment, identifier))
        if row is None:
            raise not_found(f"session of {experiment}", identifier)
        return row

    def drive(self, experiment: str, proof: str, drive: Drive) -> SessionRow | None:
        """One of the two drives of a proof, as it was prepared last; None where it was not. Raises the problem 404."""
        self.row(experiment)
        with self._database.transaction() as session:
            return session.get(SessionRow, (experiment, drive_id(proof, drive)))

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
        numbers = [int(match[1]) for name in names if (match := re.match(r"session-(\d+)(?:\.|$)", name))]
        return f"session-{max(numbers, default=-1) + 1:02d}"


def _stamp(file: Path) -> tuple[int, int]:
    """By which a file that was changed is known: ns of its change, bytes."""
    status = file.stat()
    return status.st_mtime_ns, status.st_size


def _index_recording(row: SessionRow, recording: RecordingDescription) -> None:
    row.state = recording.state[:LONGEST_STATE]
    row.reason = recording.reason and recording.reason[:LONGEST_WORDS]
    if row.weighed is None:
        row.weighed = recording.weighed
