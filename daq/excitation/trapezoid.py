"""Moves with a trapezoidal velocity: a constant speed between smooth flanks, all joints in step."""

from typing import Literal, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from daq.excitation.blend import QUINTIC_PEAK_CURVATURE, QUINTIC_PEAK_SLOPE, Array, trapezoid


class Move(BaseModel):
    """A phase of a plan that leads every joint to a position; all joints start, cruise and stop together."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    kind: Literal["move"] = "move"
    to: tuple[float, ...]
    """(n,) rad or m"""
    duration: float = Field(gt=0)
    """s"""
    ramp: float = Field(gt=0)
    """s of each flank of the velocity; between the flanks the speed is constant"""

    @model_validator(mode="after")
    def _flanks_fit(self) -> Self:
        if 2.0 * self.ramp > self.duration * (1.0 + 1e-9):
            raise ValueError(f"two flanks of {self.ramp} s do not fit in a move of {self.duration} s")
        return self

    def evaluate(self, time: Array, start: Array) -> tuple[Array, Array, Array, Array]:
        """Position, velocity, acceleration and jerk, each (N, n), at `time` (N,), s from the phase's
        start.
        """
        way = np.array(self.to) - start
        terms = trapezoid(time, min(self.ramp, 0.5 * self.duration), self.duration)
        position, velocity, acceleration, jerk = (np.outer(term, way) for term in terms)
        return start + position, velocity, acceleration, jerk

    def end(self, start: Array) -> Array:
        """(n,) where the phase ends."""
        return np.array(self.to)


class Dwell(BaseModel):
    """A phase of a plan in which every joint stands still."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    kind: Literal["dwell"] = "dwell"
    duration: float = Field(gt=0)
    """s"""

    def evaluate(self, time: Array, start: Array) -> tuple[Array, Array, Array, Array]:
        """Position, velocity, acceleration and jerk, each (N, n)."""
        still = np.zeros((len(time), len(start)))
        return start + still, still, still, still

    def end(self, start: Array) -> Array:
        """(n,) where the phase ends."""
        return start


def quickest_ramp(speed: Array, acceleration: Array, jerk: Array) -> float:
    """s: shortest flank up to `speed` (n,) that keeps every joint within its acceleration and jerk (n,)."""
    by_acceleration = QUINTIC_PEAK_SLOPE * np.abs(speed) / acceleration
    by_jerk = np.sqrt(QUINTIC_PEAK_CURVATURE * np.abs(speed) / jerk)
    return float(max(by_acceleration.max(), by_jerk.max()))


def move_at(start: Array, to: Array, velocity: Array, acceleration: Array, jerk: Array) -> Move:
    """The quickest move from `start` to `to` within velocity, acceleration and jerk, (n,) each.

    The slowest joint cruises at its velocity. A way too short to reach it is all flank: then the joint that
    needs most time sets the flank from its acceleration and jerk.
    """
    way = np.abs(np.asarray(to, dtype=float) - np.asarray(start, dtype=float))
    cruise = float((way / velocity).max())
    if cruise == 0.0:
        raise ValueError("a move needs a distance: start and end are the same")
    ramp = quickest_ramp(way / cruise, acceleration, jerk)
    if ramp > cruise:  # all flank: way = speed · ramp, duration = 2 ramp
        ramp = float(
            max(
                np.sqrt(QUINTIC_PEAK_SLOPE * way / acceleration).max(),
                np.cbrt(QUINTIC_PEAK_CURVATURE * way / jerk).max(),
            )
        )
        cruise = ramp
    return Move(to=tuple(float(x) for x in to), duration=cruise + ramp, ramp=ramp)
