"""Dry friction of a gear by load, speed and quadrant (driving or back-driving): eq. (20)-(25).

The torque that the motor must bring for a load torque L while the joint moves in direction s (+1 or -1) is

    driving,      L s > 0:  τ = (1 + α_m + b_m e) L + s (c_m + d_m e)
    back-driving, L s < 0:  τ = (1 − α_g − b_g e) L + s (c_g + d_g e)        e = exp(−|q̇| / q̇_s)

viscous friction and offset apart. At L = 0 every torque from s c_g to s c_m is in balance.
"""

from math import exp

from drivers.simulated.plant_settings import FrictionSettings


class GearFriction:
    """Eq. (25) read in both directions: torque from load, and acceleration from torque."""

    __slots__ = ("_backdriving", "_driving", "_inverse_stribeck")

    def __init__(self, settings: FrictionSettings) -> None:
        self._driving = (
            settings.load_driving,
            settings.load_driving_stribeck,
            settings.dry_driving,
            settings.dry_driving_stribeck,
        )
        self._backdriving = (
            settings.load_backdriving,
            settings.load_backdriving_stribeck,
            settings.dry_backdriving,
            settings.dry_backdriving_stribeck,
        )
        self._inverse_stribeck = 1.0 / settings.stribeck_velocity

    def torque(
        self,
        load: float,
        speed: float,
        direction: float,
        share: float = 1.0,
        factor: float = 1.0,
        extra: float = 0.0,
    ) -> float:
        """Motor torque in joint space (N m) that balances `load` in sliding towards `direction`.

        speed     : |q̇|, rad/s
        direction : +1 or -1, where friction's motion goes
        share     : 0..1, how much of dry friction acts (below 1 while asperities bend)
        factor    : multiplies dry friction (position, temperature)
        extra     : N m of dry friction that does not depend on the load
        """
        e = exp(-speed * self._inverse_stribeck)
        if load * direction >= 0.0:
            a, b, c, d = self._driving
            return load + direction * share * (factor * ((a + b * e) * abs(load) + c + d * e) + extra)
        a, b, c, d = self._backdriving
        return load + direction * share * (factor * ((a + b * e) * abs(load) + c + d * e) + extra)

    def acceleration(
        self,
        drive: float,
        static_load: float,
        load_inertia: float,
        rotor_inertia: float,
        speed: float,
        direction: float,
        share: float = 1.0,
        factor: float = 1.0,
        extra: float = 0.0,
    ) -> tuple[float, float]:
        """Joint acceleration (rad/s²) and load (N m) under the motor torque `drive` in sliding.

        The load is load_inertia · q̈ + static_load, and the torque that turns the rotor, rotor_inertia ·
        q̈, passes no gear. Load and acceleration depend on each other through the quadrant; each quadrant
        is tried, and where neither answers the load is zero (teeth between flanks, friction somewhere
        between c_g and c_m).
        """
        e = exp(-speed * self._inverse_stribeck)
        weight = direction * share
        a, b, c, d = self._driving
        slope = 1.0 + share * factor * (a + b * e)
        acceleration = (drive - weight * (factor * (c + d * e) + extra) - slope * static_load) / (
            slope * load_inertia + rotor_inertia
        )
        load = load_inertia * acceleration + static_load
        if load * direction >= 0.0:
            return acceleration, load
        a, b, c, d = self._backdriving
        slope = 1.0 - share * factor * (a + b * e)
        acceleration = (drive - weight * (factor * (c + d * e) + extra) - slope * static_load) / (
            slope * load_inertia + rotor_inertia
        )
        load = load_inertia * acceleration + static_load
        if load * direction <= 0.0:
            return acceleration, load
        return -static_load / load_inertia, 0.0

    def stiction_limits(self, load: float, factor: float = 1.0, extra: float = 0.0) -> tuple[float, float]:
        """Motor torques (N m) between which a gear at rest under `load` stays at rest: the limits of eq.
        (25) at rest.
        """
        a, b, c, d = self._driving
        driving = factor * ((a + b) * abs(load) + c + d) + extra
        a, b, c, d = self._backdriving
        backdriving = factor * ((a + b) * abs(load) + c + d) + extra
        if load > 0.0:
            return load - backdriving, load + driving
        if load < 0.0:
            return load - driving, load + backdriving
        return -driving, driving
