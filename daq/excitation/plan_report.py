"""A plan, judged: limits, standard deviations to expect, what it covers and what it cannot show."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from daq.excitation.blend import Array
from daq.excitation.excitation_plan import ExcitationPlan
from daq.excitation.information import Information
from daq.excitation.optimal_excitation import Request, information_of, optimal_plan
from daq.excitation.plan_limits import Violation, require_within_limits, sampling_times, violations
from daq.excitation.plan_model import Hidden, JointCoverage, PlannedMotion
from daq.excitation.plan_report_document import (
    CoveredJoint,
    ExpectedParameter,
    NotShown,
    PeakCurrent,
    PlannedNoise,
    PlanReportDocument,
    RepeatedStretch,
)
from identify.recording.errors import InputError
from identify.recording.experiment_file import Payload

COVERAGE_PERIOD = 0.02
"""s between the samples on which coverage and currents are judged; both change over tenths of a second"""

GENTLER = 0.85
"""factor on the dynamic limits when the predicted current is too high"""

GENTLEST = 0.2
"""share of the dynamic limits below which it is the load itself that asks for too much current"""


@dataclass(frozen=True)
class PlanReport:
    """A plan and what is to be expected of it."""

    request: Request
    plan: ExcitationPlan
    information: Information
    covered: tuple[JointCoverage, ...]
    hidden: tuple[Hidden, ...]
    peak_current: Array
    """(payloads, n) A, as predicted"""
    remarks: tuple[str, ...]

    @property
    def inseparable(self) -> list[list[str]]:
        """Names of parameters of which the plan shows only combinations; alone in a list: not at all."""
        names = [parameter.name for parameter in self.request.model.parameters]
        return [[names[k] for k in group] for group in self.information.inseparable()]

    def document(self) -> PlanReportDocument:
        """As a document; a figure that cannot be given is None."""
        request, deviations = self.request, self.information.deviations()
        return PlanReportDocument(
            rig=request.rig.name,
            model=request.model.name,
            criterion=request.criterion,
            payloads=tuple(payload.name for payload in request.payloads),
            seconds=self.plan.duration,
            repeated=tuple(
                RepeatedStretch(begin=begin, end=end, period=period)
                for begin, end, period in self.plan.repeated
            ),
            loads=request.model.source,
            noise=tuple(
                PlannedNoise(joint=axis.joint, std=float(noise))
                for axis, noise in zip(request.rig.axes, request.noise, strict=True)
            ),
            condition_number=self.information.condition_number,
            parameters=tuple(
                ExpectedParameter(
                    name=parameter.name,
                    joint=parameter.joint,
                    unit=parameter.unit,
                    effect=parameter.effect,
                    value=parameter.value,
                    std=std,
                    relative_std_percent=100.0 * std / abs(parameter.value)
                    if std is not None and parameter.value
                    else None,
                )
                for parameter, std in zip(request.model.parameters, deviations, strict=True)
            ),
            inseparable=tuple(tuple(group) for group in self.inseparable),
            cannot_tell=tuple(NotShown.model_validate(hidden) for hidden in self.hidden),
            coverage=tuple(CoveredJoint.model_validate(joint) for joint in self.covered),
            peak_current=tuple(
                PeakCurrent(
                    payload=payload.name,
                    joint=axis.joint,
                    current=float(self.peak_current[p, j]),
                    limit=axis.limits.current,
                )
                for p, payload in enumerate(request.payloads)
                for j, axis in enumerate(request.rig.axes)
            ),
            remarks=self.remarks,
            plan=self.plan,
        )


def make_plan(request: Request, progress: Callable[[float, str], None] | None = None) -> PlanReport:
    """Plan, check, judge.

    Where loads are identified, a plan that needs too much current is made again with gentler dynamics.
    Raises InputError where no plan keeps the limits: joint, time and value of the first one broken.
    """
    plan = optimal_plan(request, progress)
    if request.model.is_identified:
        while (
            current_violations(request, plan)
            and not too_heavy_at_rest(request, plan)
            and request.dynamic_share * GENTLER >= GENTLEST
        ):
            gentler = replace(request, dynamic_share=request.dynamic_share * GENTLER)
            try:
                plan = optimal_plan(gentler, progress)
            except InputError:  # there is no time for a gentler one: what stands is refused for its current
                break
            request = gentler
    return judge(request, plan)


def judge(request: Request, plan: ExcitationPlan) -> PlanReport:
    """What to expect of a plan, wherever it comes from.

    Raises InputError where it breaks a limit; a current that rests on assumed loads is only remarked upon.
    """
    require_within_limits(plan, request.rig)
    remarks: list[str] = []
    if request.dynamic_share < 1.0:
        remarks.append(
            f"velocity, acceleration and jerk use {request.dynamic_share:.0%} of their limits: "
            "more would need too much current"
        )
    exceeding = current_violations(request, plan)
    if exceeding and request.model.is_identified:
        _payload, times, torque = exceeding
        require_within_limits(plan, request.rig, torque, times)
    if exceeding:
        first = violations(plan, request.rig, exceeding[2], exceeding[1])[0]
        remarks.append(f"payload {exceeding[0].name}: {first}; but loads are {request.model.source}")
    if not plan.repeated:
        remarks.append("nothing in this plan repeats: no noise floor can be measured; make it longer")
    motions = [PlannedMotion.of(plan, payload, COVERAGE_PERIOD) for payload in request.payloads]
    judgement = request.model.judge(motions)
    gain = request.rig.drive_gain
    peaks = [np.abs(np.linalg.solve(gain, request.model.torque(motion).T)).max(axis=1) for motion in motions]
    return PlanReport(
        request=request,
        plan=plan,
        information=information_of(plan, request),
        covered=judgement.covered,
        hidden=judgement.hidden,
        peak_current=np.array(peaks),
        remarks=tuple(remarks),
    )


def current_violations(request: Request, plan: ExcitationPlan) -> tuple[Payload, Array, Array] | None:
    """The first payload whose predicted current breaks a limit, with times (N,) and torque (N, n); None
    if none does.
    """
    for payload in request.payloads:
        times = sampling_times(plan)[::10]
        torque = request.model.torque(PlannedMotion(payload, times, *plan.setpoints(times), float(times[1])))
        broken: list[Violation] = violations(plan, request.rig, torque, times)
        if any(violation.quantity == "predicted current" for violation in broken):
            return payload, times, torque
    return None


def too_heavy_at_rest(request: Request, plan: ExcitationPlan) -> bool:
    """Whether some posture of the plan needs too much current even without motion: gentler dynamics would
    not help.
    """
    times = sampling_times(plan)[::50]
    q = plan.setpoints(times).position
    still = np.zeros_like(q)
    limits = np.array([axis.limits.current for axis in request.rig.axes])
    for payload in request.payloads:
        load = request.model.load(PlannedMotion(payload, times, q, still, still, float(times[1])))
        if (limits < np.abs(np.linalg.solve(request.rig.drive_gain, load.T)).T).any():
            return True
    return False
