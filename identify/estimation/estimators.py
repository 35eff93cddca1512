"""Estimating the parameters of a fitted model by another estimator; its constants and columns stay."""

from dataclasses import replace

import numpy as np

from identify.estimation.constrained import admissible_columns, admissible_fit
from identify.estimation.estimate import ESTIMATORS
from identify.estimation.fitted_model import FittedModel
from identify.estimation.least_squares import least_squares
from identify.recording import InputError


def default_estimator(joints: int) -> str:
    """Weighted where there are several joints: their torques differ by orders of magnitude."""
    return "weighted" if joints > 1 else "ordinary"


def checked_estimator(name: str | None, joints: int) -> str:
    """The estimator that was asked for, or the default.

    Raises InputError: there is none of that name.
    """
    if name is None:
        return default_estimator(joints)
    if name not in ESTIMATORS:
        raise InputError(f"--estimator {name}: estimators are {', '.join(ESTIMATORS)}")
    return name


def with_estimator(fitted: FittedModel, estimator: str) -> FittedModel:
    """The same model with its parameters estimated by `estimator`, one of `ESTIMATORS`."""
    record, observation = fitted.record, fitted.observation
    if estimator == "ordinary" and record.joints == 1:
        return replace(fitted, estimator=estimator)  # with one joint the weighted fit is the ordinary one
    if estimator == "ordinary":
        fit = least_squares(observation, fitted.fit.fitted, weights=np.ones(record.joints))
        fit = admissible_fit(observation, fit, admissible_columns(observation, record.summaries))
        return replace(fitted, fit=replace(fit, dropped=fitted.fit.dropped), estimator=estimator)
    if estimator == "weighted":
        return replace(fitted, estimator=estimator)
    # Imported where asked for: a plain `identify` starts without them.
    if estimator == "robust":
        from identify.estimation.robust import huber as other
    else:
        from identify.estimation.instrumental_variable import instrumental as other
    estimate = other(record, fitted.entries, fitted.slots, fitted.load_from, observation, fitted.fit)
    return replace(fitted, fit=estimate.fit, estimator=estimator, estimate=estimate)
