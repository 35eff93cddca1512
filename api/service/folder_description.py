"""What the index says of an experiment's folder, read in a process of its own (confined_reader.py): files in it may come
from anybody."""

import json
from contextlib import suppress
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path

import h5py

from api.service.job_process import Progress
from api.service.session_payload import SessionPayload, UndescribedPayload, session_payload
from identify.recording.errors import InputError
from identify.recording.experiment_file import EXPERIMENT_FILE, ExperimentFile, read_experiment_file
from identify.recording.plain_text import printable

INCOMPLETE = "incomplete"
"""Folder within an experiment for recordings that were stopped."""
MEASURED = "measured"
"""State of a session whose file the experiment names; a recording that ended badly says so instead."""
RECORDED = frozenset({"done", "aborted", "faulted", "recording"})
"""States of files that this software recorded, as they say themselves."""
HDF5_ENDINGS = (".h5", ".hdf5")
LOOKED_AT = ("status", "status_reason", "weighed_mass", "payload", "role")
"""Attributes of a recording that the index wants."""
LONGEST_ATTRIBUTE = 100_000
"""Letters of an attribute that are looked at."""


@dataclass(frozen=True)
class RecordingDescription:
    """A session's file as it says itself: state and reason in words, kg weighed, payload and role where it is ours."""

    state: str
    reason: str | None
    weighed: float | None = None
    payload: SessionPayload = field(default_factory=UndescribedPayload)
    role: str = "identification"


@dataclass(frozen=True)
class FolderDescription:
    """An experiment's folder.

    declared   : its experiment file; None where that is wrong
    problem    : what is wrong with it, one line
    recordings : of each file that it lists, and of each in `incomplete/`, by path within the folder
    """

    declared: ExperimentFile | None
    problem: str | None
    recordings: dict[str, RecordingDescription] = field(default_factory=dict)


def describe_folders(progress: Progress, folders: list[str]) -> list[FolderDescription]:
    """A description of each folder, in the same order."""
    return [describe_folder(Path(folder)) for folder in folders]


def describe_folder(folder: Path) -> FolderDescription:
    """One folder, described."""
    try:
        declared = read_experiment_file(folder / EXPERIMENT_FILE)
    except InputError as error:
        return FolderDescription(None, str(error).replace(f"{folder}/", ""))
    files = [entry.file for entry in declared.sessions]
    files += [f"{INCOMPLETE}/{file.name}" for file in sorted((folder / INCOMPLETE).glob("*.h5"))]
    return FolderDescription(declared, None, {file: _recording(folder / file) for file in files})


def _recording(file: Path) -> RecordingDescription:
    """Only our own recordings say more than that they exist."""
    if not file.is_file():
        return RecordingDescription("missing", f"the file {file.name} is not there")
    if file.suffix.lower() not in HDF5_ENDINGS:
        return RecordingDescription(MEASURED, None)
    try:
        attributes = _attributes(file)
    except (OSError, RuntimeError, ValueError) as error:
        return RecordingDescription("damaged", str(error).replace(f"{file.parent}/", ""))
    status = attributes.get("status") or MEASURED
    state = "done" if status == "complete" else status
    weighed = _weighed_mass(attributes) if state in RECORDED else None
    reason = attributes.get("status_reason") or None
    role = "validation" if attributes.get("role") == "validation" else "identification"
    return RecordingDescription(state, reason, weighed, _payload(attributes), role)


def _weighed_mass(attributes: dict[str, str]) -> float | None:
    """kg, as a recording of ours has it."""
    try:
        mass = float(attributes["weighed_mass"])
    except (KeyError, ValueError):
        return None
    return mass if isfinite(mass) else None


def _payload(attributes: dict[str, str]) -> SessionPayload:
    try:
        return session_payload(json.loads(attributes["payload"]))
    except (KeyError, ValueError, RecursionError):
        return UndescribedPayload()


def _attributes(file: Path) -> dict[str, str]:
    """Texts among a recording's attributes; the file may be being written.

    What cannot be read, an attribute of a type that NumPy has not, for instance, is passed over: one odd file must not hide
    the others.
    """
    attributes: dict[str, str] = {}
    with h5py.File(file, "r", swmr=True, locking=False) as recording:
        for name in LOOKED_AT:
            with suppress(TypeError, ValueError, OSError, RuntimeError, KeyError):
                attributes[name] = printable(str(recording.attrs[name])[:LONGEST_ATTRIBUTE])
    return attributes
