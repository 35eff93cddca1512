"""An uploaded archive or session, read without trusting a byte of it, in a process of its own (confined_reader.py).

Names inside an archive are never used as paths: what `experiment.yaml` names is looked up (archive_members.py) and stored under
a plain name; the rest is passed over. All that an upload unpacks to
is counted together: members of the archive, what compressed sessions decompress to, what HDF5 files declare. An HDF5 file
may point to other files on this machine; such files are refused.
"""

import gzip
import zipfile
import zlib
from pathlib import Path
from typing import IO, Any

import h5py

from api.service.archive_members import ArchiveMembers, Member, known_ending, leads_out, plain_name
from api.service.folder_description import HDF5_ENDINGS
from api.service.job_process import Progress
from api.service.problems import Problem
from api.service.session_ids import session_id
from api.service.session_notes import NOTES, read_notes, write_notes
from api.service.session_table import rewrite_by_contract
from identify.recording import (
    DeclaredSession,
    Experiment,
    ExperimentFile,
    InputError,
    Payload,
    append_session,
    load_experiment,
    write_experiment,
)
from identify.recording.experiment_file import EXPERIMENT_FILE, read_experiment_file

SESSION_ENDINGS = (".csv", ".csv.gz", ".h5", ".hdf5")
OTHER_ENDINGS = (".yaml", ".yml")
MOST_FILES = 1000
LARGEST_SETTINGS = 1 << 20
"""Bytes of a YAML file."""
LARGEST_DIRECTORY = 1 << 20
"""Bytes of an archive's list of its members, some 100 for each."""
MOST_OBJECTS = 1000
"""Data sets and attributes of an HDF5 file."""
LARGEST_ATTRIBUTES = 4 << 20
"""Bytes of all attributes of an HDF5 file; a rig file in one of ours takes some thousand."""
BLOCK = 1 << 20
"""Bytes copied at a time."""


class Allowance:
    """What one upload may still unpack to, in bytes, all its files together."""

    def __init__(self, limit: int) -> None:
        self._left = limit

    def take(self, count: int, name: str) -> None:
        """Count bytes of a file. Raises the problem 413 where they are too many."""
        self._left -= count
        if self._left < 0:
            raise Problem(413, f"With {name}, the upload unpacks to more than this service accepts.")


def read_archive(progress: Progress, archive: str, folder: str, limit: int) -> tuple[str, list[str]]:
    """Unpack an experiment into a folder and read all of it once; returns the experiment's name, and which members of the
    archive were passed over.

    limit : bytes that everything may unpack to

    Raises InputError if it is not such an archive or the experiment is not valid, and the problem 413 if it is too large.
    """
    target, allowance = Path(folder), Allowance(limit)
    try:
        with open(archive, "rb") as stream:
            passed_over = _unpack(stream, target, allowance)
        loaded = load_experiment(target)
        _check_sessions(loaded, target, allowance)
    except InputError as error:
        raise InputError(_without_folder(error, target)) from error
    return loaded.name, passed_over


def read_session(
    progress: Progress,
    folder: str,
    declared: ExperimentFile,
    addition: DeclaredSession,
    payload: Payload | None,
    limit: int,
) -> None:
    """Read a session's file, which lies in the folder, as one of the experiment; it is rewritten by the contract if need be.

    payload : a new one, that the experiment does not have yet

    Raises InputError if it cannot be read as a session of this robot, and the problem 413 if it is too large.
    """
    place, allowance = Path(folder), Allowance(limit)
    file = place / addition.file
    try:
        if file.name.lower().endswith(".csv.gz"):
            _count_decompressed(file, allowance)
        if file.name.lower().endswith((".csv", ".csv.gz")):
            rewrite_by_contract(file, declared.robot)
        write_experiment(place, declared.model_copy(update={"sessions": (), "effects": ()}))
        append_session(place, addition, payload)
        _check_sessions(load_experiment(place), place, Allowance(limit))
    except InputError as error:
        raise InputError(_without_folder(error, place)) from error


def _unpack(upload: IO[bytes], folder: Path, allowance: Allowance) -> list[str]:
    """Unpack `experiment.yaml`, what it names and the notes on it, under plain names; returns what was passed over."""
    try:
        archive = zipfile.ZipFile(_WithoutHugeDirectory(upload))
    except (zipfile.BadZipFile, OSError, ValueError) as error:
        raise InputError(
            "file: not a zip archive; pack the experiment's folder as a .zip and upload that"
        ) from error
    members = ArchiveMembers(archive)
    _extract(archive, members.experiment, folder / EXPERIMENT_FILE, allowance, LARGEST_SETTINGS)
    declared = read_experiment_file(folder / EXPERIMENT_FILE)
    wanted = [(f"sessions[{k}].file", each.file) for k, each in enumerate(declared.sessions)]
    wanted += [(f"effects[{k}]", name) for k, name in enumerate(declared.effects)]
    if len(wanted) > MOST_FILES:
        raise Problem(413, f"The experiment names {len(wanted)} files; {MOST_FILES} are the most.")
    stored: dict[str, str] = {}
    for field, name in wanted:
        endings = SESSION_ENDINGS if field.startswith("sessions") else OTHER_ENDINGS
        ending = known_ending(name, endings)
        if ending is None:
            raise InputError(f"{EXPERIMENT_FILE}: {field}: {name!r} must end in {', '.join(endings)}")
        member = None if leads_out(name) else members.find(name)
        if member is None:
            raise InputError(f"{EXPERIMENT_FILE}: {field}: {name!r} is not a file of the upload")
        plain = plain_name(name.replace("\\", "/").rpartition("/")[2], ending)
        if plain in (*stored.values(), EXPERIMENT_FILE, NOTES):
            raise InputError(f"{EXPERIMENT_FILE}: {field}: two files would be stored as {plain}; rename one")
        most = None if endings is SESSION_ENDINGS else LARGEST_SETTINGS
        _extract(archive, member, folder / plain, allowance, most)
        stored[name] = plain
    if (notes := members.beside(NOTES)) is not None:
        _extract(archive, notes, folder / NOTES, allowance, LARGEST_SETTINGS)
    if any(name != plain for name, plain in stored.items()):
        _rename(folder, declared, stored)
    if notes is not None:
        said = read_notes(folder)
        write_notes(folder, {stored.get(file, file): note for file, note in said.items()})
    return members.passed_over()


def _extract(
    archive: zipfile.ZipFile, member: Member, target: Path, allowance: Allowance, most: int | None
) -> None:
    try:
        with archive.open(member.info) as packed, target.open("xb") as stream:
            _copy(packed, stream, allowance, most)
    except (zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError, EOFError) as error:
        raise InputError(f"file: {member.shown!r} cannot be unpacked ({error})") from error


def _rename(folder: Path, declared: ExperimentFile, stored: dict[str, str]) -> None:
    """Let the experiment's files name each file as it is stored."""
    sessions = tuple(each.model_copy(update={"file": stored[each.file]}) for each in declared.sessions)
    effects = tuple(stored[name] for name in declared.effects)
    write_experiment(folder, declared.model_copy(update={"sessions": sessions, "effects": effects}))


class _WithoutHugeDirectory:
    """An archive's file from which no list of members of millions of entries is read at once."""

    def __init__(self, file: IO[bytes]) -> None:
        self._file = file
        self.seekable, self.seek, self.tell = file.seekable, file.seek, file.tell

    def read(self, count: int = -1) -> bytes:
        if count > LARGEST_DIRECTORY:
            raise Problem(413, f"The archive's list of files is longer than {LARGEST_DIRECTORY} bytes.")
        return self._file.read(count)


def _copy(source: IO[bytes], target: IO[bytes], allowance: Allowance, most: int | None) -> None:
    copied = 0
    while block := source.read(BLOCK):
        copied += len(block)
        allowance.take(len(block), Path(target.name).name)
        if most is not None and copied > most:
            raise Problem(413, f"A file of settings in the upload is larger than {most} bytes.")
        target.write(block)


def _check_sessions(experiment: Experiment, folder: Path, allowance: Allowance) -> None:
    """Read every session once: what cannot be read is not stored."""
    listed = (*experiment.sessions, *experiment.excluded)
    names = [entry.file for entry in listed]
    names += [
        str(path.relative_to(folder) if path.is_relative_to(folder) else path) for path in experiment.effects
    ]
    given = {path.name for path in folder.iterdir()}
    for name in names:
        if name not in given:  # also a name with folders in it
            raise InputError(f"{EXPERIMENT_FILE}: sessions: {name!r} is not a file of the upload")
    ids = [session_id(entry.file) for entry in listed]
    for path in (folder / entry.file for entry in listed):
        if ids.count(session_id(path.name)) > 1:
            raise InputError(f"{EXPERIMENT_FILE}: sessions: two files are called {session_id(path.name)}")
        if path.name.lower().endswith(".gz"):
            _count_decompressed(path, allowance)
        elif path.name.lower().endswith(HDF5_ENDINGS):
            _check_hdf5(path, allowance)
    for entry in listed:
        experiment.read(entry)


def _count_decompressed(path: Path, allowance: Allowance) -> None:
    try:
        with gzip.open(path) as stream:
            while block := stream.read(BLOCK):
                allowance.take(len(block), path.name)
    except (OSError, EOFError, zlib.error) as error:
        raise InputError(f"{path.name}: not a gzip file ({error})") from error


def _check_hdf5(path: Path, allowance: Allowance) -> None:
    """Refuse links out of the file, data kept elsewhere, and more data or attributes than are accepted."""
    try:
        with h5py.File(path, "r") as recording:
            if len(recording) > MOST_OBJECTS:
                raise Problem(
                    413, f"{path.name} holds {len(recording)} objects; {MOST_OBJECTS} are the most."
                )
            _check_attributes(path.name, recording)
            for name in recording:
                link = recording.get(name, getlink=True)
                if not isinstance(link, h5py.HardLink):
                    raise InputError(f"{path.name}: {name} is a link; a recording holds its data itself")
                member = recording[name]
                if not isinstance(member, h5py.Dataset):
                    raise InputError(f"{path.name}: {name} is not a data set")
                if member.external or member.is_virtual:
                    raise InputError(f"{path.name}: {name} keeps its data in another file")
                # A chunk is unpacked whole, however little of it is asked for.
                chunk = int(member.dtype.itemsize)
                for length in member.chunks or ():
                    chunk *= length
                allowance.take(max(member.nbytes, chunk), path.name)
                _check_attributes(path.name, member)
    except (OSError, RuntimeError, KeyError, ValueError, TypeError) as error:
        raise InputError(f"{path.name}: not a readable HDF5 file ({error})") from error


def _check_attributes(name: str, member: h5py.Group | h5py.Dataset) -> None:
    if len(member.attrs) > MOST_OBJECTS:
        raise Problem(413, f"{name} holds {len(member.attrs)} attributes; {MOST_OBJECTS} are the most.")
    attributes: Any = member.attrs  # whose `get_id` is missing from the type stubs
    size = sum(attributes.get_id(each).get_storage_size() for each in attributes)
    if size > LARGEST_ATTRIBUTES:
        raise Problem(413, f"{name} holds attributes of {size} bytes; {LARGEST_ATTRIBUTES} are the most.")


def _without_folder(error: InputError, folder: Path) -> str:
    """The message without the folder that only this service knows."""
    return str(error).replace(f"{folder}/", "").replace(str(folder), "the upload")
