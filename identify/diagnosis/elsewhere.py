"""Whether a model that suits the sessions of its fit fails on those that it did not see."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identify.estimation.prediction import Prediction, mean_error

WORSE = 2.0
"""Times the error of the fit's sessions, relative to the torque and absolute, that noise and the parameters' deviations
do not make: a payload or a gain that is not what was declared."""


def fails_elsewhere(known: Sequence[Prediction], unseen: Sequence[Prediction]) -> bool:
    """Whether a joint's error on unseen sessions is beyond that on known ones."""
    if not unseen:
        return False
    here, there = _residual(known), _residual(unseen)
    if not len(here) or not len(there):
        return False
    absolute = float(np.sqrt(np.mean(there**2) / max(np.mean(here**2), 1e-300)))
    relative = mean_error(unseen) / max(mean_error(known), 1e-300)
    return min(absolute, relative) > WORSE


def _residual(parts: Sequence[Prediction]) -> NDArray[np.float64]:
    """Of the samples in motion."""
    return np.concatenate([part.residual[part.moving] for part in parts])
