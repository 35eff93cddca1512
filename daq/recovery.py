"""Finishing what a kill or a power cut left: recordings that were never closed, sessions that were never listed.

Every flushed row of an HDF5 file in SWMR mode is readable, but the file stays marked as being written and most
programs refuse it. It is copied into a closed one; the original is kept until the copy is on disk.
"""

import fcntl
import json
import os
from collections.abc import Collection
from dataclasses import dataclass, replace
from pathlib import Path

import h5py

from daq.admission import measured
from daq.experiment_folder import INCOMPLETE, admit
from daq.recorder import raw_log_of
from daq.recording_file import set_status
from daq.rig import KnownPayload
from daq.safety import StopCause
from identify.recording.errors import InputError
from identify.recording.experiment_file import EXPERIMENT_FILE
from identify.recording.session_hdf5 import CYCLE


@dataclass(frozen=True)
class RecordingState:
    """What a recording says of itself."""

    path: Path
    status: str
    """`recording` while it grows, and after a kill; `complete`, `aborted`, `faulted`"""
    reason: str
    rows: int
    payload: str
    role: str
    admitted: bool = False
    """whether it was listed in the experiment just now"""
    lacks: str = ""
    """why it is not listed, and what to do about it"""


def recording_state(path: Path) -> RecordingState:
    """Read a recording's state, closed or not.

    Raises InputError where the file is no recording or is damaged beyond reading.
    """
    try:
        with h5py.File(path, "r", libver="latest", swmr=True) as file:
            attributes = file.attrs
            rows = min(len(column) for column in _columns(file).values())
            payload = json.loads(str(attributes["payload"]))
            return RecordingState(
                path,
                str(attributes["status"]),
                str(attributes["status_reason"]),
                rows,
                payload["name"],
                str(attributes.get("role", "identification")),
            )
    except (OSError, KeyError, ValueError) as error:
        raise InputError(f"{path}: cannot be read as a recording ({error})") from None


def recover_recording(path: Path, status: str, reason: str) -> RecordingState:
    """Close a recording that was left open, keeping every row that all of its columns have.

    Raises InputError where it cannot be read, or is not open.
    """
    before = recording_state(path)
    if before.status != "recording":
        raise InputError(f"{path}: is closed already ({before.status}); there is nothing to recover")
    copy = path.with_suffix(".recovered")
    copy.unlink(missing_ok=True)
    with (
        h5py.File(path, "r", libver="latest", swmr=True) as source,
        h5py.File(copy, "x", libver="latest") as target,
    ):
        for name, value in source.attrs.items():
            target.attrs[name] = value
        for name, column in _columns(source).items():
            copied = target.create_dataset(
                name,
                data=column[: before.rows],
                maxshape=(None, *column.shape[1:]),
                chunks=column.chunks,
            )
            for key, value in column.attrs.items():
                copied.attrs[key] = value
    set_status(copy, status, reason, {"recovered": True, "rows": before.rows}, StopCause.RECORDER.value)
    os.replace(copy, path)
    _mend_log(raw_log_of(path))
    return RecordingState(path, status, reason, before.rows, before.payload, before.role)


def _columns(file: h5py.File) -> dict[str, h5py.Dataset]:
    """The data sets of samples by name."""
    columns = {str(name): item for name, item in file.items() if isinstance(item, h5py.Dataset)}
    if CYCLE not in columns:
        raise KeyError(f"no data set {CYCLE!r}")
    return columns


def _mend_log(log: Path) -> None:
    """Cut a last line that was written in part; a reader would stumble over it."""
    if not log.exists():
        return
    with log.open("r+b") as file:
        end = file.seek(0, os.SEEK_END)
        start = max(0, end - 4096)
        file.seek(start)
        tail = file.read()
        whole = tail.rfind(b"\n") + 1
        if start + whole < end:
            file.truncate(start + whole)


def recover_experiment(folder: Path, reason: str, admit_too: Collection[str] = ()) -> list[RecordingState]:
    """Look at every incomplete session of an experiment: close those that were left open, and list those that may serve
    identification (`daq.admission`), so that nothing measured is lost.

    admit_too : names of files that a person has looked at, and that are listed whatever ended them

    Recordings that are still growing are left alone. Raises InputError where the folder holds no experiment, or no
    incomplete session has such a name.
    """
    experiment = folder / EXPERIMENT_FILE
    if not experiment.is_file():
        raise InputError(f"{folder}: holds no {EXPERIMENT_FILE}")
    paths = sorted((folder / INCOMPLETE).glob("session-*.h5"))
    for name in admit_too:
        if name not in [path.name for path in paths]:
            raise InputError(f"--admit {name}: {folder / INCOMPLETE} holds no such recording")
    states: list[RecordingState] = []
    for path in paths:
        if being_written(path):
            if path.name in admit_too:
                raise InputError(f"--admit {path.name}: is being recorded")
            continue
        state = recording_state(path)
        if state.status == "recording":
            state = recover_recording(path, "faulted", reason)
        states.append(admit_if_it_may_serve(folder, state, decided=path.name in admit_too))
    return states


def admit_if_it_may_serve(folder: Path, state: RecordingState, decided: bool = False) -> RecordingState:
    """List a closed recording in its experiment, if its plan was driven to its end, if it may serve, or if a person has so
    decided; its state then.
    """
    path = state.path
    if state.status != "complete":
        try:
            found = measured(path)
        except (OSError, KeyError, ValueError) as error:
            return replace(state, lacks=f"cannot be judged ({error})")
        lacks = found.lacks
        if not lacks and found.needs_a_person and not decided:
            lacks = f"look at it, then `coulomb recover {folder} --admit {path.name}`"
        if lacks:
            return replace(state, lacks=f"{found.words}; {lacks}")
        _remember(path, f"{found.words}; listed" + (" by hand" if decided else ""))
    with h5py.File(path, "r") as file:
        payload = KnownPayload.model_validate_json(str(file.attrs["payload"]))
    role = "validation" if state.role == "validation" else "identification"
    listed = admit(folder, path, payload, role)
    return replace(recording_state(listed), admitted=True)


def _remember(path: Path, words: str) -> None:
    """Write into a closed recording how it came to be listed."""
    with h5py.File(path, "r+", libver="latest") as file:
        file.attrs["status_reason"] = f"{file.attrs['status_reason']}; {words}"
        file.flush()
        os.fsync(file.id.get_vfd_handle())


def being_written(path: Path) -> bool:
    """Whether a recorder is at work on a recording: it holds a lock on the raw log as long as it lives."""
    log = raw_log_of(path)
    if not log.exists():
        return False
    with log.open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
    return False
