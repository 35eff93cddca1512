"""The proof on the drive: does the model make this machine follow better? Proofs so far, a new one, and one with what it did."""

from dataclasses import dataclass
from typing import Annotated, Literal
from urllib.parse import urlencode

import numpy as np
from fastapi import APIRouter, Form, Query, Request
from fastapi.responses import HTMLResponse, Response
from markupsafe import Markup

from api.compensation_text import HELD_OVER_THE_BUS
from api.pages.choices import JointChoice, RigChoice, VersionChoice, chosen_model
from api.pages.error_figures import JointUnits
from api.pages.experiment_frame import experiment_context, no_model_page
from api.pages.figures.following_error import Following, draw_following_error
from api.pages.form_input import input_errors_as_problems
from api.pages.job_views import follow
from api.pages.layout import experiment_link, frame, session_link
from api.pages.proof_words import FollowingRow, joint_rows, proof_row
from api.pages.rendering import PREFIX, page
from api.pages.rigs_of_experiment import rig_of_choice, rigs_of_experiment
from api.pages.sentence import sentence
from api.pages.session_words import outcome
from api.pages.stored_models import StoredExperiment
from api.proof_drive import Drive
from api.service import access
from api.service.database import SessionRow
from api.service.proofs import ProofState
from api.service.service import Service
from daq.rig import Rig
from daq.session_events import SessionState
from identify.results.compensation import JointFollowing

router = APIRouter(prefix=f"{PREFIX}/experiments/{{experiment}}/proofs", include_in_schema=False)

DRIVES: tuple[tuple[Drive, str], ...] = (("without", "Without feedforward torque"), ("with", "With it"))
Word = Annotated[str, Form(max_length=64)]
Share = Annotated[float, Form(gt=0, le=100, allow_inf_nan=False)]


@router.get("")
def proofs_page(
    request: Request,
    user: access.Viewer,
    experiment: str,
    version: VersionChoice = None,
    rig: RigChoice = None,
) -> HTMLResponse:
    """Proofs so far, and the form for a new one."""
    service = access.service_of(request)
    stored = StoredExperiment(service.experiments, experiment)
    context = frame(request, user, "results", experiment)
    shown = chosen_model(stored, version) or stored.current()
    context |= experiment_context(stored, stored.joint_names[0], shown, "results")
    if shown is None:
        return no_model_page(request, stored, stored.joint_names[0], context)
    rigs = rigs_of_experiment(service, stored)
    rig_id = rig_of_choice(service, experiment, rigs, rig)
    proofs, damaged = service.proofs.listed(experiment)
    context |= {
        "rows": [proof_row(experiment, each) for each in proofs],
        "damaged": damaged,
        "shown": shown,
        "versions": [stored.model(each.id) for each in stored.story.versions],
        "rigs": list(rigs),
        "rig_id": rig_id,
        "other_rig": service.catalogue.other_rig(experiment, rig_id) if rig_id else None,
        "plans": _plans(service, stored),
        "payloads": _payloads(stored, rigs[rig_id]) if rig_id else [],
        "here_link": experiment_link(experiment, "proofs"),
        "plan_link": experiment_link(experiment, "proofs/plan"),
    }
    return page(request, "proofs.html", **context)


@router.post("")
def prepare(
    request: Request,
    user: access.Operator,
    experiment: str,
    rig: Word,
    plan: Word,
    payload: Word,
    version: Annotated[str, Form(max_length=12)],
    part: Annotated[Literal["whole", "friction"], Form()] = "whole",
    percent: Share = 60.0,
) -> HTMLResponse:
    """Compute what is sent along the plan; progress until it is there."""
    service = access.service_of(request)
    with input_errors_as_problems():
        service.disk.require_room()
        model = chosen_model(StoredExperiment(service.experiments, experiment), version)
        job = service.proofs.prepare(
            experiment,
            user,
            rig=rig,
            plan=plan,
            payload=payload,
            model=model.version.id if model else None,
            part=part,
            share=percent / 100.0,
        )
    return _progress(request, experiment, job.id)


@router.post("/plan")
def standard_plan(request: Request, _user: access.Operator, experiment: str, rig: Word) -> Response:
    """Make a plan to prove it with; then the form again, with it."""
    service = access.service_of(request)
    with input_errors_as_problems():
        service.disk.require_room()
        service.proofs.standard_plan(experiment, rig)
    link = f"{experiment_link(experiment, 'proofs')}?{urlencode({'rig': rig})}"
    return Response(status_code=204, headers={"HX-Redirect": link})


@router.get("/progress")
def progress(
    request: Request, _user: access.Viewer, experiment: str, job: Annotated[str, Query(max_length=32)]
) -> HTMLResponse:
    """How far it is; then the proof itself."""
    return _progress(request, experiment, job)


def _progress(request: Request, experiment: str, identifier: str) -> HTMLResponse:
    return follow(
        request,
        identifier,
        experiment_link(experiment, "proofs/progress"),
        "No proof was prepared",
        lambda job: experiment_link(experiment, f"proofs/{job.result.proof}"),
    )


@router.get("/{proof}")
def proof_page(
    request: Request, user: access.Viewer, experiment: str, proof: str, joint: JointChoice = None
) -> HTMLResponse:
    """One proof: its two drives, and what feedforward torque did to the following error of a joint."""
    service = access.service_of(request)
    stored = StoredExperiment(service.experiments, experiment)
    name = stored.joint_or_first(joint)
    state = service.proofs.get(experiment, proof)
    context = frame(request, user, "results", experiment)
    context |= experiment_context(stored, name, stored.current(), f"proofs/{proof}")
    with input_errors_as_problems():
        context |= {
            "proof": proof_row(experiment, state),
            "drives": [_drive(service, state, drive, title) for drive, title in DRIVES],
            "next": state.next,
            "operator": service.operators.operator(state.settings.rig),
            "unfinished": state.unfinished.words if state.unfinished is not None else "",
            "remarks": [
                sentence(remark)
                for remark in (
                    state.result.remarks if state.result else service.proofs.remarks(experiment, proof)
                )
            ],
            "all_joints": [
                JointRow(each.joint, _units(stored, each.joint)[1], joint_rows(each)[0])
                for each in (state.result.joints if state.result else ())
            ],
            "result": _result(service, stored, state, name),
            "proof_news_link": _news_link(experiment, proof, service.proofs.progress(experiment, proof)),
            "all_link": experiment_link(experiment, "proofs"),
        }
    return page(request, "proof.html", **context)


@router.get("/{proof}/news")
def proof_news(
    request: Request,
    _user: access.Viewer,
    experiment: str,
    proof: str,
    seen: Annotated[str, Query(max_length=400)] = "",
) -> Response:
    """A fresh page once a drive has gone further than was seen."""
    now = access.service_of(request).proofs.progress(experiment, proof)
    return Response(status_code=204, headers={} if now == seen else {"HX-Refresh": "true"})


def _news_link(experiment: str, proof: str, seen: str) -> str:
    return f"{experiment_link(experiment, f'proofs/{proof}/news')}?{urlencode({'seen': seen})}"


@router.post("/{proof}/drives/{drive}")
def prepare_drive(
    request: Request, user: access.Operator, experiment: str, proof: str, drive: Drive
) -> Response:
    """Prepare one of the drives, and go on to its steps."""
    service = access.service_of(request)
    with input_errors_as_problems():
        service.disk.require_room()
        row = service.proofs.prepare_drive(experiment, proof, drive, user)
    service.live.tell(row.rig or "")
    return Response(status_code=204, headers={"HX-Redirect": session_link(experiment, row.id)})


@dataclass(frozen=True)
class JointRow:
    """The following error of a joint over all of the plan, in `small`: mrad or mm."""

    joint: str
    small: str
    row: FollowingRow


@dataclass(frozen=True)
class PlanChoice:
    """A plan that can be driven; `driven`: a session was measured with it."""

    id: str
    name: str
    seconds: float
    driven: bool


@dataclass(frozen=True)
class DriveStep:
    """One of the two drives: what became of it, and where it goes on."""

    words: str
    done: bool
    under_way: bool
    link: str | None
    said: str
    prepare_link: str


@dataclass(frozen=True)
class ResultView:
    """What feedforward torque did to the following error of a joint; `rows` is None where nothing can be compared.

    small, limit : mrad or mm, and the following error at which the second run would have been stopped
    """

    completed: bool
    reason: str
    rows: list[FollowingRow] | None = None
    held_over_the_bus: str = ""
    own: JointFollowing | None = None
    small: str = ""
    figure: Markup | None = None
    narrow: Markup | None = None
    limit: float | None = None


def _plans(service: Service, stored: StoredExperiment) -> list[PlanChoice]:
    """Plans of these joints; those that no session was measured with come first: they prove more."""
    driven = {entry.plan for entry in service.catalogue.entries(stored.id) if entry.measured}
    plans = [
        (each, service.plans.plan(each))
        for each in sorted(service.plans.ids(), key=lambda each: each in driven)
    ]
    return [
        PlanChoice(
            id=each,
            name=(plan.name or each),
            seconds=plan.duration,
            driven=each in driven,
        )
        for each, plan in plans
        if list(plan.joints) == stored.joint_names
    ]


def _payloads(stored: StoredExperiment, rig: Rig) -> list[tuple[str, float]]:
    known = {each.name: each.mass for each in rig.payloads} | {
        each.name: each.mass for each in stored.declared.payloads
    }
    return list(known.items())


def _drive(service: Service, state: ProofState, drive: Drive, title: str) -> DriveStep:
    """One of the two drives: what became of it, and where it goes on."""
    row = state.drive(drive)
    done = row is not None and row.state == SessionState.DONE.value
    under_way = row is not None and not _over(service, row)
    said = outcome(service, row) if row is not None and not done else None
    return DriveStep(
        words=title,
        done=(done or (state.result is not None and (drive == "without" or state.result.completed))),
        under_way=under_way,
        link=(session_link(row.experiment, row.id) if row is not None else None),
        said=(f"{said.title} {said.words}" if said is not None and not under_way else ""),
        prepare_link=experiment_link(state.settings.experiment, f"proofs/{state.number}/drives/{drive}"),
    )


def _over(service: Service, row: SessionRow) -> bool:
    return SessionState(row.state).ended or service.proofs.cut_off(row)


def _result(service: Service, stored: StoredExperiment, state: ProofState, joint: str) -> ResultView | None:
    result = state.result
    errors_of_joint = next((each for each in result.joints if each.joint == joint), None) if result else None
    if result is None:
        return None
    if errors_of_joint is None:
        return ResultView(result.completed, result.reason)
    place = stored.joint_names.index(joint)
    position, small = _units(stored, joint)
    errors = service.proofs.errors(stored.id, state.number)
    figure = narrow = None
    if errors is not None:
        drawn = Following(
            errors.time,
            1e3 * errors.before[:, place],
            1e3 * errors.after[:, place],
            errors.position[:, place],
            1e3 * float(np.asarray(result.following_limits)[place]),
            small,
            position,
        )
        figure = draw_following_error(joint, drawn)
        narrow = draw_following_error(joint, drawn, width=350, height=300)
    return ResultView(
        completed=result.completed,
        reason=result.reason,
        rows=joint_rows(errors_of_joint),
        held_over_the_bus=(HELD_OVER_THE_BUS if result.held_by != "drive" else ""),
        own=errors_of_joint,
        small=small,
        figure=figure,
        narrow=narrow,
        limit=1e3 * result.following_limits[place],
    )


def _units(stored: StoredExperiment, joint: str) -> tuple[str, str]:
    """A joint's position, and its following error: rad and mrad, or m and mm."""
    units = JointUnits.of(stored.declared.robot.joints[stored.joint_names.index(joint)].type)
    return units.position, "mrad" if units.position == "rad" else "mm"
