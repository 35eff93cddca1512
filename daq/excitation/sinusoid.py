"""Sums of harmonics, periodic with whole repeats, that fade in and out.

    q_j(t) = c_j + w(t) Σ_h  a_jh cos(2π f h t) + b_jh sin(2π f h t)

Between the fades w = 1 and the motion repeats exactly, period by period: what differs between the repeats
is noise, and a noise floor can be measured. A single sinusoid has one harmonic.
"""

from typing import Literal, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from daq.excitation.blend import Array, fade


class Sinusoids(BaseModel):
    """A phase of a plan in which every joint swings about its centre; all joints share the fundamental
    frequency.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    kind: Literal["sinusoids"] = "sinusoids"
    frequency: float = Field(gt=0)
    """Hz, the fundamental f"""
    repeats: int = Field(ge=1)
    """whole periods between the fades"""
    fade: float = Field(gt=0)
    """s, of the fade-in and again of the fade-out"""
    centre: tuple[float, ...]
    """(n,) rad or m, where the phase begins and ends"""
    cosine: tuple[tuple[float, ...], ...]
    """(n, harmonics) rad or m: a_jh"""
    sine: tuple[tuple[float, ...], ...]
    """(n, harmonics) rad or m: b_jh"""

    @model_validator(mode="after")
    def _shapes(self) -> Self:
        n = len(self.centre)
        harmonics = {len(row) for row in (*self.cosine, *self.sine)}
        if len(self.cosine) != n or len(self.sine) != n or len(harmonics) != 1:
            raise ValueError(f"cosine and sine need {n} rows with the same number of harmonics")
        return self

    @property
    def duration(self) -> float:
        """s"""
        return self.repeats / self.frequency + 2.0 * self.fade

    @property
    def repeated(self) -> tuple[float, float]:
        """s from the phase's start: from when to when the motion is periodic."""
        return self.fade, self.fade + self.repeats / self.frequency

    def evaluate(self, time: Array, start: Array) -> tuple[Array, Array, Array, Array]:
        """Position, velocity, acceleration and jerk, each (N, n), at `time` (N,), s from the phase's
        start.
        """
        cosine, sine = np.array(self.cosine), np.array(self.sine)
        pulsation: Array = 2.0 * np.pi * self.frequency * np.arange(1.0, cosine.shape[1] + 1)
        angle = np.outer(time - self.fade, pulsation)
        c, s = np.cos(angle), np.sin(angle)
        swing: list[Array] = [
            (c * p) @ cosine_side.T + (s * p) @ sine_side.T
            for p, cosine_side, sine_side in (
                (1.0, cosine, sine),
                (pulsation, sine, -cosine),
                (pulsation**2, -cosine, -sine),
                (pulsation**3, -sine, cosine),
            )
        ]
        w = [term[:, np.newaxis] for term in fade(time, self.fade, self.duration)]
        return (
            np.array(self.centre) + w[0] * swing[0],
            w[1] * swing[0] + w[0] * swing[1],
            w[2] * swing[0] + 2.0 * w[1] * swing[1] + w[0] * swing[2],
            w[3] * swing[0] + 3.0 * (w[2] * swing[1] + w[1] * swing[2]) + w[0] * swing[3],
        )

    def end(self, start: Array) -> Array:
        """(n,) where the phase ends."""
        return np.array(self.centre)
