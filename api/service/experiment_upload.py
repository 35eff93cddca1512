"""Uploaded experiments and sessions: put aside, read in a process of their own (upload_reader.py), and only then stored."""

import os
import re
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, Literal

from fastapi import UploadFile

from api.service.archive_members import known_ending
from api.service.confined_reader import ConfinedReader
from api.service.database import ExperimentRow
from api.service.experiment_store import ExperimentStore
from api.service.problems import Problem
from api.service.process_limits import LimitExceeded
from api.service.record_documents import CanLogImport, Dialect, RecordDescription, RecordImport
from api.service.upload_reader import BLOCK, SESSION_ENDINGS
from daq.experiment_folder import changing
from identify.recording import DeclaredSession, ExperimentFile, InputError, Payload, append_session
from identify.recording.experiment_file import EXPERIMENT_FILE, keep_prior, read_experiment_file

READER = "api.service.upload_reader"
RECORDS = "api.service.foreign_records"


@dataclass(frozen=True)
class UploadedFile:
    """A file as it came, and the name that it came with."""

    name: str
    content: IO[bytes]


@dataclass(frozen=True)
class AddedExperiment:
    """An experiment from an archive, and what of the archive was not taken, in words."""

    row: ExperimentRow
    passed_over: list[str]


def uploaded(file: UploadFile) -> UploadedFile:
    """A file of a form."""
    return UploadedFile(file.filename or "record", file.file)


class Uploads:
    """Takes uploads into the experiment folders.

    reader : reads them
    limit  : bytes that all of an upload may unpack to, decompressed sessions included
    """

    def __init__(self, experiments: ExperimentStore, reader: ConfinedReader, limit: int) -> None:
        self._experiments = experiments
        self._reader = reader
        self._limit = limit

    def add_experiment(self, upload: IO[bytes]) -> AddedExperiment:
        """Store the experiment in a zip archive: `experiment.yaml` and the files it names, in any folder of it.

        Raises InputError if it is not such an archive or the experiment is not valid, and the problem 413 if it is too
        large, or takes too much memory or time to read.
        """
        with self._experiments.incoming() as place:
            archive, folder = place / "upload.zip", place / "experiment"
            folder.mkdir()
            _put_aside(upload, archive, self._limit)
            name, passed_over = self._read(
                f"{READER}:read_archive", archive=str(archive), folder=str(folder), limit=self._limit
            )
            return AddedExperiment(self._experiments.adopt(folder, name), passed_over)

    def add_session(
        self,
        experiment: str,
        upload: IO[bytes],
        file_name: str,
        payload: str,
        role: Literal["identification", "validation"],
        new_payload: Payload | None,
    ) -> None:
        """Add one uploaded session file to an experiment, under the next free name.

        Raises InputError, which calls the file by the name it came with, if it cannot be read as a session of this robot,
        and the problem 413 if it is too large, or takes too much memory or time to read.
        """
        ending = known_ending(file_name, SESSION_ENDINGS)
        if ending is None:
            raise InputError(f"file: the name must end in {', '.join(SESSION_ENDINGS)}")
        target = self._experiments.folder(experiment)
        declared = self._experiments.declared(experiment)
        known = {each.name: each for each in declared.payloads}
        if payload not in known and new_payload is None:
            raise InputError(
                f"payload: {payload!r} is not one of {', '.join(known)}; give its mass to add it"
            )
        if payload in known and new_payload is not None and known[payload].mass != new_payload.mass:
            raise Problem(
                409,
                f"The payload {payload} is {known[payload].mass} kg; leave the mass out or use another name.",
            )
        new = None if payload in known else new_payload
        with self._experiments.incoming() as place:
            name = f"upload{ending}"
            _put_aside(upload, place / name, self._limit)
            addition = DeclaredSession(file=name, payload=payload, role=role)
            try:
                self._read(
                    f"{READER}:read_session",
                    folder=str(place),
                    declared=declared,
                    addition=addition,
                    payload=new,
                    limit=self._limit,
                )
            except InputError as error:
                raise InputError(str(error).replace(name, _shown(file_name))) from error
            with changing(target):
                final = self._claim(experiment, place / name, ending)
                try:
                    append_session(target, addition.model_copy(update={"file": final.name}), new)
                except BaseException:
                    final.unlink()
                    raise
        self._experiments.refresh(experiment)

    def describe_records(self, files: Sequence[UploadedFile], dialect: Dialect) -> list[RecordDescription]:
        """What other people's records hold, and what their columns probably are; nothing is kept.

        Raises InputError, which names the file, and the problem 413 if they are too large.
        """
        with self._experiments.incoming() as place:
            names = self._put_aside_all(files, place)
            return self._read(f"{RECORDS}:describe_records", folder=str(place), files=names, dialect=dialect)

    def add_records(
        self, files: Sequence[UploadedFile], robot: UploadedFile | None, wanted: RecordImport
    ) -> tuple[ExperimentRow, tuple[str, ...]]:
        """Store the experiment that other people's records make, or add them to the one that is wanted; and what was decided,
        in words.

        Raises InputError, which names file and column or the field, and the problem 413 if they are too large, 404 where there
        is no such experiment, 409 where it knows another payload of that name.
        """
        known = self._experiments.declared(wanted.experiment) if wanted.experiment else None
        if known is not None:
            _refuse_other_payloads(known, [Payload(**each.model_dump()) for each in wanted.payloads])
        with self._experiments.incoming() as place:
            folder = place / "experiment"
            names = self._put_aside_all([*files, *([robot] if robot else [])], place)
            decided = self._read(
                f"{RECORDS}:import_records",
                folder=str(place),
                files=names[: len(files)],
                robot=names[-1] if robot else None,
                known=known.robot if known else None,
                wanted=wanted,
                target=str(folder),
            )
            if wanted.experiment:
                return self._append(wanted.experiment, folder), decided
            return self._experiments.adopt(folder, wanted.name), decided

    def add_can_logs(
        self, files: Sequence[UploadedFile], rig: Path, wanted: CanLogImport
    ) -> tuple[ExperimentRow, tuple[str, ...]]:
        """Store the experiment that logs of a CAN bus make by a rig's file, or add them to the one that is wanted.

        Raises as `add_records`.
        """
        known = self._experiments.declared(wanted.experiment) if wanted.experiment else None
        with self._experiments.incoming() as place:
            folder = place / "experiment"
            decided = self._read(
                f"{RECORDS}:import_can_records",
                folder=str(place),
                files=self._put_aside_all(files, place),
                rig=str(rig),
                known=known.robot if known else None,
                wanted=wanted,
                target=str(folder),
            )
            if known is not None:
                _refuse_other_payloads(known, read_experiment_file(folder / EXPERIMENT_FILE).payloads)
            if wanted.experiment:
                return self._append(wanted.experiment, folder), decided
            return self._experiments.adopt(folder, wanted.name), decided

    def _append(self, experiment: str, folder: Path) -> ExperimentRow:
        """Add the sessions of one experiment, which lies in a folder, to another of the same robot: all, or none."""
        target = self._experiments.folder(experiment)
        added = read_experiment_file(folder / EXPERIMENT_FILE)
        bodies = {each.name: each for each in added.payloads}
        settings = target / EXPERIMENT_FILE
        with changing(target):
            before = settings.read_bytes()
            there = {each.name for each in read_experiment_file(settings).payloads}
            claimed: list[Path] = []
            try:
                for each in added.sessions:
                    claimed.append(self._claim(experiment, folder / each.file, Path(each.file).suffix))
                    new = None if each.payload in there else bodies[each.payload]
                    append_session(target, each.model_copy(update={"file": claimed[-1].name}), new)
                    there.add(each.payload)
                if added.prior is not None:
                    keep_prior(target, added.prior)
            except BaseException:
                settings.write_bytes(before)
                for file in claimed:
                    file.unlink()
                raise
        self._experiments.refresh(experiment)
        return self._experiments.row(experiment)

    def _put_aside_all(self, files: Sequence[UploadedFile], place: Path) -> list[str]:
        """Each file under its name, made harmless, in a folder of its own; their paths from `place`."""
        names = []
        for number, file in enumerate(files):
            plain = re.sub(r"[^A-Za-z0-9_.-]", "_", re.split(r"[/\\]", file.name)[-1])[-100:].lstrip(".")
            names.append(f"{number}/{plain or 'record'}")
            (place / str(number)).mkdir()
            _put_aside(file.content, place / names[-1], self._limit)
        return names

    def _read(self, function: str, **arguments: object) -> Any:
        try:
            return self._reader(function, **arguments)
        except LimitExceeded as error:
            raise Problem(413, f"The upload cannot be read here: {error}.") from error
        except InputError as error:
            detail = str(error)
            raise InputError(
                f"the upload {detail}" if detail.startswith("cannot be read") else detail
            ) from error

    def _claim(self, experiment: str, file: Path, ending: str) -> Path:
        """Give a file the next free number of the experiment; two that come together get two."""
        target = self._experiments.folder(experiment)
        while True:
            final = target / f"{self._experiments.next_session_id(experiment)}{ending}"
            try:
                os.link(file, final)
            except FileExistsError:
                continue
            return final


def _refuse_other_payloads(known: ExperimentFile, given: Sequence[Payload]) -> None:
    """Raise the problem 409 where an experiment has a payload of the same name that is another one."""
    there = {each.name: each for each in known.payloads}
    for payload in given:
        if payload.name in there and there[payload.name].mass != payload.mass:
            raise Problem(
                409,
                f"The payload {payload.name} is {there[payload.name].mass} kg in this experiment; use another name.",
            )


def _put_aside(upload: IO[bytes], file: Path, limit: int) -> None:
    """Copy an upload from wherever it was spooled to the disk of the experiments."""
    with file.open("xb") as stream:
        shutil.copyfileobj(upload, stream, BLOCK)
        if stream.tell() > limit:
            raise Problem(413, f"The upload is larger than {limit} bytes.")


def _shown(file_name: str) -> str:
    return "".join(each for each in file_name if each.isprintable())[:100]
