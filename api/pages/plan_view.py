"""A planned motion as the operator sees it before anything moves: against its limits, and what it can identify."""

from collections.abc import Sequence
from dataclasses import dataclass

from markupsafe import Markup

from api.pages.catalogue_words import effect_titles
from api.pages.error_figures import JointUnits
from api.pages.figures.plan_preview import draw_plan_signal
from api.pages.number_format import listing, number, percent, significant
from api.pages.plan_preview_times import preview_times
from api.pages.sentence import sentence
from api.plan_model import Identified, RegressorModel, usual_model
from api.planned_motion import Determination, Repetition, determination, repetition
from api.predicting_model import predicting_model
from api.service.plan_documents import SeparatingPlanReport
from daq.excitation.excitation_plan import ExcitationPlan
from daq.excitation.plan_limits import violations
from daq.excitation.plan_model import PlannedMotion
from daq.excitation.plan_report import COVERAGE_PERIOD
from daq.rig import Rig
from identify.recording.experiment_file import Payload
from identify.results.identification import IdentificationDocument

NARROW = 420.0
"""Width of a figure that shares its row with others, or has a phone to itself."""
REPEATED = 0.2
"""Part of a plan that must repeat for a noise floor, as `identify.validation.noise_floor` asks of a session."""


@dataclass(frozen=True)
class Finding:
    """One thing that the plan can (`good`) or cannot (`warn`) show, in a sentence."""

    kind: str
    what: str
    words: str


@dataclass(frozen=True)
class JointFigures:
    """The planned motion of one joint, drawn: position, speed, and the torque where it can be predicted.

    narrow : the same for a phone, where `figures` would be too wide to be read; empty where they are not
    """

    name: str
    figures: list[Markup]
    narrow: list[Markup]


@dataclass(frozen=True)
class PlanView:
    """Figures of each joint (position, speed, predicted torque), broken limits and findings in words."""

    duration: float
    joints: list[JointFigures]
    broken: list[str]
    findings: list[Finding]
    torque_words: str


def plan_view(
    plan: ExcitationPlan,
    rig: Rig,
    payload: Payload,
    masses_measured: Sequence[float],
    identification: IdentificationDocument | None,
) -> PlanView:
    """Look at a plan.

    masses_measured : kg, the payloads of the experiment's sessions so far
    identification  : what the current model found, for the predicted torque; None before the first session
    """
    times = preview_times(plan)
    position, velocity, acceleration = plan.setpoints(times.new)
    model = usual_model(rig, payload, Identified.of(identification) if identification else None)
    motion = PlannedMotion(payload, times.new, position, velocity, acceleration, times.spacing)
    predicting = predicting_model(rig, payload, identification)
    torque = predicting.torque(motion) if predicting.is_identified else None
    joints = []
    for index, axis in enumerate(rig.axes):
        units = JointUnits.of(rig.robot.joints[index].type)
        limits = axis.limits
        signals = [
            (position[:, index], limits.position, "position", units.position, "position"),
            (velocity[:, index], (-limits.velocity, limits.velocity), "speed", units.speed, "measured"),
        ]
        if torque is not None:
            most = float(abs(rig.drive_gain[index, index])) * limits.current
            quantity = "force" if units.load == "N" else "torque"
            signals.append((torque[:, index], (-most, most), quantity, units.load, "predicted"))
        drawn = [
            (signal[times.row], bounds, label, unit, kind) for signal, bounds, label, unit, kind in signals
        ]
        narrow = [draw_plan_signal(times.whole, *signal, width=NARROW) for signal in drawn]
        if len(rig.axes) > 1:
            joints.append(JointFigures(axis.joint, narrow, []))
        else:
            wide = [draw_plan_signal(times.whole, *signal) for signal in drawn]
            joints.append(JointFigures(axis.joint, wide, narrow))
    torque_limits = {} if torque is None else {"torque": torque, "times": times.new}
    broken = [str(each) for each in violations(plan, rig, **torque_limits)]
    return PlanView(
        plan.duration,
        joints,
        broken,
        findings(plan, rig, payload, masses_measured, model),
        "predicted with the current model, limits from the drive's current"
        if torque is not None
        else f"{_not_predicted(identification)}; the current is watched on every sample.",
    )


def _not_predicted(identification: IdentificationDocument | None) -> str:
    """Why no torque is drawn."""
    if identification is None:
        return "The torque cannot be predicted before a first model"
    if not identification.rotors:
        return (
            "The torque cannot be predicted by a model of torques behind motor and gear (link-side), which has neither"
            " rotor inertia nor motor friction"
        )
    return "The torque cannot be predicted: the current model is not of this rig's joints and drive"


def purpose_words(report: SeparatingPlanReport | None) -> str | None:
    """What a plan was made for, where it was made to tell two effects apart; with what the rig's limits made of it."""
    if report is None:
        return None
    titles, purpose = effect_titles(), report.purpose
    names = [titles.get(name, name) for name in purpose.rivals]
    made_for = (
        f"Made to tell {' from '.join(names)} on joint {purpose.joint}, with the payload {purpose.payload}: "
        f"{significant(purpose.separation, 2)} standard deviations are expected."
    )
    return " ".join([made_for, *(sentence(remark) for remark in report.remarks)])


def findings(
    plan: ExcitationPlan,
    rig: Rig,
    payload: Payload,
    masses_measured: Sequence[float],
    model: RegressorModel,
) -> list[Finding]:
    """What the plan can and cannot identify; of the effects, each is asked itself, as the planner does."""
    motion = PlannedMotion.of(plan, payload, COVERAGE_PERIOD)
    listed = [
        _parameters(determination(rig, motion.q, motion.dq, motion.ddq)),
        _noise_floor(repetition(plan)),
    ]
    titles = effect_titles()
    unseen: dict[tuple[str, str, tuple[str, ...]], list[str]] = {}
    for hidden in model.judge([motion], masses_measured).hidden:
        unseen.setdefault((hidden.reason, hidden.remedy, hidden.effects), []).append(hidden.joint)
    for (reason, remedy, names), joints in unseen.items():
        because = reason if len(joints) == len(rig.axes) else f"{listing(joints)}: {reason}"
        effects = listing(titles.get(name, name) for name in names)
        listed.append(
            Finding("warn", "Cannot be seen", f"{sentence(f'{effects}: {because}')} {sentence(remedy)}")
        )
    if not unseen:
        listed.append(Finding("good", "Effects", "Every effect of the catalogue shows in this motion."))
    return listed


def _noise_floor(shares: Repetition) -> Finding:
    """Whether what no model can explain will be measured: a stretch must repeat that speaks for the session."""
    what = "Noise floor"
    if shares.repeats < 2:
        return Finding("warn", what, "No motion repeats exactly: what no model can explain stays unknown.")
    if shares.repeated < REPEATED:
        return Finding(
            "warn",
            what,
            f"Only {percent(shares.repeated, 2)} of the plan repeats: too little to measure what no model can explain. "
            "Make a longer plan.",
        )
    return Finding(
        "good", what, f"{number(shares.repeats, 0)} exact repeats: what no model can explain is measured."
    )


def _parameters(determined: Determination) -> Finding:
    """How well the parameters of the usual model are determined by this motion alone."""
    what, condition = "The usual model", significant(determined.condition)
    if not determined.weak:
        return Finding(
            "good",
            what,
            f"All {determined.parameters} parameters are determined; condition number {condition}.",
        )
    return Finding(
        "warn",
        what,
        f"{listing(determined.weak)} cannot be told apart by this motion alone (condition number {condition}).",
    )
