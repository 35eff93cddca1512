"""One joint with its arm under gravity: motor, rotor, gear with friction that sticks, link, payload.

    drive = N K_t i + motor-side torques − viscous − offset
    load  = J q̈ + gravity − link-side torques,    drive = gear(load, q̇) + I_rotor q̈

Integration: the classical Runge-Kutta method of fourth order between events, with the direction of friction
held through a stride. Within a stride the right-hand side is then smooth, which is what the method needs; a
stride at whose end the velocity has changed its sign is cut where it was zero. At rest the stiction limits
decide whether the joint sticks, exactly and without creep, or in which direction it breaks away. A friction
law smoothed by a steep tanh would creep under gravity and would be stiff. Plain floats: for one joint
arrays are ten times slower.
"""

from collections import deque
from collections.abc import Iterator
from math import copysign, cos, exp, sin, sqrt
from random import Random

import numpy as np

from drivers.simulated.friction import GearFriction
from drivers.simulated.hidden_effects import AxisEffects, disturbed_gravity, disturbed_payload
from drivers.simulated.plant_settings import ArmSettings, MountedPayload, motor_inertia_at_joint


class Arm:
    """The mechanism behind one simulated drive; the transmission is rigid.

    Currents in A, angles in rad, times in s. `step` takes some five microseconds.
    """

    axes = 1

    def __init__(self, settings: ArmSettings, payload: MountedPayload | None = None) -> None:
        payload = payload or MountedPayload()
        motor, friction = settings.axis.motor, settings.axis.friction
        mass, (x, y, _) = disturbed_payload(payload.mass, payload.com, settings.hidden_effects)
        spread = mass / payload.mass if payload.mass > 0.0 else 1.0
        link_inertia = settings.link.inertia + payload.inertia[5] * spread + mass * (x * x + y * y)
        rotor_inertia = motor_inertia_at_joint(motor)
        self.first_moment = (
            settings.link.first_moment[0] + mass * x,
            settings.link.first_moment[1] + mass * y,
        )
        """kg m: MX, MY of arm and payload"""
        self.inertia = link_inertia + rotor_inertia
        """kg m²: all that turns with the joint"""
        self._gx, self._gy, _ = disturbed_gravity(settings.gravity, settings.hidden_effects)
        self._load_inertia = self.inertia if friction.rotor_in_load else link_inertia
        self._rotor_inertia = 0.0 if friction.rotor_in_load else rotor_inertia
        self._ratio = motor.gear_ratio
        self._torque_per_ampere = motor.gear_ratio * motor.torque_constant
        self._current_noise = motor.current_noise
        self._resistance = motor.winding_resistance
        self._viscous = friction.viscous
        self._offset = friction.offset
        self._gear = GearFriction(friction)
        self._effects = AxisEffects(settings.hidden_effects, (self._gx, self._gy))
        self._thermal = settings.axis.thermal
        self._longest = settings.longest_substep
        self._start = settings.axis.start_position
        self.reset(0)

    def reset(self, seed: int = 0) -> None:
        """Back to the start position, at rest and cold; the same seed gives the same noise and bursts."""
        self._random = Random(seed)
        for number, effect in enumerate(self._effects.stateful):
            effect.reset(seed + 7919 * (number + 1))
        self._q = self._start
        self._v = 0.0
        self._time = 0.0
        self._temperature = self._thermal.ambient
        self._viscous_now = self._viscous
        self._bend = 0.0
        self._reversed_at = self._start
        self._heat_flow = 0.0
        self._pending: deque[tuple[float, float]] = deque()
        self._acting_current = 0.0

    @property
    def motor_angle(self) -> np.ndarray:
        """(1,) rad"""
        return np.array([self._q * self._ratio])

    @property
    def motor_velocity(self) -> np.ndarray:
        """(1,) rad/s"""
        return np.array([self._v * self._ratio])

    @property
    def temperature(self) -> np.ndarray:
        """(1,) °C"""
        return np.array([self._temperature])

    @property
    def joint_position(self) -> float:
        """rad"""
        return self._q

    @property
    def joint_velocity(self) -> float:
        """rad/s, exactly 0 while the joint sticks"""
        return self._v

    def set_state(self, position: float, velocity: float = 0.0) -> None:
        """Put the joint somewhere, rad and rad/s."""
        self._q, self._v = float(position), float(velocity)
        self._bend, self._reversed_at = 0.0, self._q

    def step(self, motor_current: np.ndarray, duration: float) -> None:
        """Advance by `duration` (s) with the current (1,), A, held."""
        current = float(motor_current[0])
        if self._current_noise:
            current += self._random.gauss(0.0, self._current_noise)
        effects = self._effects
        for effect in effects.stateful:
            effect.advance(self._time, duration, self._q)
        viscous = self._viscous
        for factor in effects.viscous_factor:
            viscous *= factor(self._time, self._temperature)
        self._viscous_now = viscous
        if effects.delay:
            for span, delayed in self._delayed(current, duration):
                self._advance(delayed, span)
        else:
            self._advance(current, duration)
        self._time += duration
        self._warm(current, duration)

    def _delayed(self, current: float, duration: float) -> Iterator[tuple[float, float]]:
        """(s, A) pieces of this step: what was asked for a delay ago."""
        pending = self._pending
        pending.append((self._time + self._effects.delay, current))
        now, end = self._time, self._time + duration
        while pending and pending[0][0] < end:
            switch, following = pending.popleft()
            if switch > now:
                yield switch - now, self._acting_current
                now = switch
            self._acting_current = following
        if end > now:
            yield end - now, self._acting_current

    def _warm(self, current: float, duration: float) -> None:
        """One lump of heat, with the losses in friction and winding as they were at the end of the step."""
        thermal = self._thermal
        loss = self._heat_flow + self._resistance * current * current
        cooling = thermal.conductance * (self._temperature - thermal.ambient)
        self._temperature += (loss - cooling) * duration / thermal.heat_capacity

    def _advance(self, current: float, duration: float) -> None:
        """Integrate with a constant current, from event to event."""
        remaining = duration
        longest = self._longest
        while remaining > 1e-12:
            stride = remaining if remaining <= longest else longest
            q, v = self._q, self._v
            if v == 0.0:
                direction = self._breakaway(current, q)
                if direction == 0.0:
                    self._heat_flow = 0.0
                    remaining -= stride
                    continue
            else:
                direction = copysign(1.0, v)
            a = self._acceleration(current, q, v, direction)
            q_end, v_end = self._stride(current, q, v, a, stride, direction)
            if v_end * direction <= 0.0:
                if v != 0.0:
                    stride *= share_until_rest(v, a * stride, v_end)
                    q_end, v_end = self._stride(current, q, v, a, stride, direction)
                    a_end = self._acceleration(current, q_end, v_end, direction)
                    if a_end * direction < 0.0:  # Newton: what is left of v is of third order
                        correction = max(-stride, min(-v_end / a_end, remaining - stride))
                        stride += correction
                        q_end += 0.5 * v_end * correction
                v_end = 0.0
            if self._effects.presliding is not None:
                self._bend = self._bent(q_end, direction)
                self._reversed_at = q_end
            self._q, self._v = q_end, v_end
            remaining -= stride

    def _stride(
        self, current: float, q: float, v: float, a: float, h: float, direction: float
    ) -> tuple[float, float]:
        """One Runge-Kutta stride of h seconds from (q, v), where the acceleration is a."""
        acceleration = self._acceleration
        half = 0.5 * h
        v2 = v + half * a
        a2 = acceleration(current, q + half * v, v2, direction)
        v3 = v + half * a2
        a3 = acceleration(current, q + half * v2, v3, direction)
        v4 = v + h * a3
        a4 = acceleration(current, q + h * v3, v4, direction)
        sixth = h / 6.0
        return q + sixth * (v + 2.0 * (v2 + v3) + v4), v + sixth * (a + 2.0 * (a2 + a3) + a4)

    def _drive(self, current: float, q: float) -> float:
        """N m at the joint on the motor's side, viscous friction apart."""
        effects = self._effects
        if effects.current or effects.motor_torque:
            motor_angle = q * self._ratio
            for effect in effects.current:
                current = effect(current, motor_angle)
            drive = self._torque_per_ampere * current - self._offset
            for effect in effects.motor_torque:
                drive += effect(q, motor_angle)
            return drive
        return self._torque_per_ampere * current - self._offset

    def _static_load(self, q: float) -> float:
        """N m of load without inertia: gravity less what pulls at the link."""
        c, s = cos(q), sin(q)
        mx, my = self.first_moment
        load = self._gx * (mx * s + my * c) - self._gy * (mx * c - my * s)
        for effect in self._effects.link_torque:
            load -= effect(q)
        return load

    def _dry(self, q: float, speed: float) -> tuple[float, float]:
        """(factor on, N m added to) the gear's dry friction."""
        factor, extra = 1.0, 0.0
        for effect in self._effects.dry_factor:
            factor *= effect(q)
        for effect in self._effects.dry_torque:
            extra += effect(q, speed)
        return factor, extra

    def _acceleration(self, current: float, q: float, v: float, direction: float) -> float:
        """rad/s² in sliding towards `direction`."""
        drive = self._drive(current, q) - self._viscous_now * v
        effects = self._effects
        for effect in effects.viscous_torque:
            drive -= effect(v)
        speed = v if v >= 0.0 else -v
        share, factor, extra = 1.0, 1.0, 0.0
        if effects.dry_factor or effects.dry_torque:
            factor, extra = self._dry(q, speed)
        if effects.presliding is not None:
            bend = self._bent(q, direction)
            drive -= effects.presliding.damping * (1.0 - bend * bend) * v
            direction, share = copysign(1.0, bend), abs(bend)
        acceleration, load = self._gear.acceleration(
            drive,
            self._static_load(q),
            self._load_inertia,
            self._rotor_inertia,
            speed,
            direction,
            share,
            factor,
            extra,
        )
        self._heat_flow = (drive - self._rotor_inertia * acceleration - load + self._viscous_now * v) * v
        return acceleration

    def _bent(self, q: float, direction: float) -> float:
        """How far the asperities are bent at q, -1..1: relaxes towards `direction` with the way since the
        last look.
        """
        assert self._effects.presliding is not None
        way = abs(q - self._reversed_at) / self._effects.presliding.displacement
        return direction - (direction - self._bend) * exp(-way)

    def _breakaway(self, current: float, q: float) -> float:
        """At rest: +1 or -1, the direction in which the joint starts to slide, or 0 where it sticks."""
        if self._effects.presliding is not None:
            # asperities bend at any torque: the joint follows the balance, there is no stiction
            acceleration = self._acceleration(current, q, 0.0, copysign(1.0, self._bend))
            return 0.0 if abs(acceleration) < 1e-9 else copysign(1.0, acceleration)
        drive = self._drive(current, q)
        factor, extra = self._dry(q, 0.0)
        lower, upper = self._gear.stiction_limits(self._static_load(q), factor, extra)
        return 1.0 if drive > upper else -1.0 if drive < lower else 0.0


def share_until_rest(v: float, linear: float, v_end: float) -> float:
    """Share θ of a stride after which a velocity that starts at v and ends beyond zero at v_end is zero.

    v(θ) ≈ v + linear θ + (v_end − v − linear) θ², where linear is the first acceleration times the stride;
    of the two roots the one in (0, 1], in the form that does not cancel.
    """
    discriminant = max(linear * linear - 4.0 * (v_end - v - linear) * v, 0.0)
    return min(1.0, max(0.0, -2.0 * v / (linear - copysign(sqrt(discriminant), v))))
