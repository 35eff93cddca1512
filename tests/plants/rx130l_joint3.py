"""A plant for tests: joint 3 of the Staubli RX130L of the paper, simulated forward in time with stick and
slip.

It shares no line with `identify`. A position controller moves the joint along sinusoids and trapezoids; what
results is recorded as a drive would (position in counts, current reference with noise) and written as an
experiment folder.

The joint, eq. (25) and (30), for a payload of mass m at L = 1.277 m, with E = exp(-|q'| / 0.03 rad/s):

    load = (J + m L^2) q'' + (MX + m L) g cos q - MY g sin q
    load q' > 0:  tau = (a_m + b_m E) load + (c_m + d_m E) sign q' + FV q' + offset + hidden
    load q' < 0:  tau = (a_g - b_g E) load + (c_g + d_g E) sign q' + FV q' + offset + hidden
    q' = 0     :  the joint sticks while tau lies between the two values of the above for q' -> -0 and q' ->
    +0

**Where the numbers come from.** Table II gives products and does not give one inertia: a_m J / a_m = 34.4 and
a_g J / a_g = 32.0 kg m^2. Its payload coefficients a_m = 0.942 and a_g = 0.915 lie both below 1, as they do
if the torque is computed with a drive gain some 6 % too low. So the plant has one J, one MX and a_m > 1 >
a_g, chosen such that times 0.94 its products lie near Table II's:

    times 0.94  a_m J  a_g J  a_m MX  a_g MX  b_m MX  b_g MX   c_m    c_g    FV    offset
    Table II    32.42  29.29  22.20   19.43   1.62    1.80     21.15  15.59  48.14  9.95
    the plant   32.51  29.04  21.97   19.62   2.22    2.45     21.15  15.60  48.13  9.96

`declared_gain_error=-0.06` records the experiment with that gain, as the paper's seems to be; the default is
an exact gain. The payload's own coefficients (0.942, 0.240, 0.915, 0.266 in the paper) are then 0.985, 0.100,
0.880, 0.110: eq. (30) asks that they be those of the arm.

**The step** is 0.25 ms for the mechanism and the controller alike (a servo drive's usual rate), with the
acceleration constant in each. The fastest thing in the equations is the fall of friction at the start of
sliding, with a time constant of J 0.03 / (b load) = 28 ms at least. A test checks that half the step gives
the same torque within the noise.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Hidden = Callable[[float, float, float], float]
"""Torque (N m) that the motor must give on top, from position (rad), velocity (rad/s) and time (s)."""

GRAVITY = 9.81
PAYLOAD_MASSES = (0.0, 3.4584, 6.970)
LEVER = 1.277
NOMINAL_SPEED = 1.2
TRAVEL = 2.4
STEP = 0.25e-3


@dataclass(frozen=True)
class Rx130lJoint3:
    """Physical parameters of the plant; see the module's text for their source."""

    inertia: float = 33.0  # J, kg m^2, rotor included
    first_moment_x: float = 22.3  # MX, kg m
    first_moment_y: float = 0.0  # MY, kg m: eliminated in the paper
    a_m: float = 1.048
    b_m: float = 0.106
    c_m: float = 22.5  # N m
    d_m: float = 0.0  # N m: eliminated in the paper
    a_g: float = 0.936
    b_g: float = 0.117
    c_g: float = 16.6  # N m
    d_g: float = 0.0  # N m
    viscous: float = 51.2  # FV, N m s/rad
    offset: float = 10.6  # N m
    stribeck_velocity: float = 0.03  # rad/s
    drive_gain: float = 35.15  # N m per unit of the current reference, the true one
    declared_gain_error: float = 0.0  # the experiment declares drive_gain (1 + this)
    counts_per_turn: int = 6_553_600  # of the joint: 65536 a motor turn, gear 100
    command_noise: float = 0.02  # standard deviation of a sample of the current reference, white
    ripple: float = 1.5  # N m, six cycles a motor turn
    hidden: tuple[Hidden, ...] = field(default=())


def joint_spring(stiffness: float = 15.0, rest: float = 0.2) -> Hidden:
    """k (q - q0)."""
    return lambda q, dq, t: stiffness * (q - rest)


def viscous_quadratic(coefficient: float = -12.0) -> Hidden:
    """c |q'| q'."""
    return lambda q, dq, t: coefficient * abs(dq) * dq


def friction_position(amplitude: float = 6.0) -> Hidden:
    """A cos(q) sign q'."""
    return lambda q, dq, t: math.copysign(amplitude * math.cos(q), dq) if dq else 0.0


def torque_ripple(amplitude: float = 5.0, per_turn: float = 40.0) -> Hidden:
    """A sin(N q)."""
    return lambda q, dq, t: amplitude * math.sin(per_turn * q)


def warm_up(coefficient: float = 15.0, time_constant: float = 25.0) -> Hidden:
    """c exp(-t / T) q', t from the start of the session."""
    return lambda q, dq, t: coefficient * math.exp(-t / time_constant) * dq


@dataclass(frozen=True)
class SessionRecord:
    """What one session gave.

    time, position, command : (N,) s, rad (whole counts), current reference (with noise)
    true_*                  : (N,) rad/s, N m: velocity and motor torque without noise, for tests
    """

    mass: float
    time: Array
    position: Array
    command: Array
    true_velocity: Array
    true_torque: Array


def planned_trajectory(random: np.random.Generator, duration: float, step: float = STEP) -> Array:
    """Position reference (N,): trapezoids there and back and sinusoids, from 1.2 rad/s down to 2.5 % of it.

    The pieces stand in an order drawn from `random` and run about different centres within 2.4 rad of
    horizontal, so that friction is seen under loads of either sign: without that, c_m, c_g and the offset are
    one number.
    """
    pieces = [
        *[
            _trapezoids(reach, speed, step)
            for reach, speed in ((1.8, 1.2), (1.2, 0.9), (-1.4, 1.1), (1.0, 0.5))
        ],
        *[_trapezoids(reach, speed, step) for reach, speed in ((0.25, 0.12), (-0.15, 0.06), (0.06, 0.03))],
        *[_sinusoid(*shape, step) for shape in ((0.50, 0.36, 2), (0.25, 0.20, 1), (0.08, 0.15, 1))],
    ]
    order = random.permutation(len(pieces))
    position = np.array([random.uniform(-0.6, 0.6)])
    k = 0
    while len(position) * step < duration:
        way = pieces[order[k % len(pieces)]]
        # each piece runs about a centre of its own, by turns in front and behind; a trapezoid leads there
        room = TRAVEL - 0.5 * (way.max() - way.min())
        centre = random.uniform(0.1, 1.0) * room * (-1) ** k - 0.5 * (way.max() + way.min())
        start = position[-1]
        position = np.concatenate([position, start + _one_way(centre + way[0] - start, 0.8, step)])
        position = np.concatenate([position, centre + way])
        k += 1
    return position[: round(duration / step)]


def simulate(
    plant: Rx130lJoint3,
    mass: float,
    *,
    seed: int = 0,
    duration: float = 60.0,
    rate: float = 1000.0,
    step: float = STEP,
    reference: Array | None = None,
) -> SessionRecord:
    """One session with a payload of `mass` kg, from rest.

    duration, rate : s and Hz; 1 / rate is a whole number of steps
    step           : s, of mechanism and controller
    reference      : (N,) positions to follow, one a step, from rest, instead of the planned trajectory
    """
    random = np.random.default_rng(seed)
    if reference is None:
        reference = planned_trajectory(random, duration, step)
    velocity_reference = np.gradient(reference, step)
    acceleration_reference = np.gradient(velocity_reference, step)
    q, dq, tau = _run(plant, mass, reference, velocity_reference, acceleration_reference, step)
    every = round(1.0 / (rate * step))
    q, dq, tau = q[::every], dq[::every], tau[::every]
    count = 2 * np.pi / plant.counts_per_turn
    command = tau / plant.drive_gain + plant.command_noise * random.standard_normal(len(tau))
    return SessionRecord(
        mass=mass,
        time=np.arange(len(q)) / rate,
        position=np.round(q / count) * count,
        command=np.round(command * 1000) / 1000,
        true_velocity=dq,
        true_torque=tau,
    )


def write_experiment(
    folder: Path,
    plant: Rx130lJoint3 | None = None,
    *,
    seed: int = 0,
    duration: float = 60.0,
    rate: float = 1000.0,
    payload_masses: Sequence[float] = PAYLOAD_MASSES,
    validation_masses: Sequence[float] = (),
) -> list[SessionRecord]:
    """Run one session per payload, write the experiment folder, and return what was run.

    validation_masses : kg; further sessions, with motions of their own, of the role `validation`
    """
    plant = plant or Rx130lJoint3()
    folder.mkdir(parents=True, exist_ok=True)
    records, payloads, sessions = [], [], []
    roles = ["identification"] * len(payload_masses) + ["validation"] * len(validation_masses)
    for index, (mass, role) in enumerate(zip([*payload_masses, *validation_masses], roles, strict=True)):
        record = simulate(plant, mass, seed=1000 * seed + index, duration=duration, rate=rate)
        records.append(record)
        file = f"session-{index:02d}.csv"
        np.savetxt(
            folder / file,
            np.column_stack([record.time, record.position, record.command]),
            fmt=("%.6f", "%.10g", "%.6g"),
            delimiter=",",
            header="t,q1,v1",
            comments="",
        )
        sessions.append(f"  - {{file: {file}, payload: mass-{mass:g}, role: {role}}}")
    for mass in dict.fromkeys([*payload_masses, *validation_masses]):
        payloads.append(f"  - {{name: mass-{mass:g}, mass: {mass}, com: [{LEVER}, 0.0, 0.0]}}")
    declared = plant.drive_gain * (1.0 + plant.declared_gain_error)
    lines = [
        "format: 1",
        "name: rx130l-joint3",
        "robot:",
        f"  gravity: [0.0, {-GRAVITY}, 0.0]",
        "  joints:",
        "    - {name: j3, type: revolute, alpha: 0.0, d: 0.0, theta: 0.0, r: 0.0, "
        f"drive_gain: {declared!r}}}",
        "payloads:",
        *payloads,
        "sessions:",
        *sessions,
    ]
    (folder / "experiment.yaml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return records


def _run(
    plant: Rx130lJoint3, mass: float, reference: Array, velocity: Array, acceleration: Array, h: float
) -> tuple[Array, Array, Array]:
    """Controller and mechanism step by step; plain floats, since each step needs the one before."""
    inertia = plant.inertia + mass * LEVER**2
    cosine_moment = (plant.first_moment_x + mass * LEVER) * GRAVITY
    sine_moment = plant.first_moment_y * GRAVITY
    a_m, b_m, c_m, d_m = plant.a_m, plant.b_m, plant.c_m, plant.d_m
    a_g, b_g, c_g, d_g = plant.a_g, plant.b_g, plant.c_g, plant.d_g
    viscous, offset, stribeck = plant.viscous, plant.offset, plant.stribeck_velocity
    ripple, per_radian = plant.ripple, 6.0 * 100.0
    hidden = plant.hidden
    count = 2 * math.pi / plant.counts_per_turn
    control = _Controller(plant, float(reference[0]), h)
    exp, cos, sin = math.exp, math.cos, math.sin

    q, dq = float(reference[0]), 0.0
    positions, velocities, torques = [], [], []
    for k, (wanted, speed, push) in enumerate(
        zip(reference.tolist(), velocity.tolist(), acceleration.tolist(), strict=True)
    ):
        tau = control.torque(round(q / count) * count, wanted, speed, push)
        positions.append(q)
        velocities.append(dq)
        torques.append(tau)

        static = cosine_moment * cos(q) - sine_moment * sin(q)
        drive = tau - offset + ripple * sin(per_radian * q)
        for effect in hidden:
            drive -= effect(q, dq, k * h)
        if dq != 0.0:
            side = 1.0 if dq > 0.0 else -1.0
            decay = exp(-abs(dq) / stribeck)
            drive -= viscous * dq
        else:
            motor, generator = (a_m + b_m) * static, (a_g - b_g) * static
            if static > 0.0:
                upper, lower = motor + c_m + d_m, generator - c_g - d_g
            else:
                upper, lower = generator + c_g + d_g, motor - c_m - d_m
            if lower <= drive <= upper:
                continue
            side = 1.0 if drive > upper else -1.0
            decay = 1.0
        # the load that this torque can hold and accelerate, in the quadrant that its own sign confirms
        load = (drive - side * (c_m + d_m * decay)) / (a_m + b_m * decay)
        if load * side <= 0.0:
            load = (drive - side * (c_g + d_g * decay)) / (a_g - b_g * decay)
            if load * side >= 0.0:
                load = 0.0
        ddq = (load - static) / inertia
        after = dq + ddq * h
        if after * side < 0.0:  # comes to rest within the step
            q += -0.5 * dq * dq / ddq if ddq else 0.0
            dq = 0.0
        else:
            q += (dq + 0.5 * ddq * h) * h
            dq = after
    return np.array(positions), np.array(velocities), np.array(torques)


class _Controller:
    """Position controller of an industrial robot: P on position, PI on velocity, feed-forward of arm and
    gravity.

    It knows the arm without payload, 10 % wrong. Bandwidths: velocity 16 Hz, position 5 Hz, velocity filter
    120 Hz.
    """

    def __init__(self, plant: Rx130lJoint3, start: float, step: float) -> None:
        self.step = step
        self.position_gain = 2 * math.pi * 5.0
        self.velocity_gain = plant.inertia * 2 * math.pi * 16.0
        self.integral_gain = self.velocity_gain * 2 * math.pi * 2.0 * step
        self.filter = 1.0 - math.exp(-2 * math.pi * 120.0 * step)
        self.inertia = 0.9 * plant.inertia
        self.gravity = 0.9 * plant.first_moment_x * GRAVITY
        self.last = start
        self.speed = 0.0
        self.integral = 0.0

    def torque(self, measured: float, wanted: float, wanted_speed: float, wanted_push: float) -> float:
        """Motor torque asked for, N m, from the position in counts and the reference."""
        self.speed += self.filter * ((measured - self.last) / self.step - self.speed)
        self.last = measured
        error = wanted_speed + self.position_gain * (wanted - measured) - self.speed
        self.integral += self.integral_gain * error
        feed_forward = self.inertia * wanted_push + self.gravity * math.cos(wanted)
        return feed_forward + self.velocity_gain * error + self.integral


def _one_way(distance: float, speed: float, step: float, acceleration: float = 3.0) -> Array:
    """Way (N,), from 0 to `distance`, with trapezoidal velocity whose corners are rounded (sine, 60 ms)."""
    if distance == 0.0:
        return np.zeros(1)
    speed = min(speed, math.sqrt(abs(distance) * acceleration))
    ramp = speed / acceleration
    total = abs(distance) / speed + ramp
    t = np.arange(0.0, total, step)
    velocity = np.minimum(np.minimum(t, total - t) * acceleration, speed)
    width = round(0.06 / step)
    window = np.hanning(width + 2)[1:-1]
    rounded = np.convolve(velocity, window / window.sum())
    way = np.cumsum(rounded)
    return way / way[-1] * distance


def _trapezoids(distance: float, speed: float, step: float) -> Array:
    """There and back."""
    way = _one_way(distance, speed, step)
    return np.concatenate([way, distance - way])


def _sinusoid(amplitude: float, frequency: float, cycles: int, step: float) -> Array:
    """Whole cycles of -cos, from rest at one end of the way to rest there."""
    t = np.arange(round(cycles / frequency / step)) * step
    return -amplitude * np.cos(2 * np.pi * frequency * t)
