"""The motion that a model predicts where its fit did not see: a second judge beside the torque error.

A torque error is one step ahead. A model that lowers it may still be worse at what it is for, since errors of one sign add
up in motion and those that alternate do not.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from identify.estimation.constrained import admissible_columns, admissible_fit
from identify.estimation.fitted_model import FittedModel
from identify.estimation.least_squares import least_squares
from identify.estimation.record import Record
from identify.recording import SessionEntry
from identify.results.unseen_motion import JointUnseenMotion, UnseenMotionErrors
from identify.simulation.give_fit import GiveFit, give_fit
from identify.simulation.measured_motion import MeasuredMotion, measured_motions
from identify.simulation.rollout import roll_out
from identify.simulation.torque_model import TorqueModel
from identify.simulation.windows import window_starts

Array = NDArray[np.float64]
Unseen = Literal["validation", "stretches"]
"""validation sessions; or, where there are none, stretches of the sessions that a fit of its own leaves out"""

HORIZON = 1.0
"""s: a move"""

STRETCHES = 5
"""of each session; the constants of the effects are those of the fit to all of them"""

MOST_WINDOWS = 25
"""of a validation session, and of a session's stretches together: the mean over them is known to a seventh where windows differ
as they do on measured machines, and a model is compared with another on the same windows"""

DOUBT = 2.0
"""standard errors of the mean difference between two models' windows, below which neither is called the better"""

NOTABLE = 0.02
"""part of the error by which it must rise to be worth a word"""


@dataclass(frozen=True)
class UnseenMotion:
    """Errors of position after windows of one horizon, begun at measured states.

    errors : (windows, joints) root mean square over each window, rad or m
    unseen : what the fit did not see
    """

    errors: Array
    unseen: Unseen
    horizon: float

    @property
    def rms(self) -> Array:
        """(joints,) over all windows, rad or m."""
        return np.sqrt(np.mean(self.errors**2, axis=0))

    def document(self, record: Record, before: UnseenMotion | None = None) -> UnseenMotionErrors:
        """With the errors of the model that this one is compared with, where there is one."""
        earlier = [None] * record.joints if before is None else [float(value) for value in before.rms]
        worse = (
            [False] * record.joints if before is None else [bool(each) for each in self.worse_than(before)]
        )
        listed = zip(record.joint_names, self.rms, earlier, worse, record.summaries, strict=True)
        return UnseenMotionErrors(
            horizon=self.horizon,
            unseen=self.unseen,
            windows=len(self.errors),
            joints=tuple(
                JointUnseenMotion(
                    joint=name,
                    position_rms=float(rms),
                    position_rms_before=compared,
                    unit="rad" if summary.revolute else "m",
                    worse=hurts,
                )
                for name, rms, compared, hurts, summary in listed
            ),
        )

    def worse_than(self, other: UnseenMotion) -> NDArray[np.bool_]:
        """(joints,) whether motion is predicted worse than by another model, beyond what the windows leave in doubt."""
        rise = self.errors - other.errors
        mean, count = rise.mean(axis=0), len(rise)
        deviation = rise.std(axis=0, ddof=1) / np.sqrt(count) if count > 1 else np.full(mean.shape, np.inf)
        return (mean > DOUBT * deviation) & (self.rms > (1.0 + NOTABLE) * other.rms)


def unseen_motion(fitted: FittedModel, horizon: float = HORIZON) -> UnseenMotion | None:
    """How well a model predicts motion that its fit did not see; None where no window of that length fits.

    Raises InputError: a session's file is wrong.
    """
    entries = fitted.record.entries("validation")
    errors = [
        part
        for entry in entries
        for part in _window_errors(
            give_fit(fitted), entry, measured_motions(fitted.record, entry), horizon, MOST_WINDOWS
        )
    ]
    unseen: Unseen = "validation"
    if not errors:
        unseen = "stretches"
        errors = list(_of_stretches(fitted, horizon))
    return UnseenMotion(np.concatenate(errors), unseen, horizon) if errors else None


def _of_stretches(fitted: FittedModel, horizon: float) -> Iterator[Array]:
    """Errors in each stretch of the sessions of the fit, of the fit without it."""
    observation = fitted.observation
    bounds = admissible_columns(observation, fitted.record.summaries)
    motions: dict[str, list[MeasuredMotion]] = {}
    whole = give_fit(fitted)
    for stretch in range(STRETCHES):
        left_out: dict[int, list[int]] = {}
        for session in range(len(fitted.entries)):
            blocks = observation.blocks_of(session)
            hidden_blocks = [
                block for place, block in enumerate(blocks) if place * STRETCHES // len(blocks) == stretch
            ]
            if hidden_blocks:
                left_out[session] = hidden_blocks
        hidden = {block for hidden_blocks in left_out.values() for block in hidden_blocks}
        rest = [block for block in range(len(observation.blocks)) if block not in hidden]
        if not rest or not hidden:
            continue
        fit = least_squares(observation, fitted.fit.fitted, rest, fitted.fit.weights)
        without = replace(fitted, fit=admissible_fit(observation, fit, bounds))
        spans = {
            fitted.entries[session].file: (
                observation.blocks[hidden_blocks[0]].start,
                observation.blocks[hidden_blocks[-1]].stop,
            )
            for session, hidden_blocks in left_out.items()
        }
        given = give_fit(without, spans, whole)
        for file, (begin, end) in spans.items():
            entry = next(each for each in fitted.entries if each.file == file)
            if file not in motions:
                motions[file] = measured_motions(fitted.record, entry)
            parts = [_between(motion, begin, end) for motion in motions[file]]
            yield from _window_errors(
                given,
                entry,
                [part for part in parts if part is not None],
                horizon,
                MOST_WINDOWS // STRETCHES,
            )


def _between(motion: MeasuredMotion, begin: float, end: float) -> MeasuredMotion | None:
    """The part of a motion between two times; None where nothing is."""
    rows = np.flatnonzero((motion.time >= begin) & (motion.time <= end))
    return motion.rows(slice(int(rows[0]), int(rows[-1]) + 1)) if len(rows) > 1 else None


def _window_errors(
    given: GiveFit, entry: SessionEntry, motions: list[MeasuredMotion], horizon: float, most: int
) -> Iterator[Array]:
    """(windows, joints) of each motion that has room for one."""
    model = TorqueModel(given.fitted, entry, given)
    for motion in motions:
        samples = max(2, round(horizon / motion.period) + 1)
        if samples > len(motion):
            continue
        course = roll_out(model, motion, window_starts(len(motion), samples, most), samples)
        rows = course.starts[None, :] + np.arange(samples)[:, None]
        yield np.sqrt(np.mean((course.q - motion.q[rows]) ** 2, axis=0))
