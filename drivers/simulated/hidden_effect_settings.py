"""Which hidden effects a simulated axis can have, and their strengths, as an operator writes them in a rig
file.
"""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field


class _Effect(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    joint: int = Field(default=1, ge=1)
    """Number of the joint (of the motor, for what sits on the motor), from 1."""


class JointSpring(_Effect):
    """A spring between base and link: torque −stiffness · (q − rest)."""

    effect: Literal["joint-spring"]
    stiffness: float
    """N m/rad"""
    rest: float = 0.0
    """rad"""


class GravitySpring(_Effect):
    """A coil spring between a pin on the base and a pin on the link, as balancers of gravity have it."""

    effect: Literal["gravity-spring"]
    stiffness: float = Field(ge=0)
    """N/m"""
    base_radius: float = Field(gt=0)
    """m, from the joint's axis to the pin on the base."""
    link_radius: float = Field(gt=0)
    """m, from the joint's axis to the pin on the link."""
    free_length: float = Field(ge=0)
    """m"""
    aligned_at: float = 1.5707963267948966
    """rad, the joint angle at which the spring is shortest."""


class TorqueRipple(_Effect):
    """Torque of a gear that is not round: amplitude · sin(order · q + phase), at the motor's side."""

    effect: Literal["torque-ripple"]
    amplitude: float
    """N m at the joint"""
    order: float = Field(gt=0)
    """periods per joint turn"""
    phase: float = 0.0
    """rad"""


class Cogging(_Effect):
    """Torque of the magnets: amplitude · sin(order · motor angle + phase), with or without current."""

    effect: Literal["cogging"]
    amplitude: float
    """N m at the joint"""
    order: float = Field(gt=0)
    """periods per motor turn"""
    phase: float = 0.0
    """rad"""


class CurrentRipple(_Effect):
    """Torque constant that varies with the motor's angle: K_t · (1 + amplitude · sin(order · motor angle +
    phase)).
    """

    effect: Literal["current-ripple"]
    amplitude: float = Field(ge=0, lt=1)
    order: float = Field(gt=0)
    """periods per motor turn"""
    phase: float = 0.0
    """rad"""


class Elasticity(_Effect):
    """A transmission that twists: the link hangs on a spring with damping. The encoder sits on the motor."""

    effect: Literal["elasticity"]
    stiffness: float = Field(gt=0)
    """N m/rad at the joint"""
    damping: float = Field(default=0.0, ge=0)
    """N m s/rad"""


class Backlash(_Effect):
    """Play in the transmission: no torque until the gap is crossed. Without `elasticity` the teeth are
    stiff.
    """

    effect: Literal["backlash"]
    gap: float = Field(gt=0)
    """rad at the joint, from one flank to the other"""


class FrictionWarmup(_Effect):
    """Viscous friction that falls from power-on: F_V · (1 + excess · exp(−t / time_constant))."""

    effect: Literal["friction-warmup"]
    excess: float
    time_constant: float = Field(gt=0)
    """s"""


class FrictionTemperature(_Effect):
    """Viscous friction that follows the temperature: F_V · exp(−coefficient · (T − reference))."""

    effect: Literal["friction-temperature"]
    coefficient: float
    """1/K"""
    reference: float = 22.0
    """°C"""


class GainSaturation(_Effect):
    """Iron that saturates: torque-giving current = limit · tanh(current / limit)."""

    effect: Literal["gain-saturation"]
    limit: float = Field(gt=0)
    """A"""


class Delay(_Effect):
    """The current acts later than it was asked for."""

    effect: Literal["delay"]
    seconds: float = Field(gt=0, le=0.1)


class GravityTilt(_Effect):
    """A base that does not stand level: gravity is turned by these angles about x, then y, then z of the
    base.
    """

    effect: Literal["gravity-tilt"]
    about_x: float = 0.0
    """rad"""
    about_y: float = 0.0
    """rad"""
    about_z: float = 0.0
    """rad"""


class PayloadMass(_Effect):
    """The payload weighs something else than was entered: true mass = factor · mass."""

    effect: Literal["payload-mass"]
    factor: float = Field(gt=0)


class PayloadCom(_Effect):
    """The payload's centre of mass sits elsewhere than was entered."""

    effect: Literal["payload-com"]
    shift: tuple[float, float, float]
    """m, in the last link's frame"""


class StickySpot(_Effect):
    """A place where dry friction is higher: + extra · exp(−((q − centre) / width)²)."""

    effect: Literal["sticky-spot"]
    extra: float = Field(ge=0)
    """N m"""
    centre: float
    """rad"""
    width: float = Field(gt=0)
    """rad"""


class FrictionPosition(_Effect):
    """Dry friction that varies around the turn: times 1 + amplitude · sin(order · q + phase)."""

    effect: Literal["friction-position"]
    amplitude: float = Field(ge=0, lt=1)
    order: float = Field(default=1.0, gt=0)
    """periods per joint turn"""
    phase: float = 0.0
    """rad"""


class Stribeck(_Effect):
    """Dry friction that rises as the speed goes to zero: + extra · exp(−|q̇| / velocity), whatever the
    load.
    """

    effect: Literal["stribeck"]
    extra: float = Field(ge=0)
    """N m"""
    velocity: float = Field(gt=0)
    """rad/s"""


class ViscousAsymmetric(_Effect):
    """Viscous friction that differs by direction: + difference · |q̇|."""

    effect: Literal["viscous-asymmetric"]
    difference: float
    """N m s/rad"""


class ViscousQuadratic(_Effect):
    """+ coefficient · q̇ |q̇|"""

    effect: Literal["viscous-quadratic"]
    coefficient: float
    """N m s²/rad²"""


class ViscousCubic(_Effect):
    """+ coefficient · q̇³"""

    effect: Literal["viscous-cubic"]
    coefficient: float
    """N m s³/rad³"""


class ViscousPower(_Effect):
    """+ coefficient · |q̇|^exponent · sign(q̇)"""

    effect: Literal["viscous-power"]
    coefficient: float
    """N m (s/rad)^exponent"""
    exponent: float = Field(gt=0, le=3)


class Presliding(_Effect):
    """Dry friction that grows with displacement after a reversal, as asperities bend (Dahl's model,
    exponent 1).
    """

    effect: Literal["presliding"]
    displacement: float = Field(gt=0)
    """rad at the joint, over which friction turns around by 1 − 1/e"""
    damping: float = Field(default=0.0, ge=0)
    """N m s/rad, while asperities bend"""


class DriveGain(_Effect):
    """The drive gives another torque than its data sheet says: factor · K_t."""

    effect: Literal["drive-gain"]
    factor: float = Field(gt=0)


class CableSnag(_Effect):
    """A cable that comes tight beyond an angle, pulls back, and chafes on its way. In no catalogue."""

    effect: Literal["cable-snag"]
    beyond: float
    """rad"""
    stiffness: float = Field(ge=0)
    """N m/rad"""
    chafing: float = Field(default=0.0, ge=0)
    """N m/rad: dry friction per angle beyond"""
    upwards: bool = True
    """Whether it tightens above the angle (or below)."""


class BrakeDrag(_Effect):
    """A holding brake whose lining touches in random bursts. In no catalogue."""

    effect: Literal["brake-drag"]
    torque: float = Field(ge=0)
    """N m of dry friction while it drags"""
    mean_interval: float = Field(gt=0)
    """s between the end of a burst and the next, exponentially distributed"""
    mean_duration: float = Field(gt=0)
    """s of a burst, exponentially distributed"""


class LooseClamp(_Effect):
    """A payload that shifts in its clamp when the force across it turns. In no catalogue."""

    effect: Literal["loose-clamp"]
    mass: float = Field(ge=0)
    """kg that shifts"""
    radius: float
    """m from the joint's axis along x of the link"""
    play: float = Field(gt=0)
    """m from the middle to either stop, along y of the link"""
    friction: float = Field(default=0.15, ge=0)
    """coefficient of the clamp's friction: it slides where the force across exceeds this share of the
    weight
    """
    time_constant: float = Field(default=0.02, gt=0)
    """s of sliding from stop to stop"""


class AmplifierDeadBand(_Effect):
    """An amplifier that gives no current around zero: currents below the band are lost. In no catalogue."""

    effect: Literal["amplifier-dead-band"]
    band: float = Field(gt=0)
    """A"""


HiddenEffectSettings = Annotated[
    JointSpring
    | GravitySpring
    | TorqueRipple
    | Cogging
    | CurrentRipple
    | Elasticity
    | Backlash
    | FrictionWarmup
    | FrictionTemperature
    | GainSaturation
    | Delay
    | GravityTilt
    | PayloadMass
    | PayloadCom
    | StickySpot
    | FrictionPosition
    | Stribeck
    | ViscousAsymmetric
    | ViscousQuadratic
    | ViscousCubic
    | ViscousPower
    | Presliding
    | DriveGain
    | CableSnag
    | BrakeDrag
    | LooseClamp
    | AmplifierDeadBand,
    Field(discriminator="effect"),
]
