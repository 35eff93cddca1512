"""Whether a closed loop of controllers and model is stable: about the measured motion, without dry friction.

A loop whose deviations grow tells of its gains and not of the model, however small the model's error is. The linear motion of
small deviations δq, δq̇, ∫δe is

    M δq̈ = −(g K cᵀ + ∂τ/∂q) δq − (g V cᵀ + ∂τ/∂q̇) δq̇ − g I cᵀ ∫δq

with the controllers' gains K, V, I, the drive gain g and the motors' turns c. A limit of the command bounds how far such a
loop goes, and dry friction holds small deviations; neither makes it follow.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from identify.estimation.fitted_model import FittedModel
from identify.recording import SessionEntry
from identify.simulation.controller import Controllers
from identify.simulation.measured_motion import MeasuredMotion
from identify.simulation.torque_model import TorqueModel, Windows

Array = NDArray[np.float64]

STATES = 40
"""measured states, evenly along the motion, about which the loop is linearised"""

STEP = 1e-6
"""of a joint's range of motion, and of its largest speed: the difference that a derivative is taken over"""


@dataclass(frozen=True)
class Growth:
    """How fast what is off grows in the closed loop.

    rate  : 1/s, of the fastest growing deviation, the median along the motion
    joint : the joint that it shows in most
    """

    rate: float
    joint: int


def growth(model: TorqueModel, motion: MeasuredMotion, controllers: Controllers) -> Growth | None:
    """How fast deviations grow in the closed loop along a measured motion.

    None where it is stable, where they would not grow to e times within the motion, or where transmissions give, whose two masses
    are not in these equations.
    """
    if model.gives:
        return None
    rows = np.unique(np.linspace(0, len(motion) - 1, STATES).astype(np.intp))
    rows = rows[np.any(~motion.resting[rows], axis=1)]
    if not len(rows):
        return None
    windows = Windows(
        time=motion.time[rows],
        q=motion.q[rows],
        dq=motion.dq[rows],
        direction=np.sign(motion.direction[rows]),
        external=None if motion.external is None else motion.external[rows],
        temperature=None if motion.temperature is None else motion.temperature[rows],
    )
    windows = replace(windows, memory=model.started(windows))
    ddq = motion.ddq[rows]
    _, slope = model.with_slope(windows, ddq)
    n, drive_gain = motion.q.shape[1], model.fitted.record.experiment.drive_gain
    speeds = np.maximum(np.abs(motion.dq).max(axis=0), 1e-12)
    torque = partial(model.torque, acceleration=ddq)
    spring = _slopes(lambda change: torque(replace(windows, q=windows.q + change)), STEP * motion.span)
    damper = _slopes(lambda change: torque(replace(windows, dq=windows.dq + change)), STEP * speeds)
    loops = controllers.opposing_rates(slope, drive_gain)
    course = np.zeros((len(rows), 3 * n, 3 * n))
    course[:, :n, n : 2 * n] = course[:, 2 * n :, :n] = np.eye(n)
    course[:, n : 2 * n, :n] = -loops.position - np.linalg.solve(slope, spring)
    course[:, n : 2 * n, n : 2 * n] = -loops.velocity - np.linalg.solve(slope, damper)
    course[:, n : 2 * n, 2 * n :] = -loops.integral
    values, vectors = np.linalg.eig(course)
    rates = np.real(values)
    worst = np.argmax(rates, axis=1)
    every = np.arange(len(rows))
    rate = float(np.median(rates[every, worst]))
    if rate * len(motion) * motion.period < 1.0:
        return None
    # in speeds, each in parts of its joint's largest
    shown = np.abs(vectors[every, n : 2 * n, worst]) / speeds
    return Growth(rate, int(np.bincount(np.argmax(shown, axis=1), minlength=n).argmax()))


def _slopes(torque: Callable[[Array], Array], steps: Array) -> Array:
    """(windows, joints, joints) derivative of a torque (windows, joints) over each entry of a change (joints,) from zero."""
    changes = np.diag(steps)
    columns = [
        (torque(change) - torque(-change)) / (2.0 * step) for change, step in zip(changes, steps, strict=True)
    ]
    return np.stack(columns, axis=2)


def unstable_loop(
    fitted: FittedModel,
    motions: Sequence[tuple[SessionEntry, MeasuredMotion]],
    controllers: Controllers,
) -> str | None:
    """A remark on the session in which deviations grow fastest; None where they grow in none."""
    grown = [growth(TorqueModel(fitted, entry), motion, controllers) for entry, motion in motions]
    growing = max((each for each in grown if each), key=lambda each: each.rate, default=None)
    if growing is None:
        return None
    gains = controllers.listed[growing.joint]
    integral = f", integral {gains.integral:g}" if gains.integral else ""
    return (
        f"the loop with these gains is unstable: a deviation grows to e times itself in {1.0 / growing.rate:.2g} s, most of all"
        f" of joint '{gains.joint}' (position {gains.position:g}, velocity {gains.velocity:g}{integral}); the errors in closed"
        " loop tell of the gains and not of the model"
    )
