"""The servo loop of a simulated drive: cascade of position (P) and velocity (PI), feed-forward, current
limit.

The gains are objects of the drive (0x2030 to 0x2033 of simulated.eds): what these hold is what the loops use.
All in counts of the encoder and seconds; currents in A. A real drive sees its shaft only through the encoder,
and so does this one: the velocity is the difference of quantised positions behind a low-pass.
"""

import math

from drivers.simulated.settings import SimulatedAxis

POSITION_GAIN, VELOCITY_GAIN, VELOCITY_INTEGRAL, VELOCITY_FILTER = 0x2030, 0x2031, 0x2032, 0x2033
_COUNTS_PER_UNIT = {POSITION_GAIN: 1e3, VELOCITY_GAIN: 1e6, VELOCITY_INTEGRAL: 1e6, VELOCITY_FILTER: 1e6}
"""raw counts per 1/s, A s/rad, A/rad and s"""


class Servo:
    """Loops of one axis; `axis` holds the gains that stand in its objects when it is switched on."""

    def __init__(self, axis: SimulatedAxis):
        gains = axis.servo
        self._per_count = 1.0 / axis.counts_per_radian
        values = {
            POSITION_GAIN: gains.position_gain,
            VELOCITY_GAIN: gains.velocity_gain,
            VELOCITY_INTEGRAL: gains.velocity_integral,
            VELOCITY_FILTER: gains.velocity_filter,
        }
        self.raw = {index: round(value * _COUNTS_PER_UNIT[index]) for index, value in values.items()}
        """the gain objects"""
        self.take_gains()
        self.max_speed = axis.max_speed * axis.counts_per_radian  # counts/s
        self.velocity = 0.0  # counts/s, as the drive believes
        self.limited = False
        self._integral = 0.0  # A
        self._last_position: int | None = None

    def take_gains(self) -> None:
        """The raw objects have changed."""
        gain = {index: raw / _COUNTS_PER_UNIT[index] for index, raw in self.raw.items()}
        self._position_gain = gain[POSITION_GAIN]  # 1/s
        self._velocity_gain = gain[VELOCITY_GAIN] * self._per_count  # A s/count
        self._velocity_integral = gain[VELOCITY_INTEGRAL] * self._per_count  # A/count
        self._filter_time = gain[VELOCITY_FILTER]

    def reset(self, current: float = 0.0) -> None:
        """Forget the past; `current` (A) is where the integrator starts."""
        self._integral = current
        self.limited = False

    def stand_by(self, current: float) -> None:
        """Somebody else's loop commands the current (A): the integrator keeps up, so that taking over is no jump."""
        self._integral = current

    def look_anew(self, velocity: float) -> None:
        """What is observed from now on has another zero or direction; `velocity` (counts/s) goes on there."""
        self._last_position = None
        self.velocity = velocity
        self._integral = 0.0

    def shift(self, counts: int) -> None:
        """The zero of the position has moved by `counts`."""
        if self._last_position is not None:
            self._last_position += counts

    def observe(self, position: int, duration: float) -> None:
        """Take the encoder's position (counts), `duration` s after the last."""
        last = self._last_position
        self._last_position = position
        if last is None:
            return
        difference = (position - last) / duration
        time = self._filter_time
        weight = 1.0 if time <= 0.0 else 1.0 - math.exp(-duration / time)
        self.velocity += weight * (difference - self.velocity)

    def follow_position(
        self,
        demand: float,
        feed_forward: float,
        position: int,
        limit: float,
        duration: float,
        added: float = 0.0,
    ) -> float:
        """Current (A) that follows a position demand (counts) moving with feed_forward (counts/s).

        added : A, beside what the loops ask for
        """
        reference = self._position_gain * (demand - position) + feed_forward
        return self.follow_velocity(reference, limit, duration, added)

    def follow_velocity(self, reference: float, limit: float, duration: float, added: float = 0.0) -> float:
        """Current (A) that follows a velocity reference (counts/s), within ±limit; `added` (A) beside it."""
        top = self.max_speed
        if reference > top:
            reference = top
        elif reference < -top:
            reference = -top
        error = reference - self.velocity
        integral = self._integral + self._velocity_integral * error * duration
        current = self._velocity_gain * error + integral + added
        if current > limit:
            self.limited = True
            # The integrator waits while the limit is in force, unless the error lets it come back.
            if error < 0.0:
                self._integral = integral
            return limit
        if current < -limit:
            self.limited = True
            if error > 0.0:
                self._integral = integral
            return -limit
        self.limited = False
        self._integral = integral
        return current
