"""Smooth steps from 0 to 1: how a motion begins and ends without a jolt.

On 0 <= x <= 1 the quintic 10 x³ − 15 x⁴ + 6 x⁵ has two derivatives that vanish at both ends, the septic 35
x⁴ − 84 x⁵ + 70 x⁶ − 20 x⁷ has three. The quintic shapes velocity ramps, the septic the fading of sinusoids:
either way position, velocity, acceleration and jerk are continuous.
"""

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

Array = NDArray[np.float64]

QUINTIC = Polynomial([0.0, 0.0, 0.0, 10.0, -15.0, 6.0])
SEPTIC = Polynomial([0.0, 0.0, 0.0, 0.0, 35.0, -84.0, 70.0, -20.0])

QUINTIC_PEAK_SLOPE = 1.875
"""of the quintic, at x = 1/2"""
QUINTIC_PEAK_CURVATURE = 10.0 / 3.0**0.5
"""of the quintic, at x = 1/2 ± 1/√12"""

_QUINTIC_TERMS = (QUINTIC.integ(), QUINTIC, QUINTIC.deriv(), QUINTIC.deriv(2))
_SEPTIC_TERMS = (SEPTIC, SEPTIC.deriv(), SEPTIC.deriv(2), SEPTIC.deriv(3))


def fade(time: Array, seconds: float, duration: float) -> tuple[Array, Array, Array, Array]:
    """Envelope that rises to 1 in the first `seconds` and falls to 0 in the last, and three derivatives.

    time : (N,) s in 0..duration
    """
    rising = time < seconds
    falling = time > duration - seconds
    x = np.where(rising, time, np.where(falling, duration - time, seconds)) / seconds
    x = np.clip(x, 0.0, 1.0)
    sign = np.where(rising, 1.0, np.where(falling, -1.0, 0.0)) / seconds
    return (
        _SEPTIC_TERMS[0](x),
        _SEPTIC_TERMS[1](x) * sign,
        _SEPTIC_TERMS[2](x) * sign**2,
        _SEPTIC_TERMS[3](x) * sign**3,
    )


def trapezoid(time: Array, ramp: float, duration: float) -> tuple[Array, Array, Array, Array]:
    """Way from 0 to 1 with a trapezoidal velocity whose flanks are quintic, and its three derivatives.

    time : (N,) s in 0..duration; ramp : s of each flank, at most duration / 2.
    The cruising velocity is 1 / (duration − ramp).
    """
    cruise = 1.0 / (duration - ramp)
    falling = time > 0.5 * duration
    x = np.clip(np.where(falling, duration - time, time) / ramp, 0.0, 1.0)
    way, velocity, acceleration, jerk = (term(x) for term in _QUINTIC_TERMS)
    beyond = np.maximum(np.where(falling, duration - time, time) - ramp, 0.0)
    way = cruise * (ramp * way + beyond)
    return (
        np.where(falling, 1.0 - way, way),
        cruise * velocity,
        cruise / ramp * np.where(falling, -acceleration, acceleration),
        cruise / ramp**2 * jerk,
    )
