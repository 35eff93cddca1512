"""What a plan will tell about a model: the information matrix and the standard deviations to expect, eq.
(12)-(15).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from daq.excitation.blend import Array
from daq.excitation.plan_model import PlanModel, PlannedMotion

INDEPENDENT_RATE = 20.0
"""samples per second that count as independent: filtering and decimation leave about that many for a
robot's joint
"""

SINGULAR = 1e-9
"""eigenvalue of the information, in units of single parameters' own, below which a combination is not
seen at all
"""


@dataclass(frozen=True)
class Information:
    """Wᵀ C⁻¹ W of a plan: how much its samples will say about the parameters.

    matrix : (p, p), per unit of the parameters
    """

    matrix: Array

    def __add__(self, other: "Information") -> "Information":
        return Information(self.matrix + other.matrix)

    @property
    def scale(self) -> Array:
        """(p,) 1 / σ of each parameter if it were the only unknown; 0 where no sample shows it."""
        return np.sqrt(np.diag(self.matrix))

    @property
    def correlated(self) -> Array:
        """(p, p): the matrix in units of `scale`, ones on the diagonal."""
        scale = np.where(self.scale > 0.0, self.scale, 1.0)
        return self.matrix / np.outer(scale, scale)

    @property
    def condition_number(self) -> float | None:
        """Of the observation matrix with columns of equal norm, so that units do not matter; None where
        singular.
        """
        eigenvalues = np.linalg.eigvalsh(self.correlated)
        return float(np.sqrt(eigenvalues[-1] / eigenvalues[0])) if eigenvalues[0] > SINGULAR else None

    def log_determinant(self, scale: Array) -> float:
        """D-optimality: ln det of the information in units of `scale` (p,), with a floor under what is
        not seen.
        """
        scale = np.where(scale > 0.0, scale, 1.0)
        eigenvalues = np.linalg.eigvalsh(self.matrix / np.outer(scale, scale))
        return float(np.log(np.maximum(eigenvalues, SINGULAR)).sum())

    def deviations(self) -> list[float | None]:
        """(p) standard deviation to expect of each parameter; None where it cannot be told from others."""
        eigenvalues, vectors = np.linalg.eigh(self.correlated)
        seen = eigenvalues > SINGULAR
        lost = (vectors[:, ~seen] ** 2).sum(axis=1) > 1e-6
        variance = (vectors[:, seen] ** 2 / eigenvalues[seen]).sum(axis=1)
        return [
            None if lost[k] or self.scale[k] == 0.0 else float(np.sqrt(variance[k]) / self.scale[k])
            for k in range(len(self.matrix))
        ]

    def inseparable(self) -> list[list[int]]:
        """Groups of parameters of which only combinations are seen; a group of one is not seen at all."""
        eigenvalues, vectors = np.linalg.eigh(self.correlated)
        groups: list[set[int]] = []
        for k in np.flatnonzero(eigenvalues <= SINGULAR):
            members = set(np.flatnonzero(np.abs(vectors[:, k]) > 1e-3).tolist())
            touching = [group for group in groups if group & members]
            groups = [group for group in groups if not group & members]
            groups.append(members.union(*touching))
        return sorted(sorted(group) for group in groups)


def information(model: PlanModel, motions: Sequence[PlannedMotion], noise: Array) -> Information:
    """Information of one session per motion.

    noise : (n,) N m, standard deviation of the filtered joint torque, per independent sample
    """
    count = len(model.parameters)
    matrix = np.zeros((count, count))
    for motion in motions:
        weight = INDEPENDENT_RATE * motion.period
        for joint, (indices, columns) in enumerate(model.rows(motion)):
            moving = motion.dq[:, joint] != 0.0
            seen = columns[moving]
            matrix[np.ix_(indices, indices)] += weight / noise[joint] ** 2 * (seen.T @ seen)
    return Information(matrix)
