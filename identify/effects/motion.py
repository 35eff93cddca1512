"""What an effect may look at: the motion of one joint, block by block, and a summary of the whole record."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identify.effects.coverage import Coverage

Array = NDArray[np.float64]

TEMPERATURE_CHANGE = 1.0
"""K that a temperature must change by before friction can be seen to follow it"""


class BlockMemory:
    """Carries the state of effects with memory from one block of a segment to the next.

    Blocks overlap by the memory of the filters, so the next block begins before the last one ended; what is
    kept is the whole course of the state, and the value at the next block's first instant is looked up by
    time.
    """

    def __init__(self) -> None:
        self._kept: dict[object, tuple[Array, Array]] = {}

    def recall(self, key: object, instant: float) -> float | None:
        """Value of the state `key` at `instant`, or None where nothing was kept (the segment begins)."""
        if key not in self._kept:
            return None
        time, state = self._kept[key]
        position = int(np.searchsorted(time, instant - 1e-9))
        return float(state[min(position, len(state) - 1)])

    def keep(self, key: object, time: Array, state: Array) -> None:
        """Remember the course of a state over one block."""
        self._kept[key] = (time, state)

    def forget(self) -> None:
        """A new segment begins: nothing is known of what was before."""
        self._kept.clear()


@dataclass(frozen=True, eq=False)
class JointMotion:
    """One block of motion as an effect of one joint sees it; arrays are (samples,), SI units, full rate.

    `load` is tau_out of eq. (6) as the fitted rigid model predicts it, never the measured torque: a column
    that contains the measurement would explain the measurement by itself.
    """

    joint: int
    time: Array
    session_time: Array
    """s since the first sample of the session"""
    experiment_time: Array
    """s of recorded motion since the first sample of the first session"""
    q: Array
    dq: Array
    ddq: Array
    direction: Array
    """sign(dq), the sign of eq. (5), -1 to 1; it turns where the positions as recorded turn"""
    period: float
    load: Array
    model_torque: Array
    """N m, the whole torque as the fitted model predicts it (load and friction)"""
    known_load: Array
    """N m, the part of the load that is known beforehand: weighed payloads and external forces"""
    payload: int
    """index of the session's payload among those of the experiment"""
    session: int
    """index of the session among those of the experiment"""
    temperature: Array | None
    motor_velocity: Array
    """velocity of the motor that owns the effect, in units of its own joint: c_m · dq (see `motor_shares`)"""
    motor_acceleration: Array
    motor_share: float
    """c_jm: torque on this joint per unit of torque of that motor on its own joint"""
    positions: Array
    """(samples, joints): of all joints, rad or m"""
    inertial: Array
    """(samples, base parameters that act on the joint): columns of eq. (10)"""
    memory: BlockMemory
    load_slope_of: Callable[[], Array]
    gravity_gradient_of: Callable[[], Array]
    payload_gradient_of: Callable[[], Array]
    payload_columns_of: Callable[[], Array]

    def gear_load(self, rotor_inertia: float) -> Array:
        """What the gear carries: the load less what turns the rotor, which sits on the motor's side of the gear."""
        return self.load - rotor_inertia * self.ddq

    @cached_property
    def load_slope(self) -> Array:
        """d tau_out / dq of the joint itself, N m/rad."""
        return self.load_slope_of()

    @cached_property
    def gravity_gradient(self) -> Array:
        """(samples, 2): d tau_out / d gravity along the two directions that tilt it, N m per m/s²."""
        return self.gravity_gradient_of()

    @cached_property
    def payload_gradient(self) -> Array:
        """(samples, 3): torque per unit of first moment of the payload, MX MY MZ in the last link's frame."""
        return self.payload_gradient_of()

    @cached_property
    def payload_columns(self) -> Array:
        """(samples, 10): torque per unit of XX … ZZ, MX MY MZ, M of a body on the last link, in its frame."""
        return self.payload_columns_of()


@dataclass(frozen=True, eq=False)
class JointSummary:
    """What is known of one joint over the whole record before any effect is tried."""

    joint: int
    name: str
    revolute: bool
    position_range: tuple[float, float]
    position_quantiles: Array
    """positions that part the samples into sixteen equal shares, ends included, (17,)"""
    maximum_speed: float
    speed_quantiles: Array
    """|dq| at 1, 2, 5, 10, 25, 50, 75, 90, 99 % of the moving samples, rad/s"""
    speed_resolution: float
    """rad/s: speeds below this are not told from rest"""
    position_resolution: float
    """rad: smallest step seen in the recorded position"""
    load_range: tuple[float, float]
    own_inertia: float
    """kg m² or kg: fitted inertia of the joint about its own axis, rotor included, at its smallest; 0 before a fit"""
    payloads: tuple[str, ...]
    payload_masses: tuple[float, ...]
    sessions: tuple[int, ...]
    """indices of the identification sessions among those of the experiment"""
    payload_of_session: tuple[int, ...]
    session_durations: tuple[float, ...]
    temperature_range: tuple[float, float] | None
    """°C; None where it was not recorded throughout"""
    has_external_force: bool
    motor_ratio: float
    coupled_motors: tuple[int, ...]
    """motors that act on this joint and on another one as well"""
    period: float
    axis_along_gravity: bool
    position_lines: tuple[float, ...] | None = None
    """candidate wave numbers of what is left over position, per rad, strongest first; None before a fit"""
    load_lines: tuple[float, ...] | None = None
    """the same for what is left in proportion to the torque"""
    line_width: float = 0.0
    """per rad; a line may show at other wave numbers that are as near to it"""
    lines_searched: int = 1
    """how many independent wave numbers were looked at to find them"""
    loaded_sessions: int = field(default=0)
    joint_before: str | None = None
    """name of the joint before it, where the two may share a motor that no gain matrix declares; else None"""
    coverage: Coverage | None = None
    """what the motion makes the joint do; None where nobody asked"""

    @property
    def has_temperature(self) -> bool:
        """Whether the temperature was recorded and changed."""
        return (
            self.temperature_range is not None and float(np.ptp(self.temperature_range)) > TEMPERATURE_CHANGE
        )

    @property
    def load_changes(self) -> bool:
        """Whether a known load changes between the sessions or within them."""
        carried = {self.payload_masses[payload] for payload in self.payload_of_session}
        return len(carried) > 1 or self.has_external_force

    @property
    def span(self) -> float:
        """Range of position, rad or m."""
        return self.position_range[1] - self.position_range[0]
