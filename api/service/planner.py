"""Plans as jobs: computed in a process, then stored."""

from typing import TYPE_CHECKING

from api.service.job_documents import JobResult
from api.service.jobs import Arguments, Job, JobRunner
from api.service.plan_store import PlanStore
from api.service.rig_store import RigStore
from identify.recording.errors import InputError
from identify.results.identification import IdentificationDocument

if TYPE_CHECKING:  # the service does not load what its processes compute with
    from api.service.plan_computation import PlanFound


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
        identified: IdentificationDocument | None = None,
    ) -> Job:
        """Plan an excitation of at most `seconds` for a model; the job's result names it.

        identified : an identification by which loads and currents are predicted

        Raises InputError for an unknown or wrong rig.
        """
        file = self._rigs.files().get(rig)
        if file is None:
            raise InputError(f"rig: {rig!r} is not known; known are {', '.join(self._rigs.files())}")
        self._rigs.rig(rig)

        def arguments() -> Arguments:
            return {
                "rig": str(file),
                "name": name,
                "seconds": seconds,
                "model": model,
                "seed": seed,
                "identified": identified,
            }

        def store(planned: "PlanFound") -> JobResult:
            return JobResult(plan=self._plans.add(planned.plan, planned.report))

        return self._jobs.submit(
            "plan", "api.service.plan_computation:plan", arguments, store, user=user, experiment=None
        )
