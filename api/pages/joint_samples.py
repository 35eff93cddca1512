"""One joint's samples of a fitted model, gathered over sessions: what every figure of the error is drawn from."""

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np


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

    def thinned(self, at_most: int) -> "JointSamples":
        """Every k-th sample, so that no more than `at_most` are left: enough for percentiles and averages."""
        step = -(-len(self.time) // at_most)
        return self if step <= 1 else self.where(np.arange(0, len(self.time), step))

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


def relative_error(measured: np.ndarray, error: np.ndarray) -> float | None:
    """‖ρ‖ / ‖Y‖ of (samples,) arrays, or None where there is nothing to divide by."""
    size = float(np.linalg.norm(measured))
    return float(np.linalg.norm(error)) / size if size > 0 else None
