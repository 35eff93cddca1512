"""Uploaded experiments and sessions, taken in without trusting a byte of them.

Names inside an archive are never used as paths: only plain names of known kinds are accepted, and what they
unpack to is counted while it is written. An HDF5 file may point to other files on this machine; such files
are refused.
"""

import gzip
import re
import shutil
import zipfile
import zlib
from pathlib import Path
from typing import IO, Literal

import h5py

from api.service.database import ExperimentRow
from api.service.experiment_store import ExperimentStore, session_id
from api.service.problems import Problem
from api.service.session_table import rewrite_by_contract
from identify.recording import (
    DeclaredSession,
    Experiment,
    InputError,
    Payload,
    append_session,
    load_experiment,
    write_experiment,
)
from identify.recording.experiment_file import EXPERIMENT_FILE

PLAIN_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,99}")
SESSION_ENDINGS = (".csv", ".csv.gz", ".h5", ".hdf5")
OTHER_ENDINGS = (".yaml", ".yml")
MOST_FILES = 1000
LARGEST_SETTINGS = 1 << 20
"""Bytes of a YAML file."""
BLOCK = 1 << 20
"""Bytes copied at a time."""


def import_archive(experiments: ExperimentStore, upload: IO[bytes], limit: int) -> ExperimentRow:
    """Store the experiment in a zip archive: `experiment.yaml` and the files it names, at its top or in one
    folder.

    limit : bytes that everything may unpack to, decompressed sessions included

    Raises InputError if it is not such an archive or the experiment is not valid, and the problem 413 if it
    is too large.
    """
    with experiments.incoming() as folder:
        _unpack(upload, folder, limit)
        try:
            loaded = load_experiment(folder)
            _check_sessions(loaded, folder, limit)
        except InputError as error:
            raise InputError(_without_folder(error, folder)) from error
        return experiments.adopt(folder, loaded.name)


def import_session(
    experiments: ExperimentStore,
    experiment: str,
    upload: IO[bytes],
    file_name: str,
    payload: str,
    role: Literal["identification", "validation"],
    new_payload: Payload | None,
    limit: int,
) -> None:
    """Add one uploaded session file to an experiment, under the next free name.

    Raises InputError, which calls the file by the name it came with, if it cannot be read as a session of this robot, and
    the problem 413 if it is too large.
    """
    ending = next(
        (each for each in sorted(SESSION_ENDINGS, key=len, reverse=True) if file_name.endswith(each)), None
    )
    if ending is None:
        raise InputError(f"file: the name must end in {', '.join(SESSION_ENDINGS)}")
    target = experiments.folder(experiment)
    declared = experiments.declared(experiment)
    known = {each.name: each for each in declared.payloads}
    if payload not in known and new_payload is None:
        raise InputError(f"payload: {payload!r} is not one of {', '.join(known)}; give its mass to add it")
    if payload in known and new_payload is not None and known[payload].mass != new_payload.mass:
        raise Problem(
            409, f"The payload {payload} is {known[payload].mass} kg; leave the mass out or use another name."
        )
    with experiments.incoming() as folder:
        name = experiments.next_session_id(experiment) + ending
        with (folder / name).open("xb") as stream:
            _copy(upload, stream, limit)
        shutil.copyfile(target / EXPERIMENT_FILE, folder / EXPERIMENT_FILE)
        addition = DeclaredSession(file=name, payload=payload, role=role)
        alone = declared.model_copy(update={"sessions": (), "effects": ()})
        try:
            if ending.startswith(".csv"):
                if ending.endswith(".gz"):
                    _check_decompressed_size(folder / name, limit)
                rewrite_by_contract(folder / name, declared.robot)
            write_experiment(folder, alone)
            append_session(folder, addition, None if payload in known else new_payload)
            _check_sessions(load_experiment(folder), folder, limit)
        except InputError as error:
            raise InputError(_without_folder(error, folder).replace(name, file_name)) from error
        (folder / name).rename(target / name)
        append_session(target, addition, None if payload in known else new_payload)
    experiments.refresh(experiment)


def _unpack(upload: IO[bytes], folder: Path, limit: int) -> None:
    try:
        archive = zipfile.ZipFile(upload)
    except (zipfile.BadZipFile, OSError, ValueError) as error:
        raise InputError("file: not a zip archive") from error
    members = [member for member in archive.infolist() if not member.is_dir()]
    if len(members) > MOST_FILES:
        raise Problem(413, f"The archive holds {len(members)} files; {MOST_FILES} are the most.")
    left = limit
    top = {member.filename.rpartition("/")[0] for member in members}
    if len(top) > 1:
        raise InputError("file: the archive's files must all be at its top or in one folder")
    for member in members:
        name = member.filename.rpartition("/")[2]
        if not PLAIN_NAME.fullmatch(name) or not name.endswith((*SESSION_ENDINGS, *OTHER_ENDINGS)):
            raise InputError(
                f"file: {member.filename!r} is not experiment.yaml or a session's .csv, .csv.gz or .h5"
            )
        try:
            with archive.open(member) as packed, (folder / name).open("xb") as stream:
                most = left if name.endswith(SESSION_ENDINGS) else min(left, LARGEST_SETTINGS)
                left -= _copy(packed, stream, most)
        except (zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError, EOFError) as error:
            raise InputError(f"file: {member.filename!r} cannot be unpacked ({error})") from error
        except FileExistsError:
            raise InputError(f"file: {member.filename!r} is in the archive twice") from None
    if not (folder / EXPERIMENT_FILE).is_file():
        raise InputError(f"file: the archive holds no {EXPERIMENT_FILE}")


def _copy(source: IO[bytes], target: IO[bytes], limit: int) -> int:
    """Copy at most `limit` bytes; returns how many."""
    copied = 0
    while block := source.read(BLOCK):
        copied += len(block)
        if copied > limit:
            raise Problem(413, "The upload unpacks to more than this service accepts.")
        target.write(block)
    return copied


def _check_sessions(experiment: Experiment, folder: Path, limit: int) -> None:
    """Read every session once: what cannot be read is not stored."""
    names = [entry.file for entry in experiment.sessions]
    names += [str(path.relative_to(folder)) for path in experiment.effects]
    given = {path.name for path in folder.iterdir()}
    for name in names:
        if name not in given:  # also a name with folders in it
            raise InputError(f"{EXPERIMENT_FILE}: sessions: {name!r} is not a file of the upload")
    ids = [session_id(entry.file) for entry in experiment.sessions]
    for path in (folder / entry.file for entry in experiment.sessions):
        if ids.count(session_id(path.name)) > 1:
            raise InputError(f"{EXPERIMENT_FILE}: sessions: two files are called {session_id(path.name)}")
        if path.name.endswith(".gz"):
            _check_decompressed_size(path, limit)
        elif path.name.endswith((".h5", ".hdf5")):
            _check_hdf5(path, limit)
    for entry in experiment.sessions:
        experiment.read(entry)


def _check_decompressed_size(path: Path, limit: int) -> None:
    size = 0
    try:
        with gzip.open(path) as stream:
            while block := stream.read(BLOCK):
                size += len(block)
                if size > limit:
                    raise Problem(413, f"{path.name} unpacks to more than this service accepts.")
    except (OSError, EOFError, zlib.error) as error:
        raise InputError(f"{path.name}: not a gzip file ({error})") from error


def _check_hdf5(path: Path, limit: int) -> None:
    """Refuse links out of the file, data kept elsewhere, and more data than is accepted."""
    try:
        with h5py.File(path, "r") as recording:
            size = 0
            for name in recording:
                link = recording.get(name, getlink=True)
                if not isinstance(link, h5py.HardLink):
                    raise InputError(f"{path.name}: {name} is a link; a recording holds its data itself")
                found = recording[name]
                if not isinstance(found, h5py.Dataset):
                    raise InputError(f"{path.name}: {name} is not a data set")
                if found.external or found.is_virtual:
                    raise InputError(f"{path.name}: {name} keeps its data in another file")
                size += found.nbytes
            if size > limit:
                raise Problem(413, f"{path.name} unpacks to more than this service accepts.")
    except (OSError, RuntimeError, KeyError, ValueError) as error:
        raise InputError(f"{path.name}: not a readable HDF5 file ({error})") from error


def _without_folder(error: InputError, folder: Path) -> str:
    """The message without the folder that only this service knows."""
    return str(error).replace(f"{folder}/", "").replace(str(folder), "the upload")
