"""Where a drive keeps the gains of its own position controller, as the section `servo` of a profile says it.

Two structures are known. A *cascade*: the position error times a gain, and a share of the commanded speed, are the speed that a
PI controller follows. A *PID*: the position error, its integral and its derivative, with feed-forward of speed and acceleration,
are the current. Both are linear, so that each is a `ServoLaw` of position error and speeds. What a drive has beside that
(filters, observers, anti-windup, gains that change with the speed) is no part of the law; a profile says so in its `remarks`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from drivers.object_kinds import ObjectType

GainUnit = Literal["1", "s", "1/s", "A/rad", "A s/rad", "A s²/rad", "A/(rad s)"]
"""of the motor's shaft, in rad; "1" is a share"""


class GainObject(BaseModel):
    """One gain: gain = scale · raw."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    index: int = Field(ge=0x1000, le=0xFFFF, description="index, e.g. 0x30A1")
    subindex: int = Field(default=0, ge=0, le=0xFE)
    type: ObjectType = Field(description="type of the raw value")
    scale: float = Field(gt=0, description="unit per raw count")
    unit: GainUnit
    source: str = Field(description="manual's name and section")

    def __str__(self) -> str:
        return f"0x{self.index:04X}:{self.subindex:02X}"


Read = Callable[[str, GainObject], float]
"""the value of a gain, by its name in the profile and its object; in the object's unit"""


@dataclass(frozen=True)
class ServoLaw:
    """Current of one motor as a linear law of its own position q, in A, rad of the shaft, and s.

    i = position · e + integral · ∫e dt + reference_velocity · q̇_ref + reference_acceleration · q̈_ref − velocity · q̇
        + reference_travel · (q_ref − q_ref at the beginning) + a constant, with e = q_ref − q
    """

    position: float
    integral: float
    velocity: float
    reference_velocity: float
    reference_acceleration: float = 0.0
    reference_travel: float = 0.0


class _Servo(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")

    remarks: tuple[str, ...] = Field(
        default=(), description="what of the drive's controller is not in these gains"
    )

    def _required(self, **units: tuple[GainUnit, ...]) -> None:
        for name, allowed in units.items():
            gain = getattr(self, name)
            if isinstance(gain, GainObject) and gain.unit not in allowed:
                raise ValueError(f"{name}: must be in {' or '.join(allowed)}, not {gain.unit}")


class CascadeObjects(_Servo):
    """A position controller (P) above a velocity controller (PI)."""

    structure: Literal["cascade"]
    position_gain: GainObject = Field(description="1/s: speed per position error")
    velocity_gain: GainObject = Field(description="A s/rad: current per error of speed")
    velocity_integral: GainObject = Field(
        description="A/rad, or the integral time in s: velocity_gain over it is the gain of the integral"
    )
    velocity_feed_forward: GainObject | Annotated[float, Field(ge=0)] = Field(
        description="share of the commanded speed that is added to the speed to follow; a number where it cannot be set"
    )
    velocity_filter: GainObject | None = Field(
        default=None, description="s: time constant of the low-pass on the measured speed; read to be said"
    )

    def model_post_init(self, context: object) -> None:
        """Units are those of the gains."""
        self._required(
            position_gain=("1/s",),
            velocity_gain=("A s/rad",),
            velocity_integral=("A/rad", "s"),
            velocity_feed_forward=("1",),
            velocity_filter=("s",),
        )

    def law(self, read: Read) -> ServoLaw:
        """The cascade as one law: i = K_v w + K_i ∫w dt with w = K_p e + f q̇_ref − q̇."""
        stiffness = read("position_gain", self.position_gain)
        damping = read("velocity_gain", self.velocity_gain)
        integral = read("velocity_integral", self.velocity_integral)
        if self.velocity_integral.unit == "s":
            integral = damping / integral if integral > 0.0 else 0.0
        share = self.velocity_feed_forward
        if isinstance(share, GainObject):
            share = read("velocity_feed_forward", share)
        return ServoLaw(
            position=damping * stiffness + integral,
            integral=integral * stiffness,
            velocity=damping,
            reference_velocity=share * damping,
            reference_travel=(share - 1.0) * integral,
        )

    def beside(self, read: Read) -> tuple[str, ...]:
        """What the drive does that is not in the law, with its value where it is read."""
        if self.velocity_filter is None:
            return self.remarks
        time = read("velocity_filter", self.velocity_filter)
        if not time:
            return self.remarks
        return (f"the low-pass of {1e3 * time:g} ms on the measured speed", *self.remarks)


class PidObjects(_Servo):
    """A PID controller of the position, whose output is the current."""

    structure: Literal["pid"]
    position_gain: GainObject = Field(description="A/rad: current per position error")
    integral_gain: GainObject = Field(description="A/(rad s): current per integral of the position error")
    derivative_gain: GainObject = Field(description="A s/rad: current per derivative of the position error")
    velocity_feed_forward: GainObject | None = Field(
        default=None, description="A s/rad of the commanded speed"
    )
    acceleration_feed_forward: GainObject | None = Field(
        default=None, description="A s²/rad of the commanded acceleration"
    )

    def model_post_init(self, context: object) -> None:
        """Units are those of the gains."""
        self._required(
            position_gain=("A/rad",),
            integral_gain=("A/(rad s)",),
            derivative_gain=("A s/rad",),
            velocity_feed_forward=("A s/rad",),
            acceleration_feed_forward=("A s²/rad",),
        )

    def law(self, read: Read) -> ServoLaw:
        """The derivative of the error is that of the reference less that of the position."""
        derivative = read("derivative_gain", self.derivative_gain)
        ahead = self.velocity_feed_forward
        inertia = self.acceleration_feed_forward
        return ServoLaw(
            position=read("position_gain", self.position_gain),
            integral=read("integral_gain", self.integral_gain),
            velocity=derivative,
            reference_velocity=derivative + (0.0 if ahead is None else read("velocity_feed_forward", ahead)),
            reference_acceleration=0.0 if inertia is None else read("acceleration_feed_forward", inertia),
        )

    def beside(self, read: Read) -> tuple[str, ...]:
        """What the drive does that is not in the law."""
        return self.remarks


ServoObjects = Annotated[CascadeObjects | PidObjects, Field(discriminator="structure")]
