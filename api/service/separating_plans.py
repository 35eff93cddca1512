"""From the experiment that would tell rival effects apart to a plan that a session takes."""

from dataclasses import dataclass

import numpy as np

from api.service.experiment_store import ExperimentStore
from api.service.model_workflow import ModelWorkflow
from api.service.plan_documents import PlanPurpose, SeparatingPlanReport
from api.service.plan_store import PlanStore
from api.service.problems import Problem
from api.service.rig_store import RigStore
from daq.excitation.separating_plan import SeparatingMotion, separating_plan
from identify.recording.errors import InputError
from identify.recording.plain_text import LONGEST_NAME


@dataclass(frozen=True)
class MadePlan:
    """A plan just made: its id, the rig it was made for, the payload to mount, and what the rig's limits made of it."""

    plan: str
    rig: str
    payload: str
    remarks: tuple[str, ...]


class SeparatingPlanner:
    """Makes plans of proposed experiments."""

    def __init__(
        self, experiments: ExperimentStore, models: ModelWorkflow, rigs: RigStore, plans: PlanStore
    ) -> None:
        self._experiments = experiments
        self._models = models
        self._rigs = rigs
        self._plans = plans

    def plan(
        self, experiment: str, joint: str, proposal: int, rig: str | None = None, model: str | None = None
    ) -> MadePlan:
        """Plan a proposed experiment within a rig's limits.

        proposal : its rank, from 1
        rig      : that which measured the experiment last if not said, else the first with its joints
        model    : the version whose diagnosis left the rivals; the current one if not said

        Raises the problem 404 (no such joint, proposal or model), 409 (nothing proposed, or no rig with these joints), and
        InputError where the rig's limits leave no way to move on.
        """
        row = self._experiments.row(experiment)
        if joint not in row.joints:
            raise Problem(404, f"The robot has no joint {joint}; it has {', '.join(row.joints)}.")
        story = self._models.story(experiment)
        versions = story.read()
        version = versions.version(model) if model else versions.current
        proposed = story.next_experiment(version.id, row.joints.index(joint)) if version else None
        if proposed is None or not proposed.proposals:
            raise Problem(409, f"No experiment is proposed for joint {joint} yet: ask for it first.")
        if not 1 <= proposal <= len(proposed.proposals):
            raise Problem(404, f"There are {len(proposed.proposals)} proposals, not {proposal}.")
        chosen = proposed.proposals[proposal - 1]
        rig = rig or self.rig_of(experiment)
        if rig is None:
            raise Problem(
                409,
                f"No rig here has the joints {', '.join(row.joints)}; add its file to the folder of rigs.",
            )
        settings = self._rigs.rig(rig)
        if [axis.joint for axis in settings.axes] != row.joints:
            raise InputError(f"rig: {rig} does not have the experiment's joints ({', '.join(row.joints)})")
        rivals = " from ".join(proposed.rivals)
        plan, remarks = separating_plan(
            settings,
            joint,
            SeparatingMotion.model_validate(chosen.model_dump()),
            np.array(proposed.posture),
            f"{rivals} on {joint}"[:LONGEST_NAME],
        )
        purpose = PlanPurpose(
            rivals=proposed.rivals,
            joint=joint,
            payload=chosen.payload,
            separation=chosen.separation,
            decides=chosen.decides,
        )
        identifier = self._plans.add(plan, SeparatingPlanReport(purpose=purpose, remarks=tuple(remarks)))
        return MadePlan(identifier, rig, chosen.payload, remarks)

    def rig_of(self, experiment: str) -> str | None:
        """The rig that measured the experiment last and still fits it, else the first that does; None where none does."""
        joints = self._experiments.row(experiment).joints
        measured = [row.rig for row in reversed(self._experiments.sessions(experiment)) if row.rig]
        for rig in dict.fromkeys([*measured, *self._rigs.files()]):
            if rig in self._rigs.files() and self._has(rig, joints):
                return rig
        return None

    def _has(self, rig: str, joints: list[str]) -> bool:
        try:
            return [axis.joint for axis in self._rigs.rig(rig).axes] == joints
        except InputError:
            return False  # its file is wrong; the page of the rig says so
