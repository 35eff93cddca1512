"""The demo as a job: from an empty list to an experiment with a model, measured on the simulated arm."""

import threading
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from api.service.disk_budget import DiskBudget
from api.service.experiment_store import ExperimentStore
from api.service.job_documents import JobResult
from api.service.jobs import Arguments, Job, JobRunner
from api.service.model_story import ModelStory
from api.service.refit import store_refit
from api.simulated_demo import PLAN, fresh_folder

if TYPE_CHECKING:  # the service does not load what its processes compute with
    from api.service.computations import FitFound

DEMO = "demo"
"""Kind of the job."""


class Demos:
    """Measures on the simulated arm, for whoever has no rig and no record at hand.

    The arm, its drive and the bus between them live in the job's processes: no rig of the service takes part.
    plan : file of the plan that each session drives
    """

    def __init__(
        self, experiments: ExperimentStore, jobs: JobRunner, disk: DiskBudget, plan: Path = PLAN
    ) -> None:
        self._experiments = experiments
        self._jobs = jobs
        self._disk = disk
        self._lock = threading.Lock()
        self.plan = plan

    def under_way(self, user: str) -> Job | None:
        """The demo of a user that has not ended yet."""
        return self._jobs.unfinished_of(user, DEMO)

    def start(self, user: str) -> Job:
        """Measure and fit; the job's result is {"experiment": id, "model": version}.

        The experiment is put together out of sight and listed as a whole. Who has a demo under way is given that one.

        Raises the problem 429 (too many jobs) or 507 (no room).
        """
        place = ExitStack()

        def arguments() -> Arguments:
            folder = place.enter_context(self._experiments.incoming()) / "experiment"
            name = fresh_folder(self._experiments.root).name
            return {"folder": str(folder), "name": name, "plan": str(self.plan), "operator": user}

        def store(fitted: "FitFound") -> JobResult:
            folder = fitted.folder.parents[2]
            version = store_refit(ModelStory(folder), fitted, user)
            row = self._experiments.adopt(folder, fitted.identification.experiment)
            return JobResult(experiment=row.id, model=version.id)

        with self._lock:
            running = self.under_way(user)
            if running is not None:
                return running
            self._disk.require_room()
            return self._jobs.submit(
                DEMO,
                "api.service.demo_computation:measure_and_fit",
                arguments,
                store,
                user=user,
                experiment=None,
                clean_up=place.close,
            )
