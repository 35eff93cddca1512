"""One joint whose transmission twists: the motor's inertia and the link on either end of a spring with play.

    I_rotor q̈_m = drive − gear(spring torque, q̇_m)
    I_link q̈  = spring torque − gravity + link-side torques

q_m is the motor's angle divided by the gear ratio; the encoder sees only that. The gear's friction acts on
the motor's side and its load is the torque in the spring, known from the positions, so that no implicit
equation has to be solved. Integration and stiction as in drivers.simulated.arm; the stride is shortened to
a fifteenth of the period of the spring's own oscillation.
"""

from math import copysign, pi, sqrt

from drivers.simulated.arm import Arm, share_until_rest
from drivers.simulated.hidden_effect_settings import Backlash, Elasticity
from drivers.simulated.plant_settings import ArmSettings, MountedPayload, motor_inertia_at_joint

TEETH_STIFFNESS = 4.0e5
"""N m/rad at the joint where only backlash is asked for: as stiff as the gears of robots of this size."""

TEETH_DAMPING = 200.0
"""N m s/rad at the joint where only backlash is asked for: flanks that meet do not ring for seconds."""


class ElasticArm(Arm):
    """The mechanism behind one simulated drive; the transmission twists and may have play."""

    def __init__(self, settings: ArmSettings, payload: MountedPayload | None = None) -> None:
        elasticity = next((e for e in settings.hidden_effects if isinstance(e, Elasticity)), None)
        backlash = next((e for e in settings.hidden_effects if isinstance(e, Backlash)), None)
        self._stiffness = elasticity.stiffness if elasticity else TEETH_STIFFNESS
        self._damping = elasticity.damping if elasticity else TEETH_DAMPING
        self._half_gap = 0.5 * backlash.gap if backlash else 0.0
        super().__init__(settings, payload)
        self._motor_inertia = motor_inertia_at_joint(settings.axis.motor)
        self._link_inertia = self.inertia - self._motor_inertia
        pulsation = sqrt(self._stiffness * (1.0 / self._motor_inertia + 1.0 / self._link_inertia))
        self._longest = min(self._longest, 2.0 * pi / pulsation / 15.0)

    def reset(self, seed: int = 0) -> None:
        """Back to the start position, at rest and cold; the link hangs where the spring carries it."""
        super().reset(seed)
        self._settle()

    def set_state(self, position: float, velocity: float = 0.0) -> None:
        """Put the motor somewhere, rad and rad/s at the joint; the link moves along, where the spring
        carries it.
        """
        super().set_state(position, velocity)
        self._settle()

    @property
    def joint_position(self) -> float:
        """rad, of the link"""
        return self._link_q

    @property
    def joint_velocity(self) -> float:
        """rad/s, of the link"""
        return self._link_v

    def _settle(self) -> None:
        """The link's angle at which the spring balances gravity, by fixed-point iteration: the spring is
        stiff.
        """
        self._link_v = self._v
        self._link_q = self._q
        for _ in range(50):
            load = self._static_load(self._link_q)
            self._link_q = (
                self._q - load / self._stiffness - (copysign(self._half_gap, load) if load else 0.0)
            )

    def _spring(self, twist: float, twist_rate: float) -> float:
        """N m that the transmission passes on: nothing within the gap, and flanks push, they do not pull."""
        if self._half_gap:
            if twist > self._half_gap:
                return max(0.0, self._stiffness * (twist - self._half_gap) + self._damping * twist_rate)
            if twist < -self._half_gap:
                return min(0.0, self._stiffness * (twist + self._half_gap) + self._damping * twist_rate)
            return 0.0
        return self._stiffness * twist + self._damping * twist_rate

    def _accelerations(
        self, current: float, q: float, v: float, link_q: float, link_v: float, direction: float
    ) -> tuple[float, float]:
        """rad/s² of motor and link; direction 0 where the motor sticks."""
        spring = self._spring(q - link_q, v - link_v)
        link = (spring - self._static_load(link_q)) / self._link_inertia
        if direction == 0.0:
            return 0.0, link
        drive = self._drive(current, q) - self._viscous_now * v
        for effect in self._effects.viscous_torque:
            drive -= effect(v)
        factor, extra = self._dry(q, abs(v))
        against = self._gear.torque(spring, abs(v), direction, 1.0, factor, extra)
        self._heat_flow = (against - spring + self._viscous_now * v) * v
        return (drive - against) / self._motor_inertia, link

    def _advance(self, current: float, duration: float) -> None:
        """Integrate with a constant current, from event to event."""
        remaining = duration
        while remaining > 1e-12:
            stride = min(remaining, self._longest)
            v = self._v
            direction = copysign(1.0, v) if v != 0.0 else self._motor_breakaway(current)
            if direction == 0.0:
                self._heat_flow = 0.0
            state = self._q, v, self._link_q, self._link_v
            first = self._accelerations(current, *state, direction=direction)
            end = self._elastic_stride(current, state, first, stride, direction)
            if end[1] * direction < 0.0:
                if v != 0.0:
                    stride *= share_until_rest(v, first[0] * stride, end[1])
                    end = self._elastic_stride(current, state, first, stride, direction)
                end = end[0], 0.0, end[2], end[3]
            self._q, self._v, self._link_q, self._link_v = end
            remaining -= stride

    def _elastic_stride(
        self,
        current: float,
        state: tuple[float, float, float, float],
        first: tuple[float, float],
        h: float,
        direction: float,
    ) -> tuple[float, float, float, float]:
        """One Runge-Kutta stride of h seconds; `first` are the accelerations at its start."""
        q, v, link_q, link_v = state
        a1, b1 = first
        half = 0.5 * h
        v2, w2 = v + half * a1, link_v + half * b1
        a2, b2 = self._accelerations(current, q + half * v, v2, link_q + half * link_v, w2, direction)
        v3, w3 = v + half * a2, link_v + half * b2
        a3, b3 = self._accelerations(current, q + half * v2, v3, link_q + half * w2, w3, direction)
        v4, w4 = v + h * a3, link_v + h * b3
        a4, b4 = self._accelerations(current, q + h * v3, v4, link_q + h * w3, w4, direction)
        sixth = h / 6.0
        return (
            q + sixth * (v + 2.0 * (v2 + v3) + v4),
            v + sixth * (a1 + 2.0 * (a2 + a3) + a4),
            link_q + sixth * (link_v + 2.0 * (w2 + w3) + w4),
            link_v + sixth * (b1 + 2.0 * (b2 + b3) + b4),
        )

    def _motor_breakaway(self, current: float) -> float:
        """At rest: +1 or -1, the direction in which the motor starts to slide, or 0 where it sticks."""
        load = self._spring(self._q - self._link_q, -self._link_v)
        factor, extra = self._dry(self._q, 0.0)
        lower, upper = self._gear.stiction_limits(load, factor, extra)
        drive = self._drive(current, self._q)
        return 1.0 if drive > upper else -1.0 if drive < lower else 0.0
