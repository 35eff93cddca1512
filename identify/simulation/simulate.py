"""`simulate`: an identified model run forward on the record, in windows of stated horizons and freely."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, cast

import numpy as np
from numpy.typing import NDArray

from identify.estimation.context import Slot
from identify.estimation.fitted_model import FittedModel
from identify.estimation.fitting import Progress
from identify.estimation.small_algebra import single_threaded
from identify.identification import Identification, identify
from identify.recording import Experiment, InputError, SessionEntry
from identify.recording.controller_file import ControllerFile
from identify.results.effect import EffectOnJoint
from identify.results.simulation import (
    HORIZONS,
    EffectInSimulation,
    Formed,
    HorizonErrors,
    JointMotionError,
    SessionMotionError,
    SimulationDocument,
)
from identify.results.unseen_motion import UnseenMotionErrors
from identify.simulation.closing import loop_asked_for, why_not_closed
from identify.simulation.controller import Controllers, estimated_controllers
from identify.simulation.free_motion import Keep, Run, free_motions
from identify.simulation.free_run import free_run
from identify.simulation.give_fit import formed_as, give_fit, giving_slots
from identify.simulation.loop_stability import unstable_loop
from identify.simulation.measured_motion import MeasuredMotion, measured_motions
from identify.simulation.rollout import energy_drift, roll_out
from identify.simulation.torque_model import TorqueModel
from identify.simulation.unseen_motion import unseen_motion
from identify.simulation.windows import window_starts

Array = NDArray[np.float64]
Role = Literal["identification", "validation"]

MOST_WINDOWS = 200
"""windows of one horizon in one session; more of them tell nothing new and cost memory"""

LEFT = 0.1
"""range of a joint's recorded positions; a free run that is further off has left the record"""


@dataclass(frozen=True)
class _Sums:
    """Squared errors of one or more groups of windows; (joints,)."""

    position: Array
    velocity: Array
    samples: int
    windows: int
    left_at: tuple[float | None, ...]
    drift: float | None
    seconds: float

    def joined(self, other: _Sums) -> _Sums:
        """Both together."""
        drifts = [value for value in (self.drift, other.drift) if value is not None]
        return _Sums(
            self.position + other.position,
            self.velocity + other.velocity,
            self.samples + other.samples,
            self.windows + other.windows,
            tuple(
                min((value for value in pair if value is not None), default=None)
                for pair in zip(self.left_at, other.left_at, strict=True)
            ),
            max(drifts, default=None),
            self.seconds + other.seconds,
        )


@single_threaded
def simulate(
    experiment: Experiment,
    model: str = "usual",
    add: Sequence[str] = (),
    horizons: Sequence[float] = HORIZONS,
    controller: ControllerFile | Path | str | None = None,
    free_run: bool = True,
    progress: Progress | None = None,
) -> SimulationDocument:
    """Forward dynamics of an identified model on its record.

    horizons   : s; windows of this length begin at measured states all along the record. None of them leaves
                 the free run alone
    controller : gains, a YAML file of them, or "estimate" closes the loop; None closes it with the gains that were read from the
                 drives, where the recordings hold them; without them, or by "torque", the recorded torque drives the model
    free_run   : whether to run the model from the record's start to its end as well, which takes longest
    Raises InputError: the experiment, the model, an effect, a horizon or the controller is wrong.
    """
    _require_times(horizons)
    result = identify(experiment, model, add)
    usual = None if result.model == "usual" and not add else identify(experiment, "usual")
    return simulated(result, usual, horizons, controller, free_run, progress)


def simulated(
    result: Identification,
    usual: Identification | None,
    horizons: Sequence[float] = HORIZONS,
    controller: ControllerFile | Path | str | None = None,
    free_run: bool = True,
    progress: Progress | None = None,
    keep: Keep | None = None,
) -> SimulationDocument:
    """`simulate` for a model that is already identified; `usual` is the model that its errors stand beside.

    keep : called with every free run, sample by sample
    Raises InputError: a horizon or the controller is wrong.
    """
    _require_times(horizons)
    record, experiment = result.fitted.record, result.experiment
    names = record.joint_names
    closing = loop_asked_for(result, controller)
    extra = () if closing is None else closing.columns
    motions = {
        entry.file: measured_motions(result.fitted.record, entry, extra) for entry in experiment.sessions
    }
    controllers = None
    remarks: list[str] = []
    if closing is None and controller is None:
        why = why_not_closed(result)
        remarks += [f"{why}; the recorded torque drives the model"] if why else []
    if closing is not None:
        controllers = closing.controllers or estimated_controllers(
            [motion for listed in motions.values() for motion in listed], names, experiment.drive_gain
        )
        remarks += closing.remarks
        longest = [
            (entry, max(motions[entry.file], key=len)) for entry in experiment.sessions if motions[entry.file]
        ]
        unstable = unstable_loop(result.fitted, longest, controllers)
        remarks += [unstable] if unstable else []
    formed = _formed(result, controllers is not None)
    remarks += _on_gives(result)
    if controllers is not None:
        remarks += _on_commands(result)
    listed = [motion for session_motions in motions.values() for motion in session_motions]
    remarks += [
        f"{name}: stands still in the whole record, so that the model has no inertia of it; it stays where it is"
        for joint, name in enumerate(names)
        if listed and all(motion.resting[:, joint].all() for motion in listed)
    ]
    asked: list[float | None] = [*sorted(set(horizons)), *([None] if free_run else [])]
    horizon_errors: list[HorizonErrors] = []
    total = len(asked) * len(experiment.sessions) * (1 if usual is None else 2)
    done = 0

    def report(horizon: float | None, file: str) -> None:
        if progress:
            what = "free run" if horizon is None else f"windows of {horizon:g} s"
            progress(done / total, f"{file}: {what}")

    usual_motions = {}
    if usual is not None:
        usual_motions = {
            entry.file: measured_motions(usual.fitted.record, entry, extra) for entry in experiment.sessions
        }
    for horizon in asked:
        by_role: dict[Role, list[tuple[SessionEntry, _Sums, _Sums | None]]] = {}
        for entry in experiment.sessions:
            report(horizon, entry.file)
            runs: list[Run] = []
            sums = _session_errors(result.fitted, entry, motions[entry.file], horizon, controllers, runs)
            done += 1
            beside, usual_runs = None, None
            if usual is not None:
                report(horizon, entry.file)
                usual_runs = []
                beside = _session_errors(
                    usual.fitted, entry, usual_motions[entry.file], horizon, controllers, usual_runs
                )
                done += 1
            if keep is not None:
                for each in free_motions(entry.file, float(record.facts(entry).start), runs, usual_runs):
                    keep(each)
            if sums is None:
                what = "a sample is longer" if _within_a_sample(horizon, motions[entry.file]) else "shorter"
                remarks.append(f"{entry.file}: {what} than the horizon of {horizon:g} s, left out there")
                continue
            by_role.setdefault(cast(Role, entry.role), []).append((entry, sums, beside))
        horizon_errors += [_horizon_errors(result, horizon, role, listed) for role, listed in by_role.items()]
    if not horizon_errors:
        every = [motion for session_motions in motions.values() for motion in session_motions]
        if _within_a_sample(max(horizons, default=None), every):
            raise InputError(
                f"a horizon of {max(horizons):g} s ends before the next sample; must be"
                f" {min(motion.period for motion in every):.3g} s or more"
            )
        longest = max(
            (len(each) * each.period for session_motions in motions.values() for each in session_motions),
            default=0.0,
        )
        raise InputError(
            f"a horizon of {min(horizons, default=0.0):g} s is longer than every session; the longest stretch without a hole"
            f" lasts {longest:.3g} s"
        )
    return SimulationDocument(
        experiment=experiment.name,
        model=result.model,
        effects=tuple(
            EffectOnJoint(effect=term.effect.name, joint=names[term.joint]) for term in result.effects
        ),
        controller=None if closing is None or controllers is None else closing.used(controllers),
        horizons=tuple(horizon_errors),
        formed=formed,
        inputs=_inputs(result, controllers is not None),
        unseen=_unseen(result, usual),
        remarks=tuple(remarks),
    )


def _require_times(horizons: Sequence[float]) -> None:
    for horizon in horizons:
        if not (math.isfinite(horizon) and horizon > 0):
            raise InputError(f"a horizon of {horizon:g} s: must be a time in seconds above zero, e.g. 0.1")


def _formed(result: Identification, closed: bool) -> tuple[EffectInSimulation, ...]:
    """How a simulation forms the torque of each effect."""
    given = give_fit(result.fitted)
    gives, fitted = given.gives, given.fitted
    listed = []
    for slot, lead in _with_command_leads(fitted):
        effect = slot.term.effect
        how: Formed = formed_as(slot, gives)
        state = {"give": "position and speed of the link", "state": effect.state_name}.get(how)
        if how == "command" and closed and lead < 0.0:
            how, state = "state", "commands that have not acted yet"
        elif (how == "give" and slot.term.joint not in gives) or (how == "command" and closed):
            how, state = "left-out", None
        joint = fitted.record.joint_names[slot.term.joint]
        listed.append(EffectInSimulation(effect=effect.name, joint=joint, formed=how, state=state))
    return tuple(listed)


def _on_gives(result: Identification) -> list[str]:
    """Remarks on what gives between motor and link: fitted for the simulation, with the parameters beside it."""
    fitted = result.fitted
    gives, names = give_fit(fitted).gives, fitted.record.joint_names
    remarks = [
        f"{names[joint]}: {give.in_words(fitted.record.summaries[joint].revolute)}, from the torque of motor and link as two"
        " masses in the identification sessions, all parameters beside it once more"
        for joint, give in gives.items()
    ]
    return remarks + [
        f"{slot.term.effect.name}@{names[slot.term.joint]}: left out, since the model has no inertia of the joint that motor and"
        " link could share"
        for slot in giving_slots(fitted)
        if slot.term.joint not in gives and formed_as(slot, gives) == "give"
    ]


def _on_commands(result: Identification) -> list[str]:
    """Remarks on commands whose time has no part in a closed loop."""
    fitted = give_fit(result.fitted).fitted
    names = fitted.record.joint_names
    return [
        f"{slot.term.effect.name}@{names[slot.term.joint]}: left out in closed loop: the command is recorded"
        f" {1e3 * lead:.3g} ms after it acts, which says how the record was made; no torque acts before its command"
        for slot, lead in _with_command_leads(fitted)
        if lead > 0.0
    ]


def _with_command_leads(fitted: FittedModel) -> Iterator[tuple[Slot, float]]:
    """The effects of a model, and by how many s each shifts the command in time; 0 for those that do not."""
    for slot, columns in zip(fitted.slots, fitted.observation.slot_columns, strict=True):
        yield slot, slot.term.effect.command_lead(fitted.fit.chi[columns])


def _inputs(result: Identification, closed: bool) -> tuple[str, ...]:
    """What of the record after its start a simulation is driven by."""
    listed = ["reference position" if closed else "recorded torque"]
    record = result.fitted.record
    if any(record.facts(entry).has_external for entry in result.experiment.sessions):
        listed.append("external torque")
    for slot in result.fitted.slots:
        listed += slot.term.effect.inputs
    return tuple(dict.fromkeys(listed))


def _unseen(result: Identification, usual: Identification | None) -> UnseenMotionErrors | None:
    """Errors where the fit did not see, beside those of the usual model."""
    errors = unseen_motion(result.fitted)
    beside = None if usual is None else unseen_motion(usual.fitted)
    return None if errors is None else errors.document(result.fitted.record, beside)


def _within_a_sample(horizon: float | None, motions: Sequence[MeasuredMotion]) -> bool:
    """Whether windows of this length end before the next sample of all these motions, so that nothing is predicted."""
    return horizon is not None and all(round(horizon / motion.period) < 1 for motion in motions)


def _session_errors(
    fitted: FittedModel,
    entry: SessionEntry,
    motions: Sequence[MeasuredMotion],
    horizon: float | None,
    controllers: Controllers | None,
    runs: list[Run],
) -> _Sums | None:
    """Errors in one session at one horizon; None where no window fits.

    runs : the free runs of its stretches are added here
    """
    model = TorqueModel(fitted, entry)
    sums: _Sums | None = None
    for motion in motions:
        samples = len(motion) if horizon is None else round(horizon / motion.period) + 1
        if not 1 < samples <= len(motion):
            continue
        starts = window_starts(len(motion), samples, MOST_WINDOWS)
        if horizon is None:
            course = free_run(model, motion, controllers)
            runs.append((motion, course))
        else:
            course = roll_out(model, motion, starts, samples, controllers)
        rows = course.starts[None, :] + np.arange(len(course.q))[:, None]
        off = course.q - motion.q[rows]
        faster = course.dq - motion.dq[rows]
        left: list[float | None] = [None] * off.shape[2]
        if horizon is None:
            lost = np.abs(off[:, 0]) > LEFT * motion.span
            start = float(fitted.record.facts(entry).start)
            for joint in np.flatnonzero(lost.any(axis=0)):
                left[int(joint)] = float(motion.time[int(np.argmax(lost[:, joint]))]) - start
        part = _Sums(
            (off**2).sum(axis=(0, 1)),
            (faster**2).sum(axis=(0, 1)),
            off.shape[0] * off.shape[1],
            off.shape[1],
            tuple(left),
            energy_drift(model, motion, course),
            off.shape[0] * off.shape[1] * motion.period,
        )
        sums = part if sums is None else sums.joined(part)
    return sums


def _horizon_errors(
    result: Identification,
    horizon: float | None,
    role: Role,
    listed: Sequence[tuple[SessionEntry, _Sums, _Sums | None]],
) -> HorizonErrors:
    whole, beside = listed[0][1], listed[0][2]
    for _, sums, other in listed[1:]:
        whole = whole.joined(sums)
        beside = None if beside is None or other is None else beside.joined(other)
    return HorizonErrors(
        horizon=horizon,
        role=role,
        joints=_joint_errors(result, whole, beside),
        sessions=tuple(
            SessionMotionError(
                file=entry.file, payload=entry.payload.name, joints=_joint_errors(result, sums, other)
            )
            for entry, sums, other in listed
        ),
        energy_drift=whole.drift,
        simulated_seconds=whole.seconds,
    )


def _joint_errors(result: Identification, sums: _Sums, beside: _Sums | None) -> tuple[JointMotionError, ...]:
    record = result.fitted.record

    def mean(squares: Array, joint: int, samples: int) -> float | None:
        value = math.sqrt(float(squares[joint]) / samples)
        return value if math.isfinite(value) else None

    return tuple(
        JointMotionError(
            joint=name,
            position_rms=mean(sums.position, joint, sums.samples),
            velocity_rms=mean(sums.velocity, joint, sums.samples),
            unit="rad" if record.summaries[joint].revolute else "m",
            windows=sums.windows,
            left_record_at=sums.left_at[joint],
            position_rms_usual=None if beside is None else mean(beside.position, joint, beside.samples),
            velocity_rms_usual=None if beside is None else mean(beside.velocity, joint, beside.samples),
            left_record_at_usual=None if beside is None else beside.left_at[joint],
        )
        for joint, name in enumerate(record.joint_names)
    )
