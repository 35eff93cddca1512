"""Settings of the simulated drives: the section `simulated` of a rig file, as far as the drives go."""

import math
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from drivers.simulated.compensation import CompensationSettings
from drivers.simulated.faults import FaultSettings
from drivers.simulated.oddities import OdditySettings


class ServoSettings(BaseModel):
    """The drive's cascade of position and velocity loop, on the motor shaft."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    position_gain: float = Field(default=40.0, gt=0, description="1/s: velocity reference per position error")
    velocity_gain: float = Field(
        default=1.0, gt=0, description="A s/rad: current reference per velocity error"
    )
    velocity_integral: float = Field(
        default=20.0, ge=0, description="A/rad: integral action of the velocity loop"
    )
    velocity_filter: float = Field(
        default=0.001, ge=0, description="s: time constant of the low-pass on the differentiated encoder"
    )


class SimulatedAxis(BaseModel):
    """One simulated drive with its motor's rating."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    node: int = Field(ge=1, le=127, description="CANopen node id")
    counts_per_turn: int = Field(default=65536, gt=0, description="encoder counts per turn of the motor")
    position_offset: int = Field(default=0, description="counts at motor angle zero")
    rated_current: float = Field(default=5.0, gt=0, description="A; object 0x6075 holds it in mA")
    rated_torque: float = Field(default=1.0, gt=0, description="N m; object 0x6076 holds it in mN m")
    current_limit: float = Field(
        default=3.0, gt=0, description="times the rated current; objects 0x6072 and 0x6073"
    )
    current_noise: float = Field(
        default=0.0, ge=0, description="A, standard deviation of current minus reference"
    )
    max_speed: float = Field(
        default=600.0, gt=0, description="rad/s of the motor; object 0x6080 holds it in rpm"
    )
    following_error: float = Field(
        default=0.5, gt=0, description="turns of the motor; object 0x6065 in counts"
    )
    following_error_time: float = Field(default=0.05, ge=0, le=65, description="s; object 0x6066 in ms")
    quick_stop_deceleration: float = Field(
        default=2000.0, gt=0, description="rad/s² of the motor; object 0x6085 in counts/s²"
    )
    brake: bool = Field(
        default=True,
        description="whether a holding brake closes when power is off; without one the axis coasts and falls",
    )
    brake_delay: float = Field(
        default=0.05, ge=0, description="s from power off in motion to the brake's closing"
    )
    brake_torque: float = Field(
        default=2.5, gt=0, description="times the rated torque; a closed brake slips above"
    )
    sync_loss: Literal["fault", "run-on"] = Field(
        default="fault",
        description="what the drive does after sync_timeout without SYNC: it stops with a fault, or goes on as it went",
    )
    servo: ServoSettings = ServoSettings()
    compensation: CompensationSettings = CompensationSettings()
    faults: FaultSettings = FaultSettings()
    oddities: OdditySettings = OdditySettings()

    @property
    def counts_per_radian(self) -> float:
        """Encoder counts per radian of the motor shaft."""
        return self.counts_per_turn / (2 * math.pi)

    @model_validator(mode="after")
    def _objects_can_hold_it(self) -> "SimulatedAxis":
        if round(self.current_limit * 1000) > 32767:
            raise ValueError("current_limit is beyond 32.767 times the rated current")
        return self


class SimulatedDrivesSettings(BaseModel):
    """All simulated drives of a rig, in the order of the mechanism's motors."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    axes: tuple[SimulatedAxis, ...] = Field(min_length=1)
    servo_period: float = Field(
        default=0.001, gt=0, le=0.01, description="s between two steps of the servo loop"
    )
    sync_timeout: float = Field(
        default=1.0, gt=0, description="s without SYNC, by the wall clock, after which moving drives stop"
    )
    run_on_after: float | None = Field(
        default=None,
        gt=0,
        description="s without SYNC, by the wall clock, from which the mechanism goes on in wall-clock time: a drive "
        "between two SYNCs follows the slope of its last setpoints. None where time is simulated and passes with SYNC",
    )
    seed: int = Field(default=1, description="of every random sequence; same seed, same numbers")

    @model_validator(mode="after")
    def _nodes_differ(self) -> "SimulatedDrivesSettings":
        nodes = [axis.node for axis in self.axes]
        if len(set(nodes)) != len(nodes):
            raise ValueError(f"every axis needs a node id of its own, not {nodes}")
        return self
