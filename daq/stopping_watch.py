"""Whether axes that were told to stop do stop: speed and way since then against what a quick stop makes of them.

From the speed v0 at the command a quick stop leads along a ramp to rest. A drive is given the time of its reaction; from
then on its speed must lie below a ramp (`limits.quick_stop_deceleration`, or `RAMP_SHARE` of the axis's acceleration
limit), and its way below that ramp's.
It must also have left OPERATION ENABLED, and go on saying where it is. Whatever else is the matter (a feedback with the
wrong sign, a drive that obeys nothing, somebody else's setpoints), it shows in one of these, and power is then cut.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.rig import Limits, Rig
from daq.samples import COMMAND_CAME, joint_positions
from drivers.cia402 import State

Array = NDArray[np.float64]

RAMP_SHARE = 0.5
"""of the acceleration limit: what a plan may ask of an axis, a quick stop must reach by half at least"""
REACTION = 0.05
"""s until a drive brakes: the controlword takes effect at the next SYNC, the window of the speed is past, and a drive
may need some servo periods"""
FLOOR_SHARE = 0.1
"""of the velocity limit: slower than that the ramp says nothing, and rest itself is waited for"""
OUT_OF_CONTROL = 1.5
"""times the velocity limit: so fast, an axis is no longer in the hands of its drive"""
_LASTING = 3
"""rows: one wrong sample is no motion"""


def expected_deceleration(limits: Limits) -> float:
    """rad/s² or m/s² with which an axis must brake once it was told to stop."""
    return limits.quick_stop_deceleration or RAMP_SHARE * limits.acceleration


def longest_stop(rig: Rig) -> float:
    """s from the command to stop until every axis rests, at most, from the greatest speed that the monitors let pass: one that
    brakes more weakly has its power cut."""
    reaction = REACTION + 3 * rig.cycle
    fastest = rig.supervision.velocity_margin
    return reaction + max(
        fastest * axis.limits.velocity / expected_deceleration(axis.limits) for axis in rig.axes
    )


class StoppingWatch:
    """Keeps the newest positions of every axis; judges them once it was told that the axes should stop."""

    def __init__(self, rig: Rig) -> None:
        limits = [axis.limits for axis in rig.axes]
        self._rig = rig
        self._names = [axis.joint for axis in rig.axes]
        self._units = ["m" if joint.type == "prismatic" else "rad" for joint in rig.robot.joints]
        velocity = np.array([limit.velocity for limit in limits])
        acceleration = np.array([limit.acceleration for limit in limits])
        self._window = max(2, round(rig.supervision.window / rig.cycle))
        self._reaction = REACTION + 3 * rig.cycle
        self._ramp = np.array([expected_deceleration(limit) for limit in limits])
        # The speed lags by half a window, and an axis may have gone on accelerating until the drive took the command.
        span = self._window * rig.cycle
        self._rise = acceleration * rig.supervision.acceleration_margin * (span + 2 * rig.cycle)
        resolution = np.abs(rig.position_matrix).sum(axis=1)
        self._floor = FLOOR_SHARE * velocity + 4 * resolution / span
        self._fastest = OUT_OF_CONTROL * velocity
        self._silence = max(rig.supervision.silence, 5 * rig.cycle)
        n = len(limits)
        self._clock = np.empty((0, 2))
        self._position = np.empty((0, n))
        self._begun: float | None = None
        self._speed = np.zeros(n)
        self._from = np.zeros(n)
        self._heard = np.zeros(n)
        self._beyond = np.zeros(n, int)

    def remember(self, rows: NDArray[Any]) -> None:
        """Take the next rows (M,) of `sample_dtype`."""
        counted = rows["cycle"] * self._rig.cycle
        stamped = counted if self._rig.simulated is not None else rows["sync_time"] * 1e-9
        matrix, offset = self._rig.position_matrix, self._rig.position_offset
        position = joint_positions(rows["position"], rows["valid"], matrix, offset)
        kept = 3 * self._window + len(rows)
        self._clock = np.concatenate([self._clock, np.column_stack([counted, stamped])])[-kept:]
        self._position = np.concatenate([self._position, position])[-kept:]

    def begin(self) -> None:
        """The axes were told to stop, after the last row."""
        if self._begun is not None or not len(self._clock):
            return
        self._begun = float(self._clock[-1, 0])
        speed = self._speeds()
        recent = np.abs(speed[-5:]) if len(speed) else np.zeros((1, len(self._names)))
        with np.errstate(invalid="ignore"):
            known = np.nan_to_num(recent, nan=0.0)
        self._speed = np.median(known, axis=0)
        for axis in range(len(self._names)):
            known_positions = self._position[~np.isnan(self._position[:, axis]), axis]
            self._from[axis] = known_positions[-1] if len(known_positions) else np.nan
        self._heard = np.full(len(self._names), self._begun)

    def judge(self, rows: NDArray[Any]) -> str:
        """What is wrong with how the axes stop, after `remember(rows)`; empty where nothing is."""
        if self._begun is None or not len(rows):
            return ""
        speeds = self._speeds()[-len(rows) :]
        for number in range(len(rows)):
            index = len(self._clock) - len(rows) + number
            elapsed = float(self._clock[index, 0]) - self._begun
            place = number - (len(rows) - len(speeds))
            speed = speeds[place] if place >= 0 else np.full(len(self._names), np.nan)
            fault = self._judge_row(rows[number], self._position[index], speed, elapsed)
            if fault:
                return fault
        return ""

    def _judge_row(self, row: Any, position: Array, speed: Array, elapsed: float) -> str:
        assert self._begun is not None
        came = ~np.isnan(position)
        self._heard[came] = self._begun + elapsed
        silent = self._begun + elapsed - self._heard
        braking = max(0.0, elapsed - self._reaction)
        allowed = np.maximum(self._floor, self._speed + self._rise - self._ramp * braking)
        allowed = np.minimum(allowed, self._fastest)
        longest = (self._speed + self._rise) * self._reaction + (self._speed + self._rise) ** 2 / (
            2 * self._ramp
        )
        longest = longest + self._floor * elapsed
        with np.errstate(invalid="ignore"):
            self._beyond = np.where(np.abs(speed) > allowed, self._beyond + 1, 0)
            too_far = np.abs(position - self._from) > longest
        mask, pattern = State.OPERATION_ENABLED.value
        enabled = ((row["status"] & mask) == pattern) & ((row["valid"] & COMMAND_CAME) != 0)
        for axis, name in enumerate(self._names):
            unit = self._units[axis]
            if self._beyond[axis] >= _LASTING:
                return (
                    f"joint {name} turns at {abs(speed[axis]):.3g} {unit}/s {1e3 * elapsed:.0f} ms after it was "
                    f"commanded to stop, {allowed[axis]:.3g} {unit}/s is the most that a quick stop leaves"
                )
            if too_far[axis]:
                way = abs(position[axis] - self._from[axis])
                return f"joint {name} went {way:.3g} {unit} since it was commanded to stop, a quick stop takes less"
            if enabled[axis] and elapsed > self._reaction + 0.05:
                return (
                    f"joint {name}: the drive does not take the quick stop, it is still in OPERATION ENABLED"
                )
            if silent[axis] > self._silence:
                return f"joint {name}: no position came for {silent[axis]:.2g} s while it should stop"
        return ""

    def _speeds(self) -> Array:
        """(R, n) signed speeds over a window that ends at each of the newest rows."""
        w = self._window
        if len(self._position) <= w:
            return np.empty((0, len(self._names)))
        elapsed = np.maximum((self._clock[w:] - self._clock[:-w]).max(axis=1), 0.5 * w * self._rig.cycle)
        return (self._position[w:] - self._position[:-w]) / elapsed[:, None]
