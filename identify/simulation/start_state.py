"""The state that windows of a simulation begin with: what the model itself makes of the positions measured until then.

The zero-phase filters of the fit see rows to either side, and smooth the speed of a motor over an impact of its link. A model
whose transmissions give is therefore driven by the recorded torque through the rows just before a window, and its state
corrected by each position as it was recorded: a cubature Kalman filter (Arasaratnam, Haykin 2009, IEEE Trans. Autom. Control
54) of each joint. Its states are position and speed of the motor, a torque that the model lacks, and position and speed of the
link. What the positions do not tell of a link, its free flight in a gap, the model's motion tells.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.simulation.course import State, Trajectories, simulate_from
from identify.simulation.driven_link import RUN_IN
from identify.simulation.measured_motion import MeasuredMotion
from identify.simulation.torque_model import LINK, LINK_SPEED, StateKey, TorqueModel, Windows
from identify.simulation.two_masses import measured_links

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

PLACE_IN_GAP = 0.1
"""parts of a gap, by which it is not known where the link stands in it when following begins"""

FINEST_POSITION = 1e-12
"""rad or m, for positions without any rounding"""

STATES = 5
Q, SPEED, LACKING, LINK_Q, LINK_DQ = range(STATES)
"""places of the states of a joint"""


@dataclass(frozen=True)
class _Uncertainty:
    """Deviations of the states of a joint, (joints, states), SI units.

    first    : where following begins
    scale    : units in which covariances are held
    per_row  : what a row adds
    keep     : part of the lacking torque that is there a row later
    recorded : (joints,) rad or m, of a position as recorded
    """

    first: Array
    scale: Array
    per_row: Array
    keep: float
    recorded: Array


def start_state(model: TorqueModel, motion: MeasuredMotion, first: Rows) -> State:
    """The state at some rows of a measured motion, from the rows until there.

    Of a model without transmissions that give it is that of the filters of the fit. Near the beginning of the motion there are
    fewer rows before, at its first row none: there the filters tell too.
    """
    if not model.gives:
        return filtered_state(model, motion, first)
    rows = max(1, round(RUN_IN / motion.period))
    row = np.maximum(first - rows, 0)
    state = filtered_state(model, motion, row)
    count, joints = state.windows.q.shape
    uncertainty = _uncertainty(model, motion, state.windows)
    mean = _states_of(model, state.windows, np.zeros((count, joints)))
    known = np.eye(STATES) * (uncertainty.first > 0.0)[:, None, :]
    covariance = np.broadcast_to(known, (count, joints, STATES, STATES))
    for _ in range(rows):
        going = row < first
        if not going.any():
            break
        state, mean, covariance = _one_row_on(
            model, motion, (row, going), (state, mean, covariance), uncertainty
        )
        row = np.where(going, row + 1, row)
    resting = np.abs(mean[..., SPEED]) <= model.fitted.record.rest_speed
    mean[..., SPEED] = np.where(resting, 0.0, mean[..., SPEED])
    state = _placed(model, state, mean)
    return replace(state, windows=replace(state.windows, time=motion.time[first]))


def _uncertainty(model: TorqueModel, motion: MeasuredMotion, windows: Windows) -> _Uncertainty:
    """How well states are known: by the encoder's rounding, and by what the fit left of the torque.

    What the model lacks of the torque changes as fast as the parallel filter of the fit lets through.
    """
    record, fit = model.fitted.record, model.fitted.fit
    rounding = np.asarray(record.facts(model.entry).position_rounding, float) / np.sqrt(12.0)
    rounding = np.where(np.isfinite(rounding), np.maximum(rounding, FINEST_POSITION), FINEST_POSITION)
    recorded = rounding / np.sqrt(motion.rows_in_one)
    lacking = fit.residual / np.sqrt(np.maximum(fit.rows, 1))
    keep = float(np.exp(-2.0 * np.pi * record.settings.decimation_cutoff * motion.period))
    _, slope = model.with_slope(windows, np.zeros(windows.q.shape))
    inertia = np.maximum(np.abs(np.diagonal(slope, axis1=1, axis2=2)).mean(axis=0), 1e-12)
    first = np.zeros((len(recorded), STATES))
    per_row = np.zeros(first.shape)
    first[:, Q], first[:, SPEED], first[:, LACKING] = 3.0 * recorded, record.rest_speed, lacking
    per_row[:, SPEED] = lacking / inertia * motion.period
    per_row[:, LACKING] = lacking * np.sqrt(1.0 - keep**2)
    for joint, give in model.gives.items():
        first[joint, LINK_Q] = give.compliance * lacking[joint] + PLACE_IN_GAP * give.gap
        first[joint, LINK_DQ] = record.rest_speed[joint]
        per_row[joint, SPEED] = lacking[joint] / give.rotor * motion.period
        link = max(inertia[joint] - give.rotor, 0.1 * give.rotor)
        per_row[joint, LINK_DQ] = lacking[joint] / link * motion.period
    return _Uncertainty(first, np.where(first > 0.0, first, 1.0), per_row, keep, recorded)


def _one_row_on(
    model: TorqueModel,
    motion: MeasuredMotion,
    at: tuple[Rows, NDArray[np.bool_]],
    before: tuple[State, Array, Array],
    uncertainty: _Uncertainty,
) -> tuple[State, Array, Array]:
    """State, mean (windows, joints, states) and scaled covariance a row later; windows that are not `going` stay."""
    row, going = at
    state, mean, covariance = before
    count, joints, states = mean.shape
    scale, points = uncertainty.scale, 2 * states
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(states * np.maximum(values, 0.0))[..., None, :]
    offsets = np.concatenate([root, -root], axis=-1) * scale[:, :, None]
    tried = (mean[..., None] + offsets).transpose(3, 0, 1, 2).reshape(points * count, joints, states)
    begun = State(
        state.windows.repeated(points),
        np.tile(state.integral, (points, 1)),
        np.tile(state.guess, (points, 1)),
    )
    course = simulate_from(
        model,
        motion,
        np.tile(row, points),
        2,
        _placed(model, begun, tried),
        beside=tried[..., LACKING],
    )
    ended = course.end.windows
    reached = _states_of(model, ended, uncertainty.keep * tried[..., LACKING])
    reached = reached.reshape(points, count, joints, states)
    seen = _as_recorded(course, motion).reshape(points, count, joints)
    middle, expected = reached.mean(axis=0), seen.mean(axis=0)
    spread, apart = (reached - middle) / scale, (seen - expected) / uncertainty.recorded
    wider = np.einsum("pwjk,pwjl->wjkl", spread, spread) / points
    wider += (uncertainty.per_row / scale)[:, :, None] ** 2 * np.eye(states)
    variance = np.mean(apart**2, axis=0) + 1.0
    gain = np.einsum("pwjk,pwj->wjk", spread, apart) / points / variance[..., None]
    innovation = (motion.recorded[np.minimum(row + 1, len(motion) - 1)] - expected) / uncertainty.recorded
    corrected = middle + scale * gain * innovation[..., None]
    narrower = wider - gain[..., :, None] * gain[..., None, :] * variance[..., None, None]
    memory = {
        key: np.where(going, held.reshape(points, count).mean(axis=0), state.windows.memory[key])
        for key, held in ended.memory.items()
    }
    guess = course.end.guess.reshape(points, count, -1).mean(axis=0)
    later = replace(
        state,
        windows=replace(
            state.windows,
            time=motion.time[np.where(going, np.minimum(row + 1, len(motion) - 1), row)],
            memory=memory,
        ),
        guess=np.where(going[:, None], guess, state.guess),
    )
    on = going[:, None, None]
    return later, np.where(on, corrected, mean), np.where(on[..., None], narrower, covariance)


def _states_of(model: TorqueModel, windows: Windows, lacking: Array) -> Array:
    """(windows, joints, states) of windows; those of a link that its motor moves along are its motor's."""
    return np.stack([windows.q, windows.dq, lacking, *model.link_motion(windows)], axis=-1)


def _placed(model: TorqueModel, state: State, states: Array) -> State:
    """A state with positions and speeds of other ones (windows, joints, states)."""
    windows, dq = state.windows, states[..., SPEED]
    memory = dict(windows.memory)
    for joint in model.gives:
        memory[LINK, joint], memory[LINK_SPEED, joint] = states[:, joint, LINK_Q], states[:, joint, LINK_DQ]
    direction = np.where(dq != 0.0, np.sign(dq), windows.direction)
    placed = replace(windows, q=states[..., Q], dq=dq, direction=direction, memory=memory)
    return replace(state, windows=placed)


def _as_recorded(course: Trajectories, motion: MeasuredMotion) -> Array:
    """(windows, joints) rad or m: mean of the positions at the record's rows between two samples, by Hermite's cubic."""
    part = (np.arange(motion.rows_in_one) + 1) / motion.rows_in_one
    (q, later), (dq, faster) = course.q, motion.period * course.dq
    return (
        np.mean(2 * part**3 - 3 * part**2 + 1) * q
        + np.mean(part**3 - 2 * part**2 + part) * dq
        + np.mean(3 * part**2 - 2 * part**3) * later
        + np.mean(part**3 - part**2) * faster
    )


def filtered_state(model: TorqueModel, motion: MeasuredMotion, first: Rows) -> State:
    """The state at some rows that the zero-phase filters of the fit give, which see rows to either side."""
    windows = Windows(
        time=motion.time[first],
        q=motion.q[first].copy(),
        dq=np.where(motion.resting[first], 0.0, motion.dq[first]),
        direction=np.sign(motion.direction[first]),
    )
    memory = _memory_at(model, motion, first)
    guess = np.zeros(windows.q.shape)
    if model.gives:
        links, carried = measured_links(model, motion, first)
        memory = {**memory, **links}
        guess = np.hstack([motion.ddq[first], carried])
    return State(replace(windows, memory=memory), np.zeros(windows.q.shape), guess)


def _memory_at(model: TorqueModel, motion: MeasuredMotion, first: Rows) -> dict[StateKey, Array]:
    """States of the memories where the windows begin, from the measured motion before."""
    travel = motion.travelled
    memory = {}
    for slot in model.stateful:
        effect, joint = slot.term.effect, slot.term.joint
        begun = effect.state_at_start(travel.direction[joint : joint + 1])
        states = effect.states_along(travel.q[:, joint], float(begun[0]), slot.values)
        memory[effect.name, joint] = states[travel.rows[first]]
    return memory
