"""Model versions of an experiment: fitted, changed, diagnosed, simulated, exported."""

from collections.abc import Sequence
from urllib.parse import urlencode

import numpy as np
from numpy.typing import NDArray

from api.client.connection import Connection, ServiceError, Signals
from api.service.free_run_documents import FreeRunView
from api.service.job_documents import JobView
from api.service.model_documents import Comparison, Stepped, StoryView, VersionView
from api.service.plan_documents import MadePlanView
from identify.recording.controller_file import ControllerFile
from identify.results.certificate import Certificate
from identify.results.diagnosis import DiagnosisDocument
from identify.results.effect import CatalogueEffect
from identify.results.identification import IdentificationDocument
from identify.results.next_experiment import NextExperimentDocument
from identify.results.reading import document_of
from identify.results.simulation import SimulationDocument

BESIDE_RESULTS = ("version", "stale", "job", "diagnosis")
"""What `/results` answers beside the identification: where it comes from, and the diagnosis, which has a call of its own."""


class ModelCalls(Connection):
    """What a client can ask about the models of an experiment."""

    def results(self, experiment: str) -> IdentificationDocument:
        """What the identifier says over all sessions so far.

        Raises ServiceError with status 404 before the first session, and 202 while the first results are
        computed.
        """
        answer = self._http.get(f"/experiments/{experiment}/results")
        if answer.status_code == 202:
            raise ServiceError(202, {"detail": "the first results are being computed", **answer.json()})
        fields = {name: value for name, value in self._answer(answer).items() if name not in BESIDE_RESULTS}
        return document_of(IdentificationDocument, fields, str(answer.url))

    def models(self, experiment: str) -> StoryView:
        """All model versions and which of them is current."""
        return self._one(StoryView, f"/experiments/{experiment}/models")

    def model(self, experiment: str, model: str) -> VersionView:
        """One model version with its newest fit and diagnosis."""
        return self._one(VersionView, f"/experiments/{experiment}/models/{model}")

    def compare(self, experiment: str, first: str, second: str) -> Comparison:
        """Two model versions side by side."""
        return self._one(Comparison, f"/experiments/{experiment}/models/compare", first=first, second=second)

    def fit(self, experiment: str, model: str = "usual", add: list[str] | None = None) -> JobView:
        """Fit a model (a job); it becomes the current one."""
        return self._begin(f"/experiments/{experiment}/models", {"model": model, "add": add or []})

    def add_effect(self, experiment: str, effect: str, joint: str | None = None) -> JobView:
        """Add an effect to the current model (a job)."""
        return self._begin(f"/experiments/{experiment}/models/effects", {"effect": effect, "joint": joint})

    def remove_effect(self, experiment: str, effect: str, joint: str | None = None) -> JobView:
        """Remove an effect from the current model (a job)."""
        change = {"effect": effect, "joint": joint}
        return self._begin(f"/experiments/{experiment}/models/effects/remove", change)

    def undo(self, experiment: str) -> Stepped:
        """Go back to the model before."""
        return self._done(Stepped, f"/experiments/{experiment}/models/undo")

    def redo(self, experiment: str) -> Stepped:
        """Take back the last undo."""
        return self._done(Stepped, f"/experiments/{experiment}/models/redo")

    def diagnose(self, experiment: str, model: str, motion: bool = False) -> JobView:
        """Find what a model version misses (a job); with `motion`, also what that does to motion predicted a second ahead."""
        asked = "?motion=true" if motion else ""
        return self._begin(f"/experiments/{experiment}/models/{model}/diagnosis{asked}")

    def diagnosis(self, experiment: str, model: str) -> DiagnosisDocument:
        """What was found to be missing in a model version."""
        address = f"/experiments/{experiment}/models/{model}/diagnosis"
        return document_of(DiagnosisDocument, self._get(address), address)

    def improve(self, experiment: str, motion: bool = False) -> JobView:
        """Diagnose and add until nothing more is justified (a job); with `motion`, predict motion a second ahead too."""
        asked = "?motion=true" if motion else ""
        return self._begin(f"/experiments/{experiment}/improvement{asked}")

    def find_next_experiment(self, experiment: str, model: str, joint: str) -> JobView:
        """Find the experiment that tells apart what the diagnosis left open on a joint (a job)."""
        return self._begin(f"/experiments/{experiment}/models/{model}/next-experiment", {"joint": joint})

    def next_experiment(self, experiment: str, model: str, joint: str) -> NextExperimentDocument:
        """The experiment that would tell the rivals of a joint apart."""
        address = f"/experiments/{experiment}/models/{model}/next-experiment"
        return document_of(NextExperimentDocument, self._get(address, joint=joint), address)

    def plan_next_experiment(
        self, experiment: str, model: str, joint: str, proposal: int = 1, rig: str | None = None
    ) -> MadePlanView:
        """Plan a proposed experiment; `plan`, `rig` and `payload` are what a session takes."""
        wanted = {"joint": joint, "proposal": proposal, "rig": rig}
        address = f"/experiments/{experiment}/models/{model}/next-experiment/plan"
        return self._done(MadePlanView, address, wanted)

    def simulate(
        self,
        experiment: str,
        model: str,
        driven_by: str = "torque",
        gains: ControllerFile | None = None,
        horizons: Sequence[float] = (),
    ) -> JobView:
        """Run a model version forward along its record (a job): by the recorded torque, or in closed loop.

        gains : closes the loop where given; else `driven_by` says whose do: those of the `drives`, or what the record tells
            (`estimate`); `known` takes those of the drives where the record holds them, else the torque
        horizons : s, of the windows; 0.1 and 1 where there are none
        """
        query = urlencode([("driven_by", driven_by), *(("horizon", each) for each in horizons)])
        address = f"/experiments/{experiment}/models/{model}/simulation?{query}"
        return self._begin(address, None if gains is None else gains.model_dump(mode="json"))

    def simulation(self, experiment: str, model: str) -> SimulationDocument:
        """How well a model version predicts motion."""
        address = f"/experiments/{experiment}/models/{model}/simulation"
        return document_of(SimulationDocument, self._get(address), address)

    def free_run(self, experiment: str, model: str, session: str, joint: str) -> FreeRunView:
        """`time`, and `position` and `speed` as measured, of the model, of the usual one, and the errors, from a session's start.

        Raises ServiceError with status 404 until the model was simulated.
        """
        address = f"/experiments/{experiment}/models/{model}/simulation/free-run"
        return self._one(FreeRunView, address, session=session, joint=joint)

    def export(self, experiment: str, model: str, ending: str) -> JobView:
        """Write a model version for another program: urdf, sdf, xml, py, c, st, fmu or json (a job)."""
        return self._begin(f"/experiments/{experiment}/models/{model}/exports/{ending}")

    def certificate(self, experiment: str, model: str, ending: str) -> Certificate:
        """What an exported file keeps of the model, and what that costs."""
        address = f"/experiments/{experiment}/models/{model}/exports/{ending}"
        return document_of(Certificate, self._get(address), address)

    def exported_file(self, experiment: str, model: str, ending: str) -> bytes:
        """The exported file; of C a ZIP archive of source, header and certificate."""
        answer = self._http.get(f"/experiments/{experiment}/models/{model}/exports/{ending}/file")
        return self._checked(answer).content

    def model_signals(
        self,
        experiment: str,
        model: str,
        session: str,
        joint: int = 1,
        start: float | None = None,
        end: float | None = None,
        points: int = 2000,
    ) -> tuple[NDArray[np.float64], Signals]:
        """Time (M,) s and `measured`, `predicted`, `error` torque, `position`, `velocity`, `load` (M,) of
        a joint.
        """
        address = f"/experiments/{experiment}/models/{model}/signals"
        query = {"session": session, "joint": joint, "from": start, "to": end, "points": points}
        return self._signals(address, query)

    def effects(self) -> list[CatalogueEffect]:
        """The catalogue of physical effects."""
        return self._all(CatalogueEffect, "/effects")
