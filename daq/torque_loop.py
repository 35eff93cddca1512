"""The position loop that this computer closes over the bus where drives take torque alone (cyclic synchronous torque, mode 10).

Per axis, on the error e between where the axis should be at a SYNC and where it was, in counts of its encoder:

    torque = proportional e + derivative e' + integral ∫ e dt + feedforward

a position is sampled at one SYNC, travels, and what is made of it acts from the next SYNC for a cycle; with the half cycle that
the difference for e' costs the dead time is two cycles. Gains are made for it by `design`, which leaves `PHASE_MARGIN`.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.recording.errors import InputError

Array = NDArray[np.float64]

DEAD_TIME = 2.0
"""cycles: one on the way, half for the hold, half for the difference"""
PHASE_MARGIN = 60.0
"""degrees left at every crossover, for every inertia and gravity along the plan"""
CORNER = 10.0
"""crossover over the frequency of the loop's two zeros. With the dead time T the crossover w that leaves the margin is
(2 atan(CORNER) - 150°) / T, and what a changing torque moves the axis by goes with CORNER² / w³: that is least near 10"""


@dataclass(frozen=True)
class AxisDynamics:
    """What an axis moves along a plan, by the identified model.

    inertia : least and greatest, kg m² (kg), as the motor feels it with the other joints free or held
    gravity : rad or m: greatest magnitude of the gravity torque's derivative, N m/rad (N/m)
    """

    inertia: tuple[float, float]
    gravity: float


@dataclass(frozen=True)
class LoopGains:
    """Of one axis, N m (N) and rad (m).

    crossover : rad/s, for the least inertia
    """

    proportional: float
    integral: float
    derivative: float
    crossover: float


def design(dynamics: AxisDynamics, cycle: float) -> LoopGains | None:
    """Gains of the quickest loop with both zeros at a tenth of its crossover that leaves `PHASE_MARGIN` over all the plan; None
    where the cycle (s) is too long for any.

    Open loop: derivative (s + a)²/s · exp(-DEAD_TIME cycle s) / (J s² + k), a = crossover / CORNER; k is what gravity adds.
    """
    least = dynamics.inertia[0]
    dead = DEAD_TIME * cycle
    most = (2.0 * np.arctan(CORNER) - np.radians(90.0 + PHASE_MARGIN)) / dead
    for crossover in most * np.linspace(1.0, 0.3, 29):
        corner = crossover / CORNER
        derivative = least * crossover / (1.0 + CORNER**-2)
        margins = [
            _phase_margin(derivative, corner, inertia, stiffness, dead)
            for inertia in dynamics.inertia
            for stiffness in (-dynamics.gravity, 0.0, dynamics.gravity)
        ]
        if min(margins) >= PHASE_MARGIN - 0.1:
            return LoopGains(2.0 * corner * derivative, corner**2 * derivative, derivative, float(crossover))
    return None


def _phase_margin(derivative: float, corner: float, inertia: float, stiffness: float, dead: float) -> float:
    """Degrees, the least over all crossovers; minus 180 where the loop does not hold gravity at all."""
    if 2.0 * corner * derivative <= -stiffness:
        return -180.0
    w = np.geomspace(0.02 * corner, 20.0 / dead, 4000)
    s = 1j * w
    loop = derivative * (s + corner) ** 2 / s * np.exp(-dead * s) / (inertia * s * s + stiffness)
    size = np.abs(loop)
    crossed = np.flatnonzero((size[:-1] >= 1.0) != (size[1:] >= 1.0))
    phase = np.degrees(np.angle(loop[crossed]))
    return float(np.min(np.where(phase < 0.0, phase + 180.0, phase - 180.0), initial=180.0))


@dataclass(frozen=True)
class TorqueLoop:
    """The loop of every axis, in counts of its encoder and per mille of its rated torque.

    proportional, integral, derivative : (n,) per mille per count, per count s, and per count/s
    bound                              : (n,) per mille, the most that is asked for in all
    crossover                          : (n,) rad/s
    """

    proportional: Array
    integral: Array
    derivative: Array
    bound: NDArray[np.int64]
    crossover: Array

    @property
    def words(self) -> str:
        """For the operator."""
        slowest = float(self.crossover.min())
        return (
            f"held by this computer's position loop, crossover {slowest:.3g} rad/s, not by the drives' own: mode 10, target"
            " torque 0x6071"
        )


class RunningLoop:
    """The loop from cycle to cycle.

    cycle : s
    """

    def __init__(self, loop: TorqueLoop, cycle: float) -> None:
        self._gains = list(
            zip(
                loop.proportional.tolist(),
                loop.integral.tolist(),
                loop.derivative.tolist(),
                loop.bound.tolist(),
                strict=True,
            )
        )
        self._cycle = cycle
        self._sum = [0.0] * len(self._gains)
        self._last: list[float] | None = None
        self._feedforward: Sequence[float] | None = None

    def begin(self, torque: Sequence[float]) -> None:
        """Start from the torque (per mille) that holds each axis now."""
        self._sum = [float(each) for each in torque]
        self._last = self._feedforward = None

    def forget_slope(self) -> None:
        """The reference jumps: the next error has no slope."""
        self._last = None

    def torque(self, error: Sequence[float], feedforward: Sequence[float] | None) -> list[int]:
        """Per mille for the next cycle, from errors in counts; `feedforward` is added, None where there is none.

        Where feedforward begins or ends the integral gives it, or takes it over, so that the torque makes no jump. At its bound
        an axis's integral waits, unless the error lets it come back.
        """
        added = feedforward or [0.0] * len(error)
        if (feedforward is None) != (self._feedforward is None):
            before = self._feedforward or [0.0] * len(error)
            self._sum = [
                held + ends - begins for held, ends, begins in zip(self._sum, before, added, strict=True)
            ]
        self._feedforward = feedforward
        last = self._last or error
        self._last = list(error)
        torques: list[int] = []
        for axis, (proportional, integral, derivative, bound) in enumerate(self._gains):
            summed = self._sum[axis] + integral * error[axis] * self._cycle
            slope = (error[axis] - last[axis]) / self._cycle
            wanted = proportional * error[axis] + derivative * slope + summed + added[axis]
            if abs(wanted) <= bound or wanted * integral * error[axis] < 0.0:
                self._sum[axis] = summed
            torques.append(round(min(max(wanted, -bound), bound)))
        return torques


def require_loop(name: str, gains: LoopGains | None, cycle: float) -> LoopGains:
    """Raises InputError: no loop holds the joint at this cycle."""
    if gains is None:
        raise InputError(
            f"{name}: at a cycle of {1e3 * cycle:g} ms no position loop over the bus leaves {PHASE_MARGIN:g}° of phase for its"
            " inertia and gravity along the plan; a shorter cycle is needed, or a plan with less"
        )
    return gains
