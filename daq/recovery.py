"""Finishing what a kill or a power cut left: recordings that were never closed, sessions that were never listed.

Every flushed row of an HDF5 file in SWMR mode is readable, but the file stays marked as being written and most
programs refuse it. It is copied into a closed one; the original is kept until the copy is on disk.
"""

import contextlib
import fcntl
import json
import os
import time
from collections.abc import Collection, Generator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from daq.admission import measured
from daq.experiment_folder import INCOMPLETE, Role, admit, changing, open_experiment
from daq.raw_log import mend, raw_log_of
from daq.recording_file import RecorderProcess, set_status
from daq.rig import Rig
from daq.safety import StopCause
from drivers.errors import DriverError
from identify.recording import DeclaredSession, Payload, append_session
from identify.recording.errors import InputError
from identify.recording.experiment_file import EXPERIMENT_FILE, read_experiment_file
from identify.recording.session_hdf5 import CYCLE

_UNREADABLE = (OSError, KeyError, ValueError, TypeError, RuntimeError, AttributeError, IndexError)
"""what h5py raises where a file is damaged, or holds something else than a recording of ours"""


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
    cycle: float = 0.0
    """s between two rows; 0 where the recording does not say it"""


_LOOKS, _BETWEEN_LOOKS = 20, 0.05
"""how often, and s in between, a recording is looked at that somebody writes: HDF5 lets a reader see the half of an attribute"""
UNREADABLE = "unreadable"
"""status of a file that is no recording, or is damaged beyond reading"""


def recording_state(path: Path) -> RecordingState:
    """Read a recording's state, closed or not; one that is being written is looked at again until it makes sense.

    Raises InputError where the file is no recording or is damaged beyond reading.
    """
    looks = 1
    while True:
        before = _as_it_stands(path)
        try:
            return _state_now(path)
        except InputError:
            if looks == _LOOKS or (before == _as_it_stands(path) and not before[0]):
                raise
        looks += 1
        time.sleep(_BETWEEN_LOOKS)


def _as_it_stands(path: Path) -> tuple[bool, int, int]:
    """Whether the file is open for writing, by its superblock (HDF5 File Format Specification 3.0, II.A, versions 2 and 3), or
    was left so; its size; its time in ns."""
    try:
        with path.open("rb") as file:
            head = file.read(12)
        known = path.stat()
    except OSError:
        return False, 0, 0
    return len(head) == 12 and head[8] >= 2 and head[11] != 0, known.st_size, known.st_mtime_ns


def _state_now(path: Path) -> RecordingState:
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
                str(payload["name"]),
                str(attributes.get("role", "identification")),
                cycle=float(attributes.get("cycle", 0.0)),
            )
    except _UNREADABLE as error:
        raise InputError(f"{path}: cannot be read as a recording ({_in_words(error)})") from None


def _in_words(error: Exception) -> str:
    """What HDF5 or a wrong attribute says, in one line."""
    if isinstance(error, KeyError):
        return f"it lacks {error.args[0]}" if error.args else "it lacks something"
    return (getattr(error, "strerror", None) or str(error) or type(error).__name__).splitlines()[0]


def recover_recording(
    path: Path,
    status: str,
    reason: str,
    left: NDArray[Any] | None = None,
    cause: StopCause = StopCause.RECORDER,
) -> RecordingState:
    """Close a recording that was left open, keeping every row that all of its columns have.

    left : further rows of `daq.samples.sample_dtype` that had not come to disk, for example from the ring; those that the
        file has already are passed over

    Raises InputError where it cannot be read, is not open, or somebody is at work on it.
    """
    with _taken(path):
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
            columns = _columns(source)
            cycles = np.asarray(columns[CYCLE][: before.rows])
            last = int(cycles[-1]) if len(cycles) else -1
            more = None if left is None else left[left["cycle"] > last]
            for name, column in columns.items():
                values = np.asarray(column[: before.rows])
                if more is not None:
                    values = np.concatenate([values, more[name].astype(values.dtype)])
                copied = target.create_dataset(
                    name, data=values, maxshape=(None, *column.shape[1:]), chunks=column.chunks
                )
                for key, value in column.attrs.items():
                    copied.attrs[key] = value
        rows = before.rows + (0 if more is None else len(more))
        set_status(copy, status, reason, {"recovered": True, "rows": rows}, cause.value)
        os.replace(copy, path)
        log = raw_log_of(path)
        if log.exists():
            mend(log)
    return RecordingState(path, status, reason, rows, before.payload, before.role)


@contextmanager
def _taken(path: Path) -> Generator[None]:
    """Nobody else is at work on a recording, and nobody begins to. Raises InputError where somebody is."""
    if being_written(path):
        raise InputError(f"{path}: is being recorded")
    log = raw_log_of(path)
    if not log.exists():
        yield
        return
    with log.open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InputError(f"{path}: is being recorded, or recovered, by another process") from None
        yield


def _columns(file: h5py.File) -> dict[str, h5py.Dataset]:
    """The data sets of samples by name."""
    columns = {str(name): item for name, item in file.items() if isinstance(item, h5py.Dataset)}
    if CYCLE not in columns:
        raise KeyError(f"no data set {CYCLE!r}")
    return columns


def recover_experiment(folder: Path, reason: str, admit_too: Collection[str] = ()) -> list[RecordingState]:
    """Look at every incomplete session of an experiment: close those that were left open, and list those that may serve
    identification (`daq.admission`), so that nothing measured is lost.

    admit_too : names of files that a person has looked at, and that are listed whatever ended them

    Recordings that are still growing are left alone. Raises InputError where the folder holds no experiment, or no
    incomplete session has such a name.
    """
    paths = sorted((folder / INCOMPLETE).glob("session-*.h5"))
    experiment = folder / EXPERIMENT_FILE
    if not experiment.exists():
        restore_experiment_file(folder)
    for name in admit_too:
        if name not in [path.name for path in paths]:
            raise InputError(f"--admit {name}: {folder / INCOMPLETE} holds no such recording")
    # A file that is wrong is said before anything is moved.
    read_experiment_file(experiment)
    states: list[RecordingState] = []
    for path in paths:
        if being_written(path):
            if path.name in admit_too:
                raise InputError(f"--admit {path.name}: is being recorded")
            continue
        try:
            state = recording_state(path)
            if state.status == "recording":
                state = recover_recording(path, "faulted", reason)
            state = admit_if_it_may_serve(folder, state, decided=path.name in admit_too)
        except InputError as error:
            # One bad file must not keep the others from being saved.
            fault = f"{str(error).removeprefix(f'{path}: ')}; move it elsewhere, or delete it, if nobody can read it"
            state = RecordingState(path, UNREADABLE, "", 0, "", "", lacks=fault)
        states.append(state)
    return states


def restore_experiment_file(folder: Path) -> None:
    """Write an experiment's file anew, from what its recordings say of rig, payload and role.

    Sessions in CSV say neither, so they are not listed. Raises InputError where no recording can be read.
    """
    for place in (folder, folder / INCOMPLETE):
        for path in sorted(place.glob("session-*.h5")):
            try:
                with h5py.File(path, "r", libver="latest", swmr=True) as file:
                    rig = Rig.model_validate_json(str(file.attrs["rig"]))
            except (*_UNREADABLE, DriverError):
                continue
            open_experiment(folder, rig)
            _list_again(folder)
            return
    raise InputError(f"{folder}: holds no {EXPERIMENT_FILE}, and no recording that says what it was")


def _list_again(folder: Path) -> None:
    """List the recordings that stand in the experiment's folder itself: they were listed once."""
    for path in sorted(folder.glob("session-*.h5")):
        try:
            state = recording_state(path)
            with h5py.File(path, "r") as file:
                payload = Payload.model_validate_json(str(file.attrs["payload"]))
        except (InputError, *_UNREADABLE):
            continue
        with changing(folder):
            append_session(
                folder,
                DeclaredSession(file=path.name, payload=payload.name, role=_role(state.role)),
                Payload(**payload.model_dump()),
            )


def _role(text: str) -> Role:
    return "validation" if text == "validation" else "identification"


def admit_if_it_may_serve(folder: Path, state: RecordingState, decided: bool = False) -> RecordingState:
    """List a closed recording in its experiment, if its plan was driven to its end, if it may serve, or if a person has so
    decided; its state then.
    """
    path = state.path
    if state.status != "complete":
        try:
            verdict = measured(path)
        except _UNREADABLE as error:
            return replace(state, lacks=f"cannot be judged ({_in_words(error)})")
        lacks = verdict.lacks
        if not lacks and verdict.needs_a_person and not decided:
            lacks = f"look at it, then `coulomb recover {folder} --admit {path.name}`"
        if lacks:
            return replace(state, lacks=f"{verdict.words}; {lacks}")
        _remember(path, f"{verdict.words}; listed" + (" by hand" if decided else ""))
    try:
        with h5py.File(path, "r") as file:
            payload = Payload.model_validate_json(str(file.attrs["payload"]))
    except _UNREADABLE as error:
        raise InputError(f"{path}: does not say its payload ({_in_words(error)})") from None
    listed = admit(folder, path, payload, _role(state.role))
    return replace(recording_state(listed), admitted=True)


def _remember(path: Path, remark: str) -> None:
    """Write into a closed recording how it came to be listed."""
    with h5py.File(path, "r+", libver="latest") as file:
        file.attrs["status_reason"] = f"{file.attrs['status_reason']}; {remark}"
        file.flush()
        os.fsync(file.id.get_vfd_handle())


def being_written(path: Path) -> bool:
    """Whether a recorder is at work on a recording: it holds a lock on the raw log as long as it lives, and has written
    into the recording who it is, should the log have been deleted.
    """
    log = raw_log_of(path)
    with contextlib.suppress(FileNotFoundError), log.open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        return False
    try:
        with h5py.File(path, "r", libver="latest", swmr=True) as recording:
            recorder = RecorderProcess.model_validate_json(str(recording.attrs["recorder"]))
            return str(recording.attrs["status"]) == "recording" and recorder.runs
    except _UNREADABLE:
        return False
