"""Effects that hide in the test joint (`single_joint.py`): each function's docstring is its equation.

The strength 1 makes an effect plainly visible (some per cent of the torque), 0.3 is near what such a record
can still tell. An effect reads the run and changes its torque, its command or what the drive reports.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

Array = NDArray[np.float64]
GRAVITY = 9.81


@dataclass(frozen=True)
class Joint:
    """Physical parameters; the defaults are a mid-sized industrial robot's elbow."""

    link_inertia: float = 8.0  # ZZ, kg m^2
    rotor_inertia: float = 4.0  # Ia, kg m^2, on the joint side
    first_moment_x: float = 9.0  # MX, kg m
    first_moment_y: float = 1.2  # MY, kg m
    viscous: float = 18.0  # FV, N m s/rad
    coulomb: float = 14.0  # FC, N m
    offset: float = 3.0  # N m
    drive_gain: float = 30.0  # N m per unit of command
    reach: float = 0.9  # L, m, from the axis to the payload
    counts_per_turn: int = 400_000  # of the joint: encoder counts times gear ratio
    command_noise: float = 0.02  # standard deviation of a sample of v, white
    slow_noise: float = 0.003  # standard deviation of a second, slow part of v's noise (0.2 s memory)


@dataclass
class Run:
    """One session while it is being made; effects read it and change `torque`, `command` or what the drive
    reports.

    q, dq, ddq    : (N,) link motion
    motor_*       : (N,) motor motion referred to the joint; equal to the link's unless an effect bends the
    drive chain load          : (N,) tau_out, with the payload as it really is
    torque        : (N,) tau on the motor side
    shape         : factor on the constants by which effects' shapes differ between machines (written k below)
    """

    joint: Joint
    index: int
    payload_mass: float
    time: Array
    q: Array
    dq: Array
    ddq: Array
    random: np.random.Generator
    shape: float = 1.0
    motor_q: Array = field(init=False)
    motor_dq: Array = field(init=False)
    motor_ddq: Array = field(init=False)
    load: Array = field(init=False)
    torque: Array = field(init=False)
    command: Array = field(init=False)
    temperature: Array | None = None

    @property
    def power_sign(self) -> Array:
        """Sign of tau_out q': the paper's motor (+) and generator (-) quadrants."""
        return np.sign(self.load * self.motor_dq)


Change = Callable[[Run, float], None]


# --- effects on the friction
# ------------------------------------------------------------------------------------


def stribeck(run: Run, strength: float) -> None:
    """tau += s 8 exp(-|q'| / 0.05 k) sign q': dry friction falls as the joint starts to slide."""
    run.torque += strength * 8.0 * np.exp(-np.abs(run.motor_dq) / (0.05 * run.shape)) * np.sign(run.motor_dq)


def viscous_quadratic(run: Run, strength: float) -> None:
    """tau += -s 8 |q'| q': viscous friction rises less than linearly with speed."""
    run.torque -= strength * 8.0 * np.abs(run.motor_dq) * run.motor_dq


def viscous_cubic(run: Run, strength: float) -> None:
    """tau += -s 6 q'^3."""
    run.torque -= strength * 6.0 * run.motor_dq**3


def viscous_asymmetric(run: Run, strength: float) -> None:
    """tau += s 6 |q'|: viscous friction differs between the two directions by 12 N m s/rad."""
    run.torque += strength * 6.0 * np.abs(run.motor_dq)


def load_friction(run: Run, strength: float) -> None:
    """tau += s 0.10 |tau_out| sign q', eq. (17): the gear loses a part of what it carries."""
    run.torque += strength * 0.10 * np.abs(run.load) * np.sign(run.motor_dq)


def load_friction_asymmetric(run: Run, strength: float) -> None:
    """tau += s 0.16 (motor) or 0.04 (generator quadrants) of |tau_out| sign q', eq. (20)."""
    loss = np.where(run.power_sign > 0, 0.16, 0.04)
    run.torque += strength * loss * np.abs(run.load) * np.sign(run.motor_dq)


def load_stribeck(run: Run, strength: float) -> None:
    """tau += s 0.2 |tau_out| exp(-|q'| / 0.06 k) sign q', the b terms of eq. (25)."""
    decay = np.exp(-np.abs(run.motor_dq) / (0.06 * run.shape))
    run.torque += strength * 0.2 * np.abs(run.load) * decay * np.sign(run.motor_dq)


def friction_position(run: Run, strength: float) -> None:
    """tau += s 5 cos(q - 0.4 k) sign q': dry friction differs along the joint's turn."""
    run.torque += strength * 5.0 * np.cos(run.motor_q - 0.4 * run.shape) * np.sign(run.motor_dq)


def friction_temperature(run: Run, strength: float) -> None:
    """tau -= s 0.5 (T - 25) q', T = 25 + 16 (1 - exp(-t / 900)) with t through all sessions; T is
    recorded.
    """
    temperature = 25.0 + 16.0 * (1.0 - np.exp(-_time_since_power_on(run) / 900.0))
    run.temperature = temperature + 0.1 * run.random.standard_normal(len(temperature))
    run.torque -= strength * 0.5 * (temperature - 25.0) * run.motor_dq


def friction_warmup(run: Run, strength: float) -> None:
    """tau += s 7 exp(-t / 25 k) q', t from the start of each session; no temperature is recorded."""
    run.torque += strength * 7.0 * np.exp(-run.time / (25.0 * run.shape)) * run.motor_dq


def presliding(run: Run, strength: float) -> None:
    """Dry friction is a bristle's, not sign q': tau += FC (z - sign q'), z' = q' - |q'| z / s 0.02 (Dahl),
    per rad.

    z is in units of its limit; the friction needs some hundredths of a radian to turn round after a reversal.
    """
    travel = np.abs(np.diff(run.motor_q, prepend=run.motor_q[0])) / (strength * 0.02)
    direction = np.sign(run.motor_dq)
    kept = np.exp(-travel)
    bristle = np.empty_like(travel)
    state = direction[1]
    for k in range(len(travel)):
        state = direction[k] + (state - direction[k]) * kept[k]
        bristle[k] = state
    run.torque += run.joint.coulomb * (bristle - direction)


# --- effects on position and load
# -------------------------------------------------------------------------------


def joint_spring(run: Run, strength: float) -> None:
    """tau += s 12 (q - 0.3): a balancing spring or a stiff cable bundle."""
    run.torque += strength * 12.0 * (run.q - 0.3)


def torque_ripple(run: Run, strength: float) -> None:
    """tau += s 4 sin(40 k q + 0.7): the gear's teeth, 40 k (a whole number) a turn."""
    run.torque += strength * 4.0 * np.sin(round(40 * run.shape) * run.motor_q + 0.7)


def gravity_tilt(run: Run, strength: float) -> None:
    """Gravity is s 0.05 rad off in the joint's plane: cos(q + 0.05 s) for cos q, seen only through the known
    payload.

    The tilt of the arm's own gravity is a change of MX and MY; the payload's is not.
    """
    gravity_lever = run.joint.first_moment_x + run.payload_mass * run.joint.reach
    tilt = 0.05 * strength
    change = gravity_lever * (np.cos(run.q + tilt) - np.cos(run.q))
    change -= run.joint.first_moment_y * (np.sin(run.q + tilt) - np.sin(run.q))
    run.torque += GRAVITY * change


def payload_mass(run: Run, strength: float) -> None:
    """The payload is s 8 % heavier than declared."""
    run.torque += payload_torque(run, 0.08 * strength * run.payload_mass, run.joint.reach, 0.0)


def payload_com(run: Run, strength: float) -> None:
    """The payload's centre is s 60 mm off in y and s 40 mm off in x from where it is declared."""
    mass, reach = run.payload_mass, run.joint.reach
    moved = payload_torque(run, mass, reach + 0.04 * strength, 0.06 * strength)
    run.torque += moved - payload_torque(run, mass, reach, 0.0)


# --- effects on the motor and the recording
# ----------------------------------------------------------------------


def current_ripple(run: Run, strength: float) -> None:
    """v = tau / (gain (1 + s 0.05 sin(60 k q + 1))): the torque constant varies with the motor's angle."""
    run.command = run.command / (1.0 + 0.05 * strength * np.sin(round(60 * run.shape) * run.motor_q + 1.0))


def drive_gain(run: Run, strength: float) -> None:
    """v = tau / (gain (1 - s 0.05)) from the second session on: the amplifier was changed or is hotter."""
    if run.index > 0:
        run.command = run.command / (1.0 - 0.05 * strength)


def gain_saturation(run: Run, strength: float) -> None:
    """tau = gain v (1 - s 0.08 (v / 8)^2), solved for v: the motor's iron saturates."""
    wanted = run.command
    curvature = 0.08 * strength / 8.0**2
    for _ in range(30):
        run.command = run.command - (run.command * (1 - curvature * run.command**2) - wanted) / (
            1 - 3 * curvature * run.command**2
        )


DELAY = 0.006
"""s by which v is early at the strength 1."""


def delay(run: Run, strength: float) -> None:
    """v is recorded s 6 ms before the position it belongs to: v(t) = tau(t + 0.006 s) / gain."""
    run.command = np.interp(run.time + DELAY * strength, run.time, run.command)


def backlash(run: Run, strength: float) -> None:
    """The motor stands s 4 mrad / 2 ahead of the link, on the side it pushes: q_m = q + s 0.002 tanh(tau_out
    / 8).
    """
    _bend(run, 0.002 * strength * np.tanh(run.load / 8.0))


def elasticity(run: Run, strength: float) -> None:
    """q_m = q + s tau_out / 4000: the gear winds up."""
    _bend(run, strength * run.load / 4000.0)


# --- effects that no catalogue holds
# ------------------------------------------------------------------------------


def one_sided_bumper(run: Run, strength: float) -> None:
    """tau += s 160 max(0, q - 0.7)^1.5: the arm leans on a rubber bumper near one end of its travel."""
    run.torque += strength * 160.0 * np.maximum(0.0, run.q - 0.7) ** 1.5


def sloshing(run: Run, strength: float) -> None:
    """A half-filled vessel on the arm: tau += s 1.5 (q'' - y), y'' + 1.2 y' + (6 k)^2 y = (6 k)^2 q''."""
    period = run.time[1] - run.time[0]
    poles = np.poly(np.exp(np.roots([1.0, 1.2, (6.0 * run.shape) ** 2]) * period)).real
    follower = lfilter([0.0, poles.sum()], poles, run.ddq)
    run.torque += strength * 1.5 * (run.ddq - follower)


def shaking_base(run: Run, strength: float) -> None:
    """tau += s 3 sin(2 pi 1.37 k t) (1 + sin(2 pi t / 17)): a machine next door."""
    swell = 1.0 + np.sin(2 * np.pi * run.time / 17.0)
    run.torque += strength * 3.0 * np.sin(2 * np.pi * 1.37 * run.shape * run.time) * swell


def detent(run: Run, strength: float) -> None:
    """tau += s 30 (q - 0.15 k) / 0.12 exp(-((q - 0.15 k) / 0.12)^2): a magnet beside the joint holds it at one place."""
    away = (run.q - 0.15 * run.shape) / 0.12
    run.torque += strength * 30.0 * away * np.exp(-(away**2))


def drifting_offset(run: Run, strength: float) -> None:
    """tau += s 4 (1 - exp(-t / (9 k s))): the offset of an amplifier that is switched on with every session."""
    run.torque += strength * 4.0 * (1.0 - np.exp(-run.time / (9.0 * run.shape)))


BENDING: Mapping[str, Change] = {"backlash": backlash, "elasticity": elasticity}

ON_THE_TORQUE: Mapping[str, Change] = {
    "stribeck": stribeck,
    "viscous-quadratic": viscous_quadratic,
    "viscous-cubic": viscous_cubic,
    "viscous-asymmetric": viscous_asymmetric,
    "load-friction": load_friction,
    "load-friction-asymmetric": load_friction_asymmetric,
    "load-stribeck": load_stribeck,
    "friction-position": friction_position,
    "friction-temperature": friction_temperature,
    "friction-warmup": friction_warmup,
    "presliding": presliding,
    "joint-spring": joint_spring,
    "torque-ripple": torque_ripple,
    "gravity-tilt": gravity_tilt,
    "payload-mass": payload_mass,
    "payload-com": payload_com,
}

ON_THE_COMMAND: Mapping[str, Change] = {
    "gain-saturation": gain_saturation,
    "current-ripple": current_ripple,
    "drive-gain": drive_gain,
    "delay": delay,
}

LEFT_OUT_OF_EVERY_CATALOGUE: Mapping[str, Change] = {
    "one-sided-bumper": one_sided_bumper,
    "sloshing": sloshing,
    "shaking-base": shaking_base,
    "detent": detent,
    "drifting-offset": drifting_offset,
}

HIDDEN: Mapping[str, Change] = {
    **BENDING,
    **ON_THE_TORQUE,
    **LEFT_OUT_OF_EVERY_CATALOGUE,
    **ON_THE_COMMAND,
}
"""Every effect by the contract's name, in the order in which they act: drive chain, torque, recording."""


def payload_torque(run: Run, mass: float, x: float, y: float) -> Array:
    """m (x^2 + y^2) q'' + m g (x cos q - y sin q)."""
    return mass * ((x * x + y * y) * run.ddq + GRAVITY * (x * np.cos(run.q) - y * np.sin(run.q)))


def _time_since_power_on(run: Run) -> Array:
    """s; sessions follow each other after five minutes, in which the payload is changed."""
    return run.time + run.index * (run.time[-1] + 300.0)


def _bend(run: Run, twist: Array) -> None:
    """Turn the motor ahead of the link by `twist` (rad)."""
    run.motor_q = run.motor_q + twist
    run.motor_dq = np.gradient(run.motor_q, run.time, edge_order=2)
    run.motor_ddq = np.gradient(run.motor_dq, run.time, edge_order=2)
