"""A session out of a log of CAN frames: what was recorded with anything, read by a rig file's mapping.

The frames go the way that live ones go (`alignment.py`, `samples.py`) into a recording as `recorder.py` writes it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.alignment import SYNC_ID, SyncAlignment
from daq.can_log_reader import CLASSIC_DATA, LoggedFrame, read_frames
from daq.json_object import JsonObject
from daq.logged_mapping import LoggedMapping, mapping_of_log
from daq.recording_file import RecordingFile, SessionDescription
from daq.rig import Rig
from daq.safety import StopCause
from daq.samples import COMMAND_CAME, POSITION_CAME, Phase, RowDecoder
from drivers.cia402 import State
from drivers.frames import FRAME
from drivers.process_data import DriveStream
from identify.recording.errors import InputError
from identify.recording.experiment_file import Payload

FEWEST_ROWS = 16


@dataclass(frozen=True)
class LoggedSession:
    """Rows of a session that were found in a log."""

    rows: NDArray[Any]
    """(M,) of `daq.samples.sample_dtype`"""
    counters: JsonObject
    """of the alignment"""
    remarks: tuple[str, ...]
    """What was decided, in an operator's words."""


def read_can_log(path: Path, rig: Rig, begin: float | None = None, end: float | None = None) -> LoggedSession:
    """The rows of a log between two times, s from its first SYNC; without them, those in which all drives were enabled.

    Raises InputError in one line when the log cannot be read, or lacks SYNC or a drive's process data.
    """
    logged, remarks = read_frames(path)
    mapping = mapping_of_log(path, logged, rig)
    streams = mapping.streams
    remarks += mapping.remarks
    frames = _frames(logged, mapping)
    _refuse_without_sync(path, frames)
    scales = [
        None if profile.temperature is None or not rig.record_temperature else profile.temperature.scale
        for profile in rig.profiles
    ]
    decoder = RowDecoder(streams, scales)
    alignment = SyncAlignment(decoder.columns, rig.cycle)
    parts = [alignment.feed(frames), alignment.flush()]
    decoded = [
        decoder.rows(
            part, np.zeros((len(part), len(streams)), np.int32), np.full(len(part), Phase.PLAN, np.uint8)
        )
        for part in parts
    ]
    rows = np.concatenate(decoded)
    rows["setpoint"] = _setpoints(frames, streams, rows["sync_time"])
    short = alignment.counters.too_short
    if short:
        plural = "s have" if short > 1 else " has"
        remarks.append(
            f"{short} frame{plural} less data than the PDO: cut off, or mapped otherwise; left out"
        )
    chosen, remark = _chosen(path, rows, begin, end)
    return LoggedSession(chosen, {"alignment": alignment.counters.to_json()}, (*remarks, remark))


def write_recording(
    path: Path, session: LoggedSession, rig: Rig, payload: Payload, role: str, source: Path
) -> None:
    """Write the rows as a recording of the rig.

    Raises OSError when the disk does not take them.
    """
    stamp = int(session.rows["sync_time"][0])
    description = SessionDescription(
        rig,
        {"imported_from": source.name},
        payload,
        "",
        "stamps of the log",
        role,
        started=datetime.fromtimestamp(stamp * 1e-9, UTC),
        remarks=session.remarks,
    )
    file = RecordingFile(path, description)
    file.append(session.rows)
    file.finish("complete", f"imported from {source.name}", session.counters, StopCause.PLAN_DONE.value)


def _frames(logged: Sequence[LoggedFrame], mapping: LoggedMapping) -> NDArray[Any]:
    """Frames of SYNC and process data in the order of the log, of the channel of the drives."""
    transmitted = {each for stream in mapping.streams for each in stream.transmit_ids}
    identifiers = {mapping.sync_id, *transmitted, *(stream.receive.can_id for stream in mapping.streams)}
    wanted = [
        frame
        for frame in logged
        if not frame.extended and frame.channel == mapping.channel and frame.can_id in identifiers
    ]
    frames = np.zeros(len(wanted), FRAME)
    frames["stamp"] = [frame.stamp for frame in wanted]
    frames["can_id"] = [frame.can_id if frame.can_id != mapping.sync_id else SYNC_ID for frame in wanted]
    frames["flags"] = [frame.flags for frame in wanted]
    frames["length"] = [len(frame.data) for frame in wanted]
    padded = b"".join(frame.data.ljust(CLASSIC_DATA, b"\0") for frame in wanted)
    frames["data"] = np.frombuffer(padded, np.uint8).reshape(-1, CLASSIC_DATA)
    return frames


def _refuse_without_sync(path: Path, frames: NDArray[Any]) -> None:
    if SYNC_ID not in frames["can_id"]:
        raise InputError(
            f"{path}: holds no SYNC (id 0x80), which separates one sample from the next; log it as well"
        )


def _setpoints(
    frames: NDArray[Any], streams: Sequence[DriveStream], sync_time: NDArray[np.int64]
) -> NDArray[np.int32]:
    """(M, n) targets that took effect at each SYNC: the last one sent before it, 0 where none was."""
    setpoints = np.zeros((len(sync_time), len(streams)), np.int32)
    for axis, stream in enumerate(streams):
        sent = frames[frames["can_id"] == stream.receive.can_id]
        if not len(sent):
            continue
        entry = stream.receive.entry("target")
        size = np.dtype(entry.kind).itemsize
        raw = np.ascontiguousarray(sent["data"][:, entry.byte_offset : entry.byte_offset + size])
        targets = raw.view(entry.kind)[:, 0]
        last = np.searchsorted(sent["stamp"], sync_time, side="left") - 1
        setpoints[:, axis] = np.where(last >= 0, targets[np.clip(last, 0, None)], 0)
    return setpoints


def _chosen(
    path: Path, rows: NDArray[Any], begin: float | None, end: float | None
) -> tuple[NDArray[Any], str]:
    if len(rows):
        seconds = (rows["sync_time"] - rows["sync_time"][0]) * 1e-9
        keep = np.ones(len(rows), bool)
        if begin is not None or end is not None:
            keep &= (seconds >= (begin or 0.0) - 1e-9) & (seconds <= (np.inf if end is None else end) + 1e-9)
            how = "as given"
        else:
            came = (rows["valid"] & (POSITION_CAME | COMMAND_CAME)) == POSITION_CAME | COMMAND_CAME
            mask, pattern = State.OPERATION_ENABLED.value
            on = ((rows["status"] & mask == pattern) | ~came).all(axis=1) & came.any(axis=1)
            keep = _longest(on)
            how = "in which all drives were enabled"
        if keep.sum() >= FEWEST_ROWS:
            first, last = seconds[keep][0], seconds[keep][-1]
            short = end is not None and last < end - 2 * np.median(np.diff(seconds))
            return rows[keep], (
                f"{int(keep.sum())} cycles from {first:.6g} to {last:.6g} s of the log, {how}"
                + (f"; it ends before {end:.6g} s" if short else "")
            )
    raise InputError(
        f"{path}: holds no {FEWEST_ROWS} cycles in which all drives were enabled; name a part by --begin and --end"
    )


def _longest(on: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The longest run of rows that are on."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], on, [False]]).astype(np.int8)))
    keep = np.zeros(len(on), bool)
    if len(edges):
        starts, stops = edges[::2], edges[1::2]
        best = int(np.argmax(stops - starts))
        keep[starts[best] : stops[best]] = True
    return keep
