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

POSITION_CAME = 0x01
COMMAND_CAME = 0x02
CAME_LATE = 0x04
SYNC_NOT_SEEN = 0x08
CAME_AGAIN = 0x10


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


@dataclass(frozen=True)
class _Value:
    """Where one value of one axis lies: column of the alignment, bytes in its PDO."""

    column: int
    offset: int
    kind: np.dtype[Any]

    def of(self, aligned: AlignedRows) -> NDArray[Any]:
        """(M,) the value in every row, 0 where its PDO did not come."""
        end = self.offset + self.kind.itemsize
        data = np.ascontiguousarray(aligned.data[:, self.column, self.offset : end])
        return data.view(self.kind)[:, 0]


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

        self._position = [find(stream, "position") for stream in streams]
        self._command = [find(stream, "command") for stream in streams]
        self._status = [find(stream, "statusword") for stream in streams]
        self._temperature = [
            None if scale is None else (find(stream, "temperature"), scale)
            for stream, scale in zip(streams, temperature_scale, strict=True)
        ]
        self.dtype = sample_dtype(len(streams))

    def rows(self, aligned: AlignedRows, setpoint: NDArray[Any], phase: NDArray[Any]) -> NDArray[Any]:
        """Rows (M,) of `sample_dtype`; setpoint (M, n) and phase (M,) are those of the same cycles."""
        rows = np.zeros(len(aligned), self.dtype)
        rows["cycle"] = aligned.cycle
        rows["sync_time"] = aligned.sync_time
        rows["setpoint"] = setpoint
        rows["phase"] = phase
        rows["temperature"] = np.nan
        not_seen = np.where(aligned.sync_seen, 0, SYNC_NOT_SEEN)
        for axis, (position, command, status) in enumerate(
            zip(self._position, self._command, self._status, strict=True)
        ):
            rows["position"][:, axis] = position.of(aligned)
            rows["command"][:, axis] = command.of(aligned)
            rows["status"][:, axis] = status.of(aligned)
            valid = aligned.came[:, position.column] * POSITION_CAME
            valid |= aligned.came[:, command.column] * COMMAND_CAME
            valid |= (aligned.late[:, position.column] | aligned.late[:, command.column]) * CAME_LATE
            again = aligned.surplus[:, position.column] | aligned.surplus[:, command.column]
            rows["valid"][:, axis] = valid | again * CAME_AGAIN | not_seen
            temperature = self._temperature[axis]
            if temperature is not None:
                value, scale = temperature
                rows["temperature"][:, axis] = np.where(
                    aligned.came[:, value.column], scale * value.of(aligned), np.nan
                )
        return rows
