"""What makes a fit doubtful before anybody reads its parameters, in words."""

import numpy as np

from identify.estimation.fitted_model import FittedModel
from identify.estimation.parameters import column_names

MUCH_WORSE = 2.0
"""Times the error of the fit on motion that it did not see. Noise and the parameters' deviations raise it by a part of
itself; twice as much says that the motion of the fit does not tell the parameters, or that something else is wrong."""
HUGE = 10.0
"""Times the measured torque that a parameter's share must be for two of them to count as cancelling each other; shares of
inertia and gravity are about as large as the torque itself."""


def doubts(fitted: FittedModel, error: float, unseen: float | None) -> list[str]:
    """Remarks on a fit, the gravest first.

    error, unseen : relative error on the sessions of the fit and on the validation sessions
    """
    sentences: list[str] = []
    if unseen is not None and unseen > MUCH_WORSE * error:
        condition = fitted.fit.condition_number
        sentences.append(
            f"the model predicts motion that it did not see much worse ({unseen:.3g} of the torque) than its own"
            f" ({error:.3g}); do not rely on the parameters (condition number {condition:.3g})"
        )
    names = [name for name, *_ in column_names(fitted)]
    sentences += [
        f"{names[first]} and {names[second]} are many times the measured torque and cancel each other: only their sum is known"
        for first, second in _cancelling(fitted)
    ]
    if fitted.fit.free is not None:
        moved = np.flatnonzero(~np.isclose(fitted.fit.chi, fitted.fit.free, rtol=1e-3, atol=1e-12))
        held = [column for column in moved if fitted.fit.chi[column] == 0]
        sentences += [
            f"{names[column]} is held at 0, the least that it can be: least squares alone would find"
            f" {fitted.fit.free[column]:.3g}"
            for column in held
        ]
    return sentences


def _cancelling(fitted: FittedModel) -> list[tuple[int, int]]:
    """Pairs of columns whose shares are huge and nearly the opposite of each other."""
    fit = fitted.fit
    if fit.r.shape[1] != len(fit.fitted) or not len(fit.fitted):
        return []  # the factor of a structured fit is of its physical parameters, not of the products of eq. (30)
    torque = float(np.linalg.norm(fit.weights * fit.norm))
    shares = fit.r * fit.chi[fit.fitted]
    size = np.linalg.norm(shares, axis=0)
    huge = np.flatnonzero(size > HUGE * torque)
    pairs = []
    for place, first in enumerate(huge):
        for second in huge[place + 1 :]:
            both = float(np.linalg.norm(shares[:, first] + shares[:, second]))
            if both < 0.5 * min(size[first], size[second]):
                pairs.append((int(fit.fitted[first]), int(fit.fitted[second])))
    return pairs
