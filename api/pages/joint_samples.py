"""One joint's samples of a fitted model, gathered over sessions: what every figure of the error is drawn from."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from api.service.stored_samples import COLUMNS, StoredSamples

FIGURE_SAMPLES = 150_000
"""More samples than this are thinned for what figures show: enough for percentiles and averages."""


@dataclass(frozen=True)
class JointSamples:
    """Filtered, decimated samples of one joint, (samples,) each, in SI; sessions follow one another.

    `session` is the index into `files`; `time` is that of the session, s; `moving` says which samples take part in the
    fit (a joint at rest does not); `temperature` is in °C, NaN where none was recorded.
    """

    files: tuple[str, ...]
    session: np.ndarray
    time: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    load: np.ndarray
    measured: np.ndarray
    predicted: np.ndarray
    moving: np.ndarray
    temperature: np.ndarray

    @cached_property
    def error(self) -> np.ndarray:
        """ρ = Y − Wχ of eq. (11)."""
        return self.measured - self.predicted

    @cached_property
    def speed(self) -> np.ndarray:
        """(M,) |q̇|, rad/s or m/s"""
        return np.abs(self.velocity)

    @cached_property
    def turned_error(self) -> np.ndarray:
        """ρ · sign(q̇): above zero where the joint loses more torque than the model says."""
        return self.error * np.sign(self.velocity)

    @cached_property
    def travel(self) -> np.ndarray:
        """Distance since the last reversal (or the session's beginning), rad or m: what presliding and backlash act
        through."""
        turns = (np.diff(np.sign(self.velocity)) != 0) | (np.diff(self.session) != 0)
        starts = np.concatenate([[0], np.flatnonzero(turns) + 1]) if len(self.velocity) else np.zeros(0, int)
        since = np.repeat(self.position[starts], np.diff(np.concatenate([starts, [len(self.position)]])))
        return np.abs(self.position - since)

    def where(self, chosen: np.ndarray) -> "JointSamples":
        """The samples that a boolean mask or indices choose."""
        columns = {
            field.name: getattr(self, field.name)[chosen] for field in fields(self) if field.name != "files"
        }
        return JointSamples(self.files, **columns)

    @cached_property
    def in_fit(self) -> "JointSamples":
        """The samples that take part in the fit: what errors are stated of."""
        return self if self.moving.all() else self.where(self.moving)


def every_few(lengths: Sequence[int], at_most: int = FIGURE_SAMPLES) -> list[slice]:
    """Every k-th row of parts that follow one another, `lengths` rows each, so that no more than `at_most` are left: the rows
    of each part."""
    step = max(-(-sum(lengths) // at_most), 1)
    rows, before = [], 0
    for length in lengths:
        rows.append(slice(-before % step, length, step))
        before += length
    return rows


def gathered(parts: Mapping[str, StoredSamples], rows: Sequence[slice]) -> JointSamples:
    """Some rows of the stored samples of sessions, by file, one after the other."""
    pieces = list(zip(parts.values(), rows, strict=True))
    columns = {
        name: np.concatenate([getattr(part, name)[of_part] for part, of_part in pieces])
        for name in COLUMNS
        if name != "moving"
    }
    moving = np.concatenate([part.moves(of_part) for part, of_part in pieces])
    lengths = [len(range(*of_part.indices(part.count))) for part, of_part in pieces]
    return JointSamples(
        files=tuple(parts), session=np.repeat(np.arange(len(parts)), lengths), moving=moving, **columns
    )


def relative_error(measured: np.ndarray, error: np.ndarray) -> float | None:
    """‖ρ‖ / ‖Y‖ of (samples,) arrays, or None where there is nothing to divide by."""
    size = float(np.linalg.norm(measured))
    return float(np.linalg.norm(error)) / size if size > 0 else None
