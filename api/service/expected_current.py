"""The current that a model predicts along a plan, for the live view to draw beneath what the drives say."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from api.plan_model import RegressorModel
from api.predicting_model import predicting_model
from api.service.experiment_store import ExperimentStore
from api.service.model_story import ModelStory
from api.service.plan_store import PlanStore
from api.service.rig_store import RigStore
from api.service.session_payload import described
from daq.excitation.excitation_plan import ExcitationPlan
from daq.excitation.plan_model import PlannedMotion
from daq.rig import Rig
from identify.recording.experiment_file import Payload

Array = NDArray[np.float64]


class Expectation(Protocol):
    """What is expected of the drives in cycles of a plan."""

    def at(self, cycles: Array) -> Array:
        """(N, n) A in the plan's cycles (N,), counted from 0, increasing."""
        ...


@dataclass(frozen=True)
class ExpectedCurrent:
    """Of one session: eq. (7) turned round, v = drive gain⁻¹ · torque of the model along the plan."""

    rig: Rig
    plan: ExcitationPlan
    payload: Payload
    model: RegressorModel

    def at(self, cycles: Array) -> Array:
        """(N, n) A in the plan's cycles (N,), counted from 0, increasing."""
        time = np.clip(cycles * self.rig.cycle, 0.0, self.plan.duration)
        motion = PlannedMotion(self.payload, time, *self.plan.setpoints(time), self.rig.cycle)
        return np.asarray(
            np.linalg.solve(self.rig.drive_gain, self.model.torque(motion).T).T, dtype=np.float64
        )


class CurrentForecast:
    """Makes the expectation of a session from its plan, its payload and the experiment's current model."""

    def __init__(self, experiments: ExperimentStore, rigs: RigStore, plans: PlanStore) -> None:
        self._experiments = experiments
        self._rigs = rigs
        self._plans = plans

    def of(self, experiment: str, session: str) -> ExpectedCurrent | None:
        """None before the experiment's first model. Raises InputError and problems where plan or rig have gone since."""
        row = self._experiments.session(experiment, session)
        story = ModelStory(self._experiments.folder(experiment))
        current = story.read().current
        document = story.identification(current.id) if current else None
        if document is None or row.rig is None or row.plan is None:
            return None
        rig, payload = self._rigs.rig(row.rig), described(row.payload)
        model = predicting_model(rig, payload, document)
        return (
            ExpectedCurrent(rig, self._plans.plan(row.plan), payload, model) if model.is_identified else None
        )
