"""What can go wrong on purpose: losses, delays and failures of a simulated drive, planned or on command.

A plan (`FaultSettings`) counts cycles: SYNCs since the node became OPERATIONAL, from 0. The same faults can
be commanded while it runs, from Python (`Faults`) or by SDO through object 0x2010, so that a test may
command a drive in another process.
"""

import random

from pydantic import BaseModel, ConfigDict, Field


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


# Subindices of object 0x2010, "fault command"; writing a value commands the fault.
COMMAND_EMERGENCY = 1  # error code
COMMAND_FREEZE = 2  # 1
COMMAND_HEARTBEAT = 3  # 0 stops it, 1 lets it go on
COMMAND_LOSE = 4  # per mille
COMMAND_LATE = 5  # per mille
COMMAND_SATURATE = 6  # per mille of the current limit that is left
COMMAND_GLITCH = 7  # counts, in the next cycle
COMMAND_KEEP_MODE = 8  # 1: mode switches are taken and ignored, as some drives do


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
