"""Essential parameters: those with a large relative deviation are eliminated one by one (section IV.D)."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identify.estimation.elimination import Elimination
from identify.estimation.fitted_model import FittedModel
from identify.estimation.least_squares import LeastSquares, least_squares
from identify.estimation.statistics import NORMAL, classical_deviation, robust_deviation

Array = NDArray[np.float64]

LARGEST_RELATIVE_DEVIATION = 1 / NORMAL
"""of an essential parameter. Above it an interval of 95 % holds zero: the data do not show the parameter."""

RULE = (
    "eliminated one by one, the largest relative deviation first, while the interval of 95 % around the value "
    "(value ± 1.96 std_robust) holds zero; the others are estimated again each time"
)


def essential_parameters(fitted: FittedModel, kept: Sequence[int] = ()) -> FittedModel:
    """The same model without the parameters that the data do not show.

    kept : columns that stay whatever their deviation, e.g. a payload ratio, whose zero means "as declared"
    """
    observation, fit = fitted.observation, fitted.fit
    eliminated: list[Elimination] = []
    while len(fit.fitted) > 1:
        relative = relative_deviations(fitted, fit)
        relative[list(kept)] = 0.0
        worst = int(fit.fitted[np.argmax(relative[fit.fitted])])
        if not relative[worst] > LARGEST_RELATIVE_DEVIATION:
            break
        without = least_squares(observation, fit.fitted[fit.fitted != worst])
        eliminated.append(
            Elimination(worst, float(relative[worst]), fit.relative_error, without.relative_error)
        )
        fit = without
    return replace(fitted, fit=replace(fit, dropped=fitted.fit.dropped), eliminated=tuple(eliminated))


def relative_deviations(fitted: FittedModel, fit: LeastSquares) -> Array:
    """(width,) std_robust over the value, classical where there is none; infinite for a value of zero."""
    deviation = robust_deviation(fitted.observation, fit)
    deviation = np.where(np.isfinite(deviation), deviation, classical_deviation(fit))
    value = np.abs(fit.chi)
    with np.errstate(divide="ignore", invalid="ignore"):
        relative = deviation / value
    return np.where(np.isnan(relative), 0.0, relative)
