"""A session of an experiment: as it is declared, and its samples once they are read."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identify.recording.experiment_file import Payload

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SessionEntry:
    """A session that the experiment declares; cheap, nothing of its samples is read yet."""

    file: str
    """As it stands in the experiment file."""
    path: Path
    payload: Payload
    role: str
    """identification or validation"""
    excluded: str | None = None
    """Why no model is to use it; None for those that take part."""


@dataclass(frozen=True, eq=False)
class Session:
    """The samples of one session, in SI units, uniform in time within each segment."""

    entry: SessionEntry
    time: Array
    """(N,) s"""
    position: Array
    """(N, n) rad or m"""
    command: Array
    """(N, n) in the unit that the drive gain expects"""
    segments: tuple[slice, ...]
    """Rows of uniform sampling without a hole."""
    sampling_period: float
    """s"""
    external: Array | None = None
    """(N, n) N m or N, known external joint force"""
    temperature: Array | None = None
    """(N, n) degC"""
    extra: dict[str, NDArray[Any]] = field(default_factory=dict)
    """Other columns, name -> (N,)"""
    remarks: tuple[str, ...] = ()
    """What was resampled, bridged or left out, in words."""

    @property
    def n(self) -> int:
        """Number of joints."""
        return self.position.shape[1]

    def in_memory(self) -> int:
        """Bytes of its samples that are held in memory (and not mapped from a file)."""
        arrays = (
            self.time,
            self.position,
            self.command,
            self.external,
            self.temperature,
            *self.extra.values(),
        )
        return sum(array.nbytes for array in arrays if array is not None and not isinstance(array, np.memmap))
