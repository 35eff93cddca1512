"""A planned motion as the operator sees it before anything moves: against its limits, and what it can identify."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from api.pages.catalogue_words import effect_titles
from api.pages.error_figures import JointUnits
from api.pages.figures.plan_preview import draw_plan_signal
from api.pages.number_format import THIN, listing, number, percent, significant
from daq.excitation.excitation_plan import ExcitationPlan
from daq.excitation.plan_limits import violations
from daq.rig import KnownPayload, Rig
from identify.dynamics.base_parameters import base_parameters
from identify.dynamics.geometry import Geometry
from identify.dynamics.payload import payload_torque

PREVIEW_POINTS = 6000
"""Points of the motion that are looked at; the preview is drawn from their least and greatest values."""
SLOW = 0.10
FAST = 0.35
"""Parts of the greatest speed that the paper calls low and high (Table III)."""
REPEATED = 0.2
"""Part of a plan that must repeat for a noise floor, as `identify.validation.noise_floor` asks of a session."""
WELL_CONDITIONED = 100.0
"""Condition number of the observation matrix up to which every parameter is determined in practice."""


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
    torque = predicted_torque(rig, payload, identification, position, velocity, acceleration)
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


def predicted_torque(
    rig: Rig,
    payload: KnownPayload,
    identification: dict[str, Any] | None,
    position: np.ndarray,
    velocity: np.ndarray,
    acceleration: np.ndarray,
) -> np.ndarray | None:
    """(N, n) joint torque of eq. (8) with the identified inertial, viscous, dry and offset parameters and the known
    payload; None where the model that stands does not give them one by one."""
    if identification is None:
        return None
    values = {entry["name"]: entry["value"] for entry in identification["parameters"]}
    geometry = Geometry.from_robot(rig.robot)
    base = base_parameters(geometry)
    if any(values.get(name) is None for name in base.names):
        return None
    torque = base.columns(position, velocity, acceleration) @ np.array([values[name] for name in base.names])
    torque = torque + payload_torque(geometry, payload, position, velocity, acceleration)
    for joint in range(torque.shape[1]):
        viscous, dry, offset = (values.get(f"{name}{joint + 1}") or 0.0 for name in ("FV", "FC", "offset"))
        torque[:, joint] += viscous * velocity[:, joint] + dry * np.sign(velocity[:, joint]) + offset
    return torque


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
    found = [_parameters(rig, position, velocity, acceleration)]
    speed = np.abs(velocity)
    reach = speed / np.array([axis.limits.velocity for axis in rig.axes])
    greatest = speed.max(axis=0)
    slow = ((speed > 1e-6) & (speed < SLOW * greatest)).mean(axis=0)
    names = [axis.joint for axis in rig.axes]
    found.append(
        _judged(
            slow > 0.08,
            names,
            "Friction at low speed",
            f"{percent(float(slow.min()), 2)} of the time is slow motion: Stribeck and presliding friction show.",
            "Hardly any slow motion: Stribeck and presliding friction would not show.",
        )
    )
    fast = reach.max(axis=0)
    found.append(
        _judged(
            fast >= FAST,
            names,
            "Friction at high speed",
            f"Up to {percent(float(fast.min()), 2)} of the speed limit: viscous friction and its curvature show.",
            f"At most {percent(float(fast.min()), 2)} of the speed limit: curvature of the viscous friction stays hidden.",
        )
    )
    both = np.minimum((velocity > 1e-6).mean(axis=0), (velocity < -1e-6).mean(axis=0)) > 0.2
    found.append(
        _judged(
            both,
            names,
            "Asymmetry",
            "Both directions are driven alike: friction that differs between them shows.",
            "One direction is hardly driven: offset and asymmetric friction cannot be told apart.",
        )
    )
    found.append(_noise_floor(plan))
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


def _noise_floor(plan: ExcitationPlan) -> Finding:
    """Whether what no model can explain will be measured: a stretch must repeat that speaks for the session."""
    periods = sum((end - begin) / period for begin, end, period in plan.repeated)
    covered = sum(end - begin for begin, end, _ in plan.repeated) / plan.duration
    what = "Noise floor"
    if periods < 2:
        return Finding("warn", what, "No motion repeats exactly: what no model can explain stays unknown.")
    if covered < REPEATED:
        return Finding(
            "warn",
            what,
            f"Only {percent(covered, 2)} of the plan repeats: too little to measure what no model can explain. "
            "Make a longer plan.",
        )
    return Finding(
        "good", what, f"{number(periods, 0)} exact repeats: what no model can explain is measured."
    )


def _parameters(rig: Rig, position: np.ndarray, velocity: np.ndarray, acceleration: np.ndarray) -> Finding:
    """How well the parameters of the usual model are determined by this motion alone: eq. (8), joint by joint."""
    step = slice(None, None, 6)
    base = base_parameters(Geometry.from_robot(rig.robot))
    columns = base.columns(position[step], velocity[step], acceleration[step])
    weak: dict[str, None] = {}
    worst, count = 1.0, len(base.names)
    for joint in range(columns.shape[1]):
        dq = velocity[step][:, joint]
        acts = base.acts_on(joint)
        W = np.column_stack([columns[:, joint, acts], dq, np.sign(dq), np.ones_like(dq)])
        names = [name for name, on in zip(base.names, acts, strict=True) if on] + ["FV", "FC", "offset"]
        count += 3
        norms = np.linalg.norm(W, axis=0)
        weak |= dict.fromkeys(name for name, norm in zip(names, norms, strict=True) if norm == 0)
        _, singular, directions = np.linalg.svd(W[:, norms > 0] / norms[norms > 0], full_matrices=False)
        condition = float(singular[0] / singular[-1]) if singular[-1] > 0 else np.inf
        worst = max(worst, condition)
        if condition > WELL_CONDITIONED:
            present = [name for name, norm in zip(names, norms, strict=True) if norm > 0]
            weak |= dict.fromkeys(present[index] for index in np.flatnonzero(np.abs(directions[-1]) > 0.3))
    what = "The usual model"
    if not weak:
        return Finding(
            "good", what, f"All {count} parameters are determined; condition number {significant(worst)}."
        )
    return Finding(
        "warn",
        what,
        f"{listing(weak)} cannot be told apart by this motion alone (condition number {significant(worst)}).",
    )
