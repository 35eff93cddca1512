"""An experiment of the simulated RX130L joint 3 without driving it: torque along plans from a closed form that shares no line
with `identify`."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from daq.excitation.excitation_plan import ExcitationPlan
from daq.excitation.standard_plan import standard_plan
from daq.excitation.trapezoid import Move
from daq.experiment_folder import experiment_robot
from daq.rig import Rig
from identify.recording import DeclaredSession, ExperimentFile, Payload, append_session, write_experiment

INERTIA, FIRST_MOMENT, LEVER, GRAVITY = 17.70 + 95.0**2 * 0.001457, 20.79, 1.277, 9.81
VISCOUS, OFFSET = 48.139, 9.950


def short_plan(name: str) -> ExcitationPlan:
    """Down and back up in 7 s; it begins and ends upright, where nothing weighs on the joint while torque is faded."""
    moves = ((0.4, 2.4), (1.5, 2.6), (1.4, 2.0))
    phases = tuple(Move(to=(to,), duration=seconds, ramp=0.5) for to, seconds in moves)
    return ExcitationPlan(name=name, joints=("j3",), start=(1.4,), phases=phases)


def write_driven_arm(
    folder: Path,
    rig: Rig,
    payloads: Sequence[str] = ("none", "disk-3.5"),
    dry: float = 18.0,
    driving: float = 0.15,
    backdriving: float = 0.08,
) -> None:
    """Experiment `arm`: 20 s at 200 Hz for each payload; friction (dry + driving |load|) sign q', of either quadrant.

    A payload `block`, heavier than any that was driven, is declared too.
    """
    known = {each.name: each for each in rig.payloads}
    declared = (*rig.payloads, Payload(name="block", mass=25.0, com=(LEVER, 0.0, 0.0)))
    write_experiment(
        folder, ExperimentFile(format=1, name="arm", robot=experiment_robot(rig), payloads=declared)
    )
    random = np.random.default_rng(4)
    plan = standard_plan(rig, 20.0)
    time = np.arange(0.0, plan.duration, 0.005)
    q, dq, ddq = (each[:, 0] for each in plan.setpoints(time))
    for number, name in enumerate(payloads):
        mass = known[name].mass
        load = (INERTIA + mass * LEVER**2) * ddq + GRAVITY * (FIRST_MOMENT + mass * LEVER) * np.cos(q)
        share = np.where(load * dq > 0, driving, backdriving)
        torque = load + (dry + share * np.abs(load)) * np.sign(dq) + VISCOUS * dq + OFFSET
        command = torque / float(rig.drive_gain[0, 0]) + random.normal(0.0, 0.02, len(time))
        file = f"session-{number:02d}.csv"
        rows = np.column_stack([time, q, command])
        np.savetxt(folder / file, rows, delimiter=",", header="t,q1,v1", comments="", fmt="%.9g")
        append_session(folder, DeclaredSession(file=file, payload=name), known[name])
