"""A free run: one simulation from the beginning of a record to its end.

In a closed loop it need not be taken step by step. The loop forgets where it began, so that stretches of the record can be
simulated side by side, each begun at a guess, the measured state. Then each is begun anew where the one before it has ended,
and so on until no beginning differs from the end before it any more: what stands then is what one simulation from the first row
to the last would give, for it has taken the same steps from the same states (the "parareal" idea, Lions, Maday, Turinici 2001,
with the fine integrator alone). Each round makes at least one more stretch right, whatever the loop. A loop with a dead time is
simulated step by step: torques that have not acted yet are no part of a beginning.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np
from numpy.typing import NDArray

from identify.simulation.controller import Controllers
from identify.simulation.course import State, Trajectories, lost
from identify.simulation.dead_time import dead_times
from identify.simulation.measured_motion import MeasuredMotion
from identify.simulation.rollout import roll_out
from identify.simulation.torque_model import TorqueModel, Windows

Array = NDArray[np.float64]

STRETCH = 1.0
"""s: some thirty times what a position loop takes to forget"""

MOST_ROUNDS = 6
"""a loop that has not forgotten by then is simulated step by step"""

SAME = 1e-9
"""of a joint's range, greatest speed and greatest command: beginnings that differ by less are the same"""


def free_run(model: TorqueModel, motion: MeasuredMotion, controllers: Controllers | None) -> Trajectories:
    """Simulate a record from its first row on; ends early where a joint is further off than its range of motion."""
    stretches = (len(motion) - 1) // max(1, round(STRETCH / motion.period))
    if controllers is not None and stretches > 1 and not np.any(dead_times(model)):
        course = _side_by_side(model, motion, controllers, stretches)
        if course is not None:
            return course
    return roll_out(model, motion, [0], len(motion), controllers, stop_when_lost=True)


def _side_by_side(
    model: TorqueModel, motion: MeasuredMotion, controllers: Controllers, stretches: int
) -> Trajectories | None:
    """The free run by stretches; None where the loop does not forget."""
    length = (len(motion) - 1) // stretches
    starts = length * np.arange(stretches)
    course = roll_out(model, motion, starts.tolist(), length + 1, controllers)
    begins = _taken(course.end, np.arange(stretches) - 1)  # that of the first is never asked for
    changed = np.arange(1, stretches)
    for _ in range(MOST_ROUNDS):
        again = roll_out(
            model, motion, starts[changed].tolist(), length + 1, controllers, begin=_taken(begins, changed)
        )
        course = _replaced(course, again, changed)
        ended = _taken(course.end, np.arange(stretches) - 1)
        differs = _differ(begins, ended, motion, controllers)
        differs[0] = False
        begins, changed = ended, np.flatnonzero(differs)
        if not len(changed):
            break
    else:
        return None
    rest = len(motion) - stretches * length
    last = roll_out(
        model, motion, [stretches * length], rest, controllers, begin=_taken(course.end, [stretches - 1])
    )
    return _one_behind_the_other(course, last, length, motion)


def _differ(one: State, other: State, motion: MeasuredMotion, controllers: Controllers) -> NDArray[np.bool_]:
    """(windows,) whether two states differ by more than can be seen."""
    speed = np.maximum(np.abs(motion.dq).max(axis=0), 1e-9)
    command = np.maximum(np.abs(motion.command).max(axis=0), 1e-9)
    integral = controllers.gain("integral") * (one.integral - other.integral)
    differs = np.any(np.abs(one.windows.q - other.windows.q) > SAME * motion.span, axis=1)
    differs |= np.any(np.abs(one.windows.dq - other.windows.dq) > SAME * speed, axis=1)
    differs |= np.any(np.abs(integral) > SAME * command, axis=1)
    for key, held in one.windows.memory.items():
        size = max(float(np.max(np.abs(held))), 1e-12)
        differs |= np.abs(held - other.windows.memory[key]) > SAME * size
    return differs


def _taken(state: State, rows: Sequence[int] | NDArray[np.intp]) -> State:
    """Some of the windows of a state."""
    kept: dict[str, object] = {}
    for field in fields(Windows):
        value = getattr(state.windows, field.name)
        if field.name == "memory":
            kept[field.name] = {key: held[rows] for key, held in value.items()}
        else:
            kept[field.name] = None if value is None else value[rows]
    return State(replace(state.windows, **kept), state.integral[rows], state.guess[rows])


def _replaced(course: Trajectories, again: Trajectories, columns: NDArray[np.intp]) -> Trajectories:
    """Trajectories with some windows simulated anew."""

    def put(before: Array, after: Array) -> Array:
        whole = before.copy()
        whole[:, columns] = after
        return whole

    def put_end(before: Array, after: Array) -> Array:
        whole = before.copy()
        whole[columns] = after
        return whole

    end, ended = course.end, again.end
    windows = replace(
        end.windows,
        time=put_end(end.windows.time, ended.windows.time),
        q=put_end(end.windows.q, ended.windows.q),
        dq=put_end(end.windows.dq, ended.windows.dq),
        direction=put_end(end.windows.direction, ended.windows.direction),
        memory={key: put_end(held, ended.windows.memory[key]) for key, held in end.windows.memory.items()},
    )
    return replace(
        course,
        q=put(course.q, again.q),
        dq=put(course.dq, again.dq),
        ddq=put(course.ddq, again.ddq),
        direction=put(course.direction, again.direction),
        applied=put(course.applied, again.applied),
        memory={key: put(held, again.memory[key]) for key, held in course.memory.items()},
        end=State(windows, put_end(end.integral, ended.integral), put_end(end.guess, ended.guess)),
    )


def _one_behind_the_other(
    course: Trajectories, last: Trajectories, length: int, motion: MeasuredMotion
) -> Trajectories:
    """One window out of stretches, whose last samples are the first ones of the next; cut where a joint is lost."""

    def joined(values: Array, rest: Array) -> Array:
        along = values[:length].swapaxes(0, 1).reshape(-1, 1, *values.shape[2:])
        return np.concatenate([along, rest])

    q = joined(course.q, last.q)
    off = lost(q[:, 0], motion.q, motion.span)
    stop = int(np.argmax(off)) + 1 if off.any() else len(q)
    return Trajectories(
        np.zeros(1, np.intp),
        q[:stop],
        *(
            joined(getattr(course, name), getattr(last, name))[:stop]
            for name in ("dq", "ddq", "direction", "applied")
        ),
        memory={key: joined(held, last.memory[key])[:stop] for key, held in course.memory.items()},
        end=last.end,
    )
