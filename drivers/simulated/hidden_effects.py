"""What a simulated axis does beside the textbook: each effect adds a small function to the place where it
acts.

An axis asks its `AxisEffects` at seven places: the current, torque on the motor's side of the gear, torque
on the link, dry friction added, dry friction multiplied, viscous friction by speed, and viscous friction by
time and temperature. A place without effects is an empty tuple and costs nothing.
"""

from collections.abc import Callable, Iterable
from math import cos, exp, sin, sqrt, tanh
from random import Random

from drivers.simulated import hidden_effect_settings as settings

Effect = settings.HiddenEffectSettings


class BrakeBursts:
    """A brake that drags in bursts whose beginnings and lengths are exponentially distributed."""

    def __init__(self, effect: settings.BrakeDrag) -> None:
        self._effect = effect
        self._random = Random(0)
        self._dragging = False
        self._until = 0.0

    def reset(self, seed: int) -> None:
        """Start anew; the same seed gives the same bursts."""
        self._random = Random(seed)
        self._dragging = False
        self._until = self._random.expovariate(1.0 / self._effect.mean_interval)

    def advance(self, time: float, duration: float, position: float) -> None:
        """Decide once per step whether the brake drags."""
        while time >= self._until:
            self._dragging = not self._dragging
            mean = self._effect.mean_duration if self._dragging else self._effect.mean_interval
            self._until += self._random.expovariate(1.0 / mean)

    def dry_torque(self, position: float, speed: float) -> float:
        """N m of dry friction now."""
        return self._effect.torque if self._dragging else 0.0


class ShiftingMass:
    """A mass on the link that slides from stop to stop when gravity across the link turns."""

    def __init__(self, effect: settings.LooseClamp, gravity: tuple[float, float]) -> None:
        self._effect = effect
        self._gravity = gravity
        self._shift = -effect.play

    def reset(self, seed: int) -> None:
        """Back against the lower stop."""
        self._shift = -self._effect.play

    def advance(self, time: float, duration: float, position: float) -> None:
        """Slide where gravity across the link overcomes the clamp's friction."""
        gx, gy = self._gravity
        across = gy * cos(position) - gx * sin(position)
        if abs(across) <= self._effect.friction * sqrt(gx * gx + gy * gy):
            return
        travel = 2.0 * self._effect.play * duration / self._effect.time_constant
        moved = self._shift + (travel if across > 0.0 else -travel)
        self._shift = max(-self._effect.play, min(self._effect.play, moved))

    def link_torque(self, position: float) -> float:
        """N m on the link: weight of the mass where it is now."""
        gx, gy = self._gravity
        c, s = cos(position), sin(position)
        x, y = self._effect.radius, self._shift
        return self._effect.mass * ((x * c - y * s) * gy - (x * s + y * c) * gx)


class AxisEffects:
    """The effects of one axis, sorted by the place where they act. All torques in N m at the joint."""

    def __init__(self, effects: Iterable[Effect], gravity_in_plane: tuple[float, float] = (0.0, 0.0)) -> None:
        current: list[Callable[[float, float], float]] = []
        motor_torque: list[Callable[[float, float], float]] = []
        link_torque: list[Callable[[float], float]] = []
        dry_torque: list[Callable[[float, float], float]] = []
        dry_factor: list[Callable[[float], float]] = []
        viscous_torque: list[Callable[[float], float]] = []
        viscous_factor: list[Callable[[float, float], float]] = []
        stateful: list[BrakeBursts | ShiftingMass] = []
        self.delay = 0.0
        self.presliding: settings.Presliding | None = None
        for effect in effects:
            match effect:
                case settings.DriveGain():
                    current.append(_drive_gain(effect))
                case settings.GainSaturation():
                    current.append(_gain_saturation(effect))
                case settings.CurrentRipple():
                    current.append(_current_ripple(effect))
                case settings.AmplifierDeadBand():
                    current.append(_dead_band(effect))
                case settings.Delay():
                    self.delay += effect.seconds
                case settings.Cogging():
                    motor_torque.append(_cogging(effect))
                case settings.TorqueRipple():
                    motor_torque.append(_torque_ripple(effect))
                case settings.JointSpring():
                    link_torque.append(_joint_spring(effect))
                case settings.GravitySpring():
                    link_torque.append(_gravity_spring(effect))
                case settings.CableSnag():
                    link_torque.append(_cable_pull(effect))
                    dry_torque.append(_cable_chafing(effect))
                case settings.LooseClamp():
                    mass = ShiftingMass(effect, gravity_in_plane)
                    stateful.append(mass)
                    link_torque.append(mass.link_torque)
                case settings.StickySpot():
                    dry_torque.append(_sticky_spot(effect))
                case settings.Stribeck():
                    dry_torque.append(_stribeck(effect))
                case settings.BrakeDrag():
                    bursts = BrakeBursts(effect)
                    stateful.append(bursts)
                    dry_torque.append(bursts.dry_torque)
                case settings.FrictionPosition():
                    dry_factor.append(_friction_position(effect))
                case settings.ViscousAsymmetric():
                    viscous_torque.append(_viscous_asymmetric(effect))
                case settings.ViscousQuadratic():
                    viscous_torque.append(_viscous_quadratic(effect))
                case settings.ViscousCubic():
                    viscous_torque.append(_viscous_cubic(effect))
                case settings.ViscousPower():
                    viscous_torque.append(_viscous_power(effect))
                case settings.FrictionWarmup():
                    viscous_factor.append(_warmup(effect))
                case settings.FrictionTemperature():
                    viscous_factor.append(_temperature(effect))
                case settings.Presliding():
                    self.presliding = effect
                case (
                    _
                ):  # the rest acts on the whole mechanism: tilt and payload below, elasticity in its own file
                    pass
        self.current = tuple(current)
        """(A, rad at the motor) -> A that gives torque"""
        self.motor_torque = tuple(motor_torque)
        """(q, motor angle) -> N m"""
        self.link_torque = tuple(link_torque)
        """(q) -> N m"""
        self.dry_torque = tuple(dry_torque)
        """(q, |q̇|) -> N m, never negative"""
        self.dry_factor = tuple(dry_factor)
        """(q) -> factor on the gear's dry friction"""
        self.viscous_torque = tuple(viscous_torque)
        """(q̇) -> N m against the motion"""
        self.viscous_factor = tuple(viscous_factor)
        """(s since reset, °C) -> factor on F_V"""
        self.stateful = tuple(stateful)


def disturbed_gravity(
    gravity: tuple[float, float, float], effects: Iterable[Effect]
) -> tuple[float, float, float]:
    """Gravity in the frame of a base that is tilted by `gravity-tilt`, m/s²."""
    x, y, z = gravity
    for effect in effects:
        if isinstance(effect, settings.GravityTilt):
            c, s = cos(effect.about_x), sin(effect.about_x)
            y, z = c * y - s * z, s * y + c * z
            c, s = cos(effect.about_y), sin(effect.about_y)
            x, z = c * x + s * z, c * z - s * x
            c, s = cos(effect.about_z), sin(effect.about_z)
            x, y = c * x - s * y, s * x + c * y
    return x, y, z


def disturbed_payload(
    mass: float, com: tuple[float, float, float], effects: Iterable[Effect]
) -> tuple[float, tuple[float, float, float]]:
    """True mass (kg) and centre of mass (m) of a payload that was entered as `mass` and `com`."""
    for effect in effects:
        if isinstance(effect, settings.PayloadMass):
            mass *= effect.factor
        elif isinstance(effect, settings.PayloadCom):
            com = (com[0] + effect.shift[0], com[1] + effect.shift[1], com[2] + effect.shift[2])
    return mass, com


def _drive_gain(effect: settings.DriveGain) -> Callable[[float, float], float]:
    return lambda current, motor_angle: effect.factor * current


def _gain_saturation(effect: settings.GainSaturation) -> Callable[[float, float], float]:
    limit = effect.limit
    return lambda current, motor_angle: limit * tanh(current / limit)


def _current_ripple(effect: settings.CurrentRipple) -> Callable[[float, float], float]:
    amplitude, order, phase = effect.amplitude, effect.order, effect.phase
    return lambda current, motor_angle: current * (1.0 + amplitude * sin(order * motor_angle + phase))


def _dead_band(effect: settings.AmplifierDeadBand) -> Callable[[float, float], float]:
    band = effect.band
    return lambda current, motor_angle: (
        0.0 if abs(current) <= band else current - band if current > 0.0 else current + band
    )


def _cogging(effect: settings.Cogging) -> Callable[[float, float], float]:
    amplitude, order, phase = effect.amplitude, effect.order, effect.phase
    return lambda position, motor_angle: amplitude * sin(order * motor_angle + phase)


def _torque_ripple(effect: settings.TorqueRipple) -> Callable[[float, float], float]:
    amplitude, order, phase = effect.amplitude, effect.order, effect.phase
    return lambda position, motor_angle: amplitude * sin(order * position + phase)


def _joint_spring(effect: settings.JointSpring) -> Callable[[float], float]:
    stiffness, rest = effect.stiffness, effect.rest
    return lambda position: -stiffness * (position - rest)


def _gravity_spring(effect: settings.GravitySpring) -> Callable[[float], float]:
    """Spring force times lever; the lever is a b sin φ / length in the triangle of the two pins and the
    axis.
    """
    a, b = effect.base_radius, effect.link_radius
    squares, product = a * a + b * b, a * b

    def torque(position: float) -> float:
        angle = position - effect.aligned_at
        length = sqrt(max(squares - 2.0 * product * cos(angle), 1e-12))
        return -effect.stiffness * (length - effect.free_length) * product * sin(angle) / length

    return torque


def _beyond(effect: settings.CableSnag, position: float) -> float:
    """rad past the angle where the cable comes tight, 0 before it."""
    return max(position - effect.beyond, 0.0) if effect.upwards else max(effect.beyond - position, 0.0)


def _cable_pull(effect: settings.CableSnag) -> Callable[[float], float]:
    pull = -effect.stiffness if effect.upwards else effect.stiffness
    return lambda position: pull * _beyond(effect, position)


def _cable_chafing(effect: settings.CableSnag) -> Callable[[float, float], float]:
    return lambda position, speed: effect.chafing * _beyond(effect, position)


def _sticky_spot(effect: settings.StickySpot) -> Callable[[float, float], float]:
    extra, centre, inverse_width = effect.extra, effect.centre, 1.0 / effect.width
    return lambda position, speed: extra * exp(-(((position - centre) * inverse_width) ** 2))


def _stribeck(effect: settings.Stribeck) -> Callable[[float, float], float]:
    extra, inverse_velocity = effect.extra, 1.0 / effect.velocity
    return lambda position, speed: extra * exp(-speed * inverse_velocity)


def _friction_position(effect: settings.FrictionPosition) -> Callable[[float], float]:
    amplitude, order, phase = effect.amplitude, effect.order, effect.phase
    return lambda position: 1.0 + amplitude * sin(order * position + phase)


def _viscous_asymmetric(effect: settings.ViscousAsymmetric) -> Callable[[float], float]:
    return lambda velocity: effect.difference * abs(velocity)


def _viscous_quadratic(effect: settings.ViscousQuadratic) -> Callable[[float], float]:
    return lambda velocity: effect.coefficient * velocity * abs(velocity)


def _viscous_cubic(effect: settings.ViscousCubic) -> Callable[[float], float]:
    return lambda velocity: effect.coefficient * velocity * velocity * velocity


def _viscous_power(effect: settings.ViscousPower) -> Callable[[float], float]:
    coefficient, exponent = effect.coefficient, effect.exponent

    def torque(velocity: float) -> float:
        magnitude = coefficient * abs(velocity) ** exponent
        return magnitude if velocity >= 0.0 else -magnitude

    return torque


def _warmup(effect: settings.FrictionWarmup) -> Callable[[float, float], float]:
    return lambda time, temperature: 1.0 + effect.excess * exp(-time / effect.time_constant)


def _temperature(effect: settings.FrictionTemperature) -> Callable[[float, float], float]:
    return lambda time, temperature: exp(-effect.coefficient * (temperature - effect.reference))
