"""The sequence of a motion: power on, approach, plan, rest, power off; from anywhere to rest when it must stop.

It is told the samples and answers with controlwords. It counts time in cycles of the rig, so it is the same in
real and in simulated time. What the drives say in their statuswords decides; nothing is assumed.
"""

from collections.abc import Callable
from enum import Enum, auto
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.rig import Rig
from daq.safety import StopCause, StopReason
from daq.samples import POSITION_CAME, Phase
from daq.setpoint_stream import SetpointStream, Trajectory
from daq.stopping_watch import StoppingWatch
from daq.torque_mode import TorqueMode
from drivers.cia402 import ENABLE_INTERPOLATION, TOWARDS_OPERATION_ENABLED, Command, State, state_of
from drivers.errors import DriverError

_ENABLE_TIMEOUT = 3.0
"""s of the rig's time until every axis is powered: brakes take some tenths of a second"""
_SETTLE = 0.3
"""s at rest with power, before the approach (the controllers take the load from the brakes) and after the plan"""
_REST_WINDOW = 0.1
"""s over which an axis must stand still to be at rest"""
_REST_SHARE = 0.005
"""of its velocity limit: slower than that, an axis is at rest"""
_POWER_OFF = 0.1
"""s for the drives to see the last controlword"""
BRAKES_CLOSE = 0.5
"""s, at least, for which samples are taken after a stop took the power: brakes close meanwhile"""

_FAULT_REACTION = 0.5
"""s, at most, for a drive that ends its own fault reaction before it gives its power up"""
_BEFORE_A_CHANGE = 10
"""cycles"""
_WITH_TORQUE = (State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE, State.FAULT_REACTION_ACTIVE)


class Step(Enum):
    """Where the sequence stands."""

    STANDBY = auto()
    ENABLING = auto()
    HOLDING = auto()
    MOVING = auto()
    SETTLING = auto()
    TAKING_OVER = auto()
    """this computer's loop runs beside the drives' own, until they are told to take its torque (`daq.torque_mode`)"""
    HANDING_BACK = auto()
    """the drives are told to hold the axes themselves again, which rest"""
    STOPPING = auto()
    CUT = auto()
    """the axes do not stop as they should: power is taken by every means there is"""
    POWERING_OFF = auto()
    ENDED = auto()


_WITH_POWER = (
    Step.ENABLING,
    Step.HOLDING,
    Step.MOVING,
    Step.SETTLING,
    Step.TAKING_OVER,
    Step.HANDING_BACK,
)


class MotionSequence:
    """Moves a rig through its plan and back to rest.

    setpoints : where targets and controlwords go
    trajectory : called with the targets (n,) in counts, at which every axis is held with power; what to drive
        through from there
    torque_mode : how the plan is driven in cyclic torque mode, its approach and end in position mode as ever; None where it is
        driven in position mode too
    """

    def __init__(
        self,
        rig: Rig,
        setpoints: SetpointStream,
        trajectory: Callable[[NDArray[Any]], Trajectory],
        torque_mode: TorqueMode | None = None,
    ) -> None:
        self.rig = rig
        self.step = Step.STANDBY
        self.reason: StopReason | None = None
        """why the motion ended, once it has"""
        self.rest_seen: bool | None = None
        """whether the samples showed every axis at rest after a stop; None where they said nothing"""
        self.cut_because = ""
        """why power is to be taken at once, by every means; empty where it is not"""
        self.unseen = ""
        """the joint whose position is not to be believed, so that no sample shows whether it rests; empty where there is none"""
        self._watch = StoppingWatch(rig)
        self._setpoints = setpoints
        self._trajectory = trajectory
        self._torque_mode = torque_mode
        self._plan: Trajectory | None = None
        """what is driven once the axes are held by torque"""
        n = len(rig.axes)
        self._powered = [
            Command.ENABLE_OPERATION.value
            | (ENABLE_INTERPOLATION if axis.mode == "interpolated-position" else 0)
            for axis in rig.axes
        ]
        self._status: list[int | None] = [None] * n
        self._counts: NDArray[Any] = np.zeros(n, np.int64)
        self._command: NDArray[Any] = np.zeros(n, np.int64)
        self._target: NDArray[Any] = np.zeros(n, np.int64)
        self._known = np.zeros(n, bool)
        self._age = 0
        self._told_now = False
        self._patience = _POWER_OFF
        window = max(2, round(_REST_WINDOW / rig.cycle))
        self._recent = np.full((window, n), np.nan)
        self._rest_speed = np.array([axis.limits.velocity for axis in rig.axes]) * _REST_SHARE
        self._resolution = np.abs(rig.position_matrix).sum(axis=1)

    def begin(self) -> None:
        """The operator has started: power on and go."""
        if self.step is Step.STANDBY:
            self._enter(Step.ENABLING)

    def stop(self, reason: StopReason) -> None:
        """Bring every axis to rest by quick stop; the first reason counts."""
        if self.reason is None:
            self.reason = reason
        self.unseen = self.unseen or reason.unseen
        if self.step is Step.STANDBY or (self.step is Step.ENABLING and not self._powered_now()):
            self._power_off()
        elif self.step in _WITH_POWER:
            self._setpoints.stop()
            self._setpoints.command([Command.QUICK_STOP.value] * len(self._status))
            self._recent[:] = np.nan
            self._watch.begin()
            self._told_now = True
            self._patience = BRAKES_CLOSE
            self._enter(Step.STOPPING)
        if reason.unseen:
            self.cut(f"nobody can see whether joint {reason.unseen} stops")

    def cut(self, because: str) -> None:
        """The axes cannot be left to the quick stop: no power, now. The first words count."""
        if self.cut_because or self.step in (Step.STANDBY, Step.ENDED):
            return
        self.cut_because = because
        self._setpoints.stop()
        self._setpoints.command([Command.DISABLE_VOLTAGE.value] * len(self._status))
        self._recent[:] = np.nan
        self._told_now = True
        self._enter(Step.CUT)

    @property
    def moves(self) -> bool:
        """Whether an axis may have power, and so may move."""
        return self.step not in (Step.STANDBY, Step.ENDED)

    def give_up(self) -> None:
        """No sample will tell more: end with the power commanded off."""
        self._setpoints.command([Command.DISABLE_VOLTAGE.value] * len(self._status))
        self._enter(Step.ENDED)

    def take(self, rows: NDArray[Any]) -> None:
        """Goes on to the next step when it is time, by what the drives said in the next rows (after `remember`)."""
        if not len(rows):
            return
        if self._told_now:
            # These rows came before the stop that they, or something else, led to.
            self._told_now = False
            return
        self._age += len(rows)
        match self.step:
            case Step.ENABLING:
                self._enable()
            case Step.HOLDING:
                if self._age * self.rig.cycle >= _SETTLE:
                    self._drive()
            case Step.MOVING:
                if self._setpoints.at_end and rows["phase"][-1] == Phase.STANDSTILL:
                    self._enter(Step.SETTLING)
            case Step.SETTLING:
                if self._age * self.rig.cycle >= _SETTLE:
                    self._go_on()
            case Step.TAKING_OVER | Step.HANDING_BACK:
                self._change_mode()
            case Step.STOPPING:
                self._watch_stopping(rows)
            case Step.CUT:
                self._watch_rest()
            case Step.POWERING_OFF:
                patience = _FAULT_REACTION if self._powered_now() else self._patience
                if self._age * self.rig.cycle >= patience:
                    self._enter(Step.ENDED)
            case Step.STANDBY | Step.ENDED:
                pass

    def _enter(self, step: Step) -> None:
        self.step = step
        self._age = 0

    def _drive(self) -> None:
        """Through approach and plan; to the plan's begin alone where another mode is wanted for it."""
        trajectory = self._trajectory(self._target)
        if self._torque_mode is not None:
            trajectory, self._plan = trajectory.split()
        self._setpoints.follow(trajectory)
        self._enter(Step.MOVING)

    def _go_on(self) -> None:
        """The axes have settled: at the plan's begin, after the plan, or in position mode again after it."""
        if self._torque_mode is not None and (self._plan is not None or self._torque_mode.holds):
            if not self._at_rest():
                if self._age * self.rig.cycle >= self.rig.supervision.stop_timeout:
                    self.stop(
                        StopReason(
                            StopCause.DRIVE_FAULT, "the axes do not rest, so that the mode cannot be changed"
                        )
                    )
                return
            if self._plan is not None and self._torque_mode.holds:
                self._setpoints.follow(self._plan)
                self._plan = None
                self._enter(Step.MOVING)
                return
            self._setpoints.hold(self._counts.tolist())
            if self._plan is not None:
                self._torque_mode.begin(self._command)
            self._enter(Step.TAKING_OVER if self._plan is not None else Step.HANDING_BACK)
            return
        if self.reason is None:
            self.reason = StopReason(StopCause.PLAN_DONE, "the plan ran to its end")
        self._power_off()

    def _change_mode(self) -> None:
        """Once the drives have had targets at the actual position, and the loop's torque, for a few cycles."""
        assert self._torque_mode is not None
        if self._age < _BEFORE_A_CHANGE:
            return
        try:
            if self.step is Step.TAKING_OVER:
                self._torque_mode.take_over()
            else:
                self._torque_mode.hand_back()
        except DriverError as error:
            self.stop(StopReason(StopCause.DRIVE_FAULT, str(error)))
            return
        self._enter(Step.SETTLING)

    def remember(self, rows: NDArray[Any]) -> None:
        """Take what the drives said in the next rows; before `stop`, `cut` and `take` of the same turn."""
        if not len(rows):
            return
        self._watch.remember(rows)
        came = (rows["valid"] & POSITION_CAME) != 0
        for axis in range(len(self._status)):
            last = np.flatnonzero(came[:, axis])
            if len(last):
                self._status[axis] = int(rows["status"][last[-1], axis])
                self._counts[axis] = rows["position"][last[-1], axis]
                self._command[axis] = rows["command"][last[-1], axis]
                self._known[axis] = True
        recent = np.where(came, rows["position"], np.nan)[-len(self._recent) :]
        self._recent = np.concatenate([self._recent[len(recent) :], recent])

    def _enable(self) -> None:
        """One step of every axis's state machine towards OPERATION ENABLED, from what its statusword says."""
        if self._known.all():
            states = [_state(word) for word in self._status]
            # While an axis has no power its target goes with it; from the command that gives it power on the target
            # stands: an axis that sags until its controller takes hold is brought back, and nothing jumps.
            powerless = [state not in (State.SWITCHED_ON, State.OPERATION_ENABLED) for state in states]
            self._target = np.where(powerless, self._counts, self._target)
            self._setpoints.hold(self._target.tolist())
            if all(state is State.OPERATION_ENABLED for state in states):
                self._enter(Step.HOLDING)
                return
            if State.FAULT not in states and State.FAULT_REACTION_ACTIVE not in states:
                self._setpoints.command(
                    [
                        TOWARDS_OPERATION_ENABLED[state][0].value
                        if state in TOWARDS_OPERATION_ENABLED
                        else word
                        for state, word in zip(states, self._powered, strict=True)
                    ]
                )
        if self._age * self.rig.cycle >= _ENABLE_TIMEOUT:
            stuck = [
                f"joint {axis.joint} is {'silent' if word is None else f'in {_words(word)}'}"
                for axis, word in zip(self.rig.axes, self._status, strict=True)
                if word is None or _state(word) is not State.OPERATION_ENABLED
            ]
            fault = f"no power within {_ENABLE_TIMEOUT:g} s: {', '.join(stuck)}"
            self.stop(StopReason(StopCause.DRIVE_FAULT, fault))

    def _watch_stopping(self, rows: NDArray[Any]) -> None:
        trouble = self._watch.judge(rows)
        if trouble:
            self.cut(trouble)
        elif self._at_rest():
            self.rest_seen = True
            self._power_off()
        elif self._age * self.rig.cycle >= self.rig.supervision.stop_timeout:
            self.cut(f"the axes did not come to rest within {self.rig.supervision.stop_timeout:g} s")

    def _watch_rest(self) -> None:
        """Without power the axes coast: until they rest, or until nothing more is to be expected."""
        if not self.unseen and self._at_rest():
            self.rest_seen = True
            self._enter(Step.ENDED)
        elif self._age * self.rig.cycle >= self.rig.supervision.stop_timeout:
            self.rest_seen = None if np.isnan(self._recent).any() else False
            self._enter(Step.ENDED)

    def _powered_now(self) -> bool:
        """Whether a drive's newest statusword shows torque."""
        return any(_state(word) in _WITH_TORQUE for word in self._status)

    def _at_rest(self) -> bool:
        position = self._recent @ self.rig.position_matrix.T
        with np.errstate(invalid="ignore"):
            travelled = position.max(axis=0) - position.min(axis=0)
        return bool(np.all(travelled <= self._rest_speed * _REST_WINDOW + self._resolution))

    @property
    def lasted(self) -> float:
        """s of the rig's time in the present step."""
        return self._age * self.rig.cycle

    @property
    def silent(self) -> bool:
        """Whether the newest samples hold no position of an axis."""
        few = max(5, round(self.rig.supervision.silence / self.rig.cycle))
        return bool(np.isnan(self._recent[-few:]).all(axis=0).any())

    def _power_off(self) -> None:
        self._setpoints.stop(Phase.STANDSTILL)
        self._setpoints.command([Command.DISABLE_VOLTAGE.value] * len(self._status))
        self._enter(Step.POWERING_OFF)


def _state(word: int | None) -> State | None:
    if word is None:
        return None
    try:
        return state_of(word)
    except ValueError:
        return None


def _words(word: int) -> str:
    state = _state(word)
    return f"statusword 0x{word:04X}" if state is None else state.words
