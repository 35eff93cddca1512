"""The live view: the newest samples of the ring in SI units, for a terminal or a browser. It may skip."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from daq.rig import Rig
from daq.ring_buffer import RingReader
from daq.samples import COMMAND_CAME, joint_positions, sample_dtype


@dataclass(frozen=True)
class LiveRows:
    """Samples of n axes, (M, n) each; NaN where nothing came."""

    cycle: NDArray[np.int64]
    """(M,) index of the SYNC"""
    time: NDArray[np.float64]
    """(M,) s of the rig's clock"""
    position: NDArray[np.float64]
    """rad or m"""
    setpoint: NDArray[np.float64]
    """rad or m"""
    command: NDArray[np.float64]
    """A"""
    valid: NDArray[np.uint8]
    """bits as in the recording"""
    temperature: NDArray[np.float64]
    """°C"""
    phase: NDArray[np.uint8]
    """(M,) `daq.samples.Phase`"""

    @classmethod
    def of(cls, rig: Rig, rows: NDArray[Any]) -> Self:
        """From rows (M,) of the ring."""
        matrix, offset = rig.position_matrix, rig.position_offset
        position = joint_positions(rows["position"], rows["valid"], matrix, offset)
        command = rows["command"] * rig.command_scale
        command[(rows["valid"] & COMMAND_CAME) == 0] = np.nan
        return cls(
            cycle=rows["cycle"].copy(),
            time=rows["sync_time"] * 1e-9,
            position=position,
            setpoint=rows["setpoint"] @ matrix.T + offset,
            command=command,
            valid=rows["valid"].copy(),
            temperature=rows["temperature"].astype(float),
            phase=rows["phase"].copy(),
        )

    @classmethod
    def empty(cls, rig: Rig) -> Self:
        """No samples."""
        return cls.of(rig, np.empty(0, sample_dtype(len(rig.axes))))


class LiveView:
    """A reader of the ring that looks at the newest rows and leaves the others."""

    def __init__(self, rig: Rig, reader: RingReader) -> None:
        self._rig = rig
        self._reader = reader

    @classmethod
    def attach(cls, rig: Rig, ring: str) -> Self | None:
        """A view of the ring of that name, None where there is none (yet)."""
        try:
            return cls(rig, RingReader(ring))
        except FileNotFoundError:
            return None

    def latest(self, seconds: float) -> LiveRows:
        """The newest samples, at most `seconds` of them."""
        return LiveRows.of(self._rig, self._reader.latest(max(1, round(seconds / self._rig.cycle))))

    def close(self) -> None:
        """Detach."""
        self._reader.close()
