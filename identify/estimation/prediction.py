"""What the fitted model predicts beside what was measured, filtered and decimated alike."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from identify.estimation.context import FittedTorque, Slot, contexts, slot_rows
from identify.estimation.executor import chosen_executor
from identify.estimation.fitted_model import FittedModel
from identify.estimation.record import Record
from identify.recording import SessionEntry

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Prediction:
    """One joint in one session: decimated samples, SI units, all (samples,).

    load   : tau_out of eq. (6) as fitted
    moving : whether the sample takes part in the fit (a joint at rest does not)
    """

    file: str
    joint: str
    time: Array
    position: Array
    velocity: Array
    acceleration: Array
    load: Array
    measured: Array
    predicted: Array
    moving: NDArray[np.bool_]
    temperature: Array | None

    @property
    def residual(self) -> Array:
        """measured − predicted"""
        return self.measured - self.predicted

    @property
    def relative_error(self) -> float:
        """‖Y − Wχ‖ / ‖Y‖ over the moving samples."""
        return relative_error(self.residual[self.moving], self.measured[self.moving])


def relative_error(residual: Array, measured: Array) -> float:
    """‖residual‖ / ‖measured‖; NaN where nothing was measured."""
    norm = float(np.linalg.norm(measured))
    return float(np.linalg.norm(residual)) / norm if norm > 0 else float("nan")


def mean_error(predictions: Sequence[Prediction]) -> float:
    """Relative error of a joint over several sessions."""
    residual = np.concatenate([part.residual[part.moving] for part in predictions])
    return relative_error(residual, np.concatenate([part.measured[part.moving] for part in predictions]))


def predict_sessions(fitted: FittedModel, entries: Sequence[SessionEntry]) -> list[list[Prediction]]:
    """Every joint of some sessions: the columns of the fit times its parameters, through the same filter.

    Computed where the executor says.
    """
    record, fit = fitted.record, fitted.fit
    base = fitted.observation.base
    factors = [
        (slot, fit.chi[columns])
        for slot, columns in zip(fitted.slots, fitted.observation.slot_columns, strict=True)
    ]
    inertial = bool(np.any(fit.fitted < base))
    torques = partial(_session_torques, record, fit.chi[:base], factors, inertial, fitted.load_from)
    return [
        _predictions(record, entry, *arrays)
        for entry, arrays in zip(entries, chosen_executor()(torques, list(entries)), strict=True)
    ]


def _session_torques(
    record: Record,
    chi: Array,
    factors: Sequence[tuple[Slot, Array]],
    inertial: bool,
    load_from: FittedTorque | None,
    entry: SessionEntry,
) -> tuple[Array, Array]:
    """Predicted torque and load of a session, decimated, (samples, joints) each."""
    parts: list[tuple[Array, Array]] = []
    for context in contexts(record, entry, load_from):
        torque = context.known.copy()
        for joint, columns in enumerate(context.inertial):
            torque[:, joint] += columns @ chi[record.body.base.acts[joint]]
        load = torque.copy() if inertial else context.load
        for slot, values in factors:
            for joint, columns in slot_rows(context, slot):
                torque[:, joint] += columns @ values
        parts.append((context.block.decimate(torque), context.block.at_decimated(load).copy()))
    predicted, load = (np.concatenate(list(part)) for part in zip(*parts, strict=True))
    return predicted, load


def _predictions(record: Record, entry: SessionEntry, predicted: Array, load: Array) -> list[Prediction]:
    samples = record.samples[entry.file]
    return [
        Prediction(
            file=entry.file,
            joint=name,
            time=samples.time,
            position=samples.q[:, joint],
            velocity=samples.dq[:, joint],
            acceleration=samples.ddq[:, joint],
            load=load[:, joint],
            measured=samples.measured[:, joint],
            predicted=predicted[:, joint],
            moving=samples.moving[:, joint],
            temperature=None if samples.temperature is None else samples.temperature[:, joint],
        )
        for joint, name in enumerate(record.joint_names)
    ]
