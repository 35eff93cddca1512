"""What stands behind the simulated drives: the agreement between a drive and the mechanism that it moves.

The drive (`node.py`, `cia402_machine.py`) owns encoder, amplifier, servo loop and their errors: quantisation,
current noise, current limit. The mechanism owns everything from the motor shaft outwards: the torque
constant, inertia, gravity, friction, payload, hidden effects. Between them pass motor currents one way, and
motor angles, velocities and temperatures the other way.
"""

from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray


@runtime_checkable
class Mechanism(Protocol):
    """A mechanism with n motors that all move in one simulated time.

    Time passes only in `step`; between two steps the mechanism stands still, whatever the wall clock does.
    The arrays that the properties return may be the mechanism's own: read them, do not keep or change them.
    """

    @property
    def axes(self) -> int:
        """Number of motors, n."""
        ...

    @property
    def motor_angle(self) -> NDArray[np.float64]:
        """(n,) rad: angles of the motor shafts, before the gear."""
        ...

    @property
    def motor_velocity(self) -> NDArray[np.float64]:
        """(n,) rad/s: velocities of the motor shafts."""
        ...

    @property
    def temperature(self) -> NDArray[np.float64]:
        """(n,) °C: temperature at each drive's sensor."""
        ...

    def reset(self, seed: int) -> None:
        """Back to the initial state at rest; every random sequence starts again from `seed`."""
        ...

    def step(self, motor_current: NDArray[np.float64], duration: float) -> None:
        """Let `duration` seconds pass with constant `motor_current`, (n,) A, quadrature current, signed."""
        ...
