"""A planned motion as the operator sees it before anything moves: against its limits, and what it can identify."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from api.pages.catalogue_words import effect_titles
from api.pages.error_figures import JointUnits
from api.pages.figures.plan_preview import draw_plan_signal
from api.pages.number_format import THIN, listing, number, percent, significant
from api.planned_motion import Determination, MotionShares, determination, motion_shares, predicted_torque
from daq.excitation.excitation_plan import ExcitationPlan
from daq.excitation.plan_limits import violations
from daq.rig import KnownPayload, Rig

PREVIEW_POINTS = 6000
"""Points of the motion that are looked at; the preview is drawn from their least and greatest values."""
FAST = 0.35
"""Part of the greatest speed that the paper calls high (Table III)."""
ENOUGH_SLOW = 0.08
"""Share of slow motion from which friction at low speed shows."""
BOTH_WAYS = 0.2
"""Share of the time in the lesser direction from which friction that differs between directions shows."""
REPEATED = 0.2
"""Part of a plan that must repeat for a noise floor, as `identify.validation.noise_floor` asks of a session."""


@dataclass(frozen=True)
class Finding:
    """One thing that the plan can (`good`) or cannot (`warn`) show, in a sentence."""

    kind: str
    what: str
    words: str


@dataclass(frozen=True)
class PlanView:
    """Figures of each joint (position, speed, predicted torque), broken limits and findings in words."""

    duration: float
    joints: list[dict[str, Any]]
    broken: list[str]
    findings: list[Finding]
    torque_words: str


def plan_view(
    plan: ExcitationPlan,
    rig: Rig,
    payload: KnownPayload,
    masses_measured: Sequence[float],
    identification: dict[str, Any] | None,
) -> PlanView:
    """Look at a plan.

    masses_measured : kg, the payloads of the experiment's sessions so far
    identification  : JSON of the model that stands, for the predicted torque; None before the first session
    """
    time = np.linspace(0.0, plan.duration, PREVIEW_POINTS)
    position, velocity, acceleration = plan.setpoints(time)
    identified = {
        entry["name"]: entry["value"] for entry in (identification or {"parameters": []})["parameters"]
    }
    torque = predicted_torque(rig, payload, identified, position, velocity, acceleration)
    joints = []
    width = 800.0 if len(rig.axes) == 1 else 420.0
    for index, axis in enumerate(rig.axes):
        units = JointUnits.of(rig.robot.joints[index].type)
        limits = axis.limits
        rows = [
            draw_plan_signal(
                time, position[:, index], limits.position, "position", units.position, "position", width
            ),
            draw_plan_signal(
                time,
                velocity[:, index],
                (-limits.velocity, limits.velocity),
                "speed",
                units.speed,
                "measured",
                width,
            ),
        ]
        if torque is not None:
            most = float(abs(rig.drive_gain[index, index])) * limits.current
            words = "force" if units.load == "N" else "torque"
            rows.append(
                draw_plan_signal(time, torque[:, index], (-most, most), words, units.load, "predicted", width)
            )
        joints.append({"name": axis.joint, "figures": rows})
    torque_limits = {} if torque is None else {"torque": torque, "times": time}
    broken = [str(each) for each in violations(plan, rig, **torque_limits)]
    return PlanView(
        plan.duration,
        joints,
        broken,
        findings(plan, rig, payload, masses_measured, position, velocity, acceleration),
        "predicted with the model that stands, limits from the drive's current"
        if torque is not None
        else "The torque cannot be predicted before a first model; the current is watched on every sample.",
    )


def purpose_words(report: dict[str, Any] | None) -> str | None:
    """What a plan was made for, where it was made to tell two effects apart; with what the rig's limits made of it."""
    purpose = (report or {}).get("purpose")
    if report is None or purpose is None:
        return None
    titles = effect_titles()
    names = [titles.get(str(name), str(name)) for name in purpose["rivals"]]
    words = (
        f"Made to tell {' from '.join(names)} on joint {purpose['joint']}, with the payload {purpose['payload']}: "
        f"{significant(purpose['separation'], 2)} standard deviations are expected."
    )
    remarks = [f"{remark[0].upper()}{remark[1:]}." for remark in report.get("remarks", [])]
    return " ".join([words, *remarks])


def findings(
    plan: ExcitationPlan,
    rig: Rig,
    payload: KnownPayload,
    masses_measured: Sequence[float],
    position: np.ndarray,
    velocity: np.ndarray,
    acceleration: np.ndarray,
) -> list[Finding]:
    """What the plan can and cannot identify, from the motion itself and the payloads measured so far."""
    found = [_parameters(determination(rig, position, velocity, acceleration))]
    shares = motion_shares(plan, rig, velocity)
    slow, fast = shares.slow, shares.fastest
    names = [axis.joint for axis in rig.axes]
    found.append(
        _judged(
            slow > ENOUGH_SLOW,
            names,
            "Friction at low speed",
            f"{percent(float(slow.min()), 2)} of the time is slow motion: Stribeck and presliding friction show.",
            "Hardly any slow motion: Stribeck and presliding friction would not show.",
        )
    )
    found.append(
        _judged(
            fast >= FAST,
            names,
            "Friction at high speed",
            f"Up to {percent(float(fast.min()), 2)} of the speed limit: viscous friction and its curvature show.",
            f"At most {percent(float(fast.min()), 2)} of the speed limit: curvature of the viscous friction stays hidden.",
        )
    )
    found.append(
        _judged(
            shares.lesser_direction > BOTH_WAYS,
            names,
            "Asymmetry",
            "Both directions are driven alike: friction that differs between them shows.",
            "One direction is hardly driven: offset and asymmetric friction cannot be told apart.",
        )
    )
    found.append(_noise_floor(shares))
    masses = sorted({round(mass, 3) for mass in [*masses_measured, payload.mass]})
    words = listing(f"{significant(mass, 4)}{THIN}kg" for mass in masses)
    found.append(
        Finding(
            "good", "Friction over load", f"Payloads of {words}: friction that depends on the load shows."
        )
        if len(masses) > 1
        else Finding(
            "warn",
            "Friction over load",
            f"Only {words} so far: measure another payload, else friction that depends on the load stays hidden.",
        )
    )
    if plan.duration < 120:
        found.append(Finding("warn", "Warm-up", "Too short to see friction fall while the gear warms up."))
    return found


def _judged(good: np.ndarray, names: Sequence[str], what: str, yes: str, no: str) -> Finding:
    if good.all():
        return Finding("good", what, yes)
    lacking = [name for name, fine in zip(names, good, strict=True) if not fine]
    return Finding(
        "warn", what, no if len(lacking) == len(names) else f"{listing(lacking)}: {no[0].lower()}{no[1:]}"
    )


def _noise_floor(shares: MotionShares) -> Finding:
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


def _parameters(found: Determination) -> Finding:
    """How well the parameters of the usual model are determined by this motion alone."""
    what, condition = "The usual model", significant(found.condition)
    if not found.weak:
        return Finding(
            "good", what, f"All {found.parameters} parameters are determined; condition number {condition}."
        )
    return Finding(
        "warn",
        what,
        f"{listing(found.weak)} cannot be told apart by this motion alone (condition number {condition}).",
    )
