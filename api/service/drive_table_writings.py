"""A model's tables for the drives of a rig: computed by a job, shown, and written where an operator says so.

model-stories …/fit/drive-tables/RIG.json       what the drives are to hold, beside the fit that it is of
                …/fit/drive-tables/RIG.rig.json   the rig's file as it was then
drive-tables/00.json                              in the experiment's folder: what was written, with what the drives held before
"""

import threading
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

from pydantic import ValidationError

from api.drive_tables import changed_since_computed, require_tables, tables_before, written
from api.service.accounts import User
from api.service.drive_table_documents import State, TablesWriting
from api.service.drive_work import DriveWork
from api.service.experiment_store import ExperimentStore
from api.service.job_documents import JobResult
from api.service.jobs import Job, JobRunner
from api.service.model_story import ModelStory, ModelVersion
from api.service.problems import Problem, not_found
from api.service.rig_store import RigStore
from daq.rig import Rig
from drivers.errors import DriverError
from identify.recording.atomic_file import write_atomically
from identify.recording.errors import InputError
from identify.recording.first_fault import first_fault
from identify.results.drive_tables import DriveTablesDocument
from identify.results.reading import read_document

FOLDER = "drive-tables"
COMPUTATION = "api.service.use_computations:drive_tables"


class DriveTableWritings:
    """Tables of all experiments' models, and what was written of them."""

    def __init__(
        self,
        experiments: ExperimentStore,
        rigs: RigStore,
        work: DriveWork,
        jobs: JobRunner,
        clock: Callable[[], float],
    ) -> None:
        self._experiments = experiments
        self._rigs = rigs
        self._work = work
        self._jobs = jobs
        self._clock = clock
        self._lock = threading.Lock()

    # --- looking

    def compute(self, experiment: str, user: User, rig: str, model: str | None = None) -> Job:
        """Choose the tables of a rig's drives (a job); nothing is written to them.

        model : a version's id, None for the current one

        Raises the problem 404 (experiment, rig, model), 409 (no model yet), InputError where no drive of the rig takes tables.
        """
        settings, version = self._rigs.rig(rig), self._version(experiment, model)
        require_tables(settings)
        story = self._story(experiment)
        file = self._file(experiment, version.id, rig)

        def store(tables: DriveTablesDocument) -> JobResult:
            file.parent.mkdir(exist_ok=True)
            file.unlink(missing_ok=True)
            write_atomically(_rig_file(file), settings.model_dump_json().encode())
            write_atomically(file, (tables.json_text(indent=1) + "\n").encode())
            return JobResult(model=version.id, rig=rig)

        return self._jobs.submit(
            "drive-tables",
            COMPUTATION,
            lambda: {
                "experiment": str(story.folder.parent),
                "model": version.model,
                "add": version.add,
                "rig": settings,
            },
            store,
            user=user.name,
            experiment=experiment,
            asked=(settings, version.id),
            about=JobResult(model=version.id, rig=rig),
        )

    def fault(self, experiment: str, rig: str, model: str) -> str | None:
        """Why the last job that was to choose the tables of a model's version for a rig made nothing, if so."""
        return self._jobs.faults(experiment, "drive-tables", model).get(JobResult(rig=rig))

    def tables(self, experiment: str, rig: str, model: str | None = None) -> DriveTablesDocument | None:
        """What the drives are to hold, or None where nobody asked yet. Raises the problem 404."""
        self._rigs.file(rig)
        try:
            return read_document(
                DriveTablesDocument, self._file(experiment, self._version(experiment, model).id, rig)
            )
        except FileNotFoundError:
            return None

    def outdated(self, experiment: str, rig: str, model: str | None = None) -> str:
        """Why the tables that were computed may not be written any more, in a sentence: the rig's file, or the profile of a
        drive, says something else by now. Empty where they may, or where there are none. Raises the problem 404."""
        tables = self.tables(experiment, rig, model)
        if tables is None:
            return ""
        settings = self._rigs.rig(rig)
        file = _rig_file(self._file(experiment, self._version(experiment, model).id, rig))
        try:
            then = Rig.model_validate_json(file.read_bytes())
        except (OSError, ValidationError):
            return f"{file.name}, beside the tables, cannot be read; compute them again."
        fields = [name for name in Rig.model_fields if getattr(settings, name) != getattr(then, name)]
        changed = ", ".join(fields) or changed_since_computed(tables, settings)
        return (
            f"Rig {rig}, {changed} changed since the tables were computed; compute them again."
            if changed
            else ""
        )

    def writings(self, experiment: str) -> list[TablesWriting]:
        """What was written, the newest first. Raises the problem 404, InputError where a file was damaged."""
        return [_read(file) for file in reversed(self._files(experiment))]

    def why_not(self, rig: str) -> str:
        """Why the drives of a rig cannot be written to at all; empty where they can."""
        return self._work.why_not(self._rigs.rig(rig))

    # --- writing

    def write(
        self, experiment: str, user: User, rig: str, model: str | None = None, client: str = ""
    ) -> TablesWriting:
        """Write the tables as they were shown, and read them back; returns when it is done.

        Raises the problem 409 (nothing shown yet, the rig's file changed since, somebody else has the rig or its bus), and
        InputError or DriverError, with everything as before, where a drive is not ready or refuses.
        """
        version = self._version(experiment, model)
        tables = self.tables(experiment, rig, version.id)
        if tables is None:
            raise Problem(
                409,
                f"The tables of model {version.id} for rig {rig} were not computed yet: compute them, look at them, then write.",
            )
        outdated = self.outdated(experiment, rig, version.id)
        if outdated:
            raise Problem(409, outdated)
        settings = self._rigs.rig(rig)
        return self._write(experiment, user, rig, settings, tables, version.id, None, client)

    def write_back(self, experiment: str, user: User, number: str, client: str = "") -> TablesWriting:
        """Write what the drives held before a writing. Raises the problem 404, and as `write`."""
        before = next((each for each in self.writings(experiment) if each.number == number), None)
        if before is None:
            raise not_found(f"writing of tables of {experiment}", number)
        settings = self._rigs.rig(before.rig)
        return self._write(
            experiment,
            user,
            before.rig,
            settings,
            tables_before(before.tables, settings),
            None,
            number,
            client,
        )

    def _write(
        self,
        experiment: str,
        user: User,
        rig: str,
        settings: Rig,
        tables: DriveTablesDocument,
        version: str | None,
        undoes: str | None,
        client: str,
    ) -> TablesWriting:
        wanted = f"model {version}" if version else f"as before writing {undoes}"
        with self._work.on(
            rig,
            settings,
            user,
            action="drive tables",
            target=f"rig {rig}, experiment {experiment}, {wanted}",
            refusal="Tables are being written to its drives; that takes some seconds.",
            client=client,
        ):
            file: Path | None = None

            def stored(document: DriveTablesDocument, state: State, reason: str = "") -> TablesWriting:
                nonlocal file
                with self._lock:
                    file = file or self._next_file(experiment)
                    writing = TablesWriting(
                        number=file.stem,
                        state=state,
                        reason=reason,
                        version=version,
                        undoes=undoes,
                        rig=rig,
                        operator=user.name,
                        created=datetime.fromtimestamp(self._clock(), UTC).isoformat(timespec="seconds"),
                        tables=document,
                    )
                    write_atomically(file, (writing.model_dump_json(indent=1) + "\n").encode())
                return writing

            begun: DriveTablesDocument | None = None

            def about_to_write(document: DriveTablesDocument) -> None:
                # What the drives held before is on disk before the first of them changes.
                nonlocal begun
                stored(document, "begun")
                begun = document

            try:
                return stored(written(tables, settings, about_to_write), "written")
            except (InputError, DriverError) as error:
                if begun is not None:
                    stored(begun, "refused", str(error))
                raise

    # --- inside

    def _version(self, experiment: str, model: str | None) -> ModelVersion:
        return self._story(experiment).read().required(model)

    def _story(self, experiment: str) -> ModelStory:
        return ModelStory(self._experiments.folder(experiment))

    def _file(self, experiment: str, version: str, rig: str) -> Path:
        return self._story(experiment).fit_folder(version) / FOLDER / f"{rig}.json"

    def _files(self, experiment: str) -> list[Path]:
        files = (self._experiments.folder(experiment) / FOLDER).glob("[0-9]*.json")
        return sorted((file for file in files if file.stem.isdecimal()), key=lambda file: int(file.stem))

    def _next_file(self, experiment: str) -> Path:
        folder = self._experiments.folder(experiment) / FOLDER
        folder.mkdir(exist_ok=True)
        last = max((int(file.stem) for file in self._files(experiment)), default=-1)
        return folder / f"{last + 1:02d}.json"


def _rig_file(file: Path) -> Path:
    return file.with_name(f"{file.stem}.rig.json")


def _read(file: Path) -> TablesWriting:
    try:
        return TablesWriting.model_validate_json(file.read_bytes())
    except ValidationError as error:
        raise InputError(f"{file}: {first_fault(error)}") from error
