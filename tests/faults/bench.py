"""A session's acquisition in this process, with the plant behind its drives in view: what really moved, and until when.

Everything is what a session runs (`daq.acquisition.Acquisition` on a virtual bus in simulated time); parent and recorder
are the two ends of their connections. The axis has no brake unless asked: without power it coasts and falls, so that a
stop that only seems to be one is seen.
"""

import contextlib
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from multiprocessing import Pipe
from multiprocessing.connection import Connection
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
from daq.samples import SessionRows
from daq.torque_offset import SentAhead

PATIENCE = 60.0
"""s of the wall clock for a session of a few simulated seconds"""
TURN = 0.05
"""s between two signs of life of the bench's parent"""
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
        """s for which the drive had power after the fault; a fault before the motion waits until there is power."""
        if self.trace.fault_at is None:
            return 0.0
        rows = self.trace.since(self.trace.fault_at)
        on = rows[rows[:, 3] > 0]
        return float(on[-1, 0] - on[0, 0]) if len(on) else 0.0


@dataclass
class Stage:
    """What a mischief can lay its hands on, while a session runs on the bench.

    parent, recorder : this side of the acquisition's connections
    beats : whether the parent still gives its sign of life
    """

    parent: Connection
    recorder: Connection
    acquisition: Acquisition
    trace: "Trace"
    plants: list[Any] = field(default_factory=list)
    beats: bool = True

    @property
    def plant(self) -> Any:
        """The simulated rig."""
        return self.plants[-1]


Mischief = Callable[[Stage], None]


def run(
    rig: Rig,
    plan: ExcitationPlan | None = None,
    stop_when: Callable[[Any, "Trace"], bool] | None = None,
    meanwhile: Callable[[Any], None] | None = None,
    patience: float = PATIENCE,
    before: Mischief | None = None,
    checked: Mischief | None = None,
    triggered: Mischief | None = None,
    ahead: SentAhead | None = None,
) -> Outcome:
    """Drive the plan; the outcome once the acquisition has ended.

    stop_when : asked at every SYNC with the simulated rig and the trace; true once: the operator stops
    meanwhile : called at every SYNC with the simulated rig, to do mischief
    before, checked : mischief before the rig is checked, and between the check and arming
    triggered : mischief when the drive's first planned fault begins
    ahead : what is sent beside the targets
    """
    plan = plan or short_plan()
    trace = Trace()
    parent, theirs = Pipe()
    recorder, to_recorder = Pipe()
    name = f"bench-{id(trace):x}"
    counts = plan_counts(rig, plan)
    order = AcquisitionOrder(rig, rig.payload("none"), counts, f"{name}-r", f"{name}-f", 1, ahead)
    plants: list[Any] = []
    real = daq.acquisition.simulated_rig

    def watched(*arguments: Any, **named: Any) -> Any:
        plant = real(*arguments, **named)
        plants.append(plant)
        _watch(plant, trace, parent, stop_when, meanwhile, lambda: triggered and triggered(stage))
        if before is not None:
            trace.fault_at = plant.time
            before(stage)
        return plant

    daq.acquisition.simulated_rig = watched
    try:
        acquisition = Acquisition(order, theirs, to_recorder)
        stage = Stage(parent, recorder, acquisition, trace, plants)
        thread = threading.Thread(target=acquisition.run, daemon=True)
        thread.start()
        alarms, ended, rows = _drive(stage, f"{name}-r", thread, patience, checked)
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


def _watch(
    plant: Any, trace: Trace, parent: Any, stop_when: Any, meanwhile: Any, triggered: Callable[[], Any]
) -> None:
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
            with contextlib.suppress(OSError):
                parent.send(("stop", "the operator's stop"))

    def commanded(subindex: int, value: int) -> None:
        if trace.fault_at is None:
            trace.fault_at = plant.time
            triggered()
        command(subindex, value)

    plant._pass_time = passing
    node.faults.command = commanded


def _drive(
    stage: Stage, ring: str, thread: threading.Thread, patience: float, checked: Mischief | None
) -> tuple[list[str], AcquisitionMessage, np.ndarray]:
    """Parent and recorder: arm, start, listen; what was said, and the rows that were to be recorded."""
    alarms: list[str] = []
    reader: RingReader | None = None
    ended: AcquisitionMessage | None = None
    with contextlib.suppress(OSError):
        stage.recorder.send("ready")
    while thread.is_alive() or _waits(stage.parent):
        message = _heard(stage)
        if message is None:
            patience -= TURN
            assert patience > 0, "the session did not end"
            continue
        if message.what == "checked" and message.check.ok:
            reader = RingReader(ring)
            if checked is not None:
                stage.trace.fault_at = stage.plant.time
                checked(stage)
            _say(stage.parent, "arm")
        elif message.what == "armed":
            _say(stage.parent, "start")
        elif message.what == "alarm":
            alarms.append(message.words)
        elif message.what == "ended":
            ended = message
            break
    thread.join(30)
    last = stage.recorder.recv() if _waits(stage.recorder) else None
    if ended is None:
        # Nobody was there to hear it; the recorder was.
        assert isinstance(last, Ending), "the acquisition ended without a word"
        ended = AcquisitionMessage(
            "ended", last.reason.words, reason=last.reason, alarm=stage.acquisition.alarm
        )
    if reader is None:
        return alarms, ended, np.zeros(0)
    rows = SessionRows().take(reader.latest(reader.capacity))
    reader.close()
    return alarms, ended, rows


def _heard(stage: Stage) -> AcquisitionMessage | None:
    """The next word from the acquisition, after a sign of life; None if there is none within a moment."""
    if stage.parent.closed:
        threading.Event().wait(TURN)
        return None
    if stage.beats:
        _say(stage.parent, "beat")
    try:
        return stage.parent.recv() if stage.parent.poll(TURN) else None
    except (EOFError, OSError):
        stage.parent.close()
        return None


def _waits(connection: Connection) -> bool:
    try:
        return not connection.closed and connection.poll()
    except OSError:
        return False


def _say(connection: Connection, word: str) -> None:
    with contextlib.suppress(OSError):
        connection.send((word, ""))


def is_safe(outcome: Outcome) -> bool:
    """No power and at rest in truth; or a person was told to press the emergency stop."""
    return (not outcome.powered and outcome.speed < 0.01) or "emergency stop" in outcome.ended_alarm


DONE = StopCause.PLAN_DONE
