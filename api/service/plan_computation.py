"""What a planning job computes, in a process of its own."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from api.assumed_masses import torque_limits
from api.plan_model import Identified, RegressorModel
from api.service.job_process import Progress
from api.service.plan_documents import PredictedCurrent, PredictedCurrents, StoredPlanReport
from daq.excitation.excitation_plan import ExcitationPlan
from daq.excitation.optimal_excitation import Request
from daq.excitation.plan_model import PlannedMotion
from daq.excitation.plan_report import make_plan
from daq.rig import Rig
from identify.results.identification import IdentificationDocument

NOISE = 0.01
"""Standard deviation of the filtered torque that is planned for, as a share of the torque at the current
limit.
"""
PREDICTED_POINTS = 600
"""Samples of the predicted current of every payload that are kept for the preview."""


@dataclass(frozen=True)
class PlanFound:
    """A plan that was made, and the report on it: what it will tell, what it cannot, and the predicted currents."""

    plan: ExcitationPlan
    report: StoredPlanReport


def plan(
    progress: Progress,
    rig: str,
    name: str,
    seconds: float,
    model: str,
    seed: int,
    identified: IdentificationDocument | None = None,
) -> PlanFound:
    """A plan of at most `seconds` for all payloads of the rig in file `rig`, made to tell most about `model`.

    identified : an identification by which loads and currents are predicted; None assumes masses
    """
    settings = Rig.load(Path(rig))
    known = None if identified is None else Identified.of(identified)
    request = Request(
        rig=settings,
        model=RegressorModel(settings, model, settings.payloads, (), known),
        payloads=settings.payloads,
        seconds=seconds,
        noise=np.asarray(NOISE * torque_limits(settings)),
        criterion="d-optimal",
        seed=seed,
    )
    planned = make_plan(request, progress)
    made = planned.plan.model_copy(update={"name": name})
    findings = dict(planned.document())
    findings.pop("plan")
    return PlanFound(made, StoredPlanReport(**findings, predicted=_predicted(request, made)))


def _predicted(request: Request, plan: ExcitationPlan) -> PredictedCurrents:
    """Predicted current of every payload and joint over time."""
    rig, period = request.rig, plan.duration / PREDICTED_POINTS
    motions = [PlannedMotion.of(plan, payload, period) for payload in request.payloads]
    currents = [np.linalg.solve(rig.drive_gain, request.model.torque(motion).T) for motion in motions]
    return PredictedCurrents(
        time=np.round(motions[0].time, 6).tolist(),
        currents=[
            PredictedCurrent(
                payload=payload.name,
                joint=axis.joint,
                limit=axis.limits.current,
                current=np.round(currents[p][j], 6).tolist(),
            )
            for p, payload in enumerate(request.payloads)
            for j, axis in enumerate(rig.axes)
        ],
    )
