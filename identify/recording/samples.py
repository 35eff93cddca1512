"""Columns of samples that grow while they are read, in memory or, when they are many, in a file without a
name."""

from __future__ import annotations

import mmap
import tempfile
from typing import IO

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LARGEST_IN_MEMORY = 64 << 20
"""Bytes of one group of columns kept in memory; beyond, it moves to a temporary file that the system
removes by itself.

64 MiB hold a six-joint position record of 1.4 million samples, more than 20 minutes at 1 kHz; the files of
an hour-long record are mapped and cost address space, not memory.
"""


class SampleColumns:
    """A group of columns of float64, appended block by block and read back as one array.

    width : number of columns; 0 makes a one-dimensional array
    """

    def __init__(self, width: int = 0, largest_in_memory: int = LARGEST_IN_MEMORY) -> None:
        self.width = width
        self.rows = 0
        self._largest = largest_in_memory
        self._blocks: list[Array] = []
        self._file: IO[bytes] | None = None

    def append(self, block: Array) -> None:
        """Add rows: (rows, width), or (rows,) for a width of 0."""
        self.rows += len(block)
        if self._file is None:
            self._blocks.append(block)
            if self.rows * max(self.width, 1) * 8 > self._largest:
                self._file = tempfile.TemporaryFile(prefix="coulomb-samples-")  # noqa: SIM115
                for held in self._blocks:
                    self._file.write(np.ascontiguousarray(held, dtype=np.float64).data)
                self._blocks = []
        else:
            self._file.write(np.ascontiguousarray(block, dtype=np.float64).data)

    def array(self) -> Array:
        """All rows, (rows, width) or (rows,); mapped from the temporary file when they are many."""
        shape = (self.rows, self.width) if self.width else (self.rows,)
        if self._file is None:
            return np.concatenate(self._blocks) if self._blocks else np.empty(shape)
        self._file.flush()
        mapped = np.memmap(self._file, dtype=np.float64, mode="c", shape=shape)
        self._file.close()
        return mapped


def release(array: Array) -> None:
    """Let the system take back the memory of a mapped array's pages; they are read again from the file when
    needed."""
    base = array
    while isinstance(base, np.ndarray):
        if base.base is None:
            return
        base = base.base  # type: ignore[assignment]
    if isinstance(base, mmap.mmap) and hasattr(base, "madvise"):
        base.madvise(mmap.MADV_DONTNEED)
