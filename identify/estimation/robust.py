"""Huber's estimator: samples that the model does not fit count less, so that a few of them spoil nothing.

P. J. Huber, "Robust estimation of a location parameter", Ann. Math. Statist. 35(1), 1964; iteratively reweighted
least squares. Rows are weighted and reduced to factors as ever, one pass for each iteration.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identify.estimation.context import FittedTorque, Slot
from identify.estimation.decimated_rows import DecimatedRows, decimated_rows
from identify.estimation.estimate import Estimate, with_parameters
from identify.estimation.least_squares import LeastSquares, least_squares
from identify.estimation.observation import Observation, assemble, reduce_rows
from identify.estimation.record import Record
from identify.estimation.statistics import block_products, deviation_from_blocks
from identify.recording import SessionEntry

Array = NDArray[np.float64]

THRESHOLD = 1.345
"""deviations; with it 95 % of the efficiency of least squares is kept where the noise is normal after all"""
MEDIAN_OF_NORMAL = 0.6745
"""median of |x| for a normal x of unit deviation"""
MOST_ITERATIONS = 30
CONVERGED = 1e-4
"""part of the residual's norm by which one more iteration moves the prediction"""
LARGEST_HELD = 256 << 20
"""bytes of decimated rows kept between iterations; longer records are passed over again"""


def huber(
    record: Record,
    entries: Sequence[SessionEntry],
    slots: Sequence[Slot],
    fitted: FittedTorque | None,
    observation: Observation,
    start: LeastSquares,
) -> Estimate:
    """Huber's estimate, from a least squares fit on.

    The scale of each joint is the median of its absolute residuals; the deviations are those of the estimating
    equation Σ W ψ(ρ/s) = 0.
    """
    rows = _Rows(record, list(entries), list(slots), fitted)
    chi = start.chi
    scale = _scales(rows, observation, chi)
    iterations, step = 0, np.inf
    while iterations < MOST_ITERATIONS and step > CONVERGED * np.linalg.norm(start.weights * start.residual):
        iterations += 1
        weighted = rows.reduced(lambda u: np.sqrt(_weight(u)), chi, scale)
        moved = least_squares(weighted, start.fitted, weights=np.ones(record.joints)).chi - chi
        chi = chi + moved
        scale = _scales(rows, observation, chi)
        step = float(np.linalg.norm(start.r @ moved[start.fitted]))
    fit = with_parameters(start, observation, chi)
    linear = rows.reduced(lambda u: (np.abs(u) <= THRESHOLD).astype(float), chi, scale)
    weighted = rows.reduced(lambda u: np.sqrt(_weight(u)), chi, scale)
    std, outlying = _classical(rows, observation, fit, chi, scale)
    remark = (
        f"robust (Huber, {THRESHOLD} deviations): {100 * outlying:.1f} % of the samples counted less, "
        f"{iterations} iterations"
    )
    return Estimate(fit, std, _robust(linear, weighted, observation, fit, chi), (remark,))


def _weight(u: Array) -> Array:
    """ψ(u)/u: one within the threshold, falling beyond."""
    return np.minimum(1.0, THRESHOLD / np.maximum(np.abs(u), 1e-300))


class _Rows:
    """The decimated rows of all sessions, kept while they are few."""

    def __init__(
        self, record: Record, entries: list[SessionEntry], slots: list[Slot], fitted: FittedTorque | None
    ) -> None:
        self.record, self.entries, self.slots, self.fitted = record, entries, slots, fitted
        self._held: dict[str, list[DecimatedRows]] = {}
        self._bytes = 0

    def of(self, entry: SessionEntry) -> Iterator[DecimatedRows]:
        if entry.file in self._held:
            yield from self._held[entry.file]
            return
        held: list[DecimatedRows] | None = []
        for block in decimated_rows(self.record, entry, self.slots, self.fitted):
            if held is not None:
                held.append(block)
                self._bytes += sum(part.nbytes for part in block.rows)
                if self._bytes > LARGEST_HELD:
                    self._bytes -= sum(part.nbytes for rows in held for part in rows.rows)
                    held = None
            yield block
        if held is not None:
            self._held[entry.file] = held

    def residuals(self, chi: Array) -> list[Array]:
        """For every joint the residuals of its moving samples."""
        parts_of_joints: list[list[Array]] = [[] for _ in range(self.record.joints)]
        for entry in self.entries:
            for block in self.of(entry):
                for joint, residual in enumerate(_residuals(block, chi)):
                    parts_of_joints[joint].append(residual[block.moving[:, joint]])
        return [np.concatenate(parts) for parts in parts_of_joints]

    def reduced(self, weight, chi: Array, scale: Array) -> Observation:
        """The observation with each row in units of its joint's scale, times a weight of its residual."""

        def weighted(entry: SessionEntry) -> Iterator[DecimatedRows]:
            for block in self.of(entry):
                factors = [
                    weight(residual / scale[joint]) / scale[joint]
                    for joint, residual in enumerate(_residuals(block, chi))
                ]
                rows = [part * factor[:, None] for part, factor in zip(block.rows, factors, strict=True)]
                yield replace(block, rows=rows)

        sessions = [reduce_rows(self.record, entry, weighted(entry)) for entry in self.entries]
        return assemble(self.entries, self.slots, sessions)


def _residuals(block: DecimatedRows, chi: Array) -> list[Array]:
    return [
        rows[:, -2] - rows[:, :-2] @ chi[columns]
        for rows, columns in zip(block.rows, block.table.joint_columns, strict=True)
    ]


def _scales(rows: _Rows, observation: Observation, chi: Array) -> Array:
    """(n,) deviation of each joint's residual by its median, not below rounding of its torque."""
    scales = []
    for joint, residual in enumerate(rows.residuals(chi)):
        merged = observation.merged(joint)
        size = float(np.linalg.norm(merged.r[:, -1])) / max(1.0, np.sqrt(merged.rows))
        deviation = float(np.median(np.abs(residual))) / MEDIAN_OF_NORMAL if len(residual) else 0.0
        scales.append(max(deviation, 1e-6 * size) or 1.0)
    return np.array(scales)


def _classical(
    rows: _Rows, observation: Observation, fit: LeastSquares, chi: Array, scale: Array
) -> tuple[Array, float]:
    """(width,) deviations with residuals taken as white (Huber 1981, eq. 7.6.5), and the part of outlying samples."""
    parts = fit.fitted
    standardised = np.concatenate(
        [residual / s for residual, s in zip(rows.residuals(chi), scale, strict=True)]
    )
    count = len(standardised)
    std = np.full(len(chi), np.nan)
    inside = float(np.mean(np.abs(standardised) <= THRESHOLD)) if count else 0.0
    if count <= len(parts) or inside == 0.0:
        return std, 1.0 - inside
    correction = 1 + len(parts) / count * (1 - inside) / inside
    squares = float(np.sum(np.clip(standardised, -THRESHOLD, THRESHOLD) ** 2)) / (count - len(parts))
    r = least_squares(observation, parts, weights=1.0 / scale).r
    inverse = np.linalg.solve(r, np.eye(len(parts)))
    std[parts] = correction * np.sqrt(squares) / inside * np.linalg.norm(inverse, axis=1)
    return std, 1.0 - inside


def _robust(
    linear: Observation, weighted: Observation, observation: Observation, fit: LeastSquares, chi: Array
) -> Array:
    """(width,) deviations from the scores Σ W ψ and their slope Σ ψ' WᵀW of every block of time."""
    plain = replace(fit, chi=chi, weights=np.ones(len(fit.weights)))
    scale = np.linalg.norm(fit.r, axis=0)
    slopes, _ = block_products(linear, plain, scale)
    _, scores = block_products(weighted, plain, scale)
    sessions = observation.sessions
    deviation = np.full(len(chi), np.nan)
    deviation[fit.fitted] = deviation_from_blocks(slopes, scores, slopes, sessions) / scale
    return deviation
