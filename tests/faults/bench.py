"""A session's acquisition in this process, with the plant behind its drives in view: what really moved, and until when.

Everything is what a session runs (`daq.acquisition.Acquisition` on a virtual bus in simulated time); parent and recorder
are the two ends of their connections. The axis has no brake unless asked: without power it coasts and falls, so that a
stop that only seems to be one is seen.
"""

import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from multiprocessing import Pipe
from typing import Any

import numpy as np

import daq.acquisition
from daq.acquisition import Acquisition, AcquisitionMessage, AcquisitionOrder
from daq.excitation.excitation_plan import ExcitationPlan
from daq.excitation.trapezoid import Move
from daq.plan_setpoints import plan_counts
from daq.recorder import Ending
from daq.rig import Rig
from daq.ring_buffer import RingReader
from daq.safety import StopCause, StopReason
from daq.samples import rows_of_the_session

PATIENCE = 60.0
"""s of the wall clock for a session of a few simulated seconds"""
SLOW, FAST = 0.1, 0.6
"""rad/s of the joint: the two speeds at which a fault is let loose"""


def bench_rig(*, brake: bool = True, cycle: float = 0.002, **faults: Any) -> Rig:
    """RX130L joint 3, simulated; `faults` as in a simulated drive's settings."""
    rig = Rig.load("rx130l-joint3-simulated")
    assert rig.simulated is not None
    drive = {**rig.simulated["drives"][0], "brake": brake, "faults": faults}
    return rig.model_copy(update={"cycle": cycle, "simulated": {**rig.simulated, "drives": [drive]}})


def short_plan() -> ExcitationPlan:
    """A slow move up, and a fast one there and back: 4 s."""
    return ExcitationPlan(
        joints=("j3",),
        start=(0.35,),
        phases=(
            Move(to=(0.5,), duration=1.5, ramp=0.3),
            Move(to=(1.3,), duration=1.3, ramp=0.4),
            Move(to=(0.5,), duration=1.3, ramp=0.4),
        ),
    )


@dataclass
class Trace:
    """What the plant did: time (s), position (rad), speed (rad/s), whether the drive had power."""

    rows: list[tuple[float, float, float, bool]] = field(default_factory=list)
    fault_at: float | None = None
    """s of the plant's time at which the first fault began"""

    def since(self, time: float) -> np.ndarray:
        """(M, 4) from that time on."""
        every = np.array(self.rows, float).reshape(-1, 4)
        return every[every[:, 0] >= time]


@dataclass
class Outcome:
    """How a session ended, as it was said and as it was."""

    reason: StopReason
    alarms: list[str]
    ended_alarm: str
    trace: Trace
    rows: np.ndarray
    powered: bool
    """whether the drive has power, in truth"""
    speed: float
    """rad/s at the end, in truth"""

    @property
    def travel(self) -> float:
        """rad from the fault to the end."""
        if self.trace.fault_at is None:
            return 0.0
        position = self.trace.since(self.trace.fault_at)[:, 1]
        return float(np.ptp(position)) if len(position) else 0.0

    @property
    def fastest(self) -> float:
        """rad/s, the greatest speed since the fault."""
        if self.trace.fault_at is None:
            return 0.0
        speed = self.trace.since(self.trace.fault_at)[:, 2]
        return float(np.abs(speed).max()) if len(speed) else 0.0

    @property
    def powered_for(self) -> float:
        """s for which the drive had power after the fault."""
        if self.trace.fault_at is None:
            return 0.0
        rows = self.trace.since(self.trace.fault_at)
        on = rows[rows[:, 3] > 0]
        return float(on[-1, 0] - self.trace.fault_at) if len(on) else 0.0


def run(
    rig: Rig,
    plan: ExcitationPlan | None = None,
    stop_when: Callable[[Any, "Trace"], bool] | None = None,
    meanwhile: Callable[[Any], None] | None = None,
    patience: float = PATIENCE,
) -> Outcome:
    """Drive the plan; the outcome once the acquisition has ended.

    stop_when : asked at every SYNC with the simulated rig and the trace; true once: the operator stops
    meanwhile : called at every SYNC with the simulated rig, to do mischief
    """
    plan = plan or short_plan()
    trace = Trace()
    parent, theirs = Pipe()
    recorder, to_recorder = Pipe()
    name = f"bench-{id(trace):x}"
    order = AcquisitionOrder(rig, rig.payload("none"), plan_counts(rig, plan), f"{name}-r", f"{name}-f", 1)
    plants: list[Any] = []
    real = daq.acquisition.simulated_rig

    def watched(*arguments: Any, **named: Any) -> Any:
        plant = real(*arguments, **named)
        plants.append(plant)
        _watch(plant, trace, parent, stop_when, meanwhile)
        return plant

    daq.acquisition.simulated_rig = watched
    try:
        acquisition = Acquisition(order, theirs, to_recorder)
        thread = threading.Thread(target=acquisition.run, daemon=True)
        thread.start()
        alarms, ended, rows = _drive(parent, recorder, f"{name}-r", thread, patience)
    finally:
        daq.acquisition.simulated_rig = real
    for connection in (parent, theirs, recorder, to_recorder):
        connection.close()
    assert ended.reason is not None
    plant = plants[-1]
    drive = plant.nodes[0].drive
    return Outcome(
        ended.reason,
        alarms,
        ended.alarm,
        trace,
        rows,
        powered=drive.machine.powered,
        speed=abs(float(plant.mechanism.joint_velocity)),
    )


def _watch(plant: Any, trace: Trace, parent: Any, stop_when: Any, meanwhile: Any) -> None:
    """Log what the plant does with every stretch of time, and when its first fault begins."""
    pass_time = plant._pass_time
    node = plant.nodes[0]
    command = node.faults.command
    stopped = False

    def passing(duration: float) -> None:
        nonlocal stopped
        pass_time(duration)
        mechanism = plant.mechanism
        powered = node.drive.machine.powered
        trace.rows.append((plant.time, mechanism.joint_position, mechanism.joint_velocity, powered))
        if meanwhile is not None:
            meanwhile(plant)
        if stop_when is not None and not stopped and stop_when(plant, trace):
            stopped = True
            parent.send(("stop", "the operator's stop"))

    def commanded(subindex: int, value: int) -> None:
        if trace.fault_at is None:
            trace.fault_at = plant.time
        command(subindex, value)

    plant._pass_time = passing
    node.faults.command = commanded


def _drive(
    parent: Any, recorder: Any, ring: str, thread: threading.Thread, patience: float
) -> tuple[list[str], AcquisitionMessage, np.ndarray]:
    """Parent and recorder: arm, start, listen; what was said, and the rows that were to be recorded."""
    alarms: list[str] = []
    reader: RingReader | None = None
    recorder.send("ready")
    while thread.is_alive() or parent.poll():
        parent.send(("beat", ""))
        if not parent.poll(0.05):
            patience -= 0.05
            assert patience > 0, "the session did not end"
            continue
        message = parent.recv()
        if message.what == "checked" and message.check.ok:
            reader = RingReader(ring)
            parent.send(("arm", ""))
        elif message.what == "armed":
            parent.send(("start", ""))
        elif message.what == "alarm":
            alarms.append(message.words)
        elif message.what == "ended":
            thread.join(30)
            assert reader is not None, message.words
            rows = rows_of_the_session(reader.latest(reader.capacity))
            reader.close()
            last = recorder.recv() if recorder.poll() else None
            assert isinstance(last, Ending)
            return alarms, message, rows
    raise AssertionError("the acquisition ended without a word")


def is_safe(outcome: Outcome) -> bool:
    """No power and at rest in truth; or a person was told to press the emergency stop."""
    return (not outcome.powered and outcome.speed < 0.01) or "emergency stop" in outcome.ended_alarm


DONE = StopCause.PLAN_DONE
