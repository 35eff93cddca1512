"""A sample is a SYNC cycle: its row in the ring buffer, and how aligned PDOs become rows.

Raw is the truth: a row holds what the drives said, in their own counts.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.alignment import AlignedRows
from drivers.process_data import DriveStream
from identify.recording.session_hdf5 import CAME_AGAIN, CAME_LATE, COMMAND_CAME, POSITION_CAME, SYNC_NOT_SEEN


class Phase(IntEnum):
    """What was going on in a cycle."""

    STANDSTILL = 0
    APPROACH = 1
    """from where the robot stood to where the plan begins"""
    PLAN = 2
    STOPPING = 3
    """a stop reason has come up; until the axis rests"""


def sample_dtype(axes: int) -> np.dtype[Any]:
    """Type of a row for so many axes.

    cycle, sync_time (ns), phase; per axis: position (counts), command (raw current reference), setpoint (raw
    target that took effect at this SYNC), status (statusword 0x6041), valid (bits as in the recording),
    temperature (°C, NaN where none)
    """
    return np.dtype(
        [
            ("cycle", "<i8"),
            ("sync_time", "<i8"),
            ("phase", "u1"),
            ("position", "<i4", (axes,)),
            ("command", "<i4", (axes,)),
            ("setpoint", "<i4", (axes,)),
            ("status", "<u2", (axes,)),
            ("valid", "u1", (axes,)),
            ("temperature", "<f4", (axes,)),
        ]
    )


def joint_positions(
    counts: NDArray[Any],
    valid: NDArray[Any],
    matrix: NDArray[np.float64],
    offset: NDArray[np.float64] | float,
) -> NDArray[np.float64]:
    """(M, n) rad or m from the axes' counts; NaN of a joint where the position of an axis that moves it did not come.

    counts : (M, n); valid : (M, n) bits as in the recording
    matrix : (n, n) joint position per count; offset : (n,) rad or m where all counts are 0
    """
    came = (valid & POSITION_CAME) != 0
    position = np.where(came, counts, 0) @ matrix.T + offset
    position[(~came).astype(int) @ (matrix != 0).T > 0] = np.nan
    return position


class SessionRows:
    """Picks the rows that a recording holds, block by block: from the plan's begin until the axes stand still after it.

    None is left out between two that are picked. What came before, and what comes up after the plan's end (a stop while the
    axes settle), is in the raw log.
    """

    def __init__(self) -> None:
        self._begun = self._over = False

    def take(self, rows: NDArray[Any]) -> NDArray[Any]:
        """Those of the next rows (M,) that are recorded."""
        if self._over or not len(rows):
            return rows[:0]
        if not self._begun:
            planned = rows["phase"] == Phase.PLAN
            self._begun = bool(planned.any())
            rows = rows[int(np.argmax(planned)) :] if self._begun else rows[:0]
        after = np.flatnonzero((rows["phase"] != Phase.PLAN) & (rows["phase"] != Phase.STOPPING))
        if len(after):
            self._over = True
            return rows[: after[0]]
        return rows


@dataclass(frozen=True)
class _Value:
    """Where one value of one axis lies: column of the alignment, bytes in its PDO."""

    column: int
    offset: int
    kind: np.dtype[Any]


class _Values:
    """One value of every axis; axes whose drives map it alike are decoded together.

    values : of the axes, in their order
    """

    def __init__(self, values: Sequence[_Value]) -> None:
        self.columns = np.array([value.column for value in values])
        alike: dict[tuple[int, np.dtype[Any]], list[int]] = {}
        for axis, value in enumerate(values):
            alike.setdefault((value.offset, value.kind), []).append(axis)
        self._groups = [
            (np.array(axes), self.columns[axes], slice(offset, offset + kind.itemsize), kind)
            for (offset, kind), axes in alike.items()
        ]

    def into(self, target: NDArray[Any], aligned: AlignedRows) -> None:
        """Put the values into target (M, n), 0 where a PDO did not come."""
        for axes, columns, place, kind in self._groups:
            data = np.ascontiguousarray(aligned.data[:, columns, place])
            target[:, axes] = data.view(kind)[:, :, 0]


class RowDecoder:
    """Turns aligned PDOs into rows.

    streams : what each axis sends, in the order of the axes
    temperature_scale : °C per raw count of each axis's temperature, where it has one
    """

    def __init__(self, streams: Sequence[DriveStream], temperature_scale: Sequence[float | None]) -> None:
        self.columns: dict[int, int] = {}
        """CAN id -> length of every PDO expected in a cycle, for the alignment"""
        for stream in streams:
            for pdo in stream.transmit:
                self.columns[pdo.can_id] = pdo.length
        column_of_id = {identifier: column for column, identifier in enumerate(self.columns)}

        def find(stream: DriveStream, name: str) -> _Value:
            pdo, entry = stream.find(name)
            return _Value(column_of_id[pdo.can_id], entry.byte_offset, np.dtype(entry.kind))

        self._position, self._command, self._status = (
            _Values([find(stream, name) for stream in streams])
            for name in ("position", "command", "statusword")
        )
        measured = [axis for axis, scale in enumerate(temperature_scale) if scale is not None]
        self._temperature_axes = np.array(measured, int)
        self._temperature = _Values([find(streams[axis], "temperature") for axis in measured])
        self._temperature_scale = np.array([scale for scale in temperature_scale if scale is not None])
        self.dtype = sample_dtype(len(streams))

    def rows(self, aligned: AlignedRows, setpoint: NDArray[Any], phase: NDArray[Any]) -> NDArray[Any]:
        """Rows (M,) of `sample_dtype`; setpoint (M, n) and phase (M,) are those of the same cycles."""
        rows = np.zeros(len(aligned), self.dtype)
        rows["cycle"] = aligned.cycle
        rows["sync_time"] = aligned.sync_time
        rows["setpoint"] = setpoint
        rows["phase"] = phase
        rows["temperature"] = np.nan
        for name, values in (
            ("position", self._position),
            ("command", self._command),
            ("status", self._status),
        ):
            values.into(rows[name], aligned)
        rows["valid"] = self._valid(aligned)
        if len(self._temperature_axes):
            raw = np.zeros((len(rows), len(self._temperature_axes)))
            self._temperature.into(raw, aligned)
            came = aligned.came[:, self._temperature.columns]
            rows["temperature"][:, self._temperature_axes] = np.where(
                came, raw * self._temperature_scale, np.nan
            )
        return rows

    def _valid(self, aligned: AlignedRows) -> NDArray[np.uint8]:
        """(M, n) bits of the recording."""
        position, command = self._position.columns, self._command.columns
        valid = aligned.came[:, position] * np.uint8(POSITION_CAME)
        valid |= aligned.came[:, command] * np.uint8(COMMAND_CAME)
        if aligned.late.any():
            valid |= (aligned.late[:, position] | aligned.late[:, command]) * np.uint8(CAME_LATE)
        if aligned.surplus.any():
            valid |= (aligned.surplus[:, position] | aligned.surplus[:, command]) * np.uint8(CAME_AGAIN)
        valid[~aligned.sync_seen] |= np.uint8(SYNC_NOT_SEEN)
        return valid
