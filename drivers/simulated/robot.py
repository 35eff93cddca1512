"""A serial robot of several coupled axes: rigid links, gears with friction that sticks, one motor per axis.

With y = coupling · q, the motor angles in joint turns, each gear stands alone:

    drive_j = gear_j(load_j, ẏ_j) + I_rotor,j ÿ_j        load = M_y ÿ + h_y
    (drivers.simulated.friction)

Every gear is in one of four states: driving, back-driving, between the flanks (load zero), or stuck (ÿ =
0). For given states the accelerations solve one linear system; states that contradict their own solution
are changed and the system solved again, which almost always ends at once because the states of the stride
before are the first guess.

Integration: drift-kick-drift (Störmer-Verlet) with one evaluation per stride at its middle, of second
order; the velocity that Coriolis and viscous torques need there is extrapolated. One evaluation costs some
100 µs, four of them for a Runge-Kutta stride would not fit a cycle. The acceleration is constant over a
stride, so that the moment at which an axis comes to rest is known exactly; the stride is cut there.
"""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from drivers.simulated.friction import GearFriction
from drivers.simulated.hidden_effects import AxisEffects, disturbed_gravity, disturbed_payload
from drivers.simulated.plant_settings import MountedPayload, RobotSettings, motor_inertia_at_joint
from drivers.simulated.rigid_bodies import Array, RigidBodies, pseudo_inertia

MOST_CHANGES = 24
"""changes of gear states tried before the last solution is taken; never seen above 6 with six axes"""


class Robot:
    """The mechanism behind the drives of a robot; all axes move in one simulated time."""

    def __init__(self, settings: RobotSettings, payload: MountedPayload | None = None) -> None:
        payload = payload or MountedPayload()
        axes = settings.axes
        n = self.axes = len(axes)
        mass, com = disturbed_payload(payload.mass, payload.com, settings.hidden_effects)
        spread = mass / payload.mass if payload.mass > 0.0 else 1.0
        inertia = tuple(spread * term for term in payload.inertia)
        xx, xy, xz, yy, yz, zz = inertia
        self.bodies = RigidBodies(
            settings.links,
            disturbed_gravity(settings.gravity, settings.hidden_effects),
            pseudo_inertia(mass, com, (xx, xy, xz, yy, yz, zz)),
        )
        self._coupling = np.eye(n) if settings.coupling is None else np.array(settings.coupling)
        self._uncoupling = np.asarray(np.linalg.inv(self._coupling), dtype=float)
        self._is_coupled = not np.array_equal(self._coupling, np.eye(n))
        self._ratio = np.array([axis.motor.gear_ratio for axis in axes])
        self._torque_per_ampere = self._ratio * np.array([axis.motor.torque_constant for axis in axes])
        self._noise = np.array([axis.motor.current_noise for axis in axes])
        self._resistance = np.array([axis.motor.winding_resistance for axis in axes])
        rotor = np.array([motor_inertia_at_joint(axis.motor) for axis in axes])
        in_load = np.array([axis.friction.rotor_in_load for axis in axes])
        self._rotor_in_load = np.diag(np.where(in_load, rotor, 0.0))
        self._rotor_apart = np.where(in_load, 0.0, rotor)
        self._identity = np.eye(n)
        friction = [axis.friction for axis in axes]
        self._gears = [GearFriction(gear) for gear in friction]
        self._viscous = np.array([gear.viscous for gear in friction])
        self._offset = np.array([gear.offset for gear in friction])
        self._inverse_stribeck = np.array([1.0 / gear.stribeck_velocity for gear in friction])
        self._columns = np.arange(n)
        # rows: back-driving, driving; columns: axes
        self._quadrant_sign = np.array([[-1.0], [1.0]])
        self._load_share = np.array(
            [[g.load_backdriving for g in friction], [g.load_driving for g in friction]]
        )
        self._load_stribeck = np.array(
            [[g.load_backdriving_stribeck for g in friction], [g.load_driving_stribeck for g in friction]]
        )
        self._dry = np.array([[g.dry_backdriving for g in friction], [g.dry_driving for g in friction]])
        self._dry_stribeck = np.array(
            [[g.dry_backdriving_stribeck for g in friction], [g.dry_driving_stribeck for g in friction]]
        )
        self._thermal_ambient = np.array([axis.thermal.ambient for axis in axes])
        self._heat_capacity = np.array([axis.thermal.heat_capacity for axis in axes])
        self._conductance = np.array([axis.thermal.conductance for axis in axes])
        self._effects = [
            AxisEffects([effect for effect in settings.hidden_effects if effect.joint == j + 1])
            for j in range(n)
        ]
        self._disturbed = [j for j in range(n) if any(e.joint == j + 1 for e in settings.hidden_effects)]
        self._longest_delay = max(effects.delay for effects in self._effects)
        self._longest = settings.longest_substep
        self._start = np.array([axis.start_position for axis in axes])
        self.reset(0)

    def reset(self, seed: int = 0) -> None:
        """Back to the start position, at rest and cold; the same seed gives the same noise and bursts."""
        n = self.axes
        self._random = np.random.default_rng(seed)
        for number, effect in enumerate(effect for effects in self._effects for effect in effects.stateful):
            effect.reset(seed + 7919 * (number + 1))
        self._time = 0.0
        self._temperature = self._thermal_ambient.copy()
        self._viscous_now = self._viscous.copy()
        self._asked: deque[tuple[float, Array]] = deque([(-np.inf, np.zeros(n))])
        self._friction_power = np.zeros(n)
        self.set_state(self._start, np.zeros(n))

    def set_state(self, position: Array, velocity: Array) -> None:
        """Put the joints somewhere, (n,) rad and rad/s."""
        self._y = self._coupling @ np.asarray(position, dtype=float)
        self._w = self._coupling @ np.asarray(velocity, dtype=float)
        self._acceleration = np.zeros(self.axes)
        self._quadrant = np.ones(self.axes, dtype=int)

    @property
    def motor_angle(self) -> Array:
        """(n,) rad"""
        return self._ratio * self._y

    @property
    def motor_velocity(self) -> Array:
        """(n,) rad/s"""
        return self._ratio * self._w

    @property
    def temperature(self) -> Array:
        """(n,) °C"""
        return self._temperature

    @property
    def joint_position(self) -> Array:
        """(n,) rad"""
        return self._uncoupling @ self._y

    @property
    def joint_velocity(self) -> Array:
        """(n,) rad/s"""
        return self._uncoupling @ self._w

    def step(self, motor_current: Array, duration: float) -> None:
        """Advance by `duration` (s) with the currents (n,), A, held."""
        current = np.asarray(motor_current, dtype=float)
        if self._noise.any():
            current = current + self._noise * self._random.standard_normal(self.axes)
        for j in self._disturbed:
            effects = self._effects[j]
            for stateful in effects.stateful:
                stateful.advance(self._time, duration, self._y[j])
            viscous = self._viscous[j]
            for factor in effects.viscous_factor:
                viscous *= factor(self._time, self._temperature[j])
            self._viscous_now[j] = viscous
        if self._longest_delay:
            self._asked.append((self._time, current))
            while len(self._asked) > 1 and self._asked[1][0] <= self._time - self._longest_delay:
                self._asked.popleft()
        now, end = self._time, self._time + duration
        while end - now > 1e-12:
            now += self._stride(self._acting(current, now), min(end - now, self._longest))
        self._time = end
        loss = self._friction_power + self._resistance * current * current
        cooling = self._conductance * (self._temperature - self._thermal_ambient)
        self._temperature = self._temperature + (loss - cooling) * (duration / self._heat_capacity)

    def _acting(self, current: Array, now: float) -> Array:
        """(n,) A: of every axis what was asked for its delay ago."""
        if not self._longest_delay:
            return current
        acting = current.copy()
        for j in self._disturbed:
            delay = self._effects[j].delay
            if delay:
                acting[j] = next(
                    asked[j] for time, asked in reversed(self._asked) if time <= now - delay + 1e-9
                )
        return acting

    def _stride(self, current: Array, h: float) -> float:
        """Move by at most h seconds, up to the next axis that comes to rest; returns the seconds."""
        y, w = self._y, self._w
        middle_y = y + (0.5 * h) * w
        middle_w = w + (0.5 * h) * self._acceleration
        acceleration = self._solve(current, middle_y, middle_w, w)
        end_w = w + h * acceleration
        reversing = (w * end_w < 0.0).nonzero()[0]
        if len(reversing):
            moments = -w[reversing] / acceleration[reversing]
            h = float(moments.min())
            end_w = w + h * acceleration
            end_w[reversing[moments <= h * (1.0 + 1e-9)]] = 0.0
        self._y = y + h * (w + (0.5 * h) * acceleration)
        self._w = end_w
        self._acceleration = np.where(end_w == 0.0, 0.0, acceleration)
        return h

    def _solve(self, current: Array, y: Array, w: Array, begin_w: Array) -> Array:
        """(n,) ÿ at the middle of a stride: position y, velocity w; begin_w says which axes are at rest."""
        mass, bias, drive, factor, extra = self._torques(current, y, w)
        e = np.exp(-np.abs(w) * self._inverse_stribeck)
        slopes = self._load_share + self._load_stribeck * e
        constants = self._dry + self._dry_stribeck * e
        if self._disturbed:
            slopes = factor * slopes
            constants = factor * constants + extra
        slopes = 1.0 + self._quadrant_sign * slopes
        direction = np.sign(begin_w)
        stuck = begin_w == 0.0
        rests = bool(
            stuck.any()
        )  # no axis comes to rest within a stride, so none is caught that was not let go in it
        between = np.zeros(self.axes, dtype=bool)
        columns = self._columns
        quadrant = self._quadrant
        flips = np.zeros(self.axes, dtype=int)
        released = np.zeros(self.axes, dtype=bool)
        acceleration, load = np.zeros(self.axes), np.zeros(self.axes)
        for _ in range(MOST_CHANGES):
            slope = slopes[quadrant, columns]
            left = slope[:, np.newaxis] * mass
            left[columns, columns] += self._rotor_apart
            right = drive - direction * constants[quadrant, columns] - slope * bias
            if between.any():
                left[between] = mass[between]
                right[between] = -bias[between]
            if rests:
                left[stuck] = self._identity[stuck]
                right[stuck] = 0.0
            acceleration = np.asarray(np.linalg.solve(left, right), dtype=float)
            load = mass @ acceleration + bias
            wrong = (load * direction >= 0.0) != (quadrant == 1)
            wrong &= ~(stuck | between)
            if wrong.any():
                flips[wrong] += 1
                between |= wrong & (flips > 2)
                quadrant = np.where(wrong & ~between, 1 - quadrant, quadrant)
                continue
            if not rests or not self._change_of_rest(
                drive, load, acceleration, factor, extra, stuck, released, direction
            ):
                break
            quadrant = np.where(load * direction >= 0.0, 1, 0)
        self._quadrant = quadrant
        against = drive - load - self._rotor_apart * acceleration + self._viscous_now * w
        self._friction_power = np.where(stuck, 0.0, against * w)
        return acceleration

    def _change_of_rest(
        self,
        drive: Array,
        load: Array,
        acceleration: Array,
        factor: Array,
        extra: Array,
        stuck: NDArray[np.bool_],
        released: NDArray[np.bool_],
        direction: Array,
    ) -> bool:
        """Let go the axis at rest that exceeds its stiction most, or catch one that was let go and would
        turn back.
        """
        back = released & ~stuck & (acceleration * direction < 0.0)
        if back.any():
            stuck[back] = True
            direction[back] = 0.0
            return True
        worst, excess, way = -1, 1e-9, 0.0
        for j in (stuck & ~released).nonzero()[0]:
            lower, upper = self._gears[j].stiction_limits(load[j], factor[j], extra[j])
            for beyond, sign in ((drive[j] - upper, 1.0), (lower - drive[j], -1.0)):
                if beyond > excess:
                    worst, excess, way = int(j), beyond, sign
        if worst < 0:
            return False
        stuck[worst], released[worst], direction[worst] = False, True, way
        return True

    def _torques(self, current: Array, y: Array, w: Array) -> tuple[Array, Array, Array, Array, Array]:
        """(M_y, h_y, drive less viscous friction, factor on dry friction, dry friction added)."""
        q = self._uncoupling @ y if self._is_coupled else y
        v = self._uncoupling @ w if self._is_coupled else w
        mass, bias = self.bodies.dynamics(q.tolist(), v)
        factor, extra = np.ones(self.axes), np.zeros(self.axes)
        for j in self._disturbed:
            for link_torque in self._effects[j].link_torque:
                bias[j] -= link_torque(q[j])
        if self._is_coupled:
            mass = self._uncoupling.T @ mass @ self._uncoupling
            bias = self._uncoupling.T @ bias
        mass = mass + self._rotor_in_load
        if self._disturbed:
            current = current.copy()
        for j in self._disturbed:
            motor_angle = self._ratio[j] * y[j]
            for effect in self._effects[j].current:
                current[j] = effect(current[j], motor_angle)
        drive = self._torque_per_ampere * current - self._offset - self._viscous_now * w
        for j in self._disturbed:
            effects = self._effects[j]
            for motor_torque in effects.motor_torque:
                drive[j] += motor_torque(y[j], self._ratio[j] * y[j])
            for viscous_torque in effects.viscous_torque:
                drive[j] -= viscous_torque(w[j])
            for dry_factor in effects.dry_factor:
                factor[j] *= dry_factor(y[j])
            for dry_torque in effects.dry_torque:
                extra[j] += dry_torque(y[j], abs(w[j]))
        return mass, bias, drive, factor, extra
