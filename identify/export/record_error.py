"""The error of an exported thing on the record: what it predicts, filtered and decimated as the identifier does."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.estimation.context import contexts
from identify.identification import Identification
from identify.recording.experiment_file import Payload

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Motion:
    """Motion that an exported thing is asked for the torque of; (N, n) unless said otherwise, SI units.

    t       : (N,) s since the session, or the first session, began
    payload : what the last link carries
    """

    t: Array
    q: Array
    dq: Array
    ddq: Array
    temperature: Array | None
    payload: Payload


TorqueOf = Callable[[Motion], Array]
"""Torque (N, n), the payload's included, of a motion whose rows follow each other in time."""


def errors_on_record(result: Identification, torque_of: TorqueOf) -> list[float | None]:
    """‖Y − Ŷ‖ / ‖Y‖ of every joint on the moving samples of the identification sessions."""
    record = result.fitted.record
    squares = np.zeros((record.joints, 2))
    across = any(slot.values.get("across_sessions") for slot in result.fitted.slots)
    for entry in result.fitted.entries:
        samples, done = record.samples[entry.file], 0
        for context in contexts(record, entry, None):
            block = context.block
            start = context.session_start - (context.record_start if across else 0.0)
            motion = Motion(
                block.time - start, block.q, block.dq, block.ddq, block.temperature, entry.payload
            )
            predicted = torque_of(motion)
            if block.external is not None:
                predicted = predicted - block.external
            rows = slice(done, done + block.count)
            moving = samples.moving[rows]
            residual = np.where(moving, samples.measured[rows] - block.decimate(predicted), 0.0)
            measured = np.where(moving, samples.measured[rows], 0.0)
            squares += np.column_stack([(residual**2).sum(axis=0), (measured**2).sum(axis=0)])
            done += block.count
    return [float(np.sqrt(r / y)) if y > 0 else None for r, y in squares]


def errors_of_model(result: Identification) -> list[float | None]:
    """The same of the identified model itself."""
    record = result.fitted.record
    errors: list[float | None] = []
    for name in record.joint_names:
        predictions = [result.prediction(entry.file, name) for entry in result.fitted.entries]
        residual = np.concatenate([part.residual[part.moving] for part in predictions])
        measured = float(np.linalg.norm(np.concatenate([part.measured[part.moving] for part in predictions])))
        errors.append(float(np.linalg.norm(residual)) / measured if measured > 0 else None)
    return errors
