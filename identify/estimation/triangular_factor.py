"""The triangular factor of [W Y]: all that least squares needs of a block of samples."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class TriangularFactor:
    """R of the QR factorisation of a block of rows [W Y], and how many rows it stands for.

    Norms and products of any of the block's columns are those of R's columns, so that every fit, residual
    norm and comparison can be had from R alone. Where a block has fewer rows than columns the rows
    themselves are kept.

    r    : (k, columns), k <= columns
    rows : number of samples
    """

    r: Array
    rows: int

    @classmethod
    def of(cls, block: Array) -> "TriangularFactor":
        """Factor of a block of rows, (rows, columns)."""
        if block.shape[0] <= block.shape[1]:
            return cls(block.copy(), block.shape[0])
        return cls(triangle(block), block.shape[0])

    @classmethod
    def merge(cls, factors: Iterable["TriangularFactor"], width: int) -> "TriangularFactor":
        """Factor of all rows of several blocks: QR of the stacked factors. Exact, in any order."""
        listed = list(factors)
        if not listed:
            return cls(np.zeros((0, width)), 0)
        stacked = cls.of(np.vstack([factor.r for factor in listed]))
        return cls(stacked.r, sum(factor.rows for factor in listed))

    def select(self, columns: Sequence[int] | NDArray[np.intp]) -> "TriangularFactor":
        """The same rows with some of the columns."""
        return TriangularFactor(self.r[:, columns], self.rows)

    def scaled(self, weight: float) -> "TriangularFactor":
        """The same rows, each multiplied by a weight."""
        return TriangularFactor(self.r * weight, self.rows)

    def gram(self) -> Array:
        """[W Y]ᵀ[W Y], (columns, columns)."""
        return self.r.T @ self.r


def triangle(rows: Array) -> Array:
    """R of the QR factorisation of rows (m, k): (min(m, k), k)."""
    return np.asarray(np.linalg.qr(rows, mode="r"), float)
