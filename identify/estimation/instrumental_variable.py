"""Instrumental variables: parameters without the bias that noise in the observation matrix W brings.

Noise of the encoder makes W noisy, and least squares then estimates inertias too small. Instruments Z are columns
like W made of a motion whose noise has nothing to do with W's: (ZᵀW) chi = ZᵀY. A. Janot, P.-O. Vandanjon,
M. Gautier, "A generic instrumental variable approach for industrial robot identification", IEEE Trans. Control Syst.
Technol. 22(1), 2014, simulate the robot under its own controller for that. The controller is not known here, so

- where every session has columns `qref1` ... `qrefn`, Z is made of the reference motion, which has no noise at all;
- elsewhere of the record itself, split in two: from the even samples and from the odd ones, each filled up by
  interpolation, W of the one with Z of the other and the other way round. This rests on encoder noise that is
  independent from sample to sample, as rounding is while the joint moves by several counts a sample.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.estimation.context import FittedTorque, Slot
from identify.estimation.decimated_rows import decimated_rows
from identify.estimation.estimate import Estimate, with_parameters
from identify.estimation.least_squares import LeastSquares
from identify.estimation.observation import Observation, block_edges
from identify.estimation.record import Record
from identify.estimation.statistics import deviation_from_blocks
from identify.recording import Session, SessionEntry

Array = NDArray[np.float64]

WEAK = 0.1
"""canonical correlation between instruments and columns below which the estimate is not to be relied on"""


def instrumental(
    record: Record,
    entries: Sequence[SessionEntry],
    slots: Sequence[Slot],
    fitted: FittedTorque | None,
    observation: Observation,
    start: LeastSquares,
) -> Estimate:
    """The instrumental-variable estimate of the columns that least squares could fit, weighted as it was."""
    scale = np.linalg.norm(start.r, axis=0)
    referenced = all(has_reference(record.session(entry)) for entry in entries)
    pairs = _reference_pairs if referenced else _split_pairs
    products = _Products(start, scale)
    sessions: list[int] = []
    for index, entry in enumerate(entries):
        sessions += [index] * products.add(record, entry, pairs(record, entry, slots, fitted))
    cross, target, square, columns = products.totals()
    parameters = np.linalg.solve(cross.sum(0), target.sum(0))
    chi = np.zeros(len(start.chi))
    chi[start.fitted] = parameters / scale
    fit = with_parameters(start, observation, chi)

    freedom = max(1, int(start.rows.sum()) - len(start.fitted))
    variance = float(np.sum((start.weights * fit.residual) ** 2)) / freedom
    inverse = np.linalg.inv(cross.sum(0))
    std, robust = np.full(len(chi), np.nan), np.full(len(chi), np.nan)
    std[start.fitted] = np.sqrt(variance * np.diag(inverse @ square.sum(0) @ inverse.T)) / scale
    scores = target - cross @ parameters
    robust[start.fitted] = deviation_from_blocks(cross, scores, square, np.array(sessions)) / scale
    weakest = weakest_correlation(cross.sum(0), products.instruments.sum(0), columns.sum(0))
    source = (
        "the reference motion qref"
        if referenced
        else "the other half of the samples (encoder noise independent from sample to sample)"
    )
    remarks = [f"instrumental variables from {source}; weakest canonical correlation {weakest:.3f}"]
    if weakest < WEAK:
        remarks.append("the instruments are weak: the estimate and its deviations are not to be relied on")
    return Estimate(fit, std, robust, tuple(remarks))


def weakest_correlation(cross: Array, instruments: Array, columns: Array) -> float:
    """Smallest canonical correlation between instruments and columns, from ZᵀW, ZᵀZ and WᵀW."""
    left = np.linalg.inv(np.linalg.cholesky(instruments))
    right = np.linalg.inv(np.linalg.cholesky(columns))
    return float(np.linalg.svd(left @ cross @ right.T, compute_uv=False).min())


@dataclass(frozen=True, eq=False)
class _Pair:
    """Rows of one joint: instruments with the columns and Y that they stand beside; `both` counts each sample once."""

    instruments: list[Array]
    columns: list[Array]
    measured: list[Array]

    @property
    def both(self) -> Array:
        return np.sum(self.instruments, axis=0)


Pairs = Iterator[tuple[Array, NDArray[np.bool_], list[_Pair], list[NDArray[np.intp]]]]


class _Products:
    """ZᵀW, ZᵀY and ZᵀZ of every block of time, columns in units of `scale`."""

    def __init__(self, start: LeastSquares, scale: Array) -> None:
        self.start, self.scale = start, scale
        self.place = np.full(len(start.chi), -1, np.intp)
        self.place[start.fitted] = np.arange(len(start.fitted))
        self.parts: list[tuple[Array, Array, Array, Array, Array]] = []

    def add(self, record: Record, entry: SessionEntry, pairs: Pairs) -> int:
        """Take in a session; returns how many blocks of time it has."""
        edges = block_edges(record, entry)
        size = len(self.start.fitted)
        sums_of_blocks: dict[int, tuple[Array, Array, Array, Array, Array]] = {}
        for time, moving, joints, joint_columns in pairs:
            place = np.clip(np.searchsorted(edges, time, side="right") - 1, 0, len(edges) - 2)
            for number in np.unique(place).tolist():
                zero = (
                    np.zeros((size, size)),
                    np.zeros(size),
                    np.zeros((size, size)),
                    np.zeros((size, size)),
                    np.zeros((size, size)),
                )
                sums = sums_of_blocks.setdefault(number, zero)
                for joint, pair in enumerate(joints):
                    chosen = (place == number) & moving[:, joint]
                    self._add(sums, pair, chosen, joint_columns[joint], float(self.start.weights[joint]))
        self.parts += [sums_of_blocks[number] for number in sorted(sums_of_blocks)]
        return len(sums_of_blocks)

    def _add(
        self,
        sums: tuple[Array, ...],
        pair: _Pair,
        chosen: NDArray[np.bool_],
        columns: NDArray[np.intp],
        weight: float,
    ) -> None:
        estimated = np.flatnonzero(self.place[columns] >= 0)
        target = self.place[columns[estimated]]
        grid = np.ix_(target, target)
        unit = weight / self.scale[target]
        for Z, W, Y in zip(pair.instruments, pair.columns, pair.measured, strict=True):
            Zc, Wc = Z[chosen][:, estimated] * unit, W[chosen][:, estimated] * unit
            sums[0][grid] += Zc.T @ Wc
            sums[1][target] += Zc.T @ (weight * Y[chosen])
            sums[3][grid] += Zc.T @ Zc
            sums[4][grid] += Wc.T @ Wc
        both = pair.both[chosen][:, estimated] * unit
        sums[2][grid] += both.T @ both

    @property
    def instruments(self) -> Array:
        """ZᵀZ of every block."""
        return np.array([part[3] for part in self.parts])

    def totals(self) -> tuple[Array, Array, Array, Array]:
        """ZᵀW, ZᵀY, products of the instruments of one sample together, WᵀW; all by block."""
        cross, target, square, _, columns = (np.array(list(part)) for part in zip(*self.parts, strict=True))
        return cross, target, square, columns


def has_reference(session: Session) -> bool:
    """Whether a session recorded the reference motion of every joint."""
    return all(f"qref{joint + 1}" in session.extra for joint in range(session.n))


def reference_positions(session: Session) -> Array:
    """(N, n) the reference motion, rad or m."""
    return np.column_stack([session.extra[f"qref{joint + 1}"] for joint in range(session.n)])


def _even(session: Session) -> Array:
    return half_of_samples(session, 0)


def _odd(session: Session) -> Array:
    return half_of_samples(session, 1)


def half_of_samples(session: Session, parity: int) -> Array:
    """(N, n) positions of every other sample; those between by cubic interpolation, within each segment."""
    positions = np.array(session.position, copy=True)
    for segment in session.segments:
        piece = positions[segment]
        inner = np.arange(3, len(piece) - 3)
        inner = inner[inner % 2 != parity]
        piece[inner] = (
            9 * (piece[inner - 1] + piece[inner + 1]) - (piece[inner - 3] + piece[inner + 3])
        ) / 16
    return positions


def _reference_pairs(
    record: Record, entry: SessionEntry, slots: Sequence[Slot], fitted: FittedTorque | None
) -> Pairs:
    measured = decimated_rows(record, entry, slots, fitted)
    planned = decimated_rows(record.with_positions(reference_positions), entry, slots, fitted)
    for recorded, other in zip(measured, planned, strict=True):
        joints = [
            _Pair([Z[:, :-2]], [W[:, :-2]], [W[:, -2]])
            for W, Z in zip(recorded.rows, other.rows, strict=True)
        ]
        yield recorded.time, recorded.moving, joints, recorded.table.joint_columns


def _split_pairs(
    record: Record, entry: SessionEntry, slots: Sequence[Slot], fitted: FittedTorque | None
) -> Pairs:
    moving = record.samples[entry.file].moving
    even = decimated_rows(record.with_positions(_even), entry, slots, fitted)
    odd = decimated_rows(record.with_positions(_odd), entry, slots, fitted)
    done = 0
    for first, second in zip(even, odd, strict=True):
        joints = [
            _Pair([B[:, :-2], A[:, :-2]], [A[:, :-2], B[:, :-2]], [A[:, -2], B[:, -2]])
            for A, B in zip(first.rows, second.rows, strict=True)
        ]
        count = len(first.time)
        yield first.time, moving[done : done + count], joints, first.table.joint_columns
        done += count
