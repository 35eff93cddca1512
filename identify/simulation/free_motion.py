"""What a free run gave, sample by sample, beside the measured motion: what a picture of it is drawn from."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.simulation.course import Trajectories
from identify.simulation.measured_motion import MeasuredMotion

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FreeMotion:
    """One stretch of a session without a hole; SI units.

    file             : of the session
    time             : (N,) s into the session
    q, dq            : (N, n) measured, rad and rad/s or m and m/s
    model_q, model_dq: (N, n) of the model; NaN from where its run had ended, a joint being off by its range of motion
    usual_q, usual_dq: (N, n) of the usual model likewise; None where the model is the usual one
    """

    file: str
    time: Array
    q: Array
    dq: Array
    model_q: Array
    model_dq: Array
    usual_q: Array | None = None
    usual_dq: Array | None = None


Run = tuple[MeasuredMotion, Trajectories]
Keep = Callable[[FreeMotion], None]


def free_motions(
    file: str, start: float, model: Sequence[Run], usual: Sequence[Run] | None
) -> list[FreeMotion]:
    """The free runs of a session's stretches.

    start : s, where the session's own time begins
    usual : of the same stretches; None where the model is the usual one
    """
    kept: list[FreeMotion] = []
    for place, (motion, course) in enumerate(model):
        beside = None if usual is None else usual[place][1]
        rows = len(motion)
        kept.append(
            FreeMotion(
                file,
                motion.time - start,
                motion.q,
                motion.dq,
                _whole(course.q, rows),
                _whole(course.dq, rows),
                None if beside is None else _whole(beside.q, rows),
                None if beside is None else _whole(beside.dq, rows),
            )
        )
    return kept


def _whole(values: Array, rows: int) -> Array:
    """(samples, 1, n) of a run that may have ended early, as (rows, n)."""
    whole = np.full((rows, values.shape[2]), np.nan)
    whole[: len(values)] = values[:, 0]
    return whole
