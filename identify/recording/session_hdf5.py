"""A recorded session in HDF5: the layout, and its reader.

The names here are the layout's; the recorder writes by them. Raw counts are scaled on reading, so a wrong
gear ratio is mended by mending an attribute.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from identify.recording.controller_file import ControllerFile
from identify.recording.errors import InputError
from identify.recording.first_fault import first_fault
from identify.recording.interpolation import interpolate
from identify.recording.samples import RawSamples, SampleColumns
from identify.recording.sampling import largest_bridged_step

if TYPE_CHECKING:
    import h5py

Array = NDArray[np.float64]

FORMAT = 1
"""Attribute `format` of the root."""

CYCLE = "cycle"
SYNC_TIME = "sync_time"
POSITION = "position"
COMMAND = "command"
SETPOINT = "setpoint"
VALID = "valid"
TEMPERATURE = "temperature"

MATRIX = "matrix"
OFFSET = "offset"
"""Attributes of `position`: q = matrix @ counts + offset."""
SCALE = "scale"
"""Attribute of `command`: v = scale * raw."""

POSITION_CAME = 1
COMMAND_CAME = 2
CAME_LATE = 4
SYNC_NOT_SEEN = 8
CAME_AGAIN = 16
"""Bits of `valid`: what came in this cycle, what came late, a SYNC whose time is interpolated, what came more than once."""

CONTROLLER = "controller"
"""Attribute of the root: the gains that were read from the drives before the session, JSON; not there where none were."""

RECORDING = "recording"
COMPLETE = "complete"
ABORTED = "aborted"
FAULTED = "faulted"
"""Values of the root's attribute `status`."""

REGULAR_WITHIN = 0.05
"""Of the cycle: SYNC times this close to a regular clock (99 of 100) mean that the SYNC was regular and
only reading the clock was not; the index of the cycle is then the better time."""
DRIFT_WITHIN = 1e-3
"""A cycle that differs by more from the nominal one is measured, not believed."""
AS_FAST_AS_ANSWERED = "as-fast-as-answered"
"""Value of `pacing` in the rig that a simulated session is recorded with."""
BLOCK = 1 << 17
"""Rows read at a time."""
MARGIN = 16
"""Rows read beside a block, to bridge a hole at its border."""


def is_hdf5(path: Path) -> bool:
    """Whether a file begins as HDF5 files do."""
    try:
        with path.open("rb") as stream:
            return stream.read(8) == b"\x89HDF\r\n\x1a\n"
    except OSError:
        return False


def read_hdf5_session(path: Path, n: int, setpoints: bool = False) -> RawSamples:
    """Read a recorded session of n joints.

    setpoints : whether the setpoints in force at each SYNC are read too, as columns `qref1` ... `qrefn`, rad or m

    Isolated missing samples of an axis are bridged and counted in the remarks; rows in a longer hole are
    left out, so that time has a hole there.

    Raises InputError: the file cannot be read or is not of the layout; names the data set or attribute.
    """
    try:
        with _opened(path) as file:
            return _read(file, path, n, setpoints)
    except OSError as error:
        reason = str(error).splitlines()[0] if str(error) else "no reason given"
        raise InputError(f"{path}: cannot be read as HDF5: {reason}") from None


def read_hdf5_controller(path: Path) -> ControllerFile | None:
    """The gains of the drives' own controllers that a recording holds; None where they were not read.

    Raises InputError: the file cannot be read, or its attribute `controller` is wrong.
    """
    try:
        with _opened(path) as file:
            held = file.attrs.get(CONTROLLER)
    except OSError as error:
        raise InputError(f"{path}: cannot be read as HDF5: {str(error).splitlines()[0]}") from None
    if held is None:
        return None
    try:
        return ControllerFile.model_validate_json(_text(held))
    except ValidationError as error:
        raise InputError(f"{path}: attribute '{CONTROLLER}': {first_fault(error)}") from None


def _opened(path: Path) -> h5py.File:
    """Open for reading, also while it is being written or after its writer was killed.

    SWMR reading is asked for only where the file's flags say that a writer is, or was, at it: on a file
    that was cut short it would wait for ever for the rest to be written.
    """
    import h5py

    try:
        return h5py.File(path, "r")
    except OSError as error:
        if "already open for write" not in str(error) and "unable to lock" not in str(error):
            raise
    return h5py.File(path, "r", swmr=True)


@dataclass(eq=False)
class _Layout:
    """The data sets of a session, checked."""

    rows: int
    cycle: NDArray[np.int64]
    sync_time: NDArray[np.int64]
    position: h5py.Dataset
    command: h5py.Dataset
    valid: NDArray[np.uint8]
    temperature: h5py.Dataset | None
    matrix: Array
    offset: Array
    scale: Array


def _read(file: h5py.File, path: Path, n: int, setpoints: bool) -> RawSamples:
    layout = _layout(file, path, n)
    remarks = _status_remarks(file)
    time, nominal = _time(file, layout, path, remarks)
    came = (layout.valid & (POSITION_CAME | COMMAND_CAME)) == POSITION_CAME | COMMAND_CAME
    if not came.any(axis=0).all():
        axis = int(np.argmin(came.any(axis=0))) + 1
        raise InputError(
            f"{path}: data set {VALID}: axis {axis} never answered; the session holds nothing to identify"
        )
    longest = int(largest_bridged_step(nominal) / nominal + 1e-6) - 1
    dead = _long_holes(came, longest)
    bridged = int((~came[~dead]).sum())
    if bridged:
        part = bridged / came.size
        remarks.append(f"{bridged} missing samples ({part:.2g} of all) bridged by local interpolation")
    if dead.any():
        remarks.append(f"{int(dead.sum())} cycles without an answer of some axis left out")
    late = int(((layout.valid & CAME_LATE) > 0).sum())
    if late:
        remarks.append(f"{late} samples came late")
    position, command = SampleColumns(n), SampleColumns(n)
    for rows in _blocks(layout.rows):
        wide = slice(max(rows.start - MARGIN, 0), min(rows.stop + MARGIN, layout.rows))
        inner = slice(rows.start - wide.start, rows.stop - wide.start)
        alive = ~dead[rows]
        ticks = layout.cycle[wide].astype(float)
        counts = _bridged(ticks, layout.position[wide].astype(float), came[wide], cubic=True)[inner]
        raw = _bridged(ticks, layout.command[wide].astype(float), came[wide], cubic=False)[inner]
        position.append((counts @ layout.matrix.T + layout.offset)[alive])
        command.append((raw * layout.scale)[alive])
    temperature = _temperature(layout, dead, remarks)
    extra: dict[str, NDArray[Any]] = {}
    if setpoints:
        sent = _data_set(file, SETPOINT, path)[: layout.rows].astype(float) @ layout.matrix.T + layout.offset
        extra = {f"qref{joint + 1}": setpoints_in_force(sent)[~dead, joint] for joint in range(n)}
    return RawSamples(time[~dead], position.array(), command.array(), None, temperature, extra, remarks)


def setpoints_in_force(sent: Array) -> Array:
    """(N, n) setpoints that the drives followed when they sampled at each SYNC: what is sent with a SYNC is in force from the
    next. Of the first row, before which nothing is recorded, what was sent with it.

    sent : (N, n) as recorded, row by row what was sent with that SYNC
    """
    return np.concatenate([sent[:1], sent[:-1]])


def _layout(file: h5py.File, path: Path, n: int) -> _Layout:
    """Check what the file holds."""
    form = file.attrs.get("format")
    if form is None:
        raise InputError(f"{path}: attribute 'format' is missing; this is not a recording of a session")
    if _number(form) != FORMAT:
        raise InputError(f"{path}: attribute 'format' is {form}; this version reads format {FORMAT}")
    sets = {name: _data_set(file, name, path) for name in (CYCLE, SYNC_TIME, POSITION, COMMAND, VALID)}
    for name in (POSITION, COMMAND, VALID):
        shape = sets[name].shape
        if len(shape) != 2 or shape[1] != n:
            raise InputError(
                f"{path}: data set '{name}' has the shape {shape}; the experiment declares {n} joints"
            )
    # A recording that was cut off may have grown in one data set and not yet in another.
    rows = min(len(data) for data in sets.values())
    if rows == 0:
        raise InputError(f"{path}: holds no samples")
    cycle, sync_time = sets[CYCLE][:rows], sets[SYNC_TIME][:rows]
    time_falls = np.diff(sync_time) <= 0 if not _time_is_counted_in_cycles(file) else False
    falls = np.flatnonzero((np.diff(cycle) <= 0) | time_falls)
    if len(falls):
        row = int(falls[0]) + 1
        if _text(file.attrs.get("status", COMPLETE)) != RECORDING:
            name, values = (CYCLE, cycle) if cycle[row] <= cycle[row - 1] else (SYNC_TIME, sync_time)
            raise InputError(
                f"{path}: data set '{name}' row {row}: {values[row]} does not come after {values[row - 1]}"
            )
        rows = row  # what the killed writer had not yet handed over
    temperature = _data_set(file, TEMPERATURE, path) if TEMPERATURE in file else None
    return _Layout(
        rows=rows,
        cycle=cycle[:rows],
        sync_time=sync_time[:rows],
        position=sets[POSITION],
        command=sets[COMMAND],
        valid=sets[VALID][:rows],
        temperature=temperature if temperature is not None and len(temperature) >= rows else None,
        matrix=_attribute(sets[POSITION], MATRIX, (n, n), path),
        offset=_attribute(sets[POSITION], OFFSET, (n,), path),
        scale=_attribute(sets[COMMAND], SCALE, (n,), path),
    )


def _data_set(file: h5py.File, name: str, path: Path) -> h5py.Dataset:
    import h5py

    data = file.get(name)
    if not isinstance(data, h5py.Dataset):
        raise InputError(f"{path}: data set '{name}' is missing")
    if data.dtype.kind not in "iuf":
        raise InputError(f"{path}: data set '{name}' holds {data.dtype}, not numbers")
    return data


def _attribute(data: h5py.Dataset, name: str, shape: tuple[int, ...], path: Path) -> Array:
    where = f"{path}: attribute '{name}' of data set '{str(data.name).lstrip('/')}'"
    if name not in data.attrs:
        raise InputError(f"{where} is missing; it scales the raw counts")
    value = np.asarray(data.attrs[name])
    if value.shape != shape or value.dtype.kind not in "iuf" or not np.isfinite(value).all():
        raise InputError(f"{where} must be {' x '.join(map(str, shape))} finite numbers")
    return value.astype(float)


def _number(value: Any) -> float | None:
    """The value of an attribute that is one number; None of anything else."""
    one = np.asarray(value)
    return float(one) if one.ndim == 0 and one.dtype.kind in "iuf" else None


def _status_remarks(file: h5py.File) -> list[str]:
    status = _text(file.attrs.get("status", COMPLETE))
    reason = _text(file.attrs.get("status_reason", ""))
    if status == RECORDING:
        return ["the recording was cut off before its end; what was on disk is used"]
    if status in (ABORTED, FAULTED):
        return [
            f"the session was {status}{': ' + reason if reason else ''}; what was measured until then is used"
        ]
    return []


def _text(value: Any) -> str:
    return value.decode() if isinstance(value, bytes) else str(value)


def _time(file: h5py.File, layout: _Layout, path: Path, remarks: list[str]) -> tuple[Array, float]:
    """Time of every row, s from the first, and the cycle, s."""
    nominal = _number(file.attrs.get("cycle"))
    if nominal is None or not nominal > 0:
        raise InputError(
            f"{path}: attribute 'cycle' is missing or no number above 0; it is the time between two SYNCs in s"
        )
    ticks = (layout.cycle - layout.cycle[0]).astype(float)
    if _time_is_counted_in_cycles(file) or layout.rows < 3:
        return ticks * nominal, nominal
    stamps = (layout.sync_time - layout.sync_time[0]) * 1e-9
    cycle, start = np.polyfit(ticks, stamps, 1)
    jitter = np.abs(stamps - (start + cycle * ticks))
    if np.quantile(jitter, 0.99) > REGULAR_WITHIN * nominal:
        remarks.append(
            f"the SYNC was not regular (jitter {np.sqrt(np.mean(jitter**2)) * 1e6:.3g} us, at most"
            f" {jitter.max() * 1e6:.3g} us): its recorded times are used"
        )
        return stamps, float(np.median(np.diff(stamps) / np.diff(ticks)))
    if abs(cycle / nominal - 1) > DRIFT_WITHIN:
        remarks.append(
            f"the cycle took {cycle * 1e3:.5g} ms instead of {nominal * 1e3:.5g} ms; the former is used"
        )
        return ticks * cycle, float(cycle)
    return ticks * nominal, nominal


def _time_is_counted_in_cycles(file: h5py.File) -> bool:
    """Whether only the cycle's index tells the time that passed for the joints: behind simulated drives time
    passes with SYNC, in whatever rhythm it came.
    """
    try:
        rig = json.loads(_text(file.attrs.get("rig", "{}")))
        return rig.get("pacing") == AS_FAST_AS_ANSWERED or bool(rig.get("simulated"))
    except (ValueError, AttributeError, RecursionError):
        return False


def _blocks(rows: int) -> Iterator[slice]:
    for first in range(0, rows, BLOCK):
        yield slice(first, min(first + BLOCK, rows))


def _long_holes(came: NDArray[np.bool_], longest: int) -> NDArray[np.bool_]:
    """(N,) rows in which some axis misses more than `longest` samples in a row, or misses at the record's
    ends."""
    dead = np.zeros(len(came), dtype=bool)
    for axis in range(came.shape[1]):
        missing = np.concatenate([[False], ~came[:, axis], [False]])
        starts, stops = np.flatnonzero(np.diff(missing.astype(np.int8))).reshape(-1, 2).T
        for start, stop in zip(starts, stops, strict=True):
            if stop - start > longest or start == 0 or stop == len(came):
                dead[start:stop] = True
    return dead


def _bridged(ticks: Array, values: Array, came: NDArray[np.bool_], cubic: bool) -> Array:
    """Each axis' missing values interpolated from the nearest that came."""
    for axis in np.flatnonzero(~came.all(axis=0)):
        there = came[:, axis]
        if there.sum() >= 2:
            gone = ~there
            filled = interpolate(ticks[there], values[there][:, axis : axis + 1], ticks[gone], cubic)
            values[gone, axis] = filled[:, 0]
    return values


def _temperature(layout: _Layout, dead: NDArray[np.bool_], remarks: list[str]) -> Array | None:
    """Temperatures of all axes, their gaps bridged; None unless every axis has some."""
    if layout.temperature is None:
        return None
    values = layout.temperature[: layout.rows].astype(float)
    known = np.isfinite(values)
    if not known.any():
        return None
    if not known.any(axis=0).all():
        axis = int(np.argmin(known.any(axis=0))) + 1
        remarks.append(f"axis {axis} has no temperature: temperatures are not used")
        return None
    rows = np.arange(layout.rows)
    for axis in range(values.shape[1]):
        there = known[:, axis]
        values[:, axis] = np.interp(rows, rows[there], values[there, axis])
    return values[~dead]
