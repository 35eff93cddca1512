"""A smooth excitation for the test joint, with exact derivatives."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline
from scipy.ndimage import gaussian_filter1d

Array = NDArray[np.float64]


def planned_motion(
    random: np.random.Generator,
    duration: float,
    rate: float,
    repeats: int = 1,
    pace: float = 1.0,
    whole: bool = False,
) -> tuple[Array, Array, Array, Array]:
    """A smooth excitation: time, q, q', q'' (each (N,)), up to 1.2 rad/s (times `pace`) and 1.2 rad, much of it slow.

    A velocity profile, made of three fixed pieces (a wide sine, a fast and a slow trapezoid there and back)
    and of random ones down to 0.03 rad/s, is rounded (Gaussian, 60 ms), integrated, and carried by a spline
    of degree 7, of which q' and q'' are the exact derivatives.

    whole : whether a repeat lasts just `duration / repeats`, so that several joints repeat together; up to a second less if not
    """
    step = 0.01
    period = duration * pace / repeats  # s of the motion before it is run faster or slower
    pieces = [_sine(1.0, 0.16, 1, step), _there_and_back(1.2, 1.0, step), _there_and_back(-0.08, 3.0, step)]
    while step * sum(map(len, pieces)) < period - (0.0 if whole else 1.0):
        if random.random() < 0.6:
            speed = float(np.exp(random.uniform(np.log(0.03), np.log(1.2))))
            way = min(random.uniform(0.8, 2.5), 1.2 / speed)
            pieces.append(_there_and_back(speed * random.choice([-1.0, 1.0]), way, step))
        else:
            frequency = random.uniform(0.2, 1.2)
            pieces.append(_sine(random.uniform(0.3, 1.2), frequency, int(random.integers(1, 3)), step))
    order = random.permutation(len(pieces))
    pieces = [pieces[k] for k in order]
    samples = round(period / step)
    velocity = np.concatenate(pieces)[:samples]
    velocity[-100:] -= velocity.sum() / 100  # the last second brings the joint back to where it began
    velocity = gaussian_filter1d(velocity, 0.06 / step, mode="wrap")
    position = np.cumsum(velocity) * step
    position += random.uniform(-0.3, 0.3) - 0.5 * (position.max() + position.min())
    wide = np.tile(
        position, repeats + 2
    )  # a repeat before and after keeps the spline's ends out of the record
    knots = (np.arange(len(wide)) - samples) * step
    spline = make_interp_spline(knots, wide, k=7)
    time = np.arange(round(duration * rate)) / rate
    inner = pace * time
    return (
        time,
        spline(inner),
        pace * spline.derivative(1)(inner),
        pace**2 * spline.derivative(2)(inner),
    )


def smooth_course(
    start: float, way: float, speed: float, repeats: int, rate: float
) -> tuple[Array, Array, Array, Array]:
    """Time, q, q', q'' (each (N,)) of ways there and back at a constant speed, rounded as above."""
    step, rounding = 0.01, 0.06
    seconds = way / speed + 2 * rounding * np.sqrt(2 / np.pi)  # what the two rounded ends cut off
    velocity = np.tile(_there_and_back(speed, seconds, step), repeats)
    velocity = gaussian_filter1d(velocity, rounding / step, mode="wrap")
    position = start + np.concatenate([[0.0], np.cumsum(velocity) * step])
    spline = make_interp_spline(np.arange(len(position)) * step, position, k=7)
    time = np.arange(round((len(position) - 1) * step * rate)) / rate
    return time, spline(time), spline.derivative(1)(time), spline.derivative(2)(time)


def _sine(speed: float, frequency: float, cycles: int, step: float) -> Array:
    """Velocity of whole cycles of a sine."""
    phase = np.arange(round(cycles / frequency / step)) * step * frequency * 2 * np.pi
    return speed * np.cos(phase)


def _there_and_back(speed: float, seconds: float, step: float) -> Array:
    """Velocity of a way at constant speed and the same way back."""
    way = np.full(round(seconds / step), speed)
    return np.concatenate([way, -way])
