"""Plans as jobs: computed in a process, then stored."""

from typing import Any

from api.service.jobs import Job, JobRunner
from api.service.plan_store import PlanStore
from api.service.rig_store import RigStore
from daq.excitation.excitation_plan import ExcitationPlan
from identify.recording.errors import InputError


class Planner:
    """Makes plans for rigs."""

    def __init__(self, rigs: RigStore, plans: PlanStore, jobs: JobRunner) -> None:
        self._rigs = rigs
        self._plans = plans
        self._jobs = jobs

    def plan(
        self,
        rig: str,
        user: str,
        name: str,
        seconds: float,
        model: str,
        seed: int,
        identified: dict[str, Any] | None = None,
    ) -> Job:
        """Plan an excitation of at most `seconds` for a model; the job's result is {"plan": id}.

        identified : document of an identification by which loads and currents are predicted

        Raises InputError for an unknown or wrong rig.
        """
        file = self._rigs.files().get(rig)
        if file is None:
            raise InputError(f"rig: {rig!r} is not known; known are {', '.join(self._rigs.files())}")
        self._rigs.rig(rig)

        def arguments() -> dict[str, Any]:
            return {
                "rig": str(file),
                "name": name,
                "seconds": seconds,
                "model": model,
                "seed": seed,
                "identified": identified,
            }

        def store(found: dict[str, Any]) -> dict[str, Any]:
            plan = ExcitationPlan.model_validate_json(found["plan"])
            return {"plan": self._plans.add(plan, found["report"])}

        return self._jobs.submit(
            "plan", "api.service.plan_computation:plan", arguments, store, user=user, experiment=None
        )
