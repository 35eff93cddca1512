"""Motion from a torque: windows of a record simulated side by side, each begun from its measured state."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identify.simulation.controller import Controllers
from identify.simulation.course import State, Trajectories, integral_that_gives_the_command, simulate_from
from identify.simulation.measured_motion import MeasuredMotion
from identify.simulation.start_state import start_state
from identify.simulation.torque_model import LINK_SPEED, TorqueModel, Windows

Array = NDArray[np.float64]


def roll_out(
    model: TorqueModel,
    motion: MeasuredMotion,
    starts: Sequence[int],
    samples: int,
    controllers: Controllers | None = None,
    stop_when_lost: bool = False,
    begin: State | None = None,
) -> Trajectories:
    """Simulate windows of `samples` samples that begin at rows `starts` of the measured motion.

    controllers    : close the loop with these instead of the recorded torque
    stop_when_lost : end early once every window is further off than its joint's range of motion
    begin          : the state to begin with; the measured one (`start_state`) if not given
    Raises ValueError: a window would end behind the motion. Raises InputError: gains that no drive can have.
    """
    first = np.asarray(starts, np.intp)
    if len(first) == 0 or first.min() < 0 or first.max() + samples > len(motion):
        raise ValueError(f"windows of {samples} samples do not fit into {len(motion)} samples")
    state = begin or start_state(model, motion, first)
    if begin is None and controllers is not None:
        integral = integral_that_gives_the_command(motion, first, state.windows, controllers)
        state = replace(state, integral=integral)
    return simulate_from(model, motion, first, samples, state, controllers, stop_when_lost)


def energy_drift(model: TorqueModel, motion: MeasuredMotion, simulated: Trajectories) -> float | None:
    """How far kinetic and potential energy depart from the work done on the rigid robot, in parts of the work.

    Work of the applied torque less that of friction and of all else that is no rigid body, by the trapezoidal rule; all
    windows together. A figure of the integration, not of the model. None where the model has no rigid robot of
    its own (eq. 30 in its linear form), or nothing moves.
    """
    if not np.any(model.fitted.fit.chi[: model.fitted.observation.base]):
        return None
    samples, count, n = simulated.q.shape
    rows = (simulated.starts[None, :] + np.arange(samples)[:, None]).ravel()
    flat = Windows(
        time=motion.time[rows],
        q=simulated.q.reshape(-1, n),
        dq=simulated.dq.reshape(-1, n),
        direction=simulated.direction.reshape(-1, n),
        external=None if motion.external is None else motion.external[rows],
        temperature=None if motion.temperature is None else motion.temperature[rows],
        memory={key: state.ravel() for key, state in simulated.memory.items()},
    )
    ddq = simulated.ddq.reshape(-1, n)
    link_q, link_dq = model.link_motion(flat)
    still = {**flat.memory}
    for joint in model.gives:
        still[LINK_SPEED, joint] = np.zeros(len(rows))
    at_rest = replace(flat, dq=np.zeros(flat.dq.shape), direction=np.zeros(flat.dq.shape), memory=still)
    gravity = model.rigid_torque(at_rest, np.zeros(ddq.shape))
    momentum = model.rigid_torque(at_rest, link_dq) - gravity
    beside = model.torque(flat, ddq) - model.rigid_torque(flat, ddq)
    applied = simulated.applied.reshape(-1, n)
    # a joint that sticks takes what friction holds it with, and neither does work
    power = ((applied - beside) * flat.dq - gravity * link_dq).sum(axis=1).reshape(samples, count)
    total = np.abs(applied * flat.dq).sum(axis=1).reshape(samples, count)
    kinetic = 0.5 * (momentum * link_dq).sum(axis=1).reshape(samples, count)
    for joint, give in model.gives.items():
        # tau_out has both inertias at the link's speed
        rotor = 0.5 * give.rotor * (flat.dq[:, joint] ** 2 - link_dq[:, joint] ** 2)
        twist = flat.q[:, joint] - link_q[:, joint]
        carried = give.load_where(twist, np.full(len(rows), 1e-12))
        kinetic += (rotor + give.energy(carried)).reshape(samples, count)
        power -= (give.link_dry * np.abs(link_dq[:, joint])).reshape(samples, count)
        if give.relaxation:
            twisting = flat.dq[:, joint] - link_dq[:, joint]
            power -= (give.relaxation / give.compliance * twisting**2).reshape(samples, count)
    work = np.trapezoid(power, dx=motion.period, axis=0)
    spent = np.trapezoid(total, dx=motion.period, axis=0)
    whole = float(spent.sum())
    return float(np.abs(kinetic[-1] - kinetic[0] - work).sum()) / whole if whole > 0 else None
