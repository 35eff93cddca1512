"""The torque that a model gives for a planned motion, and how much of it is the rigid robot's."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.dynamics.payload import payload_parameters
from identify.export.exported_model import ExportedModel
from identify.export.formula_torque import module_of, module_torque
from identify.export.record_error import Motion

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PlannedTorque:
    """(N, n) N m or N each.

    whole : what the motors must give
    rigid : inertia, Coriolis, centrifugal and gravity torque of arm and payload (tau_out of eq. 6)
    """

    whole: Array
    rigid: Array

    @property
    def beside(self) -> Array:
        """(N, n): friction, and all else that is no rigid body."""
        return self.whole - self.rigid


def planned_torque(model: ExportedModel, motion: Motion) -> PlannedTorque:
    """Of a motion whose rows follow each other in time."""
    module = module_of(model)
    rigid = module.rigid_torque(motion.q.T, motion.dq.T, motion.ddq.T, payload_parameters(motion.payload)).T
    return PlannedTorque(module_torque(module, model)(motion), rigid)
