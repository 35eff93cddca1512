"""What can go wrong on purpose: losses, delays and failures of a simulated drive, planned or on command.

A plan (`FaultSettings`) counts cycles: SYNCs since the node became OPERATIONAL, from 0. The same faults can
be commanded while it runs, from Python (`Faults`) or by SDO through object 0x2010, so that a test may
command a drive in another process.
"""

import random
from dataclasses import dataclass
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator

# Subindices of object 0x2010, "fault command"; writing a value commands the fault.
COMMAND_EMERGENCY = 1  # error code
COMMAND_FREEZE = 2  # 1
COMMAND_HEARTBEAT = 3  # 0 stops it, 1 lets it go on
COMMAND_LOSE = 4  # per mille
COMMAND_LATE = 5  # per mille
COMMAND_SATURATE = 6  # per mille of the current limit that is left
COMMAND_GLITCH = 7  # counts, in the next cycle
COMMAND_KEEP_MODE = 8  # 1: mode switches are taken and ignored, as some drives do
COMMAND_FLIP_FEEDBACK = 9  # 1: the encoder counts the other way from here on
COMMAND_DISOBEY = 10  # 1: controlwords are ignored
COMMAND_RUN_AWAY = 11  # counts/s, whatever the setpoints say
COMMAND_CURRENT_STUCK = 12  # 1: the torque demand that is shown stays at 0
COMMAND_DOUBLE = 13  # per mille of TPDOs that are sent twice
COMMAND_NMT = 14  # NMT state in which the node finds itself: 4 STOPPED, 127 PRE-OPERATIONAL
COMMAND_FOREIGN_SYNC = 15  # SYNCs that somebody else sends, one after each answer
COMMAND_FOREIGN_SETPOINT = (
    16  # counts beside the target that somebody else's RPDO asks for, after ours in every cycle
)
COMMAND_FOREIGN_NMT = 17  # NMT command that somebody else sends to this node
COMMAND_DEAF_TO_NMT = 18  # 1: NMT commands are ignored
COMMAND_RESTART = 19  # 1: the node loses its supply for a moment and boots
COMMAND_STAND = 20  # 1: the encoder stands while the axis moves; 2: only what the drive shows of it does
ENCODER_STANDS, SHOWN_STANDS = 1, 2

_NAMES = {
    "emergency": COMMAND_EMERGENCY,
    "freeze": COMMAND_FREEZE,
    "heartbeat": COMMAND_HEARTBEAT,
    "lose": COMMAND_LOSE,
    "late": COMMAND_LATE,
    "saturate": COMMAND_SATURATE,
    "glitch": COMMAND_GLITCH,
    "keep-mode": COMMAND_KEEP_MODE,
    "flip-feedback": COMMAND_FLIP_FEEDBACK,
    "disobey": COMMAND_DISOBEY,
    "run-away": COMMAND_RUN_AWAY,
    "current-stuck": COMMAND_CURRENT_STUCK,
    "double": COMMAND_DOUBLE,
    "nmt-state": COMMAND_NMT,
    "foreign-sync": COMMAND_FOREIGN_SYNC,
    "foreign-setpoint": COMMAND_FOREIGN_SETPOINT,
    "foreign-nmt": COMMAND_FOREIGN_NMT,
    "deaf-to-nmt": COMMAND_DEAF_TO_NMT,
    "restart": COMMAND_RESTART,
    "feedback-stands": COMMAND_STAND,
}


class PlannedFault(BaseModel):
    """A fault that begins by itself when the drive has come so far."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    fault: str = Field(description="one of object 0x2010's fault commands by name: " + ", ".join(_NAMES))
    value: int = Field(default=1, description="what would be written to its subindex")
    phase: Literal["streaming", "enabled", "slow", "fast", "stopping"] = Field(
        default="streaming",
        description="from when: OPERATIONAL, enabled, turning slower or faster than `speed`, or braking by itself",
    )
    speed: float = Field(default=10.0, ge=0, description="rad/s of the motor, for `slow` and `fast`")
    after: int = Field(default=0, ge=0, description="SYNCs that pass in that phase before")

    @field_validator("fault")
    @classmethod
    def _known(cls, name: str) -> str:
        if name not in _NAMES:
            raise ValueError(f"{name!r} is no fault; there are {', '.join(_NAMES)}")
        return name

    @property
    def subindex(self) -> int:
        """Of object 0x2010."""
        return _NAMES[self.fault]


class FaultSettings(BaseModel):
    """Faults of one node; nothing by default."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    lose_probability: float = Field(default=0.0, ge=0, le=1, description="of losing a cycle's TPDOs")
    lose_cycles: frozenset[int] = Field(default=frozenset(), description="cycles whose TPDOs are lost")
    late_probability: float = Field(default=0.0, ge=0, le=1, description="of TPDOs coming one cycle late")
    late_cycles: frozenset[int] = Field(
        default=frozenset(), description="cycles whose TPDOs come one cycle late"
    )
    freeze_at: int | None = Field(default=None, description="cycle from which the node does nothing any more")
    emergency_at: int | None = Field(
        default=None, description="cycle at which the drive fails with emergency_code"
    )
    emergency_code: int = Field(default=0x4310, ge=0x1000, le=0xFFFF)
    heartbeat_stops_at: int | None = Field(default=None, description="cycle from which no heartbeat is sent")
    saturate_from: int | None = Field(
        default=None, description="cycle from which the current limit is lowered"
    )
    saturate_to: int | None = Field(default=None, description="cycle from which it is as before")
    saturate_factor: float = Field(default=0.1, gt=0, le=1, description="what is left of the current limit")
    glitch_cycles: frozenset[int] = Field(default=frozenset(), description="cycles whose position is wrong")
    glitch_counts: int = Field(default=1000, description="by how much")
    planned: tuple[PlannedFault, ...] = Field(
        default=(), description="faults that begin with a phase of the motion"
    )


@dataclass
class _Waiting:
    """A planned fault that has not begun, and the SYNCs that have passed in its phase."""

    planned: PlannedFault
    passed: int = 0


class Faults:
    """The faults of one node as they stand now.

    settings : the plan
    seed     : of the losses and delays
    """

    def __init__(self, settings: FaultSettings, seed: int):
        self.settings = settings
        self.random = random.Random(seed)
        self.lose_probability = settings.lose_probability
        self.late_probability = settings.late_probability
        self.frozen = False
        self.heartbeat_stopped = False
        self.current_left = 1.0
        self.glitch = 0
        self.emergency: int | None = None
        self.keep_mode = False
        self.feedback_flips = False
        self.disobeys = False
        self.run_away = 0  # counts/s
        self.current_stuck = False
        self.double_probability = 0.0
        self.nmt_state: int | None = None  # to be taken on
        self.foreign_syncs = 0
        self.foreign_setpoint: int | None = None  # counts beside the target
        self.foreign_nmt: int | None = None
        self.deaf_to_nmt = False
        self.restarts = False
        self.feedback_stands = 0
        self.waiting: list[_Waiting] = [_Waiting(planned) for planned in settings.planned]
        """faults that are planned for a phase, and have not begun"""
        self._planned = settings != FaultSettings(
            lose_probability=settings.lose_probability, late_probability=settings.late_probability
        )

    def enter_cycle(self, cycle: int) -> None:
        """Let what is planned for this cycle begin."""
        if not self._planned:
            return
        plan = self.settings
        if cycle == plan.freeze_at:
            self.frozen = True
        if cycle == plan.heartbeat_stops_at:
            self.heartbeat_stopped = True
        if cycle == plan.emergency_at:
            self.emergency = plan.emergency_code
        if cycle == plan.saturate_from:
            self.current_left = plan.saturate_factor
        if cycle == plan.saturate_to:
            self.current_left = 1.0
        if cycle in plan.glitch_cycles:
            self.glitch = plan.glitch_counts

    def enter_phase(self, enabled: bool, stopping: bool, speed: float) -> None:
        """Let faults begin that are planned for what the drive does at this SYNC; speed: rad/s of the motor."""
        for entry in tuple(self.waiting):
            planned = entry.planned
            reached = {
                "streaming": True,
                "enabled": enabled,
                "slow": enabled and 0.0 < speed <= planned.speed,
                "fast": enabled and speed > planned.speed,
                "stopping": stopping,
            }[planned.phase]
            if not reached:
                continue
            if entry.passed < planned.after:
                entry.passed += 1
                continue
            self.waiting.remove(entry)
            self.command(planned.subindex, planned.value)

    def doubles(self) -> bool:
        """Whether this cycle's TPDOs are sent twice."""
        return bool(self.double_probability) and self.random.random() < self.double_probability

    def loses(self, cycle: int) -> bool:
        """Whether this cycle's TPDOs are lost."""
        if self.lose_probability and self.random.random() < self.lose_probability:
            return True
        return self._planned and cycle in self.settings.lose_cycles

    def delays(self, cycle: int) -> bool:
        """Whether this cycle's TPDOs come one cycle late."""
        if self.late_probability and self.random.random() < self.late_probability:
            return True
        return self._planned and cycle in self.settings.late_cycles

    def command(self, subindex: int, value: int) -> None:
        """What a write to object 0x2010 asks."""
        if subindex == COMMAND_EMERGENCY:
            self.emergency = value
        elif subindex == COMMAND_FREEZE:
            self.frozen = bool(value)
        elif subindex == COMMAND_HEARTBEAT:
            self.heartbeat_stopped = not value
        elif subindex == COMMAND_LOSE:
            self.lose_probability = value / 1000
        elif subindex == COMMAND_LATE:
            self.late_probability = value / 1000
        elif subindex == COMMAND_SATURATE:
            self.current_left = value / 1000
        elif subindex == COMMAND_GLITCH:
            self.glitch = value
        elif subindex == COMMAND_KEEP_MODE:
            self.keep_mode = bool(value)
        else:
            self._command_more(subindex, value)

    def _command_more(self, subindex: int, value: int) -> None:
        if subindex == COMMAND_FLIP_FEEDBACK:
            self.feedback_flips = bool(value)
        elif subindex == COMMAND_DISOBEY:
            self.disobeys = bool(value)
        elif subindex == COMMAND_RUN_AWAY:
            self.run_away = value
        elif subindex == COMMAND_CURRENT_STUCK:
            self.current_stuck = bool(value)
        elif subindex == COMMAND_DOUBLE:
            self.double_probability = value / 1000
        elif subindex == COMMAND_NMT:
            self.nmt_state = value
        elif subindex == COMMAND_FOREIGN_SYNC:
            self.foreign_syncs = value
        elif subindex == COMMAND_FOREIGN_SETPOINT:
            self.foreign_setpoint = value
        elif subindex == COMMAND_FOREIGN_NMT:
            self.foreign_nmt = value
        elif subindex == COMMAND_DEAF_TO_NMT:
            self.deaf_to_nmt = bool(value)
        elif subindex == COMMAND_RESTART:
            self.restarts = bool(value)
        elif subindex == COMMAND_STAND:
            self.feedback_stands = value
