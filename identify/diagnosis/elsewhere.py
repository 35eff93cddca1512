"""Whether a model that suits the sessions of its fit fails on those that it did not see."""

from collections.abc import Sequence

import numpy as np

from identify.estimation.prediction import Prediction, relative_error

WORSE = 2.0
"""Times the error of the fit's sessions, relative to the torque and absolute, that noise and the parameters' deviations
do not make: a payload or a gain that is not what was declared."""


def fails_elsewhere(known: Sequence[Prediction], unseen: Sequence[Prediction]) -> bool:
    """Whether a joint's error on unseen sessions is beyond that on known ones."""
    if not unseen:
        return False
    (here, here_torque), (there, there_torque) = _moving(known), _moving(unseen)
    if not len(here) or not len(there):
        return False
    absolute = float(np.sqrt(np.mean(there**2) / max(np.mean(here**2), 1e-300)))
    relative = relative_error(there, there_torque) / max(relative_error(here, here_torque), 1e-300)
    return min(absolute, relative) > WORSE


def _moving(parts: Sequence[Prediction]) -> tuple[np.ndarray, np.ndarray]:
    """Residual and measured torque of the samples in motion."""
    return (
        np.concatenate([part.residual[part.moving] for part in parts]),
        np.concatenate([part.measured[part.moving] for part in parts]),
    )
