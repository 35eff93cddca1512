"""What an estimator other than least squares hands over: parameters, deviations, and how it came to them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.estimation.least_squares import LeastSquares, joint_rows
from identify.estimation.observation import Observation

Array = NDArray[np.float64]

ESTIMATORS = {
    "ordinary": "least squares of eq. (12), every joint's rows alike",
    "weighted": "least squares with the rows of each joint in units of its own residual deviation",
    "robust": "Huber's M-estimator: samples that do not fit count less",
    "instrumental": "instrumental variables: no bias by the noise in the observation matrix",
}


@dataclass(frozen=True, eq=False)
class Estimate:
    """Parameters and deviations of an estimator.

    fit             : the parameters, with the residuals that they leave on the unweighted rows
    std, std_robust : (width,) as in `identify.estimation.statistics`
    remarks         : how it was done, for the reader of the result
    """

    fit: LeastSquares
    std: Array
    std_robust: Array
    remarks: tuple[str, ...]


def with_parameters(start: LeastSquares, observation: Observation, chi: Array) -> LeastSquares:
    """A fit with other parameters: their residuals on the rows of the observation."""
    residual = []
    for joint in range(len(observation.joint_columns)):
        rows = joint_rows(observation, joint)
        residual.append(float(np.linalg.norm(rows[:, -2] - rows[:, :-2] @ chi)))
    return LeastSquares(
        chi,
        start.fitted,
        start.dropped,
        start.r,
        start.weights,
        np.array(residual),
        start.norm,
        start.rows,
    )
