"""The error of an exported thing on the record: what it predicts, filtered and decimated as the identifier does."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.estimation.record import PreparedBlock
from identify.identification import Identification
from identify.recording.experiment_file import Payload
from identify.signals import MotionBlock

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

    def continued(self, samples: int) -> Motion:
        """The motion with some samples more, in which all goes on as from the last but one sample to the last.

        What is exported with a latency gives the torque of a motion when it has those after it.
        """
        temperature = None if self.temperature is None else _continued(self.temperature, samples)
        q, dq, ddq = (_continued(values, samples) for values in (self.q, self.dq, self.ddq))
        return Motion(_continued(self.t, samples), q, dq, ddq, temperature, self.payload)


def _continued(values: Array, samples: int) -> Array:
    change = values[-1] - values[-2] if len(values) > 1 else np.zeros(values.shape[1:])
    further = [values[-1] + step * change for step in range(1, samples + 1)]
    return np.concatenate([values, *([np.array(further)] if further else [])])


TorqueOf = Callable[[Motion], Array]
"""Torque (N, n), the payload's included, of a motion whose rows follow each other in time."""


@dataclass(frozen=True)
class RecordError:
    """Of one joint, on the moving samples of the identification sessions, filtered and decimated; None without motion.

    relative   : ‖Y − Ŷ‖ / ‖Y‖ of measurement and exported thing
    difference : ‖Ŷ₀ − Ŷ‖ / ‖Ŷ₀‖ of the model's formulas and the exported thing
    """

    relative: float | None
    difference: float | None


def errors_on_record(result: Identification, torque_of: TorqueOf, formulas: TorqueOf) -> list[RecordError]:
    """Errors of an exported thing, joint by joint.

    formulas : torque of the model that was exported

    A model with a memory is given each stretch of the record without a hole at once, as the drive would give it: begun anew
    within a stretch, it would know nothing of what was before.
    """
    record, fitted = result.fitted.record, result.fitted
    squares = np.zeros((record.joints, 4))
    across = any(slot.values.get("across_sessions") for slot in fitted.slots)
    remembers = any(slot.term.effect.simulated_with(slot.values) == "state" for slot in fitted.slots)
    for entry in fitted.entries:
        samples, done = record.samples[entry.file], 0
        start = float(record.facts(entry).start) - (record.started(entry) if across else 0.0)
        for stretch in _stretches(record.blocks(entry), remembers):
            motion, rows_of_blocks = _motion_along(stretch, start, entry.payload)
            predicted, exact = torque_of(motion), formulas(motion)
            for block, part in zip(stretch, rows_of_blocks, strict=True):
                external = 0.0 if block.external is None else block.external
                rows = slice(done, done + block.count)
                moving = samples.moving[rows]
                measured = samples.measured[rows]
                listed = (
                    measured - block.decimate(predicted[part] - external),
                    measured,
                    block.decimate(predicted[part] - exact[part]),
                    block.decimate(exact[part]),
                )
                squares += np.column_stack([np.where(moving, each**2, 0.0).sum(axis=0) for each in listed])
                done += block.count
    return [RecordError(_ratio(off, size), _ratio(apart, whole)) for off, size, apart, whole in squares]


def _stretches(blocks: Iterable[PreparedBlock], whole: bool) -> Iterator[list[MotionBlock]]:
    """The blocks of a session one by one, or those of each segment together."""
    together: list[MotionBlock] = []
    for prepared in blocks:
        if together and not (whole and together[0].segment == prepared.block.segment):
            yield together
            together = []
        together.append(prepared.block)
    yield together


def _motion_along(
    stretch: Sequence[MotionBlock], start: float, payload: Payload
) -> tuple[Motion, list[slice]]:
    """Blocks that overlap as one motion, and the rows of it that each block is."""
    rows: list[slice] = []
    kept: list[slice] = []
    length = 0
    for block in stretch:
        first = (block.rows.start - stretch[0].rows.start) // block.rows.step
        rows.append(slice(first, first + len(block.time)))
        kept.append(slice(length - first, None))
        length = rows[-1].stop

    def joined(parts: Sequence[Array]) -> Array:
        return np.concatenate([part[new] for part, new in zip(parts, kept, strict=True)])

    temperatures = [block.temperature for block in stretch if block.temperature is not None]
    motion = Motion(
        joined([block.time for block in stretch]) - start,
        joined([block.q for block in stretch]),
        joined([block.dq for block in stretch]),
        joined([block.ddq for block in stretch]),
        joined(temperatures) if temperatures else None,
        payload,
    )
    return motion, rows


def _ratio(square: float, of_square: float) -> float | None:
    return float(np.sqrt(square / of_square)) if of_square > 0 else None


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
