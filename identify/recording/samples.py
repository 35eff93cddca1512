"""Columns of samples that grow while they are read, in memory or, when they are many, in a file without a
name."""

from __future__ import annotations

import mmap
import tempfile
from dataclasses import dataclass, field
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LARGEST_IN_MEMORY = 16 << 20
"""Bytes of one group of columns kept in memory; beyond, it moves to a temporary file that the system
removes by itself.

16 MiB hold the positions of six joints for nearly six minutes at 1 kHz. An hour-long session is mapped from
files: it costs address space and disk, not memory.
"""


class SampleColumns:
    """A group of columns of float64, appended block by block and read back as one array.

    width : number of columns; 0 makes a one-dimensional array
    """

    def __init__(self, width: int = 0, largest_in_memory: int | None = None) -> None:
        self.width = width
        self.rows = 0
        self._largest = LARGEST_IN_MEMORY if largest_in_memory is None else largest_in_memory
        self._blocks: list[Array] = []
        self._file: IO[bytes] | None = None

    def append(self, block: Array) -> None:
        """Add rows: (rows, width), or (rows,) for a width of 0."""
        self.rows += len(block)
        self._blocks.append(np.ascontiguousarray(block, dtype=np.float64))
        if self._file is None and self.rows * max(self.width, 1) * 8 > self._largest:
            self._file = tempfile.TemporaryFile(prefix="coulomb-samples-")  # noqa: SIM115
        if self._file is not None:
            for held in self._blocks:
                self._file.write(held.data)
            self._blocks = []

    def array(self) -> Array:
        """All rows, (rows, width) or (rows,); read-only and mapped from the temporary file when they are
        many."""
        shape = (self.rows, self.width) if self.width else (self.rows,)
        if self._file is None:
            return np.concatenate(self._blocks) if self._blocks else np.empty(shape)
        self._file.flush()
        mapped = np.memmap(self._file, dtype=np.float64, mode="r", shape=shape)
        self._file.close()
        return mapped


def release(array: NDArray[Any]) -> None:
    """Give back the memory of a mapped array's pages; they are read again from the file when needed."""
    owner: Any = array
    while isinstance(owner, np.ndarray):
        owner = owner.base
    if isinstance(owner, mmap.mmap) and hasattr(owner, "madvise"):
        owner.madvise(mmap.MADV_DONTNEED)


@dataclass(eq=False)
class RawSamples:
    """The columns of a session as they stand in its file: time not yet uniform, holes not yet found."""

    time: Array
    """(N,) s"""
    position: Array
    """(N, n) rad or m"""
    command: Array
    """(N, n) unit of the drive gain"""
    external: Array | None = None
    """(N, n) N m or N"""
    temperature: Array | None = None
    """(N, n) °C"""
    extra: dict[str, NDArray[Any]] = field(default_factory=dict)
    """name -> (N,)"""
    remarks: list[str] = field(default_factory=list)
    """What reading had to do to the samples, in words."""
