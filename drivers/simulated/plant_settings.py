"""Settings of the simulated mechanism: the section `simulated:` of a rig file.

They are the truth behind the simulated drives. The rig's own section `robot:` is what the operator
believes; nothing here is read from there, so that the two can disagree, as they do on a real machine.
"""

import math
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from drivers.simulated.hidden_effect_settings import HiddenEffectSettings

Vector3 = tuple[float, float, float]
Inertia = tuple[float, float, float, float, float, float]


class Settings(BaseModel):
    """A frozen section of the file in which an unknown key is a mistake."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class MotorSettings(Settings):
    """Motor and amplifier of one axis."""

    gear_ratio: float
    """Motor turns per joint turn, N of eq. (4); negative where the motor turns the other way."""
    torque_constant: float = Field(gt=0)
    """N m/A on the motor shaft, K_t of eq. (4)."""
    rotor_inertia: float = Field(default=0.0, ge=0)
    """kg m² on the motor shaft; Ia of the joint is gear_ratio² times this."""
    winding_resistance: float = Field(default=0.0, ge=0)
    """Ω, three phases taken together, for the heat: loss = resistance · current²."""
    current_noise: float = Field(default=0.0, ge=0)
    """A, standard deviation of what the amplifier adds to the current that was asked for, new every step."""

    @model_validator(mode="after")
    def _ratio_is_not_zero(self) -> Self:
        if self.gear_ratio == 0.0:
            raise ValueError("gear_ratio must not be 0")
        return self


class FrictionSettings(Settings):
    """Friction of one gear in joint space: eq. (25) with a_m = 1 + load_driving and a_g = 1 −
    load_backdriving.
    """

    viscous: float = Field(default=0.0, ge=0)
    """N m s/rad, F_V."""
    offset: float = 0.0
    """N m, τ_off."""
    dry_driving: float = Field(default=0.0, ge=0)
    """N m, c_m: dry friction in sliding while the motor drives the load."""
    dry_driving_stribeck: float = Field(default=0.0, ge=0)
    """N m, d_m: what comes on top of c_m as the speed goes to zero."""
    dry_backdriving: float = Field(default=0.0, ge=0)
    """N m, c_g: dry friction in sliding while the load drives the motor."""
    dry_backdriving_stribeck: float = Field(default=0.0, ge=0)
    """N m, d_g."""
    load_driving: float = Field(default=0.0, ge=0)
    """α_m: share of the load lost in sliding while the motor drives."""
    load_driving_stribeck: float = Field(default=0.0, ge=0)
    """b_m: share of the load that is lost on top as the speed goes to zero."""
    load_backdriving: float = Field(default=0.0, ge=0)
    """α_g: share of the load lost while the load drives."""
    load_backdriving_stribeck: float = Field(default=0.0, ge=0)
    """b_g."""
    stribeck_velocity: float = Field(default=0.03, gt=0)
    """rad/s, the constant of the exponential in eq. (24)."""
    rotor_in_load: bool = True
    """Whether the rotor's inertia counts to the load of the gear, as in the paper (τ_dyn of eq. 2 holds Ia).

    In a real gear the teeth carry the link's share only: false."""

    @model_validator(mode="after")
    def _solvable(self) -> Self:
        if self.load_backdriving + self.load_backdriving_stribeck >= 1.0:
            raise ValueError(
                "load_backdriving + load_backdriving_stribeck must stay below 1: such a gear locks itself"
            )
        if (
            self.dry_driving < self.dry_backdriving
            or self.dry_driving + self.dry_driving_stribeck
            < self.dry_backdriving + self.dry_backdriving_stribeck
        ):
            raise ValueError(
                "dry friction in driving must be at least that in back-driving "
                "(c_m >= c_g, c_m + d_m >= c_g + d_g): otherwise two accelerations answer the same torque"
            )
        return self


class ThermalSettings(Settings):
    """Gearbox and motor as one lump of heat."""

    ambient: float = 22.0
    """°C; the temperature after a reset."""
    heat_capacity: float = Field(default=8000.0, gt=0)
    """J/K."""
    conductance: float = Field(default=4.0, ge=0)
    """W/K to the surroundings."""


class AxisSettings(Settings):
    """One motor with its gear."""

    motor: MotorSettings
    friction: FrictionSettings = FrictionSettings()
    thermal: ThermalSettings = ThermalSettings()
    start_position: float = 0.0
    """rad, joint angle after a reset."""


class MountedPayload(Settings):
    """What hangs on the last link: mass, centre of mass in the link's frame, inertia about the centre of
    mass.
    """

    mass: float = Field(default=0.0, ge=0)
    """kg"""
    com: Vector3 = (0.0, 0.0, 0.0)
    """m"""
    inertia: Inertia = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    """kg m²: XX XY XZ YY YZ ZZ"""


class PlanarLinkSettings(Settings):
    """The one link of the arm, about its joint's axis z."""

    inertia: float = Field(gt=0)
    """kg m², ZZ about the joint's axis, rotor not included."""
    first_moment: tuple[float, float] = (0.0, 0.0)
    """kg m: MX, MY in the link's frame."""


class ArmSettings(Settings):
    """One joint with its arm; the axis is z of the base frame."""

    kind: Literal["arm"] = "arm"
    gravity: Vector3 = (0.0, -9.81, 0.0)
    """m/s² in the base frame."""
    link: PlanarLinkSettings
    axis: AxisSettings
    hidden_effects: tuple[HiddenEffectSettings, ...] = ()
    longest_substep: float = Field(default=1e-3, gt=0, le=0.01)
    """s, the integrator never takes a longer stride."""

    @model_validator(mode="after")
    def _effects_fit(self) -> Self:
        names = [effect.effect for effect in self.hidden_effects]
        for name in ("elasticity", "backlash", "presliding", "delay"):
            if names.count(name) > 1:
                raise ValueError(f"hidden effect {name} can be there once")
        if "presliding" in names and ("elasticity" in names or "backlash" in names):
            raise ValueError("hidden effect presliding cannot be combined with elasticity or backlash")
        if ("elasticity" in names or "backlash" in names) and self.axis.motor.rotor_inertia <= 0.0:
            raise ValueError(
                "elasticity and backlash need a rotor with inertia: axis.motor.rotor_inertia above 0"
            )
        if any(effect.joint != 1 for effect in self.hidden_effects):
            raise ValueError("hidden effects of an arm have joint 1")
        return self


class LinkSettings(Settings):
    """One link of a robot: where its joint sits and what mass it has."""

    alpha: float = 0.0
    """rad, modified Denavit-Hartenberg, frame j in frame j−1."""
    d: float = 0.0
    """m"""
    theta: float = 0.0
    """rad, added to the joint's angle."""
    r: float = 0.0
    """m"""
    mass: float = Field(gt=0)
    """kg"""
    com: Vector3 = (0.0, 0.0, 0.0)
    """m, in the link's frame."""
    inertia: Inertia
    """kg m² about the centre of mass: XX XY XZ YY YZ ZZ."""


class RobotSettings(Settings):
    """A serial robot with revolute joints."""

    kind: Literal["robot"] = "robot"
    gravity: Vector3 = (0.0, 0.0, -9.81)
    """m/s² in the base frame."""
    links: tuple[LinkSettings, ...] = Field(min_length=1)
    axes: tuple[AxisSettings, ...] = Field(min_length=1)
    coupling: tuple[tuple[float, ...], ...] | None = None
    """Motor angles in joint turns per joint angle, n x n; motor angle = gear_ratio · (coupling · q).

    The identity where left out; a wrist whose last motor turns with two joints has a second 1 in its row."""
    hidden_effects: tuple[HiddenEffectSettings, ...] = ()
    longest_substep: float = Field(default=1e-3, gt=0, le=0.01)
    """s, the integrator never takes a longer stride."""

    @model_validator(mode="after")
    def _shapes(self) -> Self:
        n = len(self.links)
        if len(self.axes) != n:
            raise ValueError(f"{n} links need {n} axes, not {len(self.axes)}")
        if self.coupling is not None and (
            len(self.coupling) != n or any(len(row) != n for row in self.coupling)
        ):
            raise ValueError(f"coupling must be a {n} x {n} matrix")
        for effect in self.hidden_effects:
            if not 1 <= effect.joint <= n:
                raise ValueError(f"hidden effect {effect.effect}: joint {effect.joint} of {n}")
            if effect.effect in ("elasticity", "backlash", "presliding", "loose-clamp"):
                raise ValueError(f"hidden effect {effect.effect} is there for an arm only, not for a robot")
        return self


PlantSettings = Annotated[ArmSettings | RobotSettings, Field(discriminator="kind")]


def motor_inertia_at_joint(motor: MotorSettings) -> float:
    """Rotor inertia seen from the joint, kg m²: Ia of the paper's standard parameters."""
    return math.pow(motor.gear_ratio, 2) * motor.rotor_inertia
