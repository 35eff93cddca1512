"""What a fitted model is used for: predicting motion, and files for other programs with their certificates.

Both are computed by jobs when somebody asks, and kept beside the fit that they belong to: a new fit has neither.
"""

import io
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal, get_args

from api.service.experiment_store import ExperimentStore
from api.service.free_run_curves import FreeRunCurves, read_runs
from api.service.job_documents import JobResult
from api.service.jobs import Job, JobRunner
from api.service.model_story import ModelStory
from api.service.problems import Problem
from identify.recording.atomic_file import write_atomically
from identify.recording.controller_file import ControllerFile
from identify.results.certificate import Certificate
from identify.results.reading import read_document
from identify.results.simulation import HORIZONS, SimulationDocument

if TYPE_CHECKING:
    from api.service.use_computations import PredictedMotion

Ending = Literal["urdf", "sdf", "xml", "py", "c", "st", "fmu", "json"]
"""of the files that a model is exported to; what each is for stands in `identify.export.write.KINDS`"""

Driven = Literal["known", "torque", "drives", "estimate"]
"""what drives a simulated model: the recorded torque; or its controllers, with the gains that the drives held or that the record
tells; `known` is the drives' where the record holds them, else the torque"""

MOST_HORIZONS = 8
"""of one simulation that is asked for"""

ENDINGS: tuple[Ending, ...] = get_args(Ending)
SIMULATION_FILE = "simulation.json"
FREE_RUNS_FILE = "free-runs.npz"
EXPORTS = "exports"
"""folder beside a fit"""
COMPUTATIONS = "api.service.use_computations"


class ModelUse:
    """Simulations and exports of all experiments' models."""

    def __init__(self, experiments: ExperimentStore, jobs: JobRunner) -> None:
        self._experiments = experiments
        self._jobs = jobs

    def simulate(
        self,
        experiment: str,
        user: str,
        model: str,
        driven_by: Driven | ControllerFile = "torque",
        horizons: Sequence[float] = HORIZONS,
    ) -> Job:
        """Run a version forward along its record (a job), in closed loop with gains where these are given.

        horizons : s, of the windows

        Raises the problem 404.
        """
        story = self._story(experiment)
        version = story.read().version(model)

        def store(predicted: "PredictedMotion") -> JobResult:
            # Beside the fit that stands now: what the job computed is of the sessions that there were when its turn came.
            folder = story.fit_folder(model)
            # Never the curves of one run beside the figures of another, wherever the service may be killed.
            (folder / FREE_RUNS_FILE).unlink(missing_ok=True)
            write_atomically(folder / SIMULATION_FILE, predicted.document.json_text(indent=1).encode())
            write_atomically(folder / FREE_RUNS_FILE, predicted.runs)
            return JobResult(model=model)

        return self._jobs.submit(
            "simulate",
            f"{COMPUTATIONS}:simulate",
            lambda: {
                "experiment": str(story.folder.parent),
                "model": version.model,
                "add": version.add,
                "driven_by": None if driven_by == "known" else driven_by,
                "horizons": tuple(horizons),
            },
            store,
            user=user,
            experiment=experiment,
            asked=(model, driven_by, tuple(horizons)),
            about=JobResult(model=model),
        )

    def simulation(self, experiment: str, model: str) -> SimulationDocument | None:
        """How the version's newest fit predicts motion, or None where nobody asked yet. Raises the problem 404."""
        try:
            return read_document(
                SimulationDocument, self._story(experiment).fit_folder(model) / SIMULATION_FILE
            )
        except FileNotFoundError:
            return None

    def free_run(self, experiment: str, model: str, session: str, joint: int) -> FreeRunCurves | None:
        """The free run of one joint (from 0) in one session; None where there is none. Raises the problem 404."""
        return read_runs(self._story(experiment).fit_folder(model) / FREE_RUNS_FILE, session, joint)

    def export(self, experiment: str, user: str, model: str, ending: Ending) -> Job:
        """Write a version for another program (a job). Raises the problem 404."""
        story = self._story(experiment)
        version = story.read().version(model)
        return self._jobs.submit(
            "export",
            f"{COMPUTATIONS}:export",
            lambda: {
                "experiment": str(story.folder.parent),
                "model": version.model,
                "add": version.add,
                "target": str(self._target(experiment, model, ending)),
            },
            lambda certificate: JobResult(model=model, format=ending, file=certificate.target),
            user=user,
            experiment=experiment,
            asked=(model, ending),
            about=JobResult(model=model, format=ending),
        )

    def simulating(self, experiment: str, model: str) -> Job | None:
        """The job that is to run a version forward, or is at it."""
        return self._under_way(experiment, "simulate", model).get(None)

    def exporting(self, experiment: str, model: str) -> dict[str | None, Job]:
        """By format the jobs that are to write a version, or are at it."""
        return self._under_way(experiment, "export", model)

    def _under_way(self, experiment: str, kind: str, model: str) -> dict[str | None, Job]:
        jobs = [
            job for job in self._jobs.unfinished(experiment) if (job.kind, job.result.model) == (kind, model)
        ]
        return {job.result.format: job for job in reversed(jobs)}

    def export_faults(self, experiment: str, model: str) -> dict[str | None, str]:
        """By format why the last job that was to write a version in it made nothing; only of those that did not."""
        faults = self._jobs.faults(experiment, "export", model)
        return {about.format: reason for about, reason in faults.items()}

    def simulation_fault(self, experiment: str, model: str) -> str | None:
        """Why the last job that was to run a version forward made nothing, if so."""
        return self._jobs.faults(experiment, "simulate", model).get(JobResult())

    def certificate(self, experiment: str, model: str, ending: Ending) -> Certificate:
        """What the exported file keeps and costs. Raises the problem 404."""
        target = self._target(experiment, model, ending)
        try:
            return read_document(Certificate, _certificate_file(target))
        except FileNotFoundError:
            raise Problem(
                404, f"The model {model} was not exported as {ending} yet: POST to this address."
            ) from None

    def certificates(self, experiment: str, model: str) -> dict[Ending, Certificate]:
        """Of everything that the version's newest fit was exported to."""
        certificates: dict[Ending, Certificate] = {}
        for ending in ENDINGS:
            if _certificate_file(self._target(experiment, model, ending)).is_file():
                certificates[ending] = self.certificate(experiment, model, ending)
        return certificates

    def exported(self, experiment: str, model: str, ending: Ending) -> tuple[str, bytes]:
        """Name and content of the exported file; of C a ZIP archive of source, header and certificate. Raises the problem 404."""
        self.certificate(experiment, model, ending)
        target = self._target(experiment, model, ending)
        if ending != "c":
            return target.name, target.read_bytes()
        packed = io.BytesIO()
        with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
            for file in (target, target.with_suffix(".h"), _certificate_file(target)):
                archive.write(file, file.name)
        return f"{target.stem}-c.zip", packed.getvalue()

    def _story(self, experiment: str) -> ModelStory:
        return ModelStory(self._experiments.folder(experiment))

    def _target(self, experiment: str, model: str, ending: Ending) -> Path:
        return self._story(experiment).fit_folder(model) / EXPORTS / f"{experiment}-{model}.{ending}"


def _certificate_file(target: Path) -> Path:
    return target.with_name(f"{target.name}.certificate.json")
