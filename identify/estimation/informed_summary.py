"""What a first fit tells of each joint, so that effects can choose their constants by it."""

from collections.abc import Sequence
from dataclasses import replace
from typing import cast

import numpy as np

from identify.effects.motion import JointSummary
from identify.estimation import forked
from identify.estimation.fitted_model import FittedModel
from identify.estimation.position_lines import position_lines
from identify.estimation.prediction import Prediction, predict_sessions


def joint_predictions(fitted: FittedModel) -> list[list[Prediction]]:
    """For every joint its predictions in the sessions of the fit; computed once for each model."""
    if "predictions" not in fitted.held:
        by_session = predict_sessions(fitted, fitted.entries)
        fitted.held["predictions"] = [list(parts) for parts in zip(*by_session, strict=True)]
    return cast(list[list[Prediction]], fitted.held["predictions"])


def informed_summaries(fitted: FittedModel) -> list[JointSummary]:
    """The joints' summaries with the range of the fitted torque, the own inertia, and the lines over position; computed once
    for each model."""
    if "summaries" not in fitted.held:
        fitted.held["summaries"] = _informed(fitted, joint_predictions(fitted))
    return cast(list[JointSummary], fitted.held["summaries"])


def _informed(fitted: FittedModel, predictions: Sequence[Sequence[Prediction]]) -> list[JointSummary]:
    record = fitted.record
    torque_of = fitted.torque
    inertias = record.own_inertias(fitted.entries, torque_of.chi)
    cutoff = record.settings.decimation_cutoff
    known = record.summaries
    listed = forked.each(
        lambda joint: position_lines(predictions[joint], known[joint], cutoff), range(len(known))
    )
    informed = []
    for summary, parts, lines in zip(known, predictions, listed, strict=True):
        torque = np.concatenate([part.predicted for part in parts])
        informed.append(
            replace(
                summary,
                load_range=(float(torque.min()), float(torque.max())),
                own_inertia=max(0.0, inertias[summary.joint]) + max(0.0, torque_of.rotor(summary.joint)),
                position_lines=lines.torque,
                load_lines=lines.gain,
                line_width=lines.width,
                lines_searched=lines.searched,
            )
        )
    return informed
